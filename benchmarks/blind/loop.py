"""Make the experiment that an ambiguous diagnosis proposes, and diagnose again.

    python benchmarks/blind/loop.py --seed 500 --count 50 --work out/loop

Every case hides one effect. Where the diagnosis is ambiguous, with the truth in the set, the
generator makes the manoeuvre that the diagnosis proposes, with the same chair, as one trial more;
at most `--rounds` times. Resumes where it stopped: a case that has a line in loop_SEED.jsonl is not
run again. `--keep` keeps the studies.
"""

from __future__ import annotations

import argparse
import math
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from cases import single_case
from generator import SEAL, Case, Manoeuvre, add_trial, make, unseal
from runner import diagnosed, parser, resumed
from table import counted, kept, markdown, named, truth, wrong

from mjchair.diagnosis.explain.rivals import exchanged
from mjchair.diagnosis.fit.nonlinear import Fitted, refit
from mjchair.diagnosis.next_experiment import manoeuvres
from mjchair.diagnosis.next_experiment.design import Plan
from mjchair.diagnosis.result import Diagnosis, Stages
from mjchair.errors import MjchairError

# nobody starts exactly as told: standard deviations of place (m), heading (rad), and of speed and
# yaw rate (shares); assumptions
PLACE, HEADING, SPEED = 0.03, 0.02, 0.03


def one(args: argparse.Namespace, number: int, threads: int) -> dict:
    """A study, its diagnosis, and as many experiments with new diagnoses as are needed."""
    study, case = args.work / f"study_{args.seed}_{number:03d}", single_case(number, args.seed)
    seed = 1000 * args.seed + number
    make(study, case, seed, args.trials, args.seconds, held=number % args.trials)
    answer = unseal(study / SEAL)
    found, said = diagnosed(study, threads)
    line = {"number": number, "answer": answer, "diagnoses": [said], "experiments": []}
    while found is not None and goes_on(line, args.rounds):
        plan = found.evidence.plan if found.evidence else None
        if plan is None:
            break
        experiment = {
            "manoeuvre": plan.best.manoeuvre.name,
            "words": found.next_experiment,
            "rivals": list(plan.rivals),
            "promised": [math.sqrt(t) for t in plan.best.separations],
        }
        perform(study, case, seed, found, plan, len(line["experiments"]) + 1)
        again, said = diagnosed(study, threads)
        if again is not None:
            experiment["shown"] = shown(plan, found.stages, again.stages)
        line["diagnoses"].append(said)
        line["experiments"].append(experiment)
        found = again
    if not args.keep:
        shutil.rmtree(study)
    return line


def goes_on(line: dict, rounds: int) -> bool:
    """Whether another experiment is asked for: an ambiguous set with the truth in it."""
    return len(line["experiments"]) < rounds and ambiguous(last(line))


def perform(study: Path, case: Case, seed: int, found: Diagnosis, plan: Plan, nth: int) -> None:
    """Let the generator make the best manoeuvre of a plan, nearly as it says."""
    man = plan.best.manoeuvre
    here = manoeuvres.setting(found.stages.base.bench.simulator.study)
    start = here.initial(man)
    off = np.random.default_rng([seed, 4, nth]).standard_normal(5)
    asked = Manoeuvre(
        man.name,
        float((start.heading or 0.0) + HEADING * off[0]),
        start.speed * (1.0 + SPEED * off[1]),
        start.yaw_rate * (1.0 + SPEED * off[2]),
        _torque(man, here.torque) if man.torque else None,
        (start.position[0] + PLACE * off[3], start.position[1] + PLACE * off[4]),
    )
    load = (man.load.mass, man.load.height) if man.load else None
    add_trial(study, case, seed, asked, man.seconds, nth, load)


def _torque(man: manoeuvres.Manoeuvre, most: float):  # type: ignore[no-untyped-def]
    def torque(time: float) -> tuple[float, float]:
        left, right = man.torque(np.array([time]))
        return most * float(left[0]), most * float(right[0])

    return torque


def shown(plan: Plan, before: Stages, after: Stages) -> list[float | None]:
    """By how many sigmas each rival fell further behind: sqrt of what its chi2 lost, 0 if it won.

    None: a rival that could not be fitted again. A force outside the library has no fit.
    """
    choice = before.choice
    rivals = [rival.fitted for *_, rival in exchanged(choice)]
    if (rivals and len(plan.rivals) > len(rivals)) or plan.rivals == ("no further effect",):
        rivals.append(before.base.plain)  # beside something that happened once
    out: list[float | None] = []
    try:
        chosen = again(choice.fitted, after)
    except MjchairError:
        return [None] * len(rivals)
    for rival in rivals:
        try:
            grown = (again(rival, after) - chosen) - (rival.total - choice.fitted.total)
        except MjchairError:
            out.append(None)
            continue
        out.append(math.sqrt(max(grown, 0.0)))
    return out


def again(fitted: Fitted, after: Stages) -> float:
    """Chi2 of the same effects on the study that has one trial more."""
    keys = sorted(t.effect.key for t in fitted.variant.terms)
    if not keys:
        return after.base.plain.total
    tried = after.choice.tried if after.choice else []
    known = [t.fitted.total for t in tried if list(t.hypothesis.keys) == keys]
    if known:
        return min(known)
    return refit(after.base.bench, fitted.variant, after.base.around.track).total


# -- the table -----------------------------------------------------------------------------------


def last(line: dict) -> dict:
    """The newest diagnosis, with the answer, as the functions of table.py read it."""
    return after(line, len(line["diagnoses"]) - 1)


def after(line: dict, experiments: int) -> dict:
    """The diagnosis after that many experiments, or the newest."""
    which = min(experiments, len(line["diagnoses"]) - 1)
    return {"answer": line["answer"], **line["diagnoses"][which]}


def ambiguous(said: dict) -> bool:
    """Whether the verdict is `ambiguous`, with the truth in the set."""
    return said["verdict"] == "ambiguous" and kept(said)


def right_alone(said: dict) -> bool:
    """Whether the right effect, of the right channel, is named and nothing else."""
    channels = {e.get("channel") or "" for e in said["effects"]}
    return named(said) == truth(said) and channels == {said["answer"]["channel"]}


def table(lines: Sequence[dict]) -> str:
    """Rows of figure, aim and result, and a row for every loop, in Markdown."""
    went = [x for x in lines if ambiguous(after(x, 0))]
    rivalled = [x for x in went if after(x, 0)["alternatives"]]
    pairs = [
        (p, s)
        for x in went
        for e in x["experiments"]
        for p, s in zip(e["promised"], e.get("shown", []), strict=False)
        if s is not None
    ]
    rows = [
        ("right name alone at once", "", lines, lambda x: right_alone(after(x, 0))),
        ("ambiguous, with the truth in the set", "", lines, lambda x: ambiguous(after(x, 0))),
        ("of those: right name alone after one experiment", ">= 90 %", went,
         lambda x: right_alone(after(x, 1))),
        ("right name alone after two", "", went, lambda x: right_alone(after(x, 2))),
        ("ambiguous, with others in the set: alone after one", "", rivalled,
         lambda x: right_alone(after(x, 1))),
        ("a wrong name after them", "none", went, lambda x: wrong(last(x))),
        ("truth no longer in the set", "none", went, lambda x: not kept(last(x))),
        ("no experiment could be planned", "none", went, lambda x: not x["experiments"]),
    ]  # fmt: skip
    measured = [("sigmas shown over sigmas promised, median and middle half", "1", _ratios(pairs))]
    summary = markdown(("figure", "aim", "result"), [*counted(rows), *measured])
    head = ("case", "hidden", "set", "experiment", "promised", "shown", "then")
    return summary + "\n\n" + markdown(head, [r for x in went for r in _story(x)])


def _ratios(pairs: Sequence[tuple[float, float]]) -> str:
    ratios = [s / p for p, s in pairs if p > 1.0]
    if not ratios:
        return "no case"
    low, middle, high = np.percentile(ratios, [25, 50, 75])
    return f"{middle:.2f} ({low:.2f} to {high:.2f}) of {len(ratios)}"


def _story(line: dict) -> list[tuple[str, ...]]:
    """A row for each experiment of a case."""
    out = []
    for k, e in enumerate(line["experiments"]):
        then = after(line, k + 1)
        out.append((
            str(line["number"]), *([" and ".join(truth(then))]),
            _set(after(line, k)), e["manoeuvre"],
            _sigmas(e["promised"]), _sigmas(e.get("shown", [])),
            f"{then['verdict']}: {_set(then)}",
        ))  # fmt: skip
    return out


def _set(said: dict) -> str:
    groups = said["alternatives"] or [[e["name"]] for e in said["effects"]]
    return " and ".join(" or ".join(g) for g in groups) or "-"


def _sigmas(values: Sequence[float | None]) -> str:
    return ", ".join("-" if v is None else f"{v:.1f}" for v in values)


def show(line: dict) -> str:
    """One line for the terminal."""
    told = [f"{d['verdict']}: {_set(d)}, {d['seconds']:.0f} s" for d in line["diagnoses"]]
    made = [f"{e['manoeuvre']} ({_sigmas(e['promised'])}; {_sigmas(e.get('shown', []))})"
            for e in line["experiments"]]  # fmt: skip
    steps = [told[0], *(s for pair in zip(made, told[1:], strict=True) for s in pair)]
    return f"{line['number']} {line['answer']['reached']} " + " -> ".join(steps)


def main() -> None:
    options = parser(__doc__, 500, 50, "out/loop")
    options.add_argument("--rounds", type=int, default=2, help="experiments a case, at most")
    options.add_argument("--keep", action="store_true", help="keep the studies")
    args = options.parse_args()
    print(table(resumed(args.work / f"loop_{args.seed}.jsonl", args, one, show)))


if __name__ == "__main__":
    main()
