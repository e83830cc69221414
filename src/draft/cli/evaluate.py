"""`draft evaluate`: what trained policies can do, level by level."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.options import check_folder
from draft.errors import DraftError, Problem

if TYPE_CHECKING:
    from draft.learn.evaluation import Evaluation
    from draft.learn.run import Run


def main(
    runs: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(metavar="RUN", help="Folders of 'draft train'.", help_behavior_hint=""),
    ],
    /,
    battery: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="NAMES",
            help="Of walk, speed, stairs and push, such as speed,stairs; a run takes those of its "
            "stage.",
            help_behavior_hint="(default: all of the run's stage)",
        ),
    ] = None,
    replicas: Annotated[
        int, tyro.conf.arg(metavar="N", help="Roll-outs of each level; a family shares them out.")
    ] = 256,
    levels: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="N|VALUES",
            help="So many levels, spread over each grid, or the levels themselves: 0.4,1.0,2.0.",
            help_behavior_hint="(default: all)",
        ),
    ] = None,
    seconds: Annotated[
        float,
        tyro.conf.arg(
            metavar="S",
            help="Of a roll-out; the first sixth does not count, kicks come every quarter.",
        ),
    ] = 12.0,
    perturbed: Annotated[
        bool, tyro.conf.arg(help="Give every robot inertia errors of the size of real ones.")
    ] = False,
    errors: Annotated[
        Literal["twins", "survey", "paper"] | None,
        tyro.conf.arg(
            help="Whose inertia errors --perturbed gives: of the twins of Go2 and B2, of all "
            "surveyed quadrupeds held out of the trends, or the published ranges.",
            help_behavior_hint="(default: twins)",
        ),
    ] = None,
    published: Annotated[
        bool, tyro.conf.arg(help="As the published evaluation: one robot in ten only stands.")
    ] = False,
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Of everything random.")] = 0,
    checkpoint: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="Iterations of the checkpoint.", help_behavior_hint="(default: last)"
        ),
    ] = None,
    device: Annotated[str, tyro.conf.arg(help="auto, cpu, cuda or cuda:1.")] = "auto",
    engine: EngineOption = "auto",
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Write to DIR/RUN/.",
            help_behavior_hint="(default: RUN/evaluation/)",
        ),
    ] = None,
    again: Annotated[bool, tyro.conf.arg(help="Even if that result is there already.")] = False,
    force: Annotated[
        bool, tyro.conf.arg(help="Batteries of other stages too; results are flagged.")
    ] = False,
) -> int:
    """Measure what trained policies can do: speed, stairs, pushes, efficiency, and what limits."""
    check_folder(out)
    if not runs:
        raise DraftError(Problem("no run is named", None, "name a folder of 'draft train'"))
    whose = _whose(perturbed, errors)
    from draft.learn import evaluation
    from draft.learn.battery import batteries, named

    evaluation.check(replicas, seconds, seed)
    asked_words = named(battery) if battery is not None else None
    batteries(asked_words or ("speed",), levels)  # Before anything is read.
    opened = _open(runs, out)
    words = _words(opened, asked_words, force)
    questions = [
        evaluation.prepare(
            run,
            names,
            levels,
            checkpoint=checkpoint,
            replicas=replicas,
            seconds=seconds,
            seed=seed,
            errors=whose,
            protocol="published" if published else "walking",
            out=Path(out) if out else None,
        )
        for run, names in zip(opened, words, strict=True)
    ]
    return _all(questions, device, engine, again)


def _whose(perturbed: bool, errors: str | None) -> str | None:
    """Whose inertia errors robots get; None where they get none."""
    if errors is not None and not perturbed:
        cause = f"--errors {errors} goes with --perturbed, and robots without it have none"
        raise DraftError(Problem(cause, None, "add --perturbed, or leave --errors away"))
    return (errors or "twins") if perturbed else None


def _open(words: Sequence[str], out: str | None) -> list[Run]:
    """The runs, each once, all of one topology."""
    from draft.learn.quadruped import check_family
    from draft.learn.run import open_run

    folders = list(dict.fromkeys(Path(word) for word in words))
    runs = [open_run(folder) for folder in folders]
    for other in runs[1:]:
        try:
            check_family((runs[0].plan.members[0], *other.plan.members))
        except DraftError as error:
            cause = f"{runs[0].folder} and {other.folder} do not go together: "
            cause += "; ".join(problem.cause for problem in error.problems)
            raise DraftError(Problem(cause, None, "evaluate them one by one")) from None
    names = [folder.resolve().name for folder in folders]
    twice = next((name for name in names if names.count(name) > 1), None)
    if out is not None and twice is not None:
        cause = f"two of the runs are called '{twice}', and --out holds a folder per run"
        raise DraftError(Problem(cause, None, "evaluate them apart, or leave --out away"))
    return runs


def _words(
    runs: Sequence[Run], asked: tuple[str, ...] | None, force: bool
) -> list[tuple[str, ...]]:
    """Batteries of each run, as the command line calls them."""
    from draft.learn.battery import batteries, check_stage, of_stage

    found = []
    for run in runs:
        stage = run.plan.stage
        own = of_stage(stage)
        words = own if asked is None else asked if force else tuple(w for w in asked if w in own)
        if not words and asked is not None:
            check_stage(batteries(asked), stage, run.folder)
        found.append(words)
    for word in asked or ():
        if not any(word in words for words in found):
            check_stage(batteries((word,)), runs[0].plan.stage, runs[0].folder)
    return found


def _all(questions: Sequence[Evaluation], device: str, engine: str, again: bool) -> int:
    """Evaluate what is not there yet, and show all."""
    from draft.cli.display.evaluation import show
    from draft.learn.run import upgrades

    found = []
    for question in questions:
        there = None if again else question.existing()
        if there is not None:
            since = upgrades(there.get("versions"))
            since = f", from before {since}" if since else ""
            print(f"{question.folder}: is there already{since}; --again does it once more")
        found.append(there or _evaluate(question, device, engine))
    show(found)
    return 0


def _evaluate(question: Evaluation, device: str, engine: str) -> dict[str, Any]:
    """Evaluate a run, and show how far it is."""
    from draft.cli.display.evaluation import Bar
    from draft.learn.evaluation import setting

    chosen, stepped = setting(device, engine)
    names = ", ".join(battery.name for battery in question.batteries)
    print(
        f"{question.run.folder}: {names} at {question.request.iteration} iterations, on {chosen} "
        f"({stepped.name}: {stepped.why})"
    )
    with Bar() as bar:
        summary, count = question.measure(chosen, stepped, bar.tell)
    took = f"{question.request.seconds:g} s took {summary['took_s']} s"
    print(f"{count} roll-outs of {took}: {question.folder}")
    return summary
