"""Every figure of speed in one run: python benchmarks/bench.py [--only step batch ...] [--out DIR]

Two things that are compared are measured alternately in one process, so that other work on the
machine and its clock disturb both in the same way. A figure is the best measurement, which is
disturbed least, and a ratio is that of two best measurements. Where the difference is only a few
percent, it is the median of the ratios of neighbouring measurements, with quartiles.
docs/benchmarks.md says what each figure means. Writes benchmarks.md and benchmarks.json into --out.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any
from unittest import mock

import mujoco
import numpy as np
from mujoco import batch

import mjchair
from mjchair.model.visual_geoms import without_visual_geoms
from mjchair.storage import write_whole

STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
TURNS = 41
STEPS = 300


@dataclass
class Line:
    """One line of the table."""

    what: str
    value: str
    reach: str = ""
    note: str = ""


def rolling(model: mujoco.MjModel, tires: bool = True) -> tuple[mujoco.MjData, np.ndarray]:
    """Data of the chair under way, and its state."""
    data = mujoco.MjData(model)
    with mjchair.installed():
        if not tires:
            mjchair.uninstall()
        data.ctrl[:2] = (1.5, 2.0) if tires else 0.0
        mujoco.mj_step(model, data, nstep=200)
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return data, state


def stepping(
    model: mujoco.MjModel, compiled: bool | None, steps: int = STEPS
) -> Callable[[], float]:
    """A turn: microseconds a step from the same state. compiled: None for no callbacks."""
    data, state = rolling(model, compiled is not None)

    def turn() -> float:
        mjchair.uninstall() if compiled is None else mjchair.install(compiled)
        mujoco.mj_setState(model, data, state, STATE)
        begin = time.perf_counter()
        mujoco.mj_step(model, data, nstep=steps)
        return 1e6 * (time.perf_counter() - begin) / steps

    return turn


def side_by_side(
    turns: dict[str, Callable[[], float]], count: int = TURNS
) -> dict[str, np.ndarray]:
    """Measure all alternately: name -> (count,). Every second round has the reverse order."""
    found: dict[str, list[float]] = {name: [] for name in turns}
    for turn in turns.values():
        turn()
    for k in range(count):
        for name in list(turns)[:: 1 if k % 2 == 0 else -1]:
            found[name].append(turns[name]())
    mjchair.uninstall()
    return {name: np.array(values) for name, values in found.items()}


def ratio(
    found: dict[str, np.ndarray], a: str, b: str, best: Callable[..., float] = np.min
) -> float:
    """Of the best turns of a and b; best is np.min of times, np.max of rates."""
    return float(best(found[a]) / best(found[b]))


def overhead(found: dict[str, np.ndarray], a: str, b: str) -> tuple[float, str]:
    """Excess of a over b, in percent: median of the ratios of neighbours, and their spread."""
    more = 100.0 * (found[a] / found[b] - 1.0)
    low, middle, high = np.percentile(more, (25.0, 50.0, 75.0))
    return float(middle), f"quartiles {low:+.1f}, {high:+.1f} % of {more.size} pairs"


def tireless(spec: mujoco.MjSpec, condim: int) -> mujoco.MjModel:
    """The same chair without tires: frictionless, or with MuJoCo's own friction.

    Native friction keeps the default solref: on the tires' direct stiffness it blows up.
    """
    copy = spec.copy()
    for kind in (copy.actuators, copy.sensors):
        for element in list(kind):
            if element.name.endswith("_tire") or element.name == "heading":
                copy.delete(element)
    for geom in copy.geoms:
        if geom.name.endswith("_tire"):
            geom.condim, geom.friction = condim, (0.8, 0.005, 0.0001)
            if condim > 1:
                geom.solref, geom.solimp = (0.02, 1.0), (0.9, 0.95, 0.001, 0.5, 2.0)
    return copy.compile()


def step_time() -> list[Line]:
    """The step-time figures of the rolling chair."""
    spec = mjchair.load_spec()
    full = spec.compile()
    found = side_by_side(
        {
            "tires": stepping(full, True),
            "native": stepping(tireless(spec, 3), None),
            "bare": stepping(tireless(spec, 1), None),
            "slim": stepping(without_visual_geoms(spec).compile(), True),
            "apart": stepping(mjchair.load_spec(merge_visual_geoms=False).compile(), True),
        }
    )
    plain = side_by_side({"tires": stepping(full, True), "plain": stepping(full, False, 20)}, 7)
    us = {name: float(values.min()) for name, values in found.items()}
    return [
        Line("step of the manual chair, tires on", f"{us['tires']:.2f} us"),
        Line(
            "against native elliptic friction, condim 3",
            f"{ratio(found, 'tires', 'native'):.2f}",
            "<= 1.0",
            f"{us['native']:.2f} us",
        ),
        Line(
            "against the bare frictionless chair",
            f"{ratio(found, 'tires', 'bare'):.2f}",
            "<= 1.4",
            f"{us['bare']:.2f} us",
        ),
        Line(
            "plain Python callbacks against compiled",
            f"{ratio(plain, 'plain', 'tires'):.0f}",
            ">= 50",
            f"{plain['plain'].min():.0f} us",
        ),
        Line(
            "against the chair with its visual geoms not merged",
            f"{ratio(found, 'tires', 'apart'):.2f}",
            "<= 0.8",
            f"{us['apart']:.2f} us",
        ),
        Line(
            "without what is only seen, against not merged",
            f"{ratio(found, 'slim', 'apart'):.2f}",
            "",
            f"{us['slim']:.2f} us",
        ),
    ]


def drives() -> list[Line]:
    """What the drive of a power chair costs: the chair under way by joystick and by torques."""
    by_joystick = mjchair.load_spec("power", drive="normal").compile()
    by_torques = mjchair.load_spec("power").compile()
    found = side_by_side(
        {
            "drive": driving(by_joystick, {"joystick_x": 0.6, "joystick_y": 0.3}),
            "torques": driving(by_torques, {"left_wheel": 3.0, "right_wheel": 4.0}),
        }
    )
    more, spread = overhead(found, "drive", "torques")
    return [
        Line("step of the power chair with its drive", f"{found['drive'].min():.2f} us"),
        Line("more than without, driven by torques", f"{more:.1f} %", "<= 5 %", spread),
    ]


def driving(model: mujoco.MjModel, controls: dict[str, float]) -> Callable[[], float]:
    """A turn: microseconds a step of a chair under way, from the same state."""
    data = mujoco.MjData(model)
    for name, value in controls.items():
        data.actuator(name).ctrl[0] = value
    state = np.empty(mujoco.mj_stateSize(model, STATE))
    with mjchair.installed():
        mujoco.mj_step(model, data, nstep=400)
        mujoco.mj_getState(model, data, state, STATE)

    def turn() -> float:
        mjchair.install()
        mujoco.mj_setState(model, data, state, STATE)
        begin = time.perf_counter()
        mujoco.mj_step(model, data, nstep=STEPS)
        return 1e6 * (time.perf_counter() - begin) / STEPS

    return turn


def first_step() -> list[Line]:
    """A whole process, from command to the first step, compiled code cached."""
    code = (
        "import mujoco, mjchair; m = mjchair.load_spec().compile(); mjchair.install(); "
        "mujoco.mj_step(m, mujoco.MjData(m))"
    )
    taken = []
    for _ in range(4):
        begin = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        taken.append(time.perf_counter() - begin)
    second = min(taken[1:])
    return [Line("command to first step, second start", f"{second:.2f} s", "<= 2 s")]


def batches() -> list[Line]:
    """Throughput of mujoco.batch on one and two threads."""
    model = without_visual_geoms(mjchair.load_spec()).compile()
    _, state = rolling(model)
    chairs, steps = 64, 200

    def turn(threads: int) -> Callable[[], float]:
        many = batch.Batch(model, chairs, threads)

        def run() -> float:
            mjchair.install()
            many.state[:] = state
            begin = time.perf_counter()
            many.step(nstep=steps)
            return chairs * steps / (time.perf_counter() - begin)

        return run

    found = side_by_side({"one": turn(1), "two": turn(2)})
    return [
        Line("chair steps a second, batch, one thread", f"{found['one'].max():,.0f}"),
        Line("chair steps a second, batch, two threads", f"{found['two'].max():,.0f}"),
        Line("two threads against one", f"{ratio(found, 'two', 'one', np.max):.2f}", ">= 1.85"),
    ]


def environments() -> list[Line]:
    """dm_control steps a second, with and without the tires."""
    from mjchair import tasks

    def turn(tires: bool) -> Callable[[], float]:
        environment = tasks.load("straight_line", {"random": 0}, visual_geoms=False)
        action, steps = np.array([1.0, 1.2]), 60

        def run() -> float:
            mjchair.install() if tires else mjchair.uninstall()
            environment.reset()
            begin = time.perf_counter()
            for _ in range(steps):
                environment.step(action)
            return steps / (time.perf_counter() - begin)

        return run

    found = side_by_side({"with": turn(True), "without": turn(False)}, 15)
    return [
        Line("dm_control steps a second (10 substeps), tires on", f"{found['with'].max():,.0f}"),
        Line(
            "the same without tires",
            f"{found['without'].max():,.0f}",
            "",
            f"ratio {ratio(found, 'with', 'without', np.max):.2f}",
        ),
    ]


def rendering() -> list[Line]:
    """Pictures a second of mjchair's film against MuJoCo's bare renderer, same size."""
    from mjchair.report import gl
    from mjchair.report.film import Film

    width, height, pictures = 640, 360, 8
    recording = mjchair.simulate(
        mjchair.load_spec(),
        mjchair.constant({"left_wheel": 3.0, "right_wheel": 3.5}, 1.0),
        sample_rate=50.0,
    )

    def bare() -> float:
        model = recording.model.load()
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        data, context = mujoco.MjData(model), gl.context(width, height)
        scene, drawing = mujoco.MjvScene(model, 2000), mujoco.MjrContext(model, 150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawing)
        camera, options = mujoco.MjvCamera(), mujoco.MjvOption()
        camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
        camera.fixedcamid = model.camera("follow").id
        rect, pixels = mujoco.MjrRect(0, 0, width, height), np.empty((height, width, 3), np.uint8)

        def picture(sample: int) -> None:
            data.qpos[:] = recording.qpos[sample]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_camlight(model, data)
            every = mujoco.mjtCatBit.mjCAT_ALL
            mujoco.mjv_updateScene(model, data, options, None, camera, every, scene)
            mujoco.mjr_render(rect, scene, drawing)
            mujoco.mjr_readPixels(pixels, None, rect, drawing)

        rate = per_second(picture, pictures)
        drawing.free()
        context.free()
        return rate

    def film() -> float:
        with Film(recording, width, height) as drawn:
            return per_second(drawn.frame, pictures)

    try:
        found = side_by_side({"film": film, "bare": bare}, 5)
    except mjchair.MjchairError as error:
        return [Line("pictures a second", "not measured", "", str(error))]
    return [
        Line(
            f"pictures a second, force arrows, {width} x {height}",
            f"{found['film'].max():.1f}",
        ),
        Line(
            "MuJoCo's bare renderer, same size",
            f"{found['bare'].max():.1f}",
            "",
            f"ratio {ratio(found, 'film', 'bare', np.max):.2f}",
        ),
    ]


REPLAYED = """(async () => {
  await mjchair.ready;
  const scene = document.getElementById("scene"), gl = scene.getContext("webgl2");
  const pixel = new Uint8Array(4);
  const drawn = () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);  // waits
  let at = 0;
  const pictures = (count) => {
    const begin = performance.now();
    for (let k = 0; k < count; k++) mjchair.seek((at = (at + 1 / 60) % 12));
    return (performance.now() - begin) / count;
  };
  const best = { script: Infinity, calls: Infinity, software: Infinity };
  for (let turn = 0; turn < 15; turn++) {
    scene.style.display = "none";  // a picture of no size is not drawn
    best.script = Math.min(best.script, pictures(60));
    scene.style.display = "";
    pictures(1); drawn();
    const begin = performance.now();
    best.calls = Math.min(best.calls, pictures(1)); drawn();
    best.software = Math.min(best.software, performance.now() - begin);
  }
  return best;
})()"""


def replays() -> list[Line]:
    """Milliseconds for a picture of a replay that plays, in a browser without a graphics card.

    Script is what the page computes for a picture: poses, arrows, forces, diagrams; then with the
    calls that hand it to the graphics; then with the wait for a picture that software draws.
    """
    sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
    from browser import Page, program

    if program() is None:
        return [Line("a picture of a replay", "not measured", "", "no Chromium here")]
    pushes = mjchair.push_strokes({"left_wheel": 16.0, "right_wheel": 13.0}, duration=12.0)
    run = mjchair.simulate(mjchair.load_spec(), pushes, initial={"speed": 0.7}, sample_rate=250.0)
    with tempfile.TemporaryDirectory() as folder:
        run.replay({"ghost": run}).save(Path(folder) / "run.html")
        with Page(Path(folder) / "run.html", 1280, 800) as page:
            found = page.value(REPLAYED)
    reach = f"<= {1e3 / 60:.1f} ms"
    return [
        Line("script of a picture of a replay, with a ghost", f"{found['script']:.2f} ms", reach),
        Line("the same with the calls that draw it", f"{found['calls']:.2f} ms", reach),
        Line("the same, drawn by software, 1216 x 456", f"{found['software']:.0f} ms"),
    ]


def per_second(picture: Callable[[int], object], count: int) -> float:
    """How often a second `picture` draws; the first call is not counted."""
    picture(0)
    begin = time.perf_counter()
    for sample in range(1, count + 1):
        picture(sample)
    return count / (time.perf_counter() - begin)


def sweeps() -> list[Line]:
    """A sweep against bare mujoco.batch on the same models, states and controls.

    Two comparisons: with the batch inside the sweep, measured at the same time, which other work
    does not disturb; and with a separate batch, measured alternately, which includes all costs.
    """
    from mjchair import sweep
    from mjchair.simulation import batch as shared
    from mjchair.sweep import chunk

    study = sweep.Study(
        axes={"axle_position": [0.0, 0.05], "seed": list(range(16))},
        fixed={"push_left": 8.0, "push_right": 8.0, "push_spread": 0.1},
        duration=10.0,
    )
    cases = study.cases()
    first = chunk.run_chunk(study, cases, threads=1)
    keys = chunk.chair_keys(cases)
    models = [chunk.compiled_model(key) for key in keys]
    states = [chunk.start_state(*one).state for one in zip(keys, cases, strict=True)]
    steps = round(study.duration / models[0].opt.timestep)
    clock = models[0].opt.timestep * np.arange(steps)
    control = np.stack(
        [study.drive(c).control_array(m, clock) for c, m in zip(cases, models, strict=True)]
    )

    def bare() -> float:
        mjchair.install()
        begin = time.process_time()
        many = batch.Batch(models[0], len(cases), 1)
        many.set_models(models)
        many.state[:] = states
        many.rollout(steps, control, record=("sensordata",))
        return time.process_time() - begin

    inside: list[float] = []
    roll = shared.roll

    def timed(*args: Any, **options: Any) -> Any:
        begin = time.process_time()
        result = roll(*args, **options)
        inside.append(time.process_time() - begin)
        return result

    def swept() -> float:
        with mock.patch.object(shared, "roll", timed), tempfile.TemporaryDirectory() as folder:
            begin = time.process_time()
            sweep.run(study, Path(folder) / "out", threads=1)
            return time.process_time() - begin

    found = side_by_side({"bare": bare, "swept": swept}, 11)
    found["inside"] = np.array(inside[1:])  # the first was to warm up
    own, own_spread = overhead(found, "swept", "inside")
    more, spread = overhead(found, "swept", "bare")

    def compile_and_settle() -> float:
        chunk.clear_caches()
        begin = time.process_time()
        mjchair.install()
        two = [cases[0], cases[-1]]
        for key, case in zip(chunk.chair_keys(two), two, strict=True):
            chunk.start_state(key, case)
        return 1e3 * (time.process_time() - begin) / 2

    settling = compile_and_settle()
    lines = [
        Line(
            "sweep against the mujoco.batch in it, 10 s a chair",
            f"{own:+.1f} %",
            "<= 5 %",
            f"{own_spread}; {1e3 * found['bare'].min() / len(cases):.0f} ms a simulation",
        ),
        Line("the same against one in turns with it", f"{more:+.1f} %", "<= 5 %", spread),
        Line("compile and settle another chair, once for all its seeds", f"{settling:.0f} ms"),
    ]
    return lines + dask(study, first)


def dask(study: object, first: list) -> list[Line]:
    """The same sweep on a Dask worker of one process."""
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError:
        return [Line("Dask worker against here", "not measured", "", "mjchair[dask] is missing")]
    from mjchair import sweep
    from mjchair.sweep.chunk import run_chunk

    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with (
        LocalCluster(
            n_workers=1,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
            silence_logs=50,
        ) as cluster,
        Client(cluster, set_as_default=False) as client,
    ):
        client.submit(run_chunk, study, study.cases()[:16:15], pure=False).result()  # type: ignore[attr-defined]

        def far() -> float:
            with tempfile.TemporaryDirectory() as folder:
                begin = time.perf_counter()
                table = sweep.run(
                    study,  # type: ignore[arg-type]
                    Path(folder) / "out",
                    scheduler=cluster.scheduler_address,
                )
                taken = time.perf_counter() - begin
            assert table.to_pylist() == first, "a Dask worker's results differ"
            return taken

        def here() -> float:
            with tempfile.TemporaryDirectory() as folder:
                begin = time.perf_counter()
                sweep.run(study, Path(folder) / "out", threads=1)  # type: ignore[arg-type]
                return time.perf_counter() - begin

        found = side_by_side({"far": far, "here": here}, 5)
    more, spread = overhead(found, "far", "here")
    what = "one Dask worker against here, same results to the bit"
    return [Line(what, f"{more:+.1f} %", "", spread)]


def crowd(count: int) -> mujoco.MjModel:
    """A scene of several chairs, 3 m apart."""
    chair = without_visual_geoms(mjchair.load_spec())
    parent = mujoco.MjSpec()
    parent.nuser_sensor, parent.visual.map.zfar = 2, chair.visual.map.zfar
    for name in ("timestep", "integrator", "cone", "tolerance"):
        setattr(parent.option, name, getattr(chair.option, name))
    floor = next(g for g in chair.geoms if g.name == "floor")
    parent.worldbody.add_geom(name="floor", type=floor.type, size=floor.size, condim=3)
    for k in range(count):
        one = without_visual_geoms(mjchair.load_spec())
        one.delete(one.geom("floor"))
        frame = parent.worldbody.add_frame(pos=(3.0 * (k % 4), 3.0 * (k // 4), 0.0))
        parent.attach(one, prefix=f"chair_{k}/", frame=frame)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return parent.compile()


def crowds() -> list[Line]:
    """Cost of a step against the number of chairs in one scene."""
    counts = (1, 4, 16)
    found = side_by_side(
        {str(n): stepping(crowd(n), True, max(20, STEPS // n)) for n in counts}, 15
    )
    lines = []
    for n in counts:
        each = found[str(n)].min() / n
        lines.append(
            Line(
                f"step a chair, {n} in one scene",
                f"{each:.2f} us",
                "" if n == 1 else "linear within 10 %",
                "" if n == 1 else f"{ratio(found, str(n), '1') / n:.2f} of one alone",
            )
        )
    return lines


def fields() -> list[Line]:
    """Cost of a step on a height field, with the tires' own contact and with MuJoCo's."""
    turns, contacts, alone = {}, {}, {}
    models = {"plane": without_visual_geoms(mjchair.load_spec()).compile()}
    for cell in (0.2, 0.05, 0.025):
        shape = (round(5 / cell) + 1, round(10 / cell) + 1)
        spec = mjchair.load_spec(scene="hfield", heights=np.zeros(shape))
        models[f"{100 * cell:g} cm cells"] = without_visual_geoms(spec).compile()
    for name, model in models.items():
        contacts[name] = rolling(model)[0].ncon
        alone[name] = rolling(model, tires=False)[0].ncon
        turns[name] = stepping(model, True, 60)
        bare = f"{name}, no callbacks"
        turns[bare] = stepping(model, None, 60)
    found = side_by_side(turns, 9)
    lines = []
    for name in models:
        lines.append(
            Line(
                f"step on {'a plane' if name == 'plane' else 'a height field, ' + name}",
                f"{found[name].min():.1f} us",
                "",
                f"{contacts[name]} contacts; {found[f'{name}, no callbacks'].min():.1f} us and "
                f"{alone[name]} contacts without callbacks",
            )
        )
    return lines


PARTS: dict[str, Callable[[], list[Line]]] = {
    "step": step_time,
    "drive": drives,
    "start": first_step,
    "batch": batches,
    "tasks": environments,
    "render": rendering,
    "replay": replays,
    "sweep": sweeps,
    "crowd": crowds,
    "hfield": fields,
}


def machine() -> dict[str, str]:
    """The machine and the versions."""
    name = platform.processor() or platform.machine()
    if Path("/proc/cpuinfo").is_file():
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                name = line.split(":", 1)[1].strip()
                break
    from importlib.metadata import version

    versions = {p: version(p) for p in ("mujoco", "dm-control", "numpy", "numba")}
    load = f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "?"
    return {
        "processor": f"{name}, {os.cpu_count()} threads",
        "load at the start": load,
        "python": platform.python_version(),
        **versions,
    }


def markdown(told: dict[str, str], lines: list[Line]) -> str:
    rows = ["| figure | measured | reach | |", "|---|---|---|---|"]
    rows += [f"| {line.what} | {line.value} | {line.reach} | {line.note} |" for line in lines]
    about = "; ".join(f"{key} {value}" for key, value in told.items())
    return f"{about}\n\n" + "\n".join(rows) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("out/bench"))
    parser.add_argument("--only", nargs="+", choices=PARTS, default=list(PARTS))
    args = parser.parse_args()
    told, lines = machine(), []
    logging.getLogger("absl").setLevel(logging.ERROR)  # dm_control's echo of MuJoCo's warnings
    width = shutil.get_terminal_size((100, 24)).columns
    for name in args.only:
        for line in PARTS[name]():
            lines.append(line)
            print(f"{line.what:58} {line.value:>14}  {line.reach:12} {line.note}"[:width])
    args.out.mkdir(parents=True, exist_ok=True)
    write_whole(args.out / "benchmarks.md", markdown(told, lines))
    table = {"machine": told, "figures": [asdict(line) for line in lines]}
    write_whole(args.out / "benchmarks.json", json.dumps(table, indent=1) + "\n")
    print(f"written to {args.out}")


if __name__ == "__main__":
    main()
