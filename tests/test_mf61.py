"""Magic Formula 5.2 and 6.1: against reference forces, and against the equations one by one."""

import csv
from pathlib import Path

import mf_equations
import numpy as np
import pytest
from mf_equations import BOOK_RADIUS, book

from mjchair.errors import MjchairError
from mjchair.tire import Tire, law
from mjchair.tire.formula.mf_names import NAMES_52, NAMES_61, SECTIONS_52

DATA = Path(__file__).parent / "data" / "tire"


def tire(family="mf61", **changes):
    return Tire(name="book", family=family, coefficients=book(**changes), nominal_load=4000.0)


def reference():
    with (DATA / "mf61_book205.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    return {k: np.array([float(r[k]) if r[k] else np.nan for r in rows]) for k in rows[0]}


def test_the_reference_tire_is_met():
    ref = reference()
    f = tire().forces(ref["fz_n"], ref["kappa"], ref["alpha_rad"], ref["gamma_rad"], ref["vx_mps"])
    upright = ref["gamma_rad"] == 0.0
    assert np.all(np.abs(f.Fx - ref["fx_n"]) <= 1e-6 * np.abs(ref["fx_n"]) + 0.01)
    error = np.abs(f.Fy - ref["fy_n"])
    assert np.all(error[upright] <= 1e-6 * np.abs(ref["fy_n"][upright]) + 0.01)
    assert np.all(error[~upright] <= 1e-3 * np.abs(ref["fy_n"][~upright]) + 0.01)
    assert np.max(np.abs(f.Mz - ref["mz_nm"])[upright]) < 0.01  # 3 N m asked for


def random_numbers(seed, names):
    """Every coefficient of the family in use, pressure and scaling factors too."""
    rng = np.random.default_rng(seed)
    numbers = book()
    for name in names:
        if name.startswith("L") and name in SECTIONS_52["SCALING_COEFFICIENTS"]:
            numbers[name] = rng.uniform(0.8, 1.2)
        elif name not in numbers:
            numbers[name] = rng.uniform(-0.3, 0.3)
        elif name[0] in "PQRS" and numbers[name] == 0.0:
            numbers[name] = rng.uniform(-0.1, 0.1)
    for name in ("LGAX", "LGAY", "LGAZ", "LSGKP", "LSGAL", "QBZ6"):
        numbers.pop(name, None)
    ranges = [n for s, ns in SECTIONS_52.items() if s.endswith("RANGE") for n in ns]
    numbers |= dict.fromkeys(ranges, 0.0)
    return numbers | {
        "NOMPRES": 2.2e5,
        "INFLPRES": 2.5e5,
        "LONGVL": 16.67,
        "LONGITUDINAL_STIFFNESS": 3e5,
        "LATERAL_STIFFNESS": 1e5,
        "PTX1": 2.0,
        "PTY1": 2.0,
        "PTY2": 1.5,
        "QSY7": 0.85,
        "QSY8": -0.4,
    }


@pytest.mark.parametrize("family", ["mf61", "mf52"])
def test_constants_computed_once_change_no_equation(family):
    names = NAMES_52 if family == "mf52" else NAMES_61
    rng = np.random.default_rng(7)
    for seed in range(5):
        numbers = {k: v for k, v in random_numbers(seed, names).items() if k in names}
        wheel = Tire(name="t", family=family, coefficients=numbers, nominal_load=4000.0)
        for _ in range(20):
            point = (
                rng.uniform(1000, 6000),
                rng.uniform(-0.3, 0.3),
                rng.uniform(-0.25, 0.25),
                rng.uniform(-0.07, 0.07),
                rng.uniform(1, 30),
            )
            expected = mf_equations.forces(numbers, *point, old=family == "mf52")
            assert np.allclose(wheel.forces(*point), expected, rtol=1e-9, atol=1e-6)


def test_camber_of_52_is_scaled_by_its_own_factors():
    plain, scaled = tire("mf52"), tire("mf52", LGAX=0.5, LGAY=0.5, LGAZ=0.5)
    args = (4000.0, 0.0, 0.05)
    half = plain.forces(*args, gamma=np.arcsin(0.5 * np.sin(0.06)))
    assert scaled.forces(*args, gamma=0.06).Fy == pytest.approx(half.Fy, rel=1e-3)
    assert plain.forces(*args, gamma=0.06).Fy != pytest.approx(half.Fy, rel=1e-3)


def test_everything_stays_finite_and_loads_beyond_the_range_are_held():
    rng = np.random.default_rng(0)
    n = 20000
    wheel = tire()
    f = wheel.forces(
        10 ** rng.uniform(-3, 7, n),
        rng.choice([-1, 1], n) * 10 ** rng.uniform(-9, 9, n),
        rng.uniform(-1.57, 1.57, n),
        rng.uniform(-1.5, 1.5, n),
        rng.choice([-1, 0, 1], n) * 10 ** rng.uniform(-6, 2, n),
    )
    assert all(np.isfinite(component).all() for component in f)
    held = tire(FZMIN=200.0, FZMAX=8000.0, KPUMAX=1.0, KPUMIN=-1.0, ALPMIN=-0.3, ALPMAX=0.3)
    at_limit = held.forces(8000.0, 1.0, 0.3)
    assert held.forces(20000.0, 5.0, 1.2).Fy == pytest.approx(at_limit.Fy)
    assert held.forces(1e-6, 0.1, 0.1).Fy == pytest.approx(0.0, abs=1e-4)


def test_without_combined_coefficients_the_friction_ellipse_limits():
    bare = {k: v for k, v in book().items() if k[0] != "R"}
    wheel = Tire(name="t", family="mf61", coefficients=bare, nominal_load=4000.0)
    d_x, d_y = np.array(wheel.peak_friction(4000.0)) * 4000.0
    both = wheel.forces(4000.0, 0.15, 0.2)
    assert np.hypot(both.Fx / d_x, both.Fy / d_y) == pytest.approx(1.0, abs=0.05)
    along = wheel.forces(4000.0, 0.15, 0.0).Fx
    assert along == pytest.approx(tire().forces(4000.0, 0.15, 0.0).Fx, rel=1e-2)


def test_shifts_pass_through_zero_at_standstill_and_turn_with_the_direction():
    wheel = tire()
    forward, still, back = (wheel.forces(4000.0, 0.0, 0.0, speed=v).Fy for v in (5.0, 0.0, -5.0))
    assert forward != 0.0
    assert still == 0.0
    assert back == pytest.approx(-forward)
    # rolling resistance acts against rolling either way
    assert wheel.forces(4000.0, 0.0, 0.0, speed=5.0).My < 0.0
    assert wheel.forces(4000.0, 0.0, 0.0, speed=-5.0).My > 0.0


def test_slopes_and_peaks_are_those_of_the_curve():
    wheel = tire(PHX1=0.0, PHX2=0.0, PHY1=0.0, PHY2=0.0, PVX1=0.0, PVY1=0.0, PVY2=0.0)
    c_kappa, c_alpha, d_x, d_y = law.family_stiffness(wheel.block(), 3000.0, 0.0, 1.0)
    h = 1e-6
    assert wheel.forces(3000.0, h, 0.0).Fx / h == pytest.approx(c_kappa, rel=1e-4)
    assert -wheel.forces(3000.0, 0.0, h).Fy / h == pytest.approx(c_alpha, rel=1e-4)
    assert wheel.forces(3000.0, np.linspace(0, 3, 3001), 0.0).Fx.max() == pytest.approx(d_x, 1e-4)
    angles = np.arctan(np.linspace(0, 3, 3001))
    assert -wheel.forces(3000.0, 0.0, angles).Fy.min() == pytest.approx(d_y, 1e-4)


def test_relaxation_lengths_come_from_the_file():
    six = tire(LONGITUDINAL_STIFFNESS=3e5, LATERAL_STIFFNESS=1e5, PCFY1=0.2, PCFX1=0.1)
    block = six.with_(relaxation_x=0.0, relaxation_y=0.0).block()
    load = 5000.0
    c_kappa, c_alpha, _, _ = law.family_stiffness(block, load, 0.0, 1.0)
    x, y = law.family_relaxation(block, load, c_kappa, c_alpha)
    assert x == pytest.approx(c_kappa / (3e5 * 1.025))
    assert y == pytest.approx(c_alpha / (1e5 * 1.05))
    old = tire("mf52", PTX1=1.5, PTX2=0.2, PTX3=0.1, PTY1=1.9, PTY2=1.8)
    block = old.with_(relaxation_x=0.0, relaxation_y=0.0).block()
    x, y = law.family_relaxation(block, load, 1.0, 1.0)
    assert x == pytest.approx(load * (1.5 + 0.2 / 4) * np.exp(-0.1 / 4) * BOOK_RADIUS / 4000)
    assert y == pytest.approx(1.9 * np.sin(2 * np.arctan(5000 / 1.8 / 4000)) * BOOK_RADIUS)


def test_a_given_relaxation_length_goes_before_the_files():
    block = tire(LONGITUDINAL_STIFFNESS=3e5).with_(relaxation_x=0.2, relaxation_y=0.0).block()
    x, y = law.family_relaxation(block, 4000.0, 1e5, 6e4)
    assert x == 0.2
    assert y == pytest.approx(0.5 * BOOK_RADIUS)  # no stiffness in the file: the assumption


def test_moments_are_scaled_to_the_wheel_that_carries_the_tire():
    block = tire().block()
    own = law.family_forces(block, 3000.0, 0.01, 0.1, 0.02, 10.0, 1.0)
    block[law.block.RADIUS] = BOOK_RADIUS / 4
    small = law.family_forces(block, 3000.0, 0.01, 0.1, 0.02, 10.0, 1.0)
    assert small[:2] == own[:2]
    assert np.allclose(small[2:], np.array(own[2:]) / 4)


def test_a_file_without_its_scale_is_refused():
    numbers = book()
    del numbers["FNOMIN"]
    with pytest.raises(MjchairError, match="FNOMIN"):
        Tire(name="t", family="mf61", coefficients=numbers)


def test_a_wheel_that_creeps_at_an_angle_reaches_its_kinematic_slip():
    block = Tire(
        name="t", family="linear", coefficients={"cornering_stiffness": 3600.0, "friction": 0.8}
    ).block()
    state = law.Deflection(0.0, 0.0, 0.0)
    slip = np.tan(np.radians(15.0))  # four knees
    motion = law.Motion(2e-3, 0.0, 2e-3 * slip, 0.0066, 0.0, 0.3)
    for _ in range(4000):
        state, reached, _ = law.step_tire(block, state, 300.0, 0.0, motion, law.Road(0.0, 1.0), 0.1)
    assert reached.tan_alpha == pytest.approx(slip, rel=1e-3)


def test_plain_python_and_compiled_code_agree():
    wheel = tire()
    block = wheel.block()
    rng = np.random.default_rng(3)
    for _ in range(50):
        fz, kappa, alpha = rng.uniform(100, 6000), rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5)
        gamma, speed = rng.uniform(-0.1, 0.1), rng.uniform(0.1, 30.0)
        slip = law.Slip(kappa, np.tan(alpha), gamma)
        plain = law.steady_forces(block, fz, slip, law.Rolling(speed, 1.0, 1.0, wheel.radius), 1.0)
        given = wheel.forces(fz, kappa, alpha, gamma, speed)
        assert np.allclose(plain, given, rtol=1e-12, atol=1e-9)


def test_a_tir_tire_drives_the_chair_in_the_native_callback():
    import mujoco

    import mjchair

    numbers = book(LATERAL_STIFFNESS=1e5, LONGITUDINAL_STIFFNESS=3e5)
    car = Tire(
        "car",
        "mf61",
        numbers,
        relaxation_x=0.0,
        relaxation_y=0.0,
        nominal_load=4000.0,
        damping_time=0.001,
    )
    model = mjchair.load_spec("manual", tire=car).compile()
    data = mujoco.MjData(model)
    with mjchair.installed():
        mujoco.mj_step(model, data, 250)
        data.ctrl[:2] = 8.0
        mujoco.mj_step(model, data, 1000)
        assert np.isfinite(data.qpos).all()
        assert data.body("chair").xpos[0] > 0.2
        assert data.sensor("left_wheel_tire").data[0] > 1.0


@pytest.mark.parametrize("family", ["mf61", "mf52"])
def test_a_shift_is_no_slip_where_the_friction_ellipse_limits(family):
    """Without coefficients of combined slip, pure slip still is the curve of the equations."""
    none = dict.fromkeys(("RBX1", "RBX3", "RBY1", "RBY4", "RVY1", "RVY2", "RVY3"), 0.0)
    shifts = {"PHX1": 0.02, "PVX1": 0.05, "PHY1": 0.02, "PVY1": 0.05}
    numbers = {k: v for k, v in (book() | shifts).items() if family == "mf61" or k in NAMES_52}
    whole = Tire("book", family, numbers | {"RHX1": 0.0, "RHY1": 0.0}, nominal_load=4000.0)
    bare = Tire("bare", family, numbers | none, nominal_load=4000.0)
    alpha, kappa = np.linspace(-0.3, 0.3, 41), np.linspace(-0.5, 0.5, 41)
    for gamma in (0.0, 0.1):
        induced = dict.fromkeys(("RVY1", "RVY2", "RVY3"), 0.0)
        pure = Tire("pure", family, {**whole.coefficients, **induced}, nominal_load=4000.0)
        given = (4000.0, 0.0, alpha, gamma)
        np.testing.assert_array_equal(bare.forces(*given).Fy, pure.forces(*given).Fy)
        given = (4000.0, kappa, 0.0, gamma)
        np.testing.assert_array_equal(bare.forces(*given).Fx, pure.forces(*given).Fx)


def test_magic_formula_52_takes_camber_as_an_angle():
    """The lateral force of MF 5.2 in pure slip, from its published equations."""
    c = {k: v for k, v in book().items() if k in NAMES_52} | {"PHY3": 0.03}
    fz, alpha, gamma = 3500.0, 0.05, 0.08
    f0 = c["FNOMIN"]
    df = (fz - f0) / f0
    mu = (c["PDY1"] + c["PDY2"] * df) * (1 - c["PDY3"] * gamma**2)
    k = c["PKY1"] * f0 * np.sin(2 * np.arctan(fz / (c["PKY2"] * f0))) * (1 - c["PKY3"] * gamma)
    y = np.tan(alpha) + c["PHY1"] + c["PHY2"] * df + c["PHY3"] * gamma
    e = (c["PEY1"] + c["PEY2"] * df) * (1 - (c["PEY3"] + c["PEY4"] * gamma) * np.sign(y))
    b = k / (c["PCY1"] * mu * fz)
    sine = np.sin(c["PCY1"] * np.arctan(b * y - e * (b * y - np.arctan(b * y))))
    v = fz * (c["PVY1"] + c["PVY2"] * df + (c["PVY3"] + c["PVY4"] * df) * gamma)
    c |= {"PKY4": 2.0, "PKY5": 0.0, "PEY5": 0.0}
    found = Tire("old", "mf52", c, nominal_load=4000.0).forces(fz, 0.0, alpha, gamma)
    assert found.Fy == pytest.approx(mu * fz * sine + v, abs=1e-9)
