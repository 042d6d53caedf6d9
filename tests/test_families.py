"""Formula families: one record each, found by the number in a block, in compiled code too."""

import re
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.extending import register_jitable

import mjchair
from mjchair.model import assets
from mjchair.model.spec import read_tire
from mjchair.tire import block, families, law
from mjchair.tire.formula.family import Family

ONE_PLACE = ("tire/law.py", "tire/transient.py", "tire/block.py", "tire/compiled.py", "engine")


def test_numbers_are_places_and_names_are_one_each():
    """Saved models carry the numbers, so these five never change; a new one goes to the end."""
    first = ["linear", "quadratic", "pac89", "mf52", "mf61"]
    assert [family.name for family in families.REGISTERED[:5]] == first
    assert [f.number for f in families.REGISTERED] == list(range(len(families.REGISTERED)))
    assert len(families.FAMILIES) == len(families.REGISTERED)


def test_every_formula_file_is_registered():
    import importlib

    folder = Path(families.__file__).parent / "formula"
    for path in folder.glob("*.py"):
        module = importlib.import_module(f"mjchair.tire.formula.{path.stem}")
        for value in vars(module).values():
            assert not isinstance(value, Family) or value in families.REGISTERED


@pytest.mark.parametrize("name", sorted(assets.tires()))
def test_the_law_takes_the_functions_of_the_record(name):
    tire = read_tire(name)
    family, p = families.FAMILIES[tire.family], tire.block()
    point = (200.0, 0.02, 0.05, 0.01, 1.0, 1.0)
    assert law.family_forces(p, *point) == family.forces(p, *point)
    assert law.family_stiffness(p, 200.0, 0.01, 1.0) == family.stiffness(p, 200.0, 0.01, 1.0)
    assert law.formula_relaxation(p, 200.0, 3e3, 2e3) == family.relaxation(p, 200.0, 3e3, 2e3)


def test_a_new_family_is_a_record():
    @register_jitable
    def forces(p, fz, kappa, tan_alpha, gamma, speed, direction):
        return p[block.HEADER] * kappa, -p[block.HEADER + 1] * tan_alpha, 1.0, 2.0, 3.0

    @register_jitable
    def stiffness(p, fz, gamma, speed):
        return p[block.HEADER], p[block.HEADER + 1], fz, fz

    number = len(families.REGISTERED)
    new = Family(number, "brush", ("along", "across"), forces, stiffness)
    chosen = families.choose_by_number([*(f.forces for f in families.REGISTERED), new.forces])
    # compiled beside one family; the others take long to compile and are compiled by the engine
    some = families.choose_by_number([families.FAMILIES["linear"].forces] * number + [new.forces])
    compiled = numba.njit(lambda p, *given: some(p, *given))
    point = (200.0, 0.02, 0.05, 0.0, 1.0, 1.0)

    packed = np.concatenate(
        [np.zeros(block.HEADER), new.packed({"across": 7.0, "along": 5.0}, 0.3)]
    )
    packed[block.FAMILY] = number
    expected = pytest.approx((0.1, -0.35, 1.0, 2.0, 3.0), rel=1e-12)
    assert chosen(packed, *point) == expected
    assert compiled(packed, *point) == expected
    for tire in ("wheelchair", "linear", "quadratic"):  # the others stay as they were
        own = read_tire(tire)
        record = families.FAMILIES[own.family]
        assert chosen(own.block(), *point) == record.forces(own.block(), *point)
    linear = read_tire("linear").block()
    assert compiled(linear, *point) == pytest.approx(chosen(linear, *point), rel=1e-12)
    assert not new.has_relaxation


def test_no_other_file_of_the_kernel_knows_a_family():
    package = Path(mjchair.__file__).parent
    names = "|".join(families.FAMILIES)
    for place in ONE_PLACE:
        given = package / place
        for path in sorted(given.glob("*.py")) if given.is_dir() else [given]:
            assert not re.search(rf"[\"'](?:{names})[\"']|formula\.(?!family)\w+", path.read_text())
