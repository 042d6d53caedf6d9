"""`mjchair simulate`: any chair, scene, tire and input to a recording, a CSV and figures.

In: the options of the command line. Out, in --out: recording.npz, recording.csv, figures and, with
--video, a film.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from mjchair.commands import options
from mjchair.errors import MjchairError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import mujoco

    from mjchair.drive.quantities import Drive
    from mjchair.measurement.smartwheel import PushRim
    from mjchair.simulation.inputs import Inputs
    from mjchair.simulation.recording import Recording

DURATION = 10.0  # s, where neither an option nor a file says how long


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "simulate",
        help="simulate a chair; writes a recording, a CSV and figures",
        description="Simulate a chair. Writes recording.npz, recording.csv, wheel_speed.png and "
        "trajectory.png into --out, and video.mp4 with --video.",
    )
    options.add_model(parser)
    _add_drive(parser)
    _add_start(parser)
    run_options = parser.add_argument_group("run")
    run_options.add_argument("--duration", type=options.number, metavar="S", help="s")
    run_options.add_argument(
        "--timestep", type=options.number, metavar="S", help="s; default: the model's"
    )
    run_options.add_argument(
        "--sample-rate", type=options.number, metavar="HZ", help="Hz; default: every step"
    )
    run_options.add_argument("--video", action="store_true", help="film it as well")
    options.add_output(run_options, "out/simulate")  # type: ignore[arg-type]
    parser.set_defaults(run=run)


def _add_drive(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("drive (one of them; none: the chair coasts)")
    drive = group.add_mutually_exclusive_group()
    drive.add_argument(
        "--input",
        metavar="FILE",
        help="table of actuator columns, CSV or Parquet: torques (N m), or joystick_x, joystick_y",
    )
    drive.add_argument(
        "--smartwheel", metavar="FILE", help="push-rim recording; both wheels get its moment"
    )
    drive.add_argument(
        "--torque", type=options.pair, metavar="L,R", help="constant torque left and right, N m"
    )
    drive.add_argument(
        "--push", type=options.pair, metavar="L,R", help="push strokes: peak torques, N m"
    )
    drive.add_argument(
        "--controller",
        metavar="FILE[:NAME]",
        help="Python file with a function `controller` (or NAME): observation -> command",
    )
    group.add_argument("--rate", type=options.number, metavar="HZ", help="of the controller; 50")
    group.add_argument(
        "--delay", type=options.number, metavar="S", help="of the controller's commands, s"
    )
    group.add_argument(
        "--dropped", type=options.number, metavar="P", help="share of its commands that is lost"
    )
    group.add_argument(
        "--real-time", action="store_true", help="the controller runs with the clock on the wall"
    )
    group.add_argument(
        "--baseline", metavar="FILE", help="push-rim recording with no hand on the rim"
    )
    group.add_argument(
        "--hold",
        action="store_true",
        help="--input keeps each value until the next sample; without: straight lines",
    )
    group.add_argument(
        "--push-period", type=options.number, metavar="S", help="from stroke to stroke, s"
    )
    group.add_argument("--push-time", type=options.number, metavar="S", help="of a stroke, s")


def _add_start(parser: argparse.ArgumentParser) -> None:
    start = parser.add_argument_group("start")
    start.add_argument(
        "--position", type=options.pair, metavar="X,Y", help="of the rear axle's middle, m"
    )
    start.add_argument("--heading", type=options.number, help="rad")
    start.add_argument("--speed", type=options.number, default=0.0, help="m/s")
    start.add_argument("--yaw-rate", type=options.number, default=0.0, help="rad/s")
    start.add_argument("--brakes", action="store_true", help="lock the parking brakes")


def run(args: argparse.Namespace) -> int:
    """Simulate and write; 2 where the run broke, with what it has written."""
    from mjchair.simulation.initial import Initial
    from mjchair.simulation.recording import Status
    from mjchair.simulation.simulate import simulate
    from mjchair.storage import check_vacant, output_folder

    check_vacant(args.out, args.force)
    spec = options.chair(args, timestep=args.timestep, drive=_profile(args))
    stopped = ""
    inputs = measured = None
    if args.controller:
        recording, stopped = _closed_loop(args, spec)
    else:
        inputs, measured = _drive(args, spec.compile())
        duration = args.duration
        if duration is None and inputs is None:
            duration = DURATION
        recording = simulate(
            spec,
            inputs,
            duration,
            initial=Initial(args.position, args.heading, args.speed, args.yaw_rate),
            sample_rate=args.sample_rate,
            brakes=args.brakes,
            progress=True,
        )
    folder = output_folder(args.out, args.force)
    recording.save(folder / "recording.npz")
    recording.to_csv(folder / "recording.csv")
    _draw(recording, measured, folder, args.video)
    if stopped:
        print(f"mjchair: {stopped}; the recording up to then is in {folder}", file=sys.stderr)
        return 2
    if recording.status is not Status.COMPLETED:
        hint = _unit_hint(inputs)
        print(f"mjchair: {recording.describe()} in {folder}{hint}", file=sys.stderr)
        return 2
    print(f"{recording.describe()}; written to {folder}")
    return 0


def _unit_hint(inputs: Inputs | None) -> str:
    """What a run that broke may owe to the unit of its torques, as the end of a line."""
    from mjchair.measurement.torque import check_torques

    torques = {} if inputs is None else inputs.controls
    try:
        check_torques({n: v for n, v in torques.items() if n.endswith("_wheel")}, "its input")
    except MjchairError as error:
        return f"; {error}"
    return ""


def _closed_loop(args: argparse.Namespace, spec: mujoco.MjSpec) -> tuple[Recording, str]:
    """The recording of a run with the user's controller, and why it stopped early ("": not)."""
    from mjchair.simulation.controller_file import read_controller
    from mjchair.simulation.initial import Initial
    from mjchair.simulation.simulator import ControllerError, Link, Simulator

    _check_pairs(args)
    controller = read_controller(args.controller)
    simulator = Simulator(
        spec,
        rate=50.0 if args.rate is None else args.rate,
        initial=Initial(args.position, args.heading, args.speed, args.yaw_rate),
        sample_rate=args.sample_rate,
        brakes=args.brakes,
        commands=Link(args.delay or 0.0, dropped=args.dropped or 0.0),
        real_time=args.real_time,
    )
    try:
        return simulator.run(controller, args.duration or DURATION), ""
    except ControllerError as error:
        if error.recording is None:
            raise
        return error.recording, str(error)


def _profile(args: argparse.Namespace) -> str | Drive | None:
    """The drive that is asked for; the usual one where the input has a joystick and none is."""
    from mjchair.drive.block import JOYSTICK
    from mjchair.drive.files import USUAL

    asked = options.drive(args)
    if asked is not None or not args.input:
        return asked
    from mjchair.model import assets
    from mjchair.model.spec import drive_file
    from mjchair.simulation.table import read_table

    chair = assets.find("model", args.model, assets.chairs())
    stick = set(JOYSTICK) & set(read_table(args.input).columns)
    return USUAL if stick and drive_file(chair).is_file() else None


def _drive(args: argparse.Namespace, model: mujoco.MjModel) -> tuple[Inputs | None, PushRim | None]:
    """The inputs that the options ask for, and the push-rim recording they come from."""
    from mjchair.simulation.inputs import constant, push_strokes, read_inputs

    _check_pairs(args)
    duration = DURATION if args.duration is None else args.duration
    if args.input:
        return read_inputs(args.input, model, args.hold), None
    if args.smartwheel:
        return _push_rim(args)
    if args.torque:
        return constant(_both(args.torque), duration), None
    if args.push:
        given = {"period": args.push_period, "push": args.push_time}
        chosen = {name: value for name, value in given.items() if value is not None}
        strokes = push_strokes(_both(args.push), duration, **chosen)
        return _with_arms(strokes, model, duration, chosen), None
    return None, None


def _with_arms(
    strokes: Inputs, model: mujoco.MjModel, duration: float, chosen: Mapping[str, float]
) -> Inputs:
    """The strokes with the motion of the rider who makes them, where the rider moves."""
    from mjchair.rider.anatomy import JOINT_NAMES
    from mjchair.rider.stroke import Stroke, has_rims, push_motion
    from mjchair.simulation.inputs import PUSH_PERIOD, PUSH_SHARE, PUSH_START, Inputs, drivable

    if JOINT_NAMES[0] not in drivable(model):
        return strokes
    if not has_rims(model):
        print("mjchair: the chair has no push rims; its rider holds still", file=sys.stderr)
        return strokes
    stroke = Stroke(
        chosen.get("period", PUSH_PERIOD),
        chosen.get("push", PUSH_PERIOD * PUSH_SHARE),
        PUSH_START,
        duration,
    )
    motion = push_motion(model, stroke, strokes.time)
    return Inputs(strokes.time, {**strokes.controls, **motion}, strokes.source)


def _check_pairs(args: argparse.Namespace) -> None:
    """Raise MjchairError for an option without the one that it belongs to."""
    for name, owner in (
        ("baseline", "smartwheel"),
        ("push_period", "push"),
        ("push_time", "push"),
        ("hold", "input"),
        *((name, "controller") for name in ("rate", "delay", "dropped", "real_time")),
    ):
        if getattr(args, name) not in (None, False) and getattr(args, owner) is None:
            raise MjchairError(f"--{name.replace('_', '-')} goes with --{owner}; give that too")


def _push_rim(args: argparse.Namespace) -> tuple[Inputs, PushRim]:
    from mjchair.measurement.baseline import without_baseline
    from mjchair.measurement.smartwheel import oriented, push_inputs, read_smartwheel

    baseline = read_smartwheel(args.baseline) if args.baseline else None
    measured = oriented(without_baseline(read_smartwheel(args.smartwheel), baseline))
    return push_inputs(measured), measured


def _both(values: tuple[float, float]) -> dict[str, float]:
    return {"left_wheel": values[0], "right_wheel": values[1]}


def _draw(recording, measured, folder, video: bool) -> None:  # type: ignore[no-untyped-def]
    """Figures, and a film where one is asked for."""
    from mjchair.report.figure_file import save
    from mjchair.report.trajectory import trajectory
    from mjchair.report.wheel_speed import wheel_speed

    compared = None if measured is None else (measured.time, measured.speed)
    save(wheel_speed(recording, compared), folder / "wheel_speed.png")
    save(trajectory(recording), folder / "trajectory.png")
    if video:
        from mjchair.report.film import write_film

        write_film(recording, folder / "video.mp4", progress=True)
