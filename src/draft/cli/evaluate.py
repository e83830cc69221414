"""`draft evaluate`: measure what trained policies can do, level by level."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import check_folder
from draft.cli.settings_options import with_options
from draft.cli.spelling import spelt
from draft.errors import DraftError, counted
from draft.learn.measuring.evaluation_options import Options

if TYPE_CHECKING:
    from draft.learn.measuring.evaluation import Evaluation
    from draft.learn.measuring.summary import Summary
    from draft.learn.training.run import Run


def levels_of(text: str) -> object:
    """Read a number of levels, or a list of levels; other text as it is."""
    if re.fullmatch(r"\s*\d{1,9}\s*", text):
        return int(text)
    try:
        return [float(part) for part in words_of(text)]
    except ValueError:
        return text


def words_of(text: str) -> list[str]:
    """Read a list such as "speed,stairs"."""
    return [word.strip() for word in text.split(",") if word.strip()]


@with_options(
    Options,
    without=("protocol", "progress"),
    read={"test": words_of, "levels": levels_of},
)
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
    *,
    options: Options,
    perturbed: Annotated[
        bool,
        tyro.conf.arg(
            help="Give every robot inertia errors as large as real ones; of twins without --errors."
        ),
    ] = False,
    published: Annotated[
        bool, tyro.conf.arg(help="Use the published protocol, in which one robot in ten stands.")
    ] = False,
    force: Annotated[
        bool, tyro.conf.arg(help="Allow skill tests of other stages; their results are flagged.")
    ] = False,
) -> int:
    """Measure what trained policies can do: speed, stairs, pushes, efficiency, range, limits."""
    check_folder(None if options.out is None else str(options.out))
    if not runs:
        raise DraftError("no run is named", "name a folder of 'draft train'")
    asked = {
        "errors": _error_source(perturbed, options.errors),
        "protocol": "published" if published else "walking",
    }
    from draft.learn.measuring import evaluation
    from draft.learn.measuring.levels import skill_tests

    skill_tests(options.test or ("speed",), options.levels)  # Check before any run is read.
    opened = _open(runs, options)
    evaluations = [
        evaluation.prepare(run, options.model_copy(update=asked | {"test": names}))
        for run, names in zip(opened, _tests(opened, options.test, force), strict=True)
    ]
    return _all(evaluations, options)


def _error_source(perturbed: bool, errors: str | None) -> str | None:
    """Return the source of the robots' inertia errors; None if they have none."""
    if errors is not None and not perturbed:
        cause = f"--errors {errors} has no effect without --perturbed"
        raise DraftError(cause, "add --perturbed, or omit --errors")
    return (errors or "twins") if perturbed else None


def _open(names: Sequence[str], options: Options) -> list[Run]:
    """Open the runs and designs, each once, and check that all have one topology."""
    from draft.learn.bodies.legged import check_family
    from draft.learn.measuring.evaluation import opened

    runs = [opened(path, options.policy) for path in dict.fromkeys(map(Path, names))]
    for other in runs[1:]:
        try:
            check_family((runs[0].plan.members[0], *other.plan.members))
        except DraftError as error:
            cause = f"{runs[0].folder} and {other.folder} cannot be evaluated together: "
            cause += "; ".join(problem.cause for problem in error.problems)
            raise DraftError(cause, "evaluate them one by one") from None
    last = [run.folder.resolve().name for run in runs]
    twice = next((name for name in last if last.count(name) > 1), None)
    if options.out is not None and twice is not None:
        cause = f"two of the runs are named '{twice}', and --out holds one folder per name"
        raise DraftError(cause, "evaluate them separately, or omit --out")
    return runs


def _tests(
    runs: Sequence[Run], asked: Sequence[str] | None, force: bool
) -> Sequence[Sequence[str]]:
    """Return the names of each run's skill tests."""
    from draft.learn.measuring.evaluation import usual

    own = [usual(run) for run in runs]
    if asked is None or force:
        return [asked or names for names in own]
    found = [tuple(name for name in asked if name in names) for names in own]
    for run, names in zip(runs, found, strict=True):
        if not names:
            raise _of_other_stage(asked[0], run)
    for name in asked:
        if not any(name in names for names in found):
            raise _of_other_stage(name, runs[0])
    return found


def _of_other_stage(name: str, run: Run) -> DraftError:
    """Error of a skill test that is for policies of other stages."""
    from draft.learn.measuring.evaluation import usual
    from draft.learn.measuring.levels import stages_of

    cause = (
        f"test '{name}' is for policies of stage {stages_of(name)}, and {run.folder} is of stage "
        f"{run.plan.stage}"
    )
    return DraftError(cause, f"use --test {','.join(usual(run))}, or add --force")


def _all(evaluations: Sequence[Evaluation], options: Options) -> int:
    """Run the evaluations that do not exist yet, and print all."""
    from draft.cli.display.evaluation import show
    from draft.learn.training.run import upgrades

    found = []
    for evaluation in evaluations:
        line = evaluation.run.policy_line(evaluation.request.iteration)
        print(f"{evaluation.run.folder}: {spelt(line)}", flush=True)
        existing = None if options.again else evaluation.existing()
        if existing is not None:
            since = upgrades(existing.versions)
            since = f", made before {since}" if since else ""
            print(f"{evaluation.folder}: exists{since}; add --again to repeat it")
        kept = f"{len(found)} of {counted(len(evaluations), 'evaluation')} are kept; {AGAIN}"
        with if_interrupted(kept):
            found.append(existing or _evaluate(evaluation, options))
    show(found)
    return 0


def _evaluate(evaluation: Evaluation, options: Options) -> Summary:
    """Evaluate a run, and show the progress."""
    from draft.cli.display.evaluation import Bar
    from draft.learn.measuring.evaluation import setting

    chosen, stepped = setting(options.device, options.engine)
    names = ", ".join(test.name for test in evaluation.tests)
    print(f"{evaluation.run.folder}: {names} on {chosen} ({stepped.name}: {stepped.why})")
    with Bar() as bar:
        summary, count = evaluation.measure(chosen, stepped, bar.tell)
    took = f"{evaluation.request.seconds:g} s took {summary.took_s} s"
    print(f"{counted(count, 'roll-out')} of {took}: {evaluation.folder}")
    return summary
