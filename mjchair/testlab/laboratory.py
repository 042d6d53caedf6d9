"""Runs tests on designs, several at a time, and continues a run that was interrupted.

In: designs, names of tests, a folder. Out: a `Result` for every design and test, each also as a
file in the folder's `parts/`, and `results.json`. Where a test fails, the others are finished and
their results are kept; then the failure is raised.
"""

from __future__ import annotations

import hashlib
import importlib
import json
import multiprocessing
import os
from collections.abc import Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import mujoco
from tqdm import tqdm

from mjchair.engine.install import installed
from mjchair.errors import MjchairError, nearest
from mjchair.model import assets
from mjchair.simulation.recording import Recording
from mjchair.storage import check_vacant, output_folder, write_whole
from mjchair.testlab.design import Design
from mjchair.testlab.result import Result, Value

# name -> module and function, title, in the order of the sheet
TESTS: dict[str, tuple[str, str]] = {
    "static-stability": ("static_stability", "Static stability (ISO 7176-1:2014)"),
    "dynamic-stability": ("dynamic_stability", "Dynamic stability (ISO 7176-2:2017)"),
    "brakes": ("brakes", "Brakes (ISO 7176-3:2012)"),
    "energy": ("energy", "Energy (ISO 7176-4:2008)"),
    "turning": ("turning", "Dimensions and room (ISO 7176-5:2008)"),
    "speed": ("speed", "Speed and acceleration (ISO 7176-6:2018)"),
    "obstacles": ("obstacles", "Obstacles (ISO 7176-10:2008)"),
    "dummies": ("dummies", "Dummies (ISO 7176-11:2012)"),
    "rolling": ("rolling", "Rolling laboratory"),
    "caster-shimmy": ("caster_shimmy", "Caster shimmy"),
    "downhill-bump": ("downhill_bump", "Downhill bump"),
    "published": ("published", "Published measurements and ours"),
}
ALIASES = {"dimensions": "turning", "shimmy": "caster-shimmy", "bump": "downhill-bump"}
# the longest tests start first, so that all processors are busy until the end
LONGEST = ("caster-shimmy", "dynamic-stability", "obstacles", "downhill-bump", "static-stability")
ABOUT, PARTS = "laboratory.json", "parts"
FILMS, REPLAYS = "films", "replays"


@dataclass(frozen=True)
class Request:
    """Which tests to run on which designs, and with which options.

    Attributes:
      designs: name -> design; the first is what `results.json` has under "tests".
      tests: names. stops: whether the tilting platform has stops. films, replays: whether to write
        them.
      adjust: chair parameter -> range, for the least and the most stable set-up.
      draws: designs drawn at random around the first one, for intervals.
    """

    designs: Mapping[str, Design]
    tests: Sequence[str]
    stops: bool = True
    films: bool = False
    replays: bool = False
    adjust: Mapping[str, tuple[float, float]] | None = None
    draws: Sequence[Design] = field(default_factory=tuple)

    def digest(self) -> str:
        """Digest of everything that decides the numbers, with the chair's file and this code."""
        first = next(iter(self.designs.values()))
        path = assets.find("model", first.model, assets.chairs())
        content = {
            "designs": {name: _plain(design) for name, design in self.designs.items()},
            "draws": [_plain(design) for design in self.draws],
            "stops": self.stops,
            "adjust": None if self.adjust is None else dict(self.adjust),
            "file": hashlib.sha256(path.read_bytes()).hexdigest(),
            "code": _code(),
            "mujoco": mujoco.__version__,
        }
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _plain(design: Design) -> dict[str, Any]:
    drive = design.own_drive()
    return {
        "model": design.model,
        "occupant": design.occupant,
        "parameters": dict(design.parameters),
        "draw": None if design.draw is None else asdict(design.draw),
        "drive": None if drive is None else asdict(drive),
    }


def _code() -> str:
    """Digest of the modules of this folder."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def chosen(names: Sequence[str]) -> list[str]:
    """The tests of these names in the order of the sheet; no names: all tests.

    Raises:
      MjchairError: an unknown test.
    """
    tests = set()
    for name in names:
        known = ALIASES.get(name, name)
        if known not in TESTS:
            raise MjchairError(f"unknown test {name!r}" + nearest(name, TESTS))
        tests.add(known)
    return [name for name in TESTS if name in tests or not names]


def perform(
    test: str,
    design: Design,
    stops: bool = True,
    adjust: Mapping[str, tuple[float, float]] | None = None,
) -> Result:
    """Run one test on one design in this process.

    Raises:
      MjchairError: an unknown test, or a chair on which the test cannot be run.
    """
    if test not in TESTS:
        raise MjchairError(f"unknown test {test!r}" + nearest(test, TESTS))
    name = TESTS[test][0]
    function = getattr(importlib.import_module(f"mjchair.testlab.{name}"), name)
    if test == "static-stability":
        return function(design, stops=stops, adjust=adjust)  # type: ignore[no-any-return]
    return function(design)  # type: ignore[no-any-return]


def _task(test: str, design: Design, request: Request, where: str | None) -> dict[str, Any]:
    """Run a test in a worker; its result as plain data. Films and replays go into `where`."""
    result = perform(test, design, request.stops, request.adjust)
    if where is not None:
        for name, run in result.runs.items():
            _show(run.recording(), request, Path(where), f"{test}-{name}")
    return result.plain()


def _show(recording: Recording, request: Request, folder: Path, name: str) -> None:
    """Write a film and a replay of a run, where the request asks for them."""
    if request.films:
        from mjchair.report.film import write_film

        (folder / FILMS).mkdir(parents=True, exist_ok=True)
        write_film(recording, folder / FILMS / f"{name}.mp4", view="side")
    if request.replays:
        (folder / REPLAYS).mkdir(parents=True, exist_ok=True)
        recording.replay(title=name).save(folder / REPLAYS / f"{name}.html")


def run(
    request: Request,
    out: str | os.PathLike[str],
    *,
    workers: int = 0,
    progress: bool = False,
    force: bool = False,
) -> dict[str, dict[str, Result]]:
    """Run every test of a request whose result is not in the folder yet.

    Args:
      out: folder; the folder of an interrupted run of the same request is continued. workers:
        number of processes; 0 for as many as there are processors, 1 for this process alone.
      progress: show a bar where standard error is a terminal. force: write into a folder that has
        other content.

    Returns:
      Design -> test -> result; the values of the first design have intervals. `results.json` is
      written as well.

    Raises:
      MjchairError: the folder has other content; or, after all tests, the first one that failed.
    """
    for design in (*request.designs.values(), *request.draws):
        design.spec()
    folder = _begin(request, out, force)
    tasks = _tasks(request)
    done: dict[str, dict[str, Any]] = {}
    for key in tasks:
        path = folder / PARTS / f"{key}.json"
        if path.is_file():
            done[key] = json.loads(path.read_text())
    failures = _finish(tasks, done, request, folder, workers, progress)
    by_design = _collected(request, done)
    if by_design:
        write_results(request, by_design, folder)
    if failures:
        kept = f"; what was finished is in {folder}" if by_design else ""
        raise MjchairError("; ".join(dict.fromkeys(failures)) + kept)
    return by_design


def _begin(request: Request, out: str | os.PathLike[str], force: bool) -> Path:
    """The folder: a new one, or that of an interrupted run of the same request."""
    folder, digest = Path(out), request.digest()
    about = folder / ABOUT
    same_request = False
    if about.is_file():
        try:
            same_request = json.loads(about.read_text())["digest"] == digest
        except (ValueError, KeyError):
            same_request = False
    if not same_request:
        check_vacant(folder, force)
        for path in (folder / PARTS).glob("*.json"):
            path.unlink()
        output_folder(folder, force)
        (folder / PARTS).mkdir(exist_ok=True)
        write_whole(about, json.dumps({"digest": digest}) + "\n")
    return folder


def _tasks(request: Request) -> dict[str, tuple[str, Design, str | None]]:
    """Key -> test, design, the folder below which its films and replays are written, or None."""
    tasks: dict[str, tuple[str, Design, str | None]] = {}
    for name in (*LONGEST, *(test for test in TESTS if test not in LONGEST)):
        if name not in request.tests:
            continue
        for i, (design_name, design) in enumerate(request.designs.items()):
            where = None
            if request.films or request.replays:
                where = "" if i == 0 else design_name
            tasks[f"design-{i}-{name}"] = (name, design, where)
        for i, design in enumerate(request.draws):
            tasks[f"draw-{i}-{name}"] = (name, design, None)
    return tasks


def _finish(
    tasks: Mapping[str, tuple[str, Design, str | None]],
    done: dict[str, dict[str, Any]],
    request: Request,
    folder: Path,
    workers: int,
    progress: bool,
) -> list[str]:
    """Run the tasks that are not done and write each result at once; a line for each failure."""
    left = {key: task for key, task in tasks.items() if key not in done}
    failures: list[str] = []

    def keep(key: str, result: dict[str, Any]) -> None:
        done[key] = result
        write_whole(folder / PARTS / f"{key}.json", json.dumps(result))

    def below(where: str | None) -> str | None:
        return None if where is None else str(folder / where)

    count = min(workers or os.cpu_count() or 1, len(left))
    with tqdm(
        total=len(tasks), initial=len(done), unit="test", disable=None if progress else True
    ) as bar:
        if count <= 1:
            for key, (test, design, where) in left.items():
                bar.set_postfix_str(test)
                try:
                    keep(key, _task(test, design, request, below(where)))
                except MjchairError as error:
                    failures.append(f"{test}: {error}")
                bar.update()
            return failures
        with installed():  # compiles the tires once, if necessary, and not in every process
            context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(count, mp_context=context) as pool:
            try:
                waiting = {
                    pool.submit(_task, test, design, request, below(where)): (key, test)
                    for key, (test, design, where) in left.items()
                }
                while waiting:
                    ready, _ = wait(waiting, return_when=FIRST_COMPLETED)
                    for future in ready:
                        key, test = waiting.pop(future)
                        try:
                            keep(key, future.result())
                        except MjchairError as error:
                            failures.append(f"{test}: {error}")
                        bar.set_postfix_str(test)
                        bar.update()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                raise
    return failures


def _collected(
    request: Request, done: Mapping[str, dict[str, Any]]
) -> dict[str, dict[str, Result]]:
    """Results by design and test; the values of the first design get intervals."""
    by_design: dict[str, dict[str, Result]] = {}
    for i, name in enumerate(request.designs):
        for test in request.tests:
            plain = done.get(f"design-{i}-{test}")
            if plain is not None:
                by_design.setdefault(name, {})[test] = Result.of(test, plain)
    if request.draws and by_design:
        first = next(iter(request.designs))
        for test, result in by_design.get(first, {}).items():
            draws = [done.get(f"draw-{i}-{test}") for i in range(len(request.draws))]
            drawn = [Result.of(test, plain) for plain in draws if plain is not None]
            by_design[first][test] = with_intervals(result, drawn)
    return by_design


def with_intervals(result: Result, drawn: Sequence[Result]) -> Result:
    """The result, its numbers with the 2.5 and 97.5 % quantiles of the drawn results."""
    import numpy as np

    values: dict[str, Value] = {}
    for key, value in result.values.items():
        numbers = [r.values[key].value for r in drawn if key in r.values]
        known = [
            float(n) for n in numbers if isinstance(n, int | float) and not isinstance(n, bool)
        ]
        if len(known) >= 2 and isinstance(value.value, int | float):
            low, high = np.quantile(known, (0.025, 0.975))
            value = Value(
                value.value, value.unit, float(low), float(high), value.source, value.note
            )
        values[key] = value
    return result.with_values(values)


def write_results(
    request: Request, by_design: Mapping[str, Mapping[str, Result]], folder: Path
) -> None:
    """Write `results.json`: model, occupant, parameters and tests of all designs."""

    def tests(results: Mapping[str, Result]) -> dict[str, Any]:
        return {
            test: {key: value.plain() for key, value in result.values.items()}
            if not result.missing
            else {"not_applicable": {"value": None, "unit": "", "source": result.missing}}
            for test, result in results.items()
        }

    name, design = next(iter(request.designs.items()))
    content: dict[str, Any] = {
        **{k: v for k, v in _plain(design).items() if k != "draw"},
        "tests": tests(by_design.get(name, {})),
    }
    if len(request.designs) > 1:
        content["designs"] = [
            {"name": n, "parameters": dict(d.parameters), "tests": tests(by_design.get(n, {}))}
            for n, d in request.designs.items()
        ]
    write_whole(folder / "results.json", json.dumps(content, indent=1, allow_nan=False) + "\n")
