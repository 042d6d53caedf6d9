"""Every picture of the documentation has a source in scripts/pictures.py, and none lies about."""

import importlib.util
import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def sources():
    """The table of scripts/pictures.py."""
    spec = importlib.util.spec_from_file_location("pictures", ROOT / "scripts" / "pictures.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["pictures"] = module
    spec.loader.exec_module(module)
    return module


def shown():
    """Names of the pictures that the documentation shows from docs/images."""
    pages = [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("models/*/README.md")]
    text = "\n".join(page.read_text() for page in pages)
    return set(re.findall(r"\]\((?:[./]*docs/)?[./]*images/([\w.]+)\)", text))


def test_every_picture_that_is_shown_has_a_script():
    made = {name for source in sources().SOURCES for name in source.pictures}
    assert shown() - made == set()


def test_every_picture_that_is_kept_is_shown():
    kept = {path.name for path in (ROOT / "docs" / "images").glob("*.png")}
    assert kept == shown()


def test_every_script_is_there_and_no_picture_has_two():
    module = sources()
    names = [name for source in module.SOURCES for name in source.pictures]
    assert len(names) == len(set(names))
    for source in module.SOURCES:
        for command in source.commands:
            program = command.split()[0]
            assert program == "mjchair" or (ROOT / program).is_file()


def test_the_learning_curve_is_made_only_when_asked_for():
    module = sources()
    assert "tasks_learning" not in [s.name for s in module.chosen([])]
    assert [s.name for s in module.chosen(["tasks_learning"])] == ["tasks_learning"]
    assert [s.name for s in module.chosen(["demo", "lab"])] == ["demo", "lab"]
