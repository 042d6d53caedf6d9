"""The tire elements of a model or a specification, and checks that they are complete.

In: a compiled model, or a specification and the name of a wheel. Out: a `Wheel` for each tire, an
MjSpec with a tire on its wheel, or an error that says what is missing.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjchair.drive import attach
from mjchair.drive import block as drive_block
from mjchair.drive.attach import drives
from mjchair.errors import MjchairError
from mjchair.rider import seat
from mjchair.rider.anatomy import JOINT_NAMES
from mjchair.tire import block, law

WHEELS = ("left_wheel", "right_wheel", "left_caster", "right_caster")
REAR_CASTERS = ("left_rear_caster", "right_rear_caster")  # additional, with mid-wheel drive
SUFFIX = "_tire"


# what every chair has, by name; docs/chairs.md says what each is
NAMES = (
    *WHEELS,
    *(wheel + SUFFIX for wheel in WHEELS),
    *("left_caster_swivel", "right_caster_swivel", "left_caster_angle", "right_caster_angle"),
    *("left_wheel_angle", "right_wheel_angle", "left_wheel_speed", "right_wheel_speed"),
    *("left_brake", "right_brake", "chair", "imu", "axle", "imu_gyro", "imu_accelerometer"),
    *("position", "heading", "velocity"),
    *REAR_CASTERS,
    *(caster + end for caster in REAR_CASTERS for end in (SUFFIX, "_swivel", "_angle")),
    *drive_block.ACTUATORS,
    *JOINT_NAMES,
    *(joint + "_angle" for joint in JOINT_NAMES),
)


def base_name(name: str) -> str:
    """A name without the prefixes that attachments gave it.

    It is the part after the last "/". After any other prefix that does not end in a letter or a
    digit, it is the longest of NAMES with which the name ends.
    """
    tail = name.rsplit("/", 1)[-1]
    behind = [n for n in NAMES if tail.endswith(n) and not tail[: -len(n)][-1:].isalnum()]
    return max(behind, key=len, default=tail)


@dataclass(frozen=True)
class Wheel:
    """One wheel of a compiled model.

    Attributes:
      name: of the wheel's joint. geom, body, joint, actuator: ids.
      block: the tire's numbers, a view into geom_user.
    """

    name: str
    geom: int
    body: int
    joint: int
    actuator: int
    block: NDArray[np.float64]


def wheels(model: mujoco.MjModel) -> list[Wheel]:
    """The wheels of a compiled model: every tire state actuator with its tire geom."""
    listed = []
    driving = {a for driven in drives(model) for a in (driven.drive, *driven.motors)}
    for actuator in range(model.nactuator):
        if (
            model.actuator_dyntype[actuator] != mujoco.mjtDyn.mjDYN_USER
            or model.actuator_trntype[actuator] != mujoco.mjtTrn.mjTRN_JOINT
            or actuator in driving
        ):
            continue
        joint = int(model.actuator_trnid[actuator, 0])
        body = int(model.jnt_bodyid[joint])
        first = int(model.body_geomadr[body])
        for geom in range(first, first + int(model.body_geomnum[body])):
            if _tagged(model, geom):
                name = model.joint(joint).name
                listed.append(Wheel(name, geom, body, joint, actuator, model.geom_user[geom]))
                break
    return listed


def _tagged(model: mujoco.MjModel, geom: int) -> bool:
    user = model.geom_user
    return bool(user.shape[1] >= block.HEADER and user[geom, block.TAG_AT] == block.TAG)


def check(model: mujoco.MjModel) -> None:
    """Check that every wheel has a complete tire, and that the time step is small enough for it.

    Raises:
      MjchairError: a joint named as a wheel has no tire; a tire geom makes friction of its own
        (condim above 1), has no state actuator, or a block of another version; the time step is
        beyond the stability limit of a tire.
    """
    model_wheels = wheels(model)
    have = {wheel.joint for wheel in model_wheels}
    for joint in range(model.njnt):
        name = model.joint(joint).name
        if base_name(name) in WHEELS and joint not in have:
            raise MjchairError(
                f"wheel {name!r} has no tire: its body needs a geom named {name + SUFFIX!r} with "
                "a tire block, and a user actuator of that name with actdim 4"
            )
    geoms = {wheel.geom for wheel in model_wheels}
    for geom in range(model.ngeom):
        if _tagged(model, geom) and geom not in geoms:
            raise MjchairError(
                f"tire geom {model.geom(geom).name!r} has no state: add a user actuator with "
                "actdim 4 on its wheel's joint"
            )
    for wheel in model_wheels:
        name = model.geom(wheel.geom).name
        if model.geom_condim[wheel.geom] != 1:
            raise MjchairError(
                f"tire geom {name!r} has condim {model.geom_condim[wheel.geom]}; it must be 1, "
                "since the tire makes the friction"
            )
        if wheel.block[block.VERSION_AT] != block.VERSION:
            raise MjchairError(
                f"tire geom {name!r} has a block of version {wheel.block[block.VERSION_AT]:g}; "
                f"this mjchair reads version {block.VERSION:g}: make the model anew"
            )
    check_timestep(model, model_wheels)


# limit of k h^2 / m + 2 c h / m for a spring and damper whose force is computed after its state
STABLE = 4.0
COMFORTABLE = 1.5  # value after damping is reduced, so that twice the time step is still stable
LEAST = 0.5  # of this value: least part for the damping, however large the stiffness


@dataclass(frozen=True)
class Spring:
    """One of the springs that represent a tire at standstill.

    Attributes:
      axis: "along", "across" or "about its axle". stiffness, damping: N/m and N s/m, about the
        axle N m/rad and N m s/rad. inertia: kg, about the axle kg m^2.
      damping_time: index of the tire's damping time in its block.
    """

    axis: str
    stiffness: float
    damping: float
    inertia: float
    damping_time: int

    def number(self, h: float) -> float:
        """k h^2 / m + 2 c h / m at the time step `h` (s)."""
        if math.isinf(self.stiffness):  # whatever its damping
            return math.inf
        return (self.stiffness * h * h + 2.0 * self.damping * h) / self.inertia

    def largest_step(self) -> float:
        """The step (s) at which the number reaches its limit; 0 where nothing gives way."""
        if math.isinf(self.stiffness):
            return 0.0
        k, c, m = self.stiffness, self.damping, self.inertia
        return float((np.sqrt(c * c + STABLE * k * m) - c) / k)


def check_timestep(model: mujoco.MjModel, known: list[Wheel] | None = None) -> None:
    """Compare the time step with the stability limits of tires, moving rider and drive.

    Raises:
      MjchairError: the time step is beyond a limit; the message gives the largest stable step.
    """
    seat.check_timestep(model)
    attach.check_timestep(model)
    h = model.opt.timestep
    for wheel, spring in springs(model, known):
        if spring.number(h) >= STABLE:
            raise MjchairError(
                f"timestep {h:g} s is beyond the stability limit of {wheel.name}'s tire "
                f"{spring.axis}; use at most {0.9 * spring.largest_step():.2g} s, or a tire with "
                "a longer relaxation length"
            )


def cut_damping(model: mujoco.MjModel, above: float = 2.0 * COMFORTABLE) -> None:
    """Reduce, in the model's blocks, the damping times of tires on wheels too light for them.

    A tire for a rear wheel is often used for the casters as well. Its stiffness is a property of
    the tire; its damping is an assumption, which matters only for coming to rest at standstill.

    Args:
      above: the stability number above which damping is reduced.
    """
    h = model.opt.timestep
    for wheel, spring in springs(model):
        spare = max(COMFORTABLE - spring.stiffness * h * h / spring.inertia, LEAST)
        if spring.number(h) > above:
            most = 0.5 * spare * spring.inertia / (h * spring.stiffness)
            wheel.block[spring.damping_time] = min(most, wheel.block[spring.damping_time])


def keep_stiffness(
    spec: mujoco.MjSpec, before: mujoco.MjModel, after: mujoco.MjModel, wheel: Wheel
) -> None:
    """Give a tire the vertical stiffness and damping that it had before the masses were divided.

    MuJoCo divides them by the mean inverse mass behind the contact (models/manual/README.md).

    Args:
      spec: edited in place; it compiles to `after`. wheel: of `before`.
    """
    geom = spec.geom(before.geom(wheel.geom).name)
    solref = np.array(before.geom_solref[wheel.geom])
    if solref[0] < 0.0:
        now = after.body_invweight0[after.geom(geom.name).bodyid[0], 0]
        geom.solref = solref * now / before.body_invweight0[wheel.body, 0]


def springs(
    model: mujoco.MjModel, known: list[Wheel] | None = None
) -> Iterator[tuple[Wheel, Spring]]:
    """Every wheel's springs: along and across the heading, and about the axle.

    Along and across, k = C / sigma is the carcass stiffness at the tire's nominal load, or at
    half the model's weight where that is less, and m the mass that the contact point moves
    against in the model's initial pose, without the ground under it. About the axle they are
    those of the rolling moment and of the wheel.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    mujoco.mj_crb(model, data)
    mujoco.mj_factorM(model, data)
    weight = model.body_subtreemass[0] * np.linalg.norm(model.opt.gravity)
    for wheel in wheels(model) if known is None else known:
        tire = wheel.block
        load = min(tire[block.NOMINAL_LOAD], 0.5 * weight)  # a car tire carries a light chair here
        radius = model.geom_size[wheel.geom, 0]
        c_kappa, c_alpha, _, _ = law.family_stiffness(tire, load, 0.0, 0.0)
        sigma_x, sigma_y = law.family_relaxation(tire, load, c_kappa, c_alpha)
        slope = law.factors(tire, load)[1]
        rolling = tire[block.ROLLING_RESISTANCE] * load * radius**2
        with np.errstate(divide="ignore"):  # a tire without relaxation does not give way at all
            stiffness = (
                slope * law.along(tire) * c_kappa / sigma_x,
                slope * c_alpha / sigma_y,
                rolling / tire[block.ROLLING_RELAXATION],
            )
        for axis, k, m, at in zip(
            ("along", "across", "about its axle"),
            stiffness,
            contact_inertia(model, data, wheel),
            (block.DAMPING_TIME, block.DAMPING_TIME, block.ROLLING_DAMPING_TIME),
            strict=True,
        ):
            if k > 0.0:
                yield wheel, Spring(axis, k, k * tire[at], m, at)


def contact_inertia(
    model: mujoco.MjModel, data: mujoco.MjData, wheel: Wheel
) -> tuple[float, float, float]:
    """Effective mass at the contact along and across the heading, and inertia about the axle.

    Args:
      data: with positions and the factorised inertia matrix.

    Returns:
      kg, kg, kg m^2.
    """
    axis = data.geom_xmat[wheel.geom].reshape(3, 3)[:, 2]
    up = np.array([0.0, 0.0, 1.0])
    heading = np.cross(axis, up)
    heading /= np.linalg.norm(heading)
    left = np.cross(up, heading)
    point = data.geom_xpos[wheel.geom] - up * model.geom_size[wheel.geom, 0]
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, point, wheel.body)
    rows = np.vstack([[heading, left] @ jacobian, np.zeros(model.nv)])
    rows[2, model.jnt_dofadr[wheel.joint]] = 1.0
    solved = np.zeros_like(rows)
    mujoco.mj_solveM(model, data, solved, rows)
    with np.errstate(divide="ignore"):  # a held wheel has infinite mass
        along, across, about = 1.0 / (rows * solved).sum(axis=1)
    return along, across, about
