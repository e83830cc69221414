"""`draft study`: train and evaluate designs x seeds x stages, and report on them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import JsonOutput, check_folder
from draft.cli.settings_options import with_options
from draft.errors import DraftError
from draft.study.options import RunOptions


@with_options(RunOptions)
def main(
    file: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="FILE.yaml",
            help="File of the study.",
        ),
    ],
    /,
    *,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder of the study.",
            help_behavior_hint="(default: studies/NAME-OF-FILE)",
        ),
    ] = None,
    toy: Annotated[
        bool, tyro.conf.arg(help="Run a tiny version, with the values under 'toy' in the file.")
    ] = False,
    dry_run: Annotated[
        bool,
        tyro.conf.arg(help="Print the jobs and an estimate of their hours, and write nothing."),
    ] = False,
    options: RunOptions,
    rate: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="N",
            help="Steps per second for the estimate of --dry-run.",
            help_behavior_hint="(default: measured in the study, else assumed)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Train and evaluate all designs of a study with all seeds; the same command resumes it."""
    check_folder(out)
    if rate is not None and not dry_run:
        raise DraftError("--rate is for --dry-run", "add --dry-run, or omit --rate")
    from draft.cli.display.study_output import Screen, print_notes, print_outcome, print_plan
    from draft.study.placement import expected_capacity
    from draft.study.running import open_study, run_study

    if dry_run:
        from draft.study.costs import estimate

        store = open_study(file, out, toy)
        print_notes(store)
        capacity = expected_capacity(store.study, options)
        print_plan(store, estimate(store, rate, capacity), capacity, json)
        return 0
    kept = f"finished jobs are kept, and of trainings all but the last minute; {AGAIN}"
    with if_interrupted(kept), Screen(silent=json) as screen:
        outcome = run_study(file, out, toy=toy, watch=screen, **dict(options))
    print_outcome(outcome, json)
    return 1 if outcome.failures else 0


def report(
    folder: Annotated[
        tyro.conf.Positional[str], tyro.conf.arg(metavar="DIR", help="Folder of a study.")
    ],
    /,
) -> int:
    """Write the report of a study on what is done so far."""
    from draft.study.report.writing import write

    print(f"report: {write(Path(folder))}")
    return 0


def collect(
    folder: Annotated[
        tyro.conf.Positional[str], tyro.conf.arg(metavar="STUDY", help="Folder of a study.")
    ],
    /,
    out: Annotated[
        str,
        tyro.conf.arg(metavar="DIR", help="Folder of the results, created or updated."),
    ],
) -> int:
    """Collect the finished results of a study as plain text, small enough to be committed."""
    from draft.cli.display.results import print_collected
    from draft.study.report.collect import collect as collect_results

    check_folder(out)
    print_collected(collect_results(Path(folder), Path(out)))
    return 0


def results(
    folder: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(metavar="[DIR]", help="Folder that 'draft study collect' wrote."),
    ] = "examples/results/three_quadrupeds",
    /,
    write: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.md",
            help="Write a page, with figures in images/FILE beside it.",
            help_behavior_hint="(default: print tables)",
        ),
    ] = None,
    against: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="DIR",
            help="Other results of the same designs, to compare with.",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    json: JsonOutput = False,
) -> int:
    """Print collected results: each skill over seeds in both arms, with its provenance."""
    from draft.cli.display.results import print_json, print_tables, write_page
    from draft.study.report.folder import read

    study = read(Path(folder), results=True)
    others = {Path(other): read(Path(other), results=True) for other in against}
    if write is not None:
        write_page(study, Path(folder), Path(write), others)
    elif json:
        print_json(study, list(others.values()))
    else:
        print_tables(study, list(others.values()))
    return 0


SUBCOMMANDS = {"report": report, "collect": collect, "results": results}
