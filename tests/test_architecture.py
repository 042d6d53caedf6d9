"""Imports go one way: a file imports only from floors beneath its own, or from its own."""

import ast
from pathlib import Path

import pytest

import mjchair
from mjchair.effects.library import names as effect_names

PACKAGE = Path(mjchair.__file__).parent

# bottom first; those of one row stand side by side and do not know each other
FLOORS = [
    ("errors",),
    ("csv_table", "storage", "toml_file", "units"),
    ("tire", "rider", "drive"),
    ("model",),
    ("engine",),
    ("simulation",),
    ("measurement",),
    ("motion",),
    ("identification",),
    ("effects",),
    ("diagnosis", "practice"),
    ("report",),
    ("tasks", "sweep", "testlab"),
    ("commands",),
    ("cli",),
    ("__init__", "__main__"),
]
LEVEL = {name: level for level, row in enumerate(FLOORS) for name in row}
WITHOUT_MUJOCO = ("errors", "storage", "tire")


def floor(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(path: Path):
    """Modules that a file imports, at its top or inside functions; "x.y" for `from x import y`."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute here"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def floors_of(path: Path) -> set[str]:
    found = set()
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "mjchair" and len(parts) > 1:
            found.add(parts[1] if parts[1] in LEVEL else "__init__")
    return found


# the rooms of the diagnosis, in the same way
ROOMS = [
    ("rules",),
    ("data",),
    ("replay",),
    ("fit",),
    ("explain",),
    ("next_experiment",),
    ("result",),
    ("evidence", "material", "notes"),
    ("decide",),
    ("diagnose",),
    ("driven_run",),
]
ROOM_LEVEL = {name: level for level, row in enumerate(ROOMS) for name in row}

FILES = sorted(PACKAGE.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_go_down(path):
    own = floor(path)
    assert own in LEVEL, f"{own} is on no floor: give it one in this file"
    for other in floors_of(path) - {own}:
        assert LEVEL[other] < LEVEL[own], f"{own} imports {other}, which is not beneath it"


DIAGNOSIS = [p for p in FILES if floor(p) == "diagnosis"]


@pytest.mark.parametrize("path", DIAGNOSIS, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_data_flows_up_through_the_rooms_of_the_diagnosis(path):
    parts = path.relative_to(PACKAGE / "diagnosis").parts
    own = parts[0].removesuffix(".py")
    if own == "__init__":
        return
    for name in imports(path):
        other = name.split(".")
        if other[:2] == ["mjchair", "diagnosis"] and other[2] != own:
            assert ROOM_LEVEL[other[2]] < ROOM_LEVEL[own], f"{own} imports {name}"


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_the_tire_law_knows_no_engine(path):
    if floor(path) in WITHOUT_MUJOCO:
        assert not [name for name in imports(path) if name.split(".")[0] == "mujoco"]


SIMULATING = ("simulate", "simulator", "batch")


def test_reports_draw_and_do_not_simulate():
    for path in FILES:
        if floor(path) == "report":
            for module in SIMULATING:
                used = [
                    n for n in imports(path) if f"{n}.".startswith(f"mjchair.simulation.{module}.")
                ]
                assert not used, f"{path.name} simulates: {used}"


def test_the_general_machinery_of_the_diagnosis_knows_no_effect_by_name():
    known = set(effect_names())
    for path in DIAGNOSIS:
        tree = ast.parse(path.read_text())
        texts = {n.value for n in ast.walk(tree) if isinstance(n, ast.Constant)}
        named = known & {text for text in texts if isinstance(text, str)}
        modules = {n for n in imports(path) if n.removeprefix("mjchair.effects.") in known}
        assert not named | modules, f"{path.name} knows {named | modules}"


def test_no_drawer_for_odds_and_ends():
    assert not [p for p in FILES if p.stem in ("utils", "util", "helpers", "misc", "common")]


def test_importing_sets_no_callback():
    import subprocess
    import sys

    code = (
        "import mjchair, mjchair.cli, mujoco; "
        "assert mujoco.get_mjcb_act_dyn() is None and mujoco.get_mjcb_sensor() is None"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
