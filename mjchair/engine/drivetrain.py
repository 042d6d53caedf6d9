"""The drive of a chair inside MuJoCo: one step of its controller, battery, motors and brakes.

In: the views of a model and its data (mjchair.engine.views) and an actuator. Out: the rates of the
drive's state in `act_dot`, the torques of its motors among them, and its sensors in `sensordata`.

MuJoCo calls `act_dyn` for the actuator `drive`, which steps both motors as well: their current is
the battery's. A motor's torque is the last number of its state, and its actuator takes the value
at the end of the step (`actearly`), so it acts in the step in which it is computed. As with the
tires, `act` changes only when MuJoCo integrates.
"""

from __future__ import annotations

import numpy as np
from mujoco import mjtDyn
from numba.extending import register_jitable
from numpy.typing import NDArray

from mjchair.drive import block, law
from mjchair.engine.views import DataView, ModelView

DYN_USER = int(mjtDyn.mjDYN_USER)
DRIVE, MOTOR = 1, 2
EMPTY = 1e-9  # charge; rounding leaves less in an empty battery
_C, _M = block.CONTROLLER, block.MOTOR

RADIUS, TRACK = _C["radius"], _C["track"]
FORWARD_SPEED, REVERSE_SPEED, TURN_SPEED = (
    _C["forward_speed"],
    _C["reverse_speed"],
    _C["turn_speed"],
)
FORWARD_UP, FORWARD_DOWN = _C["forward_acceleration"], _C["forward_deceleration"]
REVERSE_UP, REVERSE_DOWN = _C["reverse_acceleration"], _C["reverse_deceleration"]
TURN_UP, TURN_DOWN, FAST_BRAKE = _C["turn_acceleration"], _C["turn_deceleration"], _C["fast_brake"]
DEADBAND, CURVE, TREMOR, DELAY = _C["deadband"], _C["curve"], _C["tremor"], _C["brake_delay"]
CAPACITY, CHARGE, STANDBY = _C["capacity"], _C["charge"], _C["standby"]
INTERNAL, GROWTH, VOLTAGE = _C["internal_resistance"], _C["resistance_growth"], _C["voltage_0"]

RESISTANCE, COEFFICIENT = _M["resistance"], _M["temperature_coefficient"]
CONSTANT, GEAR, EFFICIENCY, FRICTION = _M["constant"], _M["gear"], _M["efficiency"], _M["friction"]
FADE, BOOST_CURRENT, CONTINUOUS = _M["fade_speed"], _M["boost_current"], _M["continuous_current"]
BOOST_TIME, BAND, COMPENSATION = _M["boost_time"], _M["foldback"], _M["compensation"]
LAG, CALIBRATION = _M["compensation_lag"], _M["calibration"]
HEAT_CAPACITY, THERMAL, AMBIENT = _M["heat_capacity"], _M["thermal_resistance"], _M["ambient"]
WARM, HOT = _M["foldback_temperature"], _M["largest_temperature"]
BRAKE_TORQUE, STIFFNESS, DAMPING = _M["brake_torque"], _M["brake_stiffness"], _M["brake_damping"]
OPENING, CLOSING, DRAG = _M["brake_opening"], _M["brake_closing"], _M["brake_drag"]

X, Y, SPEED, TURN, AWAKE, USED, SAG, CURRENT = range(len(block.CONTROLLER_STATE))
FILTERED, BOOST, RISE, OPEN, WINDUP, VOLTS, AMPERES, TORQUE = range(len(block.MOTOR_STATE))


@register_jitable(forceinline=True)
def kind(m: ModelView, actuator: int) -> int:
    """DRIVE, MOTOR, or 0 for an actuator that belongs to no drive."""
    user = m.actuator_user
    if user.shape[1] < block.NUMBERS or m.actuator_dyntype[actuator] != DYN_USER:
        return 0
    if user[actuator, block.TAG_AT] == block.CONTROLLER_TAG:
        return DRIVE
    return MOTOR if user[actuator, block.TAG_AT] == block.MOTOR_TAG else 0


@register_jitable(forceinline=True)
def joystick_axis(m: ModelView, d: DataView, actuator: int) -> float:
    """Deflection, -1 to 1, of the joystick axis whose actuator it is; 0 where it is no number."""
    value = d.ctrl[m.actuator_ctrladr[actuator]]
    return law.clip(value, -1.0, 1.0) if value == value else 0.0


@register_jitable(forceinline=True)
def battery_without_load(
    user: NDArray[np.float64], drive: int, used: float
) -> tuple[float, float, float]:
    """Charge (1), voltage without load (V) and internal resistance (ohm) of the battery."""
    charge = law.clip(user[drive, CHARGE] - used / user[drive, CAPACITY], 0.0, 1.0)
    voltage = law.open_circuit(
        charge,
        user[drive, VOLTAGE],
        user[drive, VOLTAGE + 1],
        user[drive, VOLTAGE + 2],
        user[drive, VOLTAGE + 3],
        user[drive, VOLTAGE + 4],
    )
    growth = user[drive, GROWTH] * (1.0 - charge)
    return charge, voltage, user[drive, INTERNAL] * (1.0 + growth)


@register_jitable(forceinline=True)
def spin_of(m: ModelView, d: DataView, motor: int) -> float:
    """Speed (rad/s) of the wheel that a motor turns."""
    return d.qvel[m.jnt_dofadr[m.actuator_trnid[motor, 0]]]


@register_jitable(forceinline=True)
def resistance_at(user: NDArray[np.float64], motor: int, rise: float) -> float:
    """Resistance (ohm) of a motor whose winding is `rise` (K) above the air."""
    warmer = user[motor, AMBIENT] + rise - law.STANDARD
    return user[motor, RESISTANCE] * (1.0 + user[motor, COEFFICIENT] * warmer)


@register_jitable(forceinline=True)
def limit_of(user: NDArray[np.float64], motor: int, boost: float, rise: float) -> float:
    """Current limit (A) of a motor."""
    return law.current_limit(
        boost,
        user[motor, AMBIENT] + rise,
        user[motor, BOOST_CURRENT],
        user[motor, CONTINUOUS],
        user[motor, BAND],
        user[motor, WARM],
        user[motor, HOT],
    )


@register_jitable(forceinline=True)
def step_motor(
    m: ModelView, d: DataView, motor: int, reference: float, supply: float, awake: bool, h: float
) -> float:
    """Step a motor, its gear and its brake.

    Args:
      reference: speed of the wheel, rad/s. supply: voltage of the battery, V.
      awake: the brake is to be open. h: s.

    Returns:
      Power (W) that the motor takes.
    """
    user, act, rate = m.actuator_user, d.act, d.act_dot
    at = m.actuator_actadr[motor]
    filtered, boost, rise = act[at + FILTERED], act[at + BOOST], act[at + RISE]
    opened, windup = act[at + OPEN], act[at + WINDUP]
    spin = spin_of(m, d, motor)
    wheel_constant = user[motor, CONSTANT] * user[motor, GEAR]
    emf = wheel_constant * spin
    resistance = resistance_at(user, motor, rise)
    voltage, current = emf, 0.0
    if awake or opened > 0.0:
        voltage, current = law.motor_operating_point(
            user[motor, CALIBRATION] * reference + user[motor, COMPENSATION] * filtered,
            emf,
            resistance,
            limit_of(user, motor, boost, rise),
            supply,
        )
    change = h / user[motor, OPENING] if awake else -h / user[motor, CLOSING]
    opened = law.clip(opened + change, 0.0, 1.0)
    brake_torque = max(user[motor, BRAKE_TORQUE] * (1.0 - opened), user[motor, DRAG])
    new_windup, braking = law.brake_step(
        windup, spin, brake_torque, user[motor, STIFFNESS], user[motor, DAMPING], h
    )
    shaft = wheel_constant * current
    friction = law.gear_friction(
        shaft, spin, user[motor, EFFICIENCY], user[motor, FRICTION], user[motor, FADE]
    )
    heat = current * current * resistance
    steady = user[motor, CONTINUOUS] * user[motor, CONTINUOUS]
    above = user[motor, BOOST_CURRENT] * user[motor, BOOST_CURRENT] - steady
    boost_rate = (current * current - steady) / (above * user[motor, BOOST_TIME])
    rate[at + FILTERED] = (current - filtered) / (user[motor, LAG] + h)
    rate[at + BOOST] = (law.clip(boost + h * boost_rate, 0.0, 1.0) - boost) / h
    rate[at + RISE] = (heat - rise / user[motor, THERMAL]) / user[motor, HEAT_CAPACITY]
    rate[at + OPEN] = (opened - act[at + OPEN]) / h
    rate[at + WINDUP] = (new_windup - windup) / h
    rate[at + VOLTS] = (voltage - act[at + VOLTS]) / h
    rate[at + AMPERES] = (current - act[at + AMPERES]) / h
    rate[at + TORQUE] = (shaft - friction - braking - act[at + TORQUE]) / h
    return voltage * current


@register_jitable(forceinline=True)
def act_dyn(m: ModelView, d: DataView, drive: int) -> None:
    """Step a whole drive: joystick, references, both motors, battery."""
    user, act, rate, h = m.actuator_user, d.act, d.act_dot, m.timestep
    at = m.actuator_actadr[drive]
    charge, source, internal = battery_without_load(user, drive, act[at + USED])
    supply = source - act[at + SAG]
    filter_gain = h / (user[drive, TREMOR] + h)
    x = act[at + X] + filter_gain * (joystick_axis(m, d, drive - block.X_BEFORE) - act[at + X])
    y = act[at + Y] + filter_gain * (joystick_axis(m, d, drive - block.Y_BEFORE) - act[at + Y])
    ahead = law.joystick_demand(x, user[drive, DEADBAND], user[drive, CURVE])
    aside = law.joystick_demand(y, user[drive, DEADBAND], user[drive, CURVE])
    if charge <= EMPTY:  # an empty battery: as if the joystick were released
        ahead, aside = 0.0, 0.0
    speed, turn = act[at + SPEED], act[at + TURN]
    reference = ahead * (user[drive, FORWARD_SPEED] if ahead > 0.0 else user[drive, REVERSE_SPEED])
    forward = speed > 0.0 or (speed == 0.0 and reference > 0.0)
    new_speed = law.ramp_step(
        speed,
        reference,
        user[drive, FORWARD_UP] if forward else user[drive, REVERSE_UP],
        user[drive, FORWARD_DOWN] if forward else user[drive, REVERSE_DOWN],
        user[drive, FAST_BRAKE],
        h,
    )
    new_turn = law.ramp_step(
        turn,
        aside * user[drive, TURN_SPEED],
        user[drive, TURN_UP],
        user[drive, TURN_DOWN],
        user[drive, TURN_DOWN],
        h,
    )
    moving = ahead != 0.0 or aside != 0.0 or new_speed != 0.0 or new_turn != 0.0
    # one step at least, so that a delay of zero opens the brakes as well
    awake = user[drive, DELAY] + h if moving else max(act[at + AWAKE] - h, 0.0)

    left, right = drive - block.LEFT_BEFORE, drive - block.RIGHT_BEFORE
    half_difference = 0.5 * new_turn * user[drive, TRACK]
    power = user[drive, STANDBY]
    power += step_motor(
        m, d, left, (new_speed - half_difference) / user[drive, RADIUS], supply, awake > 0.0, h
    )
    power += step_motor(
        m, d, right, (new_speed + half_difference) / user[drive, RADIUS], supply, awake > 0.0, h
    )
    current = law.battery_current(power, source, internal)
    rate[at + X] = (x - act[at + X]) / h
    rate[at + Y] = (y - act[at + Y]) / h
    rate[at + SPEED] = (new_speed - speed) / h
    rate[at + TURN] = (new_turn - turn) / h
    rate[at + AWAKE] = (awake - act[at + AWAKE]) / h
    rate[at + USED] = law.charge_current(
        current, act[at + USED], user[drive, CHARGE], user[drive, CAPACITY], h
    )
    rate[at + SAG] = (internal * current - act[at + SAG]) / h
    rate[at + CURRENT] = (current - act[at + CURRENT]) / h


@register_jitable(forceinline=True)
def sense_drive(m: ModelView, d: DataView, drive: int, adr: int) -> None:
    """Fill the sensor `drive`; its components are named in mjchair.drive.block."""
    at, h, out = m.actuator_actadr[drive], m.timestep, d.sensordata
    charge, source, _ = battery_without_load(m.actuator_user, drive, d.act[at + USED])
    current = d.act[at + CURRENT] + h * d.act_dot[at + CURRENT]
    left = m.actuator_actadr[drive - block.LEFT_BEFORE]
    right = m.actuator_actadr[drive - block.RIGHT_BEFORE]
    out[adr] = d.act[at + SPEED] + h * d.act_dot[at + SPEED]
    out[adr + 1] = d.act[at + TURN] + h * d.act_dot[at + TURN]
    out[adr + 2] = 0.5 * (
        d.act[left + OPEN]
        + h * d.act_dot[left + OPEN]
        + d.act[right + OPEN]
        + h * d.act_dot[right + OPEN]
    )
    out[adr + 3] = charge
    out[adr + 4] = source - (d.act[at + SAG] + h * d.act_dot[at + SAG])
    out[adr + 5] = current
    # what a full battery is charged with turns into heat
    out[adr + 6] = source * (d.act_dot[at + USED] if current < 0.0 else current)


@register_jitable(forceinline=True)
def sense_motor(m: ModelView, d: DataView, motor: int, adr: int) -> None:
    """Fill the sensor of a motor; its components are named in mjchair.drive.block."""
    user, at, h, out = m.actuator_user, m.actuator_actadr[motor], m.timestep, d.sensordata
    spin = spin_of(m, d, motor)
    rise = d.act[at + RISE]
    current = d.act[at + AMPERES] + h * d.act_dot[at + AMPERES]
    torque = d.act[at + TORQUE] + h * d.act_dot[at + TORQUE]
    out[adr] = current
    out[adr + 1] = d.act[at + VOLTS] + h * d.act_dot[at + VOLTS]
    out[adr + 2] = spin * user[motor, GEAR]
    out[adr + 3] = torque
    out[adr + 4] = user[motor, AMBIENT] + rise
    out[adr + 5] = limit_of(user, motor, d.act[at + BOOST], rise)
    out[adr + 6] = 1.0 - (d.act[at + OPEN] + h * d.act_dot[at + OPEN])
    out[adr + 7] = current * current * resistance_at(user, motor, rise)
    out[adr + 8] = (user[motor, CONSTANT] * user[motor, GEAR] * current - torque) * spin
