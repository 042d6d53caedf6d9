"""A tire of one side of the vehicle on the other: its mirror image, in formula and on a chair."""

import numpy as np
import pytest
from mf_equations import BOOK_RADIUS, book

import mjchair
from mjchair.errors import MjchairError
from mjchair.tire import Pac89, Tire, read, write
from mjchair.tire.families import FAMILIES
from mjchair.tire.formula.mf_names import NAMES_52, NAMES_61, SECTIONS_52

RANGES = {"ALPMIN": -0.2, "ALPMAX": 0.3, "CAMMIN": -0.1, "CAMMAX": 0.05, "FZMAX": 9000.0}


def whole(family, side="left", seed=1):
    """A tire with every coefficient of its family in use, all shifts among them."""
    rng = np.random.default_rng(seed)
    if family == "pac89":
        a = {"a0": 1.3, "a2": 0.8, "a3": 50.0, "a4": 500.0, "a5": 0.01, "a6": -1e-4, "a7": -0.5}
        a |= {"a8": 0.03, "a9": 1e-3, "a10": 0.4, "a11": 0.01, "a12": 0.02, "a13": 5.0}
        b = [1.6, 0.0, 0.9, 0.0, 0.2, 0.0, 0.0, 0.0, -0.3, 1e-3, 0.05]
        c = [2.2, -1e-6, 0.01, -1e-6, -2e-3, 1e-4, 0.01, 0, 0, -1.0, 0.01, 0.02, 1e-3, 0.3]
        c += [0.0, 1e-4, 1e-3, 0.6]
        return Pac89(a=a, b=b, c=c, load_unit="N", side=side, nominal_load=300.0)
    names = NAMES_52 if family == "mf52" else NAMES_61
    numbers = book() | RANGES
    ranges = [n for s, ns in SECTIONS_52.items() if s.endswith("RANGE") for n in ns]
    for name in names:
        if name in SECTIONS_52["SCALING_COEFFICIENTS"]:
            numbers[name] = rng.uniform(0.8, 1.2)
        elif name[0] in "PQRS" and name not in ranges and not numbers.get(name):
            numbers[name] = rng.uniform(-0.1, 0.1)
    numbers = {name: value for name, value in numbers.items() if name in names}
    return Tire("whole", family, numbers, side=side, nominal_load=4000.0, radius=BOOK_RADIUS)


def points():
    rng = np.random.default_rng(2)
    kappa, alpha, gamma = (rng.uniform(-s, s, 400) for s in (0.3, 0.5, 0.15))
    kappa[:80], alpha[80:160], gamma[160:240] = 0.0, 0.0, 0.0
    return rng.uniform(0.2, 2.0, 400), kappa, alpha, gamma


@pytest.mark.parametrize("speed", [-3.0, 3.0])
@pytest.mark.parametrize("family", ["mf52", "mf61", "pac89"])
def test_on_the_other_side_the_forces_are_those_of_the_mirror_image(family, speed):
    tire = whole(family)
    load, kappa, alpha, gamma = points()
    fz = load * tire.nominal_load
    here = tire.forces(fz, kappa, -alpha, -gamma, speed)
    there = tire.on("right").forces(fz, kappa, alpha, gamma, speed)
    for name, sign in (("Fx", 1), ("Fy", -1), ("Mx", -1), ("My", 1), ("Mz", -1)):
        one, other = getattr(here, name), getattr(there, name)
        assert np.allclose(other, sign * one, rtol=1e-12, atol=1e-12 * np.abs(one).max()), name
    unlike = tire.forces(fz, kappa, alpha, gamma, speed).Fy
    assert np.abs(unlike - there.Fy).max() > 0.01 * np.abs(unlike).max()
    assert tire.on("left") is tire
    assert tire.on("right").on("left") == tire


@pytest.mark.parametrize("family", ["mf52", "mf61", "pac89"])
def test_every_odd_coefficient_is_needed(family):
    """Without any one of them the mirror image is another tire."""
    tire = whole(family)
    load, kappa, alpha, gamma = points()
    image = tire.on("right")
    given = (load * tire.nominal_load, kappa, alpha, gamma)
    right = np.stack(image.forces(*given))
    for name in FAMILIES[family].odd:
        kept = {**image.coefficients, name: tire.coefficients[name]}
        wrong = Tire("wrong", family, kept, nominal_load=tire.nominal_load, radius=tire.radius)
        assert np.abs(np.stack(wrong.forces(*given)) - right).max() > 1e-6, name


def test_pac89_is_mirrored_as_adams_tire_does():
    """The list of Adams Tire's manual, "Left and Right Side Tires"."""
    assert " ".join(FAMILIES["pac89"].odd) == "a9 a10 a12 a13 c12 c13 c16 c17"


@pytest.mark.parametrize("family", ["mf52", "mf61", "pac89"])
def test_a_symmetric_tire_has_neither_ply_steer_nor_conicity(family):
    assert whole(family, side="symmetric").coefficients == whole(family).coefficients
    tire = whole(family, side="symmetric").on("left")
    straight = tire.forces(tire.nominal_load, 0.1, 0.0)
    assert straight.Fy == 0.0
    assert straight.Mz == 0.0
    assert straight.Mx == 0.0
    assert whole(family).forces(tire.nominal_load, 0.1, 0.0).Fy != 0.0
    assert tire.on("left") is tire.on("right")


@pytest.mark.parametrize("suffix", [".toml", ".tir"])
@pytest.mark.parametrize("side", ["left", "right", "symmetric", ""])
@pytest.mark.parametrize("family", ["mf61", "pac89"])
def test_the_side_is_written_and_read_back(family, side, suffix, tmp_path):
    tire = whole(family, side=side)
    write(tire, tmp_path / f"tire{suffix}")
    again = read(tmp_path / f"tire{suffix}")
    assert again.side == side
    assert again == tire


def test_an_unknown_side_is_refused():
    with pytest.raises(MjchairError, match="unknown side 'lefd'; did you mean 'left'"):
        whole("mf61", side="lefd")


def coasting(tire):
    """A run of the chair with `tire` on its wheels and, for casters, a lighter one of its side."""
    pac = whole("pac89", side=tire.side)
    spec = mjchair.load_spec("manual", tire={"wheels": tire, "casters": pac})
    return mjchair.simulate(spec, None, 3.0, initial={"speed": 1.0}, sample_rate=20)


def test_a_chair_on_tires_of_one_side_coasts_straight():
    for side in ("left", "right", "symmetric"):
        run = coasting(whole("mf61", side=side))
        assert np.abs(run["heading"]).max() < 1e-9, side
        assert np.abs(run["position.y"]).max() < 1e-9, side
        left, right = (run[f"{wheel}_tire.Fy"] for wheel in ("left_wheel", "right_wheel"))
        assert np.allclose(left, -right, rtol=0.0, atol=1e-6)
        assert (np.abs(left).max() > 1.0) == (side != "symmetric")


def test_a_chair_on_tires_of_no_side_turns_with_them():
    assert np.abs(coasting(whole("mf61", side=""))["heading"]).max() > 0.01


def test_tires_of_two_sides_are_each_mirrored_where_they_must_be():
    """A left tire on both wheels is the same chair as its image, a right tire, on both."""
    tire = whole("mf61")
    blocks = []
    for choice in (tire, tire.on("right")):
        spec = mjchair.load_spec("manual", tire={"wheels": choice})
        blocks.append([np.array(spec.geom(f"{w}_wheel_tire").userdata) for w in ("left", "right")])
    assert np.array_equal(blocks[0], blocks[1])
    assert not np.array_equal(blocks[0][0], blocks[0][1])
