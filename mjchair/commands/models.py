"""`mjchair models`: the chairs, scenes and tires that ship, with units and sources.

In: nothing, or the name of a tire or a chair. Out: text on standard output.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

from mjchair.errors import MjchairError, nearest

PARAMETERS = "parameters"


def add(subparsers: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "models",
        help="list the chairs, scenes and tires that ship",
        description="List the chairs, scenes and tires that ship, with units and sources.",
    )
    parser.add_argument("name", nargs="?", help="one tire or chair in full, or `parameters`")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print the list, or one of its entries."""
    from mjchair.model import assets

    chairs, scenes, tires = assets.chairs(), assets.scenes(), assets.tires()
    if args.name is None:
        lines = [*_chairs(chairs), "", *_scenes(scenes), "", *_tires(tires)]
        lines += ["", "`mjchair models parameters`: what --set NAME=VALUE changes of a chair"]
    elif args.name == PARAMETERS:
        lines = list(_parameters())
    elif args.name in chairs:
        lines = (chairs[args.name].parent / "README.md").read_text().splitlines()
    elif args.name in tires:
        lines = list(_tire(args.name))
    elif args.name in scenes:
        lines = list(_scenes({args.name: scenes[args.name]}))
    else:
        raise MjchairError(
            f"no shipped model {args.name!r}"
            + nearest(args.name, (*chairs, *scenes, *tires, PARAMETERS))
        )
    print("\n".join(lines))
    return 0


def _parameters() -> Iterator[str]:
    """Every chair parameter, with its unit, its range in that unit, and what it is."""
    from dataclasses import fields

    from mjchair.model.parameters import ChairParameters
    from mjchair.units import units_of, with_unit

    yield "chair parameters (--set NAME=VALUE; in study.toml a table [chair]; in Python"
    yield "load_spec(parameters={...})): SI, or with another unit, as camber=3deg"
    for item in fields(ChairParameters):
        unit, low, high = (item.metadata[key] for key in ("unit", "low", "high"))
        told = unit if unit == "yes or no" else with_unit(f"{low:g} to {high:g}", unit)
        others = [u for u in units_of(unit) if u != unit]
        also = f" (also in {', '.join(others)})" if others else ""
        yield f"  {item.name:<16} {told:<18} {item.metadata['text']}{also}"


def _chairs(chairs) -> Iterator[str]:  # type: ignore[no-untyped-def]
    from mjchair.model.spec import load_spec
    from mjchair.model.wheels import wheels

    yield "chairs (--model); `mjchair models NAME` has the source of every number"
    for name, path in chairs.items():
        model = load_spec(name).compile()
        listed = wheels(model)
        radii = sorted({float(model.geom_size[w.geom, 0]) for w in listed}, reverse=True)
        yield (
            f"  {name:<18} {float(model.body_mass.sum()):.1f} kg, wheel radii "
            f"{', '.join(f'{r:g}' for r in radii)} m, timestep {model.opt.timestep:g} s"
        )
        yield f"  {'':<18} {path}"


def _scenes(scenes) -> Iterator[str]:  # type: ignore[no-untyped-def]
    yield "scenes (--scene); --grade is rise over run"
    for name, path in scenes.items():
        yield f"  {name:<18} {_comment(path.read_text())}"


def _comment(text: str) -> str:
    """The first sentence of an XML file's first comment."""
    words = text.partition("<!--")[2].partition("-->")[0].split()
    return " ".join(words).partition(". ")[0].rstrip(".")


def _tires(tires) -> Iterator[str]:  # type: ignore[no-untyped-def]
    from mjchair.model.spec import read_tire

    yield "tires (--tire); peak friction at the nominal load; `mjchair models NAME` has the rest"
    for name in tires:
        tire = read_tire(name)
        along, across = tire.peak_friction(tire.nominal_load)
        yield (
            f"  {name:<18} {tire.family}, peak friction {along:.2f} along and {across:.2f} across "
            f"at {tire.nominal_load:g} N"
        )
        yield f"  {'':<18} source: {tire.source}"


def _tire(name: str) -> Iterator[str]:
    from dataclasses import fields

    from mjchair.model.spec import read_tire

    tire = read_tire(name)
    yield f"{tire.name}: {tire.family}; source: {tire.source}"
    for item in fields(tire):
        if item.metadata:
            value, unit = getattr(tire, item.name), item.metadata["unit"]
            yield f"  {item.name:<22} {value:>12g} {unit:<5} {item.metadata['text']}"
    for key, value in tire.coefficients.items():
        if value:
            yield f"  {key:<22} {value:>12g}       coefficient of the {tire.family} family"
