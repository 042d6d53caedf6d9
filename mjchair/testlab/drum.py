"""One wheel on a rotating drum: its drag at a load, as it is measured in drum laboratories.

In: a design, a wheel, a load. Out: the drag (N) at the axle. The drum is a cylinder that turns
under the wheel; the wheel is held in its direction of travel and moves freely up and down. The
radius of the drum, 0.6 m, is an assumption. The tire law has no term for the curvature of the
ground, so the drag is that on a flat floor; a real drum gives a larger drag.
"""

from __future__ import annotations

import mujoco
import numpy as np

from mjchair.engine.install import installed
from mjchair.model.spec import compile_spec
from mjchair.model.wheels import SUFFIX, base_name, wheels
from mjchair.simulation.channels import tire_place
from mjchair.testlab.design import GRAVITY, Design

RADIUS = 0.6  # m, of the drum
HEAVY = 1e6  # kg m^2, so large that the drum keeps its speed
SETTLING, READ = 2.0, 1.0  # s


def drum_drag(design: Design, wheel: str, load: float, speed: float = 1.0) -> float:
    """Mean drag (N) of a wheel at a load (N); the surface of the drum moves at `speed` (m/s)."""
    chair = compile_spec(design.spec())
    chosen = next(one for one in wheels(chair) if base_name(one.name) == wheel)
    model = compile_spec(_rig(chair, chosen.geom, chosen.body, chosen.joint, load))
    data = mujoco.MjData(model)
    radius = float(chair.geom_size[chosen.geom, 0])
    data.joint("drum").qvel[0] = -speed / RADIUS  # its top moves to the rear, as a floor does
    data.joint(wheel).qvel[0] = speed / radius
    at = tire_place(model, wheel, "Fx")
    forces = []
    with installed():
        steps = round(0.01 / model.opt.timestep)
        for tick in range(round((SETTLING + READ) / 0.01)):
            mujoco.mj_step(model, data, nstep=steps)
            if tick * 0.01 > SETTLING:
                forces.append(-float(data.sensordata[at]))
    return float(np.mean(forces))


def _rig(chair: mujoco.MjModel, geom: int, body: int, joint: int, load: float) -> mujoco.MjSpec:
    """A drum with an upright wheel of a chair on it, loaded by its own weight and a mass."""
    spec = mujoco.MjSpec()
    spec.option.timestep = chair.opt.timestep
    spec.option.integrator = chair.opt.integrator
    spec.option.cone = chair.opt.cone
    spec.option.tolerance = chair.opt.tolerance
    spec.option.ccd_tolerance = 1e-10
    name = base_name(chair.joint(joint).name)
    radius = float(chair.geom_size[geom, 0])
    turning = spec.worldbody.add_body(name="drum")
    axis = (0.0, 1.0, 0.0)
    turning.add_joint(name="drum", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    turning.explicitinertial = True
    turning.mass, turning.inertia = 1.0, (HEAVY, HEAVY, HEAVY)
    turning.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(RADIUS, 0.3, 0.0),
        quat=(1.0, -1.0, 0.0, 0.0),
        condim=1,
    )
    carriage = spec.worldbody.add_body(name="carriage", pos=(0.0, 0.0, RADIUS + radius))
    carriage.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=(0.0, 0.0, 1.0))
    carriage.explicitinertial = True
    carriage.mass = max(load / GRAVITY - float(chair.body_mass[body]), 0.1)
    carriage.inertia = (1.0, 1.0, 1.0)
    rolling = carriage.add_body(name=name)
    damping = chair.dof_damping[chair.jnt_dofadr[joint]]
    rolling.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, damping=damping)
    rolling.explicitinertial = True
    rolling.mass = float(chair.body_mass[body])
    rolling.inertia = chair.body_inertia[body]
    rolling.iquat = chair.body_iquat[body]
    rolling.add_geom(
        name=name + SUFFIX,
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=chair.geom_size[geom],
        quat=(1.0, -1.0, 0.0, 0.0),
        condim=1,
        priority=1,
        solref=chair.geom_solref[geom],
        solimp=chair.geom_solimp[geom],
        userdata=chair.geom_user[geom],
        mass=0.0,
    )
    spec.add_actuator(
        name=name + SUFFIX,
        target=name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        dyntype=mujoco.mjtDyn.mjDYN_USER,
        actdim=4,
        gainprm=np.zeros(10),
        biastype=mujoco.mjtBias.mjBIAS_NONE,
    )
    spec.add_sensor(
        name=name + SUFFIX,
        type=mujoco.mjtSensor.mjSENS_USER,
        objtype=mujoco.mjtObj.mjOBJ_ACTUATOR,
        objname=name + SUFFIX,
        dim=7,
        needstage=mujoco.mjtStage.mjSTAGE_ACC,
    )
    return spec
