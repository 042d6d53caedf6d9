"""The contacts of a recording are those of the simulation, and Newton's law holds with them."""

import mujoco
import numpy as np
import pytest

import mjchair
from mjchair.engine.contact import contact_patch
from mjchair.engine.views import data_view
from mjchair.model.ground import uneven
from mjchair.report.forces import wheel_forces
from mjchair.simulation.contacts import wheel_contacts
from mjchair.simulation.floor import tire_geoms
from mjchair.simulation.initial import as_initial, start

DRIVE = {"left_wheel": 12.0, "right_wheel": 9.0}
PLACES = {
    "kerb": ({"scene": "kerb"}, {"speed": 1.2}),
    "threshold": ({"scene": "threshold"}, {"speed": 1.2}),
    "hfield": ({"scene": "hfield", "heights": uneven(0.03, 0.7, seed=5)}, {}),
}


@pytest.fixture(scope="module", params=PLACES)
def rough(request):
    """Model, first motion and recording of a run over ground that is not plane."""
    ground, initial = PLACES[request.param]
    model = mjchair.load_spec(**ground).compile()
    duration = 0.8 if initial else 2.0
    run = mjchair.simulate(model, mjchair.constant(DRIVE, duration), duration, initial=initial)
    return model, initial, run


def test_recorded_contacts_are_those_that_were_simulated(rough):
    model, initial, run = rough
    some = np.linspace(0, run.time.size - 2, 60).astype(int)
    recorded = wheel_contacts(run, some)
    geoms = tire_geoms(model)
    slanted = 0
    with mjchair.installed():
        data = start(model, as_initial(initial))
        for k in range(run.time.size - 1):
            for wheel, torque in DRIVE.items():
                data.ctrl[model.actuator(wheel).id] = torque
            mujoco.mj_step(model, data)
            if k not in some:
                continue
            row = int(np.flatnonzero(some == k)[0])
            for wheel, geom in geoms.items():
                # after a step the contacts are still those that the step was made with
                _, nx, ny, nz, px, py, pz, ground = contact_patch(data_view(data), geom)
                mine = recorded[wheel]
                if ground < 0:
                    assert np.isnan(mine.place[row]).all()
                    continue
                np.testing.assert_array_equal(mine.normal[row], (nx, ny, nz))
                np.testing.assert_array_equal(mine.place[row], (px, py, pz))
                slanted += nz < 0.999
    assert slanted, "no contact off the vertical: the test sees nothing"


def test_forces_along_the_recorded_axes_move_the_chair(rough):
    """The sum of all tire forces and the weight is the rate of the chair's momentum."""
    model, _, run = rough
    contacts = wheel_contacts(run)
    data = mujoco.MjData(model)
    velocity = np.empty((run.time.size, 3))
    for k in range(run.time.size):
        data.qpos[:], data.qvel[:] = run.qpos[k], run.qvel[k]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        mujoco.mj_subtreeVel(model, data)
        velocity[k] = data.subtree_linvel[0]
    mass = model.body_subtreemass[0]
    rate = mass * np.diff(velocity, axis=0) / run.timestep
    total = np.tile(mass * model.opt.gravity, (run.time.size, 1))
    for wheel, contact in contacts.items():
        for part, axis in (("Fx", contact.forward), ("Fy", contact.left), ("Fz", contact.normal)):
            total += np.nan_to_num(run[f"{wheel}_tire.{part}"][:, None] * axis)
    off = np.linalg.norm(total[:-1] - rate, axis=1)
    upright = np.array([contact.normal[:-1, 2] for contact in contacts.values()])
    slanted = (upright < 0.999).any(axis=0)
    # N, of 950 N; not always, since the anti-tippers touch the floor as well
    assert np.median(off) < 0.5
    assert slanted.any() and np.median(off[slanted]) < 10.0


def test_arrows_are_drawn_at_the_recorded_contacts(rough):
    model, _, run = rough
    data = mujoco.MjData(model)
    sample = int(np.argmax(np.abs(run["left_caster_tire.Fz"])))
    recorded = wheel_contacts(run, [sample])
    data.qpos[:] = run.qpos[sample]
    for wheel in wheel_forces(model, data, run, sample):
        contact = recorded[wheel.wheel]
        load = run[f"{wheel.wheel}_tire.Fz"][sample]
        if load > 0.0:
            np.testing.assert_array_equal(wheel.contact, contact.place[0])
            np.testing.assert_array_equal(wheel.forces["load"], load * contact.normal[0])
            across = run[f"{wheel.wheel}_tire.Fy"][sample]
            np.testing.assert_array_equal(wheel.forces["lateral"], across * contact.left[0])
