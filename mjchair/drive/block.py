"""Where the numbers of a drive lie: in `user` fields, in the activation, and in the sensors.

In: nothing. Out: the index of each number, and the names of the parts.

A drive is five actuators that stand next to one another in the model, in this order:

    joystick_x, joystick_y   inputs, -1 to 1; without a force
    left_motor, right_motor  the state MOTOR_STATE; its last number is the torque about the axle
    drive                    controller and battery: the state CONTROLLER_STATE, without a force

The controller comes last: it steps the motors, and MuJoCo clears the rates of an actuator before
it asks for them.

The parameters are in the `user` fields of `drive` (CONTROLLER) and of the motors (MOTOR). A state
of zeros is a drive that is parked, cold, with the charge of its first instant.
"""

from __future__ import annotations

JOYSTICK = ("joystick_x", "joystick_y")
DRIVE = "drive"
MOTORS = ("left_motor", "right_motor")
ACTUATORS = (*JOYSTICK, *MOTORS, DRIVE)
X_BEFORE, Y_BEFORE, LEFT_BEFORE, RIGHT_BEFORE = 4, 3, 2, 1  # places before `drive`

TAG_AT, VERSION_AT = 0, 1
CONTROLLER_TAG = 5066308.0  # "MJD": the actuator is the controller of a drive
MOTOR_TAG = 5066317.0  # "MJM": the actuator is one of its motors
VERSION = 1.0

# fmt: off
_CONTROLLER = (
    "tag", "version", "radius", "track", "forward_speed", "reverse_speed", "turn_speed",
    "forward_acceleration", "forward_deceleration", "reverse_acceleration",
    "reverse_deceleration", "turn_acceleration", "turn_deceleration", "fast_brake", "deadband",
    "curve", "tremor", "brake_delay", "capacity", "charge", "internal_resistance",
    "resistance_growth", "standby", "voltage_0", "voltage_1", "voltage_2", "voltage_3",
    "voltage_4",
)
# fmt: on
CONTROLLER = {name: index for index, name in enumerate(_CONTROLLER)}

# fmt: off
_MOTOR = (
    "tag", "version", "resistance", "temperature_coefficient", "constant", "gear", "efficiency",
    "friction", "fade_speed", "boost_current", "continuous_current", "boost_time", "foldback",
    "compensation", "compensation_lag", "calibration", "heat_capacity", "thermal_resistance",
    "ambient", "foldback_temperature", "largest_temperature", "brake_torque", "brake_stiffness",
    "brake_damping", "brake_opening", "brake_closing", "brake_drag",
)
# fmt: on
MOTOR = {name: index for index, name in enumerate(_MOTOR)}
NUMBERS = max(len(CONTROLLER), len(MOTOR))

# activation of `drive`: filtered joystick (1), reference speed (m/s) and yaw rate (rad/s), time
# until the brakes may close (s), charge used (A s), voltage under that without load (V), current
# of the battery (A)
CONTROLLER_STATE = ("x", "y", "speed", "turn", "awake", "used", "sag", "current")
# activation of a motor: filtered current (A), used share of the boost, temperature over the
# ambient (K), brake (0 closed, 1 open), windup of the brake (rad), voltage (V), current (A),
# torque about the axle (N m)
MOTOR_STATE = ("filtered", "boost", "rise", "open", "windup", "voltage", "current", "torque")

# components and units of the sensors `drive`, `left_motor` and `right_motor`
DRIVE_SENSOR = (
    ("speed_reference", "m/s"),
    ("turn_reference", "rad/s"),
    ("brakes_open", "1"),
    ("battery_charge", "1"),
    ("battery_voltage", "V"),
    ("battery_current", "A"),
    ("battery_power", "W"),
)
MOTOR_SENSOR = (
    ("current", "A"),
    ("voltage", "V"),
    ("speed", "rad/s"),
    ("torque", "N m"),
    ("temperature", "degC"),
    ("current_limit", "A"),
    ("brake", "1"),
    ("heat", "W"),
    ("friction", "W"),
)
