"""The built wheel works where the checkout is not."""

import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def call(*command, cwd, **environment):
    done = subprocess.run(
        [str(word) for word in command],
        cwd=cwd,
        capture_output=True,
        text=True,
        env={"PATH": "/usr/bin:/bin", "HOME": str(cwd)} | environment,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "build", "--wheel", "--no-isolation", "-o", folder, ROOT, cwd=folder)
    (wheel,) = folder.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def python(built, tmp_path_factory):
    """A clean environment with the wheel, and this one's dependencies behind it."""
    folder = tmp_path_factory.mktemp("clean")
    venv.create(folder / "venv", with_pip=False)
    inside = folder / "venv" / "bin" / "python"
    place = Path(
        call(
            inside, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder
        ).strip()
    )
    with zipfile.ZipFile(built) as archive:  # a pure wheel is installed by unpacking it
        archive.extractall(place)
    dependencies = folder / "dependencies"
    dependencies.mkdir()
    for entry in Path(sysconfig.get_path("purelib")).iterdir():
        if "mjchair" not in entry.name:  # neither this checkout nor a link to it
            (dependencies / entry.name).symlink_to(entry)
    (place / "dependencies.pth").write_text(str(dependencies))
    return inside


def test_it_carries_models_tires_data_and_licence(built):
    names = zipfile.ZipFile(built).namelist()
    for wanted in (
        "mjchair/models/manual/manual.xml",
        "mjchair/models/scenes/flat.xml",
        "mjchair/models/tires/wheelchair.toml",
        "mjchair/data/smartwheel/propulsion.csv",
        "mjchair/data/smartwheel/NOTICE.txt",
        "mjchair/report/templates/diagnosis.html",
        "mjchair/report/templates/diagnosis.css",
        "mjchair/data/smartwheel/LICENSE.txt",
    ):
        assert wanted in names
    assert any(name.endswith("licenses/LICENSE") for name in names)
    assert not [n for n in names if n.startswith(("tests/", "scripts/")) or "__pycache__" in n]
    assert not [n for n in names if n.endswith("MUJOCO_LOG.TXT")]


def test_it_simulates_outside_the_checkout(python, tmp_path):
    code = (
        "import mjchair, sys; from mjchair.measurement import samples; "
        "assert mjchair.__file__.startswith(sys.prefix); "
        "assert samples.propulsion().is_file(); "
        "torque = mjchair.constant({'left_wheel': 3.0}, 0.1); "
        "print(mjchair.simulate(mjchair.load_spec('manual'), torque).describe())"
    )
    out = call(python, "-c", code, cwd=tmp_path, NUMBA_CACHE_DIR=str(tmp_path))
    assert out == "completed: 0.1 s, 51 samples\n"


def test_its_command_line_runs(python, tmp_path):
    out = call(python, "-m", "mjchair", "models", cwd=tmp_path)
    assert "manual" in out and "wheelchair" in out
