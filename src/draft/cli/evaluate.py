"""`draft evaluate`: measure what trained policies can do, level by level."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import DeviceOption, EngineOption, check_folder
from draft.cli.spelling import spelt
from draft.errors import DraftError, counted

if TYPE_CHECKING:
    from draft.learn.measuring.evaluation import Evaluation
    from draft.learn.measuring.summary import Summary
    from draft.learn.training.run import Run


def main(
    runs: Annotated[
        tyro.conf.Positional[tuple[str, ...]],
        tyro.conf.arg(
            metavar="RUN|DESIGN ...",
            help="Folders of runs, as 'draft train' writes them, or designs.",
            help_behavior_hint="(required)",
        ),
    ],
    /,
    battery: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="NAMES",
            help="Batteries of walk, speed, stairs and push, such as speed,stairs; each run is "
            "tested by those of its stage.",
            help_behavior_hint="(default: all of the run's stage; of a design: walk,speed,push)",
        ),
    ] = None,
    policy: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="RUN|FILE.onnx",
            help="Policy of the designs: that of a run, or an exported one.",
            help_behavior_hint="(default: the policy of quadrupeds that ships)",
        ),
    ] = None,
    replicas: Annotated[
        int, tyro.conf.arg(metavar="N", help="Roll-outs of each level, shared among a family.")
    ] = 256,
    levels: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="N|VALUES",
            help="Number of levels, spread over each grid, or a list of levels: 0.4,1.0,2.0.",
            help_behavior_hint="(default: all)",
        ),
    ] = None,
    seconds: Annotated[
        float,
        tyro.conf.arg(
            metavar="S",
            help="Length of a roll-out [s]; the first sixth is not counted, and kicks come every "
            "quarter.",
        ),
    ] = 12.0,
    perturbed: Annotated[
        bool, tyro.conf.arg(help="Give every robot inertia errors as large as real ones.")
    ] = False,
    errors: Annotated[
        Literal["twins", "survey", "paper"] | None,
        tyro.conf.arg(
            metavar="{twins,survey,paper}",
            help="Source of the inertia errors: twins of Go2 and B2, all surveyed quadrupeds held "
            "out of the trends, or the published ranges.",
            help_behavior_hint="(default: twins, with --perturbed)",
        ),
    ] = None,
    published: Annotated[
        bool, tyro.conf.arg(help="Use the published protocol, in which one robot in ten stands.")
    ] = False,
    payload: Annotated[
        float,
        tyro.conf.arg(
            metavar="KG",
            help="Mass of a block on the trunk, 500 kg/m3; the policy was trained without it.",
            help_behavior_hint="(default: none)",
        ),
    ] = 0.0,
    regeneration: Annotated[
        float,
        tyro.conf.arg(
            metavar="SHARE",
            help="Share of the power of braking joints that returns to the battery, 0 to 1.",
            help_behavior_hint="(default: none)",
        ),
    ] = 0.0,
    seed: Annotated[int, tyro.conf.arg(metavar="N", help="Seed of everything random.")] = 0,
    checkpoint: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="Iterations of the checkpoint.", help_behavior_hint="(default: last)"
        ),
    ] = None,
    device: DeviceOption = "auto",
    engine: EngineOption = "auto",
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Write to DIR/RUN, or DIR/DESIGN-POLICY.",
            help_behavior_hint="(default: RUN/evaluation, or out/DESIGN-POLICY/evaluation)",
        ),
    ] = None,
    again: Annotated[bool, tyro.conf.arg(help="Repeat evaluations that exist.")] = False,
    force: Annotated[
        bool, tyro.conf.arg(help="Allow batteries of other stages; their results are flagged.")
    ] = False,
) -> int:
    """Measure what trained policies can do: speed, stairs, pushes, efficiency, range, limits."""
    check_folder(out)
    if not runs:
        raise DraftError("no run is named", "name a folder of 'draft train'")
    source = _error_source(perturbed, errors)
    from draft.learn.measuring import evaluation
    from draft.learn.measuring.levels import batteries, named

    evaluation.check(replicas, seconds, seed, payload, regeneration)
    asked = named(battery) if battery is not None else None
    wanted = _levels(levels)
    batteries(asked or ("speed",), wanted)  # Check before any run is read.
    opened = _open(runs, out, policy)
    chosen = _batteries(opened, asked, force)
    evaluations = [
        evaluation.prepare(
            run,
            names,
            wanted,
            checkpoint=checkpoint,
            replicas=replicas,
            seconds=seconds,
            seed=seed,
            errors=source,
            protocol="published" if published else "walking",
            payload=payload,
            regeneration=regeneration,
            out=Path(out) if out else None,
        )
        for run, names in zip(opened, chosen, strict=True)
    ]
    return _all(evaluations, device, engine, again)


def _levels(text: str | None) -> int | list[float] | None:
    """Read a number of levels, or a list of levels."""
    from draft.learn.measuring.levels import no_levels

    if text is None:
        return None
    if re.fullmatch(r"\s*\d{1,9}\s*", text):
        return int(text)
    try:
        return [float(part) for part in text.split(",") if part.strip()]
    except ValueError:
        raise no_levels(text) from None


def _error_source(perturbed: bool, errors: str | None) -> str | None:
    """Return the source of the robots' inertia errors; None if they have none."""
    if errors is not None and not perturbed:
        cause = f"--errors {errors} has no effect without --perturbed"
        raise DraftError(cause, "add --perturbed, or omit --errors")
    return (errors or "twins") if perturbed else None


def _open(names: Sequence[str], out: str | None, policy: str | None) -> list[Run]:
    """Open the runs and designs, each once, and check that all have one topology."""
    from draft.learn.bodies.legged import check_family
    from draft.learn.measuring.evaluation import opened

    runs = [opened(path, policy) for path in dict.fromkeys(map(Path, names))]
    for other in runs[1:]:
        try:
            check_family((runs[0].plan.members[0], *other.plan.members))
        except DraftError as error:
            cause = f"{runs[0].folder} and {other.folder} cannot be evaluated together: "
            cause += "; ".join(problem.cause for problem in error.problems)
            raise DraftError(cause, "evaluate them one by one") from None
    last = [run.folder.resolve().name for run in runs]
    twice = next((name for name in last if last.count(name) > 1), None)
    if out is not None and twice is not None:
        cause = f"two of the runs are named '{twice}', and --out holds one folder per name"
        raise DraftError(cause, "evaluate them separately, or omit --out")
    return runs


def _batteries(
    runs: Sequence[Run], asked: tuple[str, ...] | None, force: bool
) -> list[tuple[str, ...]]:
    """Return the names of each run's batteries."""
    from draft.learn.measuring.evaluation import usual
    from draft.learn.measuring.levels import batteries, check_stage

    found = []
    for run in runs:
        stage = run.plan.stage
        own = usual(run)
        names = own if asked is None else asked if force else tuple(n for n in asked if n in own)
        if not names and asked is not None:
            check_stage(batteries(asked), stage, run.folder)
        found.append(names)
    for name in asked or ():
        if not any(name in names for names in found):
            check_stage(batteries((name,)), runs[0].plan.stage, runs[0].folder)
    return found


def _all(evaluations: Sequence[Evaluation], device: str, engine: str, again: bool) -> int:
    """Run the evaluations that do not exist yet, and print all."""
    from draft.cli.display.evaluation import show
    from draft.learn.training.run import upgrades

    found = []
    for evaluation in evaluations:
        line = evaluation.run.policy_line(evaluation.request.iteration)
        print(f"{evaluation.run.folder}: {spelt(line)}", flush=True)
        existing = None if again else evaluation.existing()
        if existing is not None:
            since = upgrades(existing.versions)
            since = f", made before {since}" if since else ""
            print(f"{evaluation.folder}: exists{since}; add --again to repeat it")
        kept = f"{len(found)} of {counted(len(evaluations), 'evaluation')} are kept; {AGAIN}"
        with if_interrupted(kept):
            found.append(existing or _evaluate(evaluation, device, engine))
    show(found)
    return 0


def _evaluate(evaluation: Evaluation, device: str, engine: str) -> Summary:
    """Evaluate a run, and show the progress."""
    from draft.cli.display.evaluation import Bar
    from draft.learn.measuring.evaluation import setting

    chosen, stepped = setting(device, engine)
    names = ", ".join(battery.name for battery in evaluation.batteries)
    print(f"{evaluation.run.folder}: {names} on {chosen} ({stepped.name}: {stepped.why})")
    with Bar() as bar:
        summary, count = evaluation.measure(chosen, stepped, bar.tell)
    took = f"{evaluation.request.seconds:g} s took {summary.took_s} s"
    print(f"{counted(count, 'roll-out')} of {took}: {evaluation.folder}")
    return summary
