"""`draft study`: train and evaluate designs x seeds x stages, and report on them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import EngineOption, JsonOutput, check_folder


def main(
    file: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="FILE.yaml",
            help="File of the study.",
        ),
    ],
    /,
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
    minutes: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="Time limit [min]; repeat the command to resume.",
            help_behavior_hint="(default: no limit)",
        ),
    ] = None,
    device: Annotated[
        str,
        tyro.conf.arg(
            metavar="DEVICE",
            help="auto (all GPUs, or the CPU), cpu, cuda:1, or numbers of GPUs such as 0,1.",
        ),
    ] = "auto",
    workers: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of jobs at once.",
            help_behavior_hint="(default: one per GPU; on a CPU one that uses all cores)",
        ),
    ] = None,
    engine: EngineOption = "auto",
    replicas: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Number of processes of each training on a CPU.",
            help_behavior_hint="(default: one per physical core, shared by the jobs at once)",
        ),
    ] = None,
    ray: Annotated[
        bool,
        tyro.conf.arg(help="Run on a Ray cluster that shares the folder, not on this machine."),
    ] = False,
    address: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="HOST:PORT",
            help="Address of the Ray cluster.",
            help_behavior_hint="(default: this machine's)",
        ),
    ] = None,
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
    from draft.cli.display.study_output import Screen, print_notes, print_outcome, print_plan
    from draft.study.placement import Placement, expected_capacity
    from draft.study.running import check_number, open_study, run_study

    check_number("rate", rate, 1e12)
    if dry_run:
        placement = Placement(device, workers, engine, replicas, ray, address)
        placement.check()
        check_number("minutes", minutes, 10**6)
        from draft.study.costs import estimate

        store = open_study(file, out, toy)
        print_notes(store)
        capacity = expected_capacity(store.study, placement)
        print_plan(store, estimate(store, rate, capacity), capacity, json)
        return 0
    kept = f"finished jobs are kept, and of trainings all but the last minute; {AGAIN}"
    with if_interrupted(kept), Screen(silent=json) as screen:
        outcome = run_study(
            file,
            out,
            toy=toy,
            minutes=minutes,
            device=device,
            workers=workers,
            engine=engine,
            replicas=replicas,
            ray=ray,
            address=address,
            watch=screen,
        )
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
