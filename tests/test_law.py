"""Laws of one tire: what must hold whatever its coefficients."""

import numpy as np
import pytest

from mjchair.model import assets
from mjchair.model.spec import read_tire
from mjchair.tire import Pac89, Tire, block, law

H = 0.002
TIRES = sorted(assets.tires())
SYMMETRIC = ("wheelchair", "caster", "linear", "quadratic", "genta_table1", "wheelchair_a0_148")


def step(tire, *, u=0.0, w=0.0, r=0.0, fz=200.0, gamma=0.0, vx=0.0, vsx=0.0, vsy=0.0, yaw=0.0, h=H):
    p = tire.block()
    spin = (vx - vsx) / p[block.RADIUS]
    motion = law.Motion(vx, vsx, vsy, spin, yaw, p[block.RADIUS])
    new, slip, force = law.step_tire(
        p, law.Deflection(u, w, r), fz, gamma, motion, law.Road(0.0, 1.0), h
    )
    told = {"u": new.longitudinal, "w": new.lateral, "r": new.rolling}
    return told | {"kappa": slip.kappa, "tan_alpha": slip.tan_alpha} | force._asdict()


def settle(tire, steps=4000, **given):
    got = {"u": 0.0, "w": 0.0, "r": 0.0}
    for _ in range(steps):
        got = step(tire, u=got["u"], w=got["w"], r=got["r"], **given)
    return got


@pytest.mark.parametrize("name", TIRES)
def test_no_load_no_force_no_memory(name):
    got = step(read_tire(name), u=0.01, w=0.01, r=0.001, fz=0.0, vx=1.0, vsx=0.1, vsy=0.1)
    assert not any(got.values())


@pytest.mark.parametrize("name", SYMMETRIC)
def test_zero_slip_gives_zero_force(name):
    got = settle(read_tire(name), vx=1.0)
    assert abs(got["fx"]) < 1e-9 and abs(got["fy"]) < 1e-9


@pytest.mark.parametrize("name", SYMMETRIC)
def test_mirror(name):
    tire = read_tire(name)
    left = settle(tire, 200, vx=0.7, vsx=0.02, vsy=0.05, gamma=0.03)
    right = settle(tire, 200, vx=0.7, vsx=0.02, vsy=-0.05, gamma=-0.03)
    assert left["fx"] == pytest.approx(right["fx"], abs=1e-9)
    assert left["fy"] == pytest.approx(-right["fy"], abs=1e-9)
    assert left["mz"] == pytest.approx(-right["mz"], abs=1e-9)


@pytest.mark.parametrize("name", SYMMETRIC)
@pytest.mark.parametrize("seed", range(3))
def test_sliding_is_passive(name, seed):
    """Over a closed history the tire takes energy and never gives any back."""
    rng = np.random.default_rng(seed)
    tire = read_tire(name)
    got = {"u": 0.0, "w": 0.0, "r": 0.0}
    work = 0.0
    time = np.arange(8000) * H
    slide = [0.3 * np.sin(rng.uniform(2, 9) * time + rng.uniform(0, 6)) for _ in range(2)]
    for vsx, vsy in zip(*slide, strict=True):
        got = step(tire, u=got["u"], w=got["w"], r=got["r"], vsx=vsx, vsy=vsy)
        work += H * (got["fx"] * vsx + got["fy"] * vsy)
        assert work < 1e-6
    assert work < -1.0


@pytest.mark.parametrize("name", SYMMETRIC)
def test_total_force_stays_inside_the_friction_ellipse(name):
    tire = read_tire(name)
    p = tire.block()
    rng = np.random.default_rng(0)
    for _ in range(300):
        fz = rng.uniform(1, 600)
        vx, vsx, vsy = rng.normal(0, 1, 3)
        got = {"u": 0.0, "w": 0.0, "r": 0.0}
        for _ in range(40):
            got = step(tire, u=got["u"], w=got["w"], r=got["r"], fz=fz, vx=vx, vsx=vsx, vsy=vsy)
        _, _, dx, dy = law.family_stiffness(p, fz, 0.0, vx)
        assert np.hypot(got["fx"] / dx, got["fy"] / dy) <= 1.0 + 1e-9


@pytest.mark.parametrize("name", ["wheelchair", "caster", "linear"])
def test_steady_state_is_the_formula(name):
    tire = read_tire(name)
    vx, kappa, alpha = 0.004, 0.02, 0.1
    got = settle(tire, 40000, vx=vx, vsx=-kappa * vx, vsy=np.tan(alpha) * vx, h=0.004)
    want = tire.forces(200.0, kappa, alpha, speed=vx)
    assert got["fx"] == pytest.approx(float(want.Fx), rel=1e-6)
    assert got["fy"] == pytest.approx(float(want.Fy), rel=1e-6)
    assert got["mz"] == pytest.approx(float(want.Mz), rel=1e-4)
    assert got["my"] == pytest.approx(float(want.My), rel=1e-4)


def test_relaxation_takes_its_length():
    """63 % of the side force after one relaxation length, whatever the speed (small slip)."""
    tire = read_tire("wheelchair").with_(relaxation_y=0.1, damping_time=0.0)
    for vx in (0.1, 1.0):
        h = 1e-5 / vx
        steps = round(0.1 / (vx * h))
        short = settle(tire, steps, vx=vx, vsy=1e-3 * vx, h=h)["fy"]
        full = float(tire.forces(200.0, 0.0, np.arctan(1e-3)).Fy)
        assert short / full == pytest.approx(1 - np.exp(-1), abs=2e-3)


def test_nothing_winds_up_at_standstill():
    """Dragged a metre aside and pulled back, the force reverses within millimetres."""
    tire = read_tire("wheelchair")
    got = settle(tire, 2000, vsy=0.25)
    assert -160.0 <= got["fy"] < -0.85 * 160.0, "sliding, past the peak of 0.8 * 200 N"
    back, moved = got, 0.0
    while back["fy"] < 0.0:
        back = step(tire, u=back["u"], w=back["w"], r=back["r"], vsy=-0.001)
        moved += 0.001 * H
    assert moved < 0.012


def test_friction_and_stiffness_factors_scale_peak_and_slope():
    base = read_tire("wheelchair")
    peak = base.with_(friction_factor=0.5)
    assert float(peak.forces(300, 0, 1.0).Fy) == pytest.approx(
        0.5 * float(base.forces(300, 0, 1.0).Fy), rel=0.02
    )
    small = np.array([1e-4])
    assert peak.forces(300, 0, small).Fy == pytest.approx(base.forces(300, 0, small).Fy, rel=1e-3)
    stiff = base.with_(stiffness_factor=2.0)
    assert stiff.forces(300, 0, small).Fy == pytest.approx(
        2 * base.forces(300, 0, small).Fy, rel=1e-3
    )


def test_the_longitudinal_factor_is_of_the_slip_along_the_heading_alone():
    base = read_tire("wheelchair")
    stiff, small = base.with_(longitudinal_factor=2.0), np.array([1e-4])
    assert stiff.forces(300, small, 0).Fx == pytest.approx(
        2 * base.forces(300, small, 0).Fx, rel=1e-3
    )
    assert np.array_equal(stiff.forces(300, 0, small).Fy, base.forces(300, 0, small).Fy)
    # rolling in a steady state, and the block of an older model, which has none
    assert step(stiff, u=1e-5, vsx=2.5e-4)["fx"] == pytest.approx(
        2 * step(base, u=1e-5, vsx=2.5e-4)["fx"], rel=1e-2
    )
    older = base.block()
    older[block.LONGITUDINAL_FACTOR] = 0.0
    assert law.along(older) == 1.0


def test_load_exponent_bends_the_load_dependence():
    bent = read_tire("linear").with_(load_exponent=0.2)
    at = float(bent.nominal_load)
    assert float(bent.forces(2 * at, 0, 1e-3).Fy) / float(
        bent.forces(at, 0, 1e-3).Fy
    ) == pytest.approx(2.0**-0.2)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Pac89([1.3, -53.31, 1190, 588.6, 2.5315], load_unit="N"), "peak friction"),
        (lambda: Pac89([1.3, 0, 0.8, 100, 900], load_unit="kg"), "load_unit"),
        (lambda: Pac89([0.0] * 15), "at most 14"),
        (lambda: Tire("t", "pac98", {}), "did you mean 'pac89'"),
        (lambda: Tire("t", "linear", {"cornering_stifness": 1.0}), "did you mean"),
        (lambda: Tire("t", "linear", {"cornering_stiffness": np.nan, "friction": 1}), "finite"),
        (lambda: read_tire("wheelchair").with_(relaxation_x=-1.0), "relaxation_x is -1 m"),
    ],
)
def test_bad_numbers_are_refused_in_one_line(make, words):
    with pytest.raises(ValueError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
