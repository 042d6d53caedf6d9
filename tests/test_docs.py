"""The documentation: every block of code and every command in it runs, every link leads somewhere.

Blocks of a page run in order, in one folder of their own and one namespace, as a reader would run
them. Commands that would take long run with STAND_IN results or are PARSED only, and another test
runs what they do. NOT_RUN are those that are no commands of mjchair's.
"""

from __future__ import annotations

import importlib.util
import inspect
import json
import re
import sys
from pathlib import Path
from unittest import mock

import matplotlib
import matplotlib.pyplot
import pytest

from mjchair import cli
from mjchair.commands import completion
from mjchair.effects.library import names as effect_names
from mjchair.testlab import laboratory
from mjchair.testlab.result import Result, Value

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
NOTEBOOKS = sorted(DOCS.glob("notebooks/*.ipynb"))
# pages whose commands have tests of their own
ELSEWHERE = {"tire_laboratory.md": "tests/test_laboratory_page.py"}
# commands of the test laboratory that take long: they run, with results that cost nothing in place
# of the physics, which tests/test_testlab.py has
STAND_IN = (
    "mjchair test --model manual --occupant 100 --out out/sheet",
    "mjchair test rolling --set camber=0deg,6deg,12deg",
    "mjchair test rolling --uncertainty 40",
    "mjchair test obstacles --films",
    "mjchair test rolling --replays",
    "mjchair test static-stability turning --out out/two",
    "mjchair test static-stability --set axle_position=0.03",
)
# command as it stands in a page -> why it is only parsed
PARSED = {
    "mjchair rider run.c3d --static static.c3d --out rider.csv --video rider.mp4": (
        "files of one's own; tests/test_motion_capture.py has some"
    ),
    "mjchair diagnose out/study --out out/verdict --force": (
        "minutes; tests/test_gather.py diagnoses the study"
    ),
}
NOT_RUN = ("make ", ". .venv", "pip ")


def blocks(page: str) -> list[tuple[str, str, str]]:
    """Language, text, and what stands just before each block of a page."""
    text = (DOCS / page).read_text()
    return [
        (m[1], m[2], text[max(0, m.start() - 200) : m.start()])
        for m in re.finditer(r"^```(\w+)\n(.*?)^```", text, re.M | re.S)
    ]


def commands(text: str) -> list[str]:
    """The commands of a shell block, without their comments."""
    lines = [line.removeprefix("$ ").split("  #")[0].strip() for line in text.splitlines()]
    return [line for line in lines if line and not line.startswith("#")]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to read a page in, with the repository's data and scripts in it."""
    monkeypatch.chdir(tmp_path)
    for name in ("data", "scripts", "models"):
        (tmp_path / name).symlink_to(ROOT / name)
    matplotlib.use("Agg")
    return tmp_path


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p) and p not in ELSEWHERE])
def test_every_block_of_a_page_runs(page, folder):
    namespace: dict[str, object] = {"__name__": "__main__"}
    for language, text, _ in blocks(page):
        if language == "python":
            exec(compile(text, page, "exec"), namespace)
        elif language == "toml":
            name = re.match(r"# (\S+\.toml)", text)
            if name:
                (folder / name[1]).write_text(text)
        elif language in ("sh", "console"):
            for command in commands(text):
                run(command)


def run(command: str) -> None:
    """Run a command of mjchair; what would take long is at least parsed."""
    if command.startswith(NOT_RUN) or not command.startswith("mjchair"):
        return
    for part in command.split("&&"):
        words = part.split()[1:]
        if command in PARSED:
            cli.parser().parse_args(words)
        elif command in STAND_IN:
            fewer = ["3" if word == "40" else word for word in words]  # chairs that are drawn
            with mock.patch.object(laboratory, "perform", stand_in):
                assert cli.main([*fewer, "--workers", "1", "--force"]) == 0, command
        else:  # films are tested in tests/test_film.py
            assert cli.main([word for word in words if word != "--video"]) == 0, command


def stand_in(test, design, stops=True, adjust=None):
    """A result in the place of a test of the laboratory."""
    return Result(test, {"of the design": Value(design.occupant or 75.0, "kg")})


def test_what_is_not_run_as_it_stands_is_in_a_page():
    said = {
        c
        for page in PAGES
        for lang, text, _ in blocks(page)
        if lang == "sh"
        for c in commands(text)
    }
    assert {*STAND_IN, *PARSED} <= said


@pytest.mark.parametrize("page", PAGES)
def test_every_command_named_in_a_sentence_exists(page):
    known = completion.commands(cli.parser())
    for words in re.findall(r"`mjchair ([a-z-]+)[^`]*`", (DOCS / page).read_text()):
        assert words in known, f"{page}: mjchair {words}"


@pytest.mark.parametrize("page", PAGES)
def test_every_link_leads_somewhere(page):
    """Offline: files of the repository, and headings in them."""
    text = re.sub(r"```.*?```", "", (DOCS / page).read_text(), flags=re.S)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("https://", "http://")):
            continue
        name, _, heading = target.partition("#")
        path = (DOCS / page).parent / name if name else DOCS / page
        if path.parent.name == "reference" and path.name in GENERATED:
            continue
        assert path.exists(), f"{page}: {target}"
        if heading and path.suffix == ".md":
            headings = re.findall(r"^#+ (.*)$", path.read_text(), re.M)
            slugs = [re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in headings]
            assert heading in slugs, f"{page}: {target}"


@pytest.mark.parametrize("notebook", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(notebook, folder):
    """Its cells, one after another, in plain Python: no cell needs a notebook."""
    pytest.importorskip("IPython", reason="make docs installs what notebooks need")
    namespace: dict[str, object] = {"__name__": "__main__"}
    for cell in json.loads(notebook.read_text())["cells"]:
        if cell["cell_type"] == "code":
            assert not cell["outputs"], "notebooks are kept without output; the site has it"
            exec(compile("".join(cell["source"]), notebook.name, "exec"), namespace)
    matplotlib.pyplot.close("all")


def test_there_are_five_notebooks_and_the_site_has_all_pages():
    assert len(NOTEBOOKS) == 5
    site = (ROOT / "mkdocs.yml").read_text()
    for page in [*PAGES, *GENERATED_PAGES, *(f"notebooks/{n.name}" for n in NOTEBOOKS)]:
        assert f" {page}" in site, f"{page} is not in the navigation"


# ---- the reference, made from the code ---------------------------------------------------------


def reference(name="site_reference"):
    """A script of the site."""
    path = ROOT / "scripts" / f"{name}.py"
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


GENERATED = {"names.md", "commands.md", "effects.md", "channels.md"}
GENERATED_PAGES = sorted(f"reference/{name}" for name in GENERATED)


@pytest.fixture(scope="module")
def made():
    return reference().pages()


def test_the_reference_has_every_option_of_every_command(made):
    page = made["reference/commands.md"]
    for name, parser in completion.commands(cli.parser()).items():
        section = page.partition(f"## mjchair {name}\n")[2].partition("\n## ")[0]
        for action in parser._actions:
            for flag in action.option_strings:
                assert flag in ("-h", "--help") or f"`{flag}`" in section, (name, flag)


def test_the_reference_has_every_effect_and_every_channel(made):
    for name in effect_names():
        assert f"## {name}\n" in made["reference/effects.md"]
    for channel in ("left_wheel_tire.Fx", "imu_gyro.z", "position.x", "left_wheel"):
        assert f"| `{channel}` |" in made["reference/channels.md"]
    assert "?" not in re.findall(r"^\| `[^`]+` \| (.*) \|$", made["reference/channels.md"], re.M)


def test_the_reference_has_every_public_name(made):
    import mjchair

    page = made["reference/names.md"]
    assert set(made) == set(GENERATED_PAGES)
    for name in mjchair.__all__:
        assert name == "__version__" or f"mjchair.{name}\n" in page, name


def test_the_reference_lists_every_argument_on_a_line_of_its_own():
    """Docstrings name several on a line; a table of the site would have the first of them only."""
    import mjchair

    pytest.importorskip("griffe", reason="make docs installs what reads docstrings")
    split = reference("site_arguments").split
    functions = [v for n in mjchair.__all__ if inspect.isfunction(v := getattr(mjchair, n))]
    told = [f for f in functions if "Args:" in (f.__doc__ or "")]
    assert len(told) > 5
    for function in [*told, mjchair.ChairParameters]:
        names = set(inspect.signature(function).parameters)
        lines = split(inspect.cleandoc(function.__doc__), names).splitlines()
        missing = names - {m[1] for line in lines if (m := re.match(r"  (\w+): ", line))}
        assert not missing, f"{function.__name__}: {missing}"


def test_the_site_is_made_without_a_warning():
    """The configuration is strict, asks no network for fonts, and `make docs` uses it."""
    site = (ROOT / "mkdocs.yml").read_text()
    assert "strict: true" in site and "font: false" in site
    assert re.search(r"^docs:.*\n(\t.*\n)*\t.*mkdocs build", (ROOT / "Makefile").read_text(), re.M)
