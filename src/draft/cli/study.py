"""`draft study`: train and evaluate designs x seeds x stages, and report on them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.options import JsonOutput, check_folder


def run(
    file: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="FILE.yaml",
            help="The study; or 'report DIR' for a report of one, 'collect DIR --out DIR' to keep "
            "its results as small plain text, 'results DIR' to print such results.",
        ),
    ],
    /,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR", help="Its folder.", help_behavior_hint="(default: studies/FILE)"
        ),
    ] = None,
    toy: Annotated[
        bool, tyro.conf.arg(help="All of it, but tiny: what the file has under 'toy'.")
    ] = False,
    dry_run: Annotated[
        bool, tyro.conf.arg(help="Print the jobs and an estimate of their hours; write nothing.")
    ] = False,
    minutes: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="End after so long; the same command goes on.",
            help_behavior_hint="(default: no limit)",
        ),
    ] = None,
    device: Annotated[
        str, tyro.conf.arg(help="auto (all GPUs), cpu, cuda:1, or numbers of GPUs such as 0,1.")
    ] = "auto",
    workers: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Jobs at once.",
            help_behavior_hint="(default: one per GPU; on a CPU one that takes all cores)",
        ),
    ] = None,
    engine: EngineOption = "auto",
    replicas: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Processes of each training on a CPU.",
            help_behavior_hint="(default: one per physical core, shared among the jobs at once)",
        ),
    ] = None,
    ray: Annotated[
        bool,
        tyro.conf.arg(help="On a Ray cluster that shares the folder, not on this machine."),
    ] = False,
    address: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="HOST:PORT",
            help="The Ray cluster.",
            help_behavior_hint="(default: this machine's)",
        ),
    ] = None,
    rate: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="N",
            help="Steps per second that the estimate goes by.",
            help_behavior_hint="(default: measured in the study, or else an assumption)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Train and evaluate all designs of a study, with all seeds; the same command goes on."""
    check_folder(out)
    from draft.cli.display.study import Screen, print_notes, print_outcome, print_plan
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
    with Screen(silent=json) as screen:
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
        tyro.conf.Positional[str], tyro.conf.arg(metavar="DIR", help="A study's folder.")
    ],
    /,
) -> int:
    """Write the report of a study, of what is done so far."""
    from draft.study.report import write

    print(f"report: {write(Path(folder))}")
    return 0


def collect(
    folder: Annotated[
        tyro.conf.Positional[str], tyro.conf.arg(metavar="STUDY", help="A study's folder.")
    ],
    /,
    out: Annotated[
        str,
        tyro.conf.arg(metavar="DIR", help="Folder of the results; made, or brought up to date."),
    ],
) -> int:
    """Collect what a study has finished, as plain text that is small enough to be committed."""
    from draft.cli.display.results import print_collected
    from draft.study.results.collect import collect as collected

    check_folder(out)
    print_collected(collected(Path(folder), Path(out)))
    return 0


def results(
    folder: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(metavar="DIR", help="Folder that 'draft study collect' wrote."),
    ] = "examples/results/three_quadrupeds",
    /,
    write: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.md",
            help="Write a page about them, with figures in images/FILE beside it.",
            help_behavior_hint="(default: print tables)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Print collected results: each skill over seeds in both arms, and how the rows were made."""
    from draft.cli.display.results import print_json, print_tables, write_page
    from draft.study.results.files import read

    study = read(Path(folder))
    if write is not None:
        write_page(study, Path(folder), Path(write))
    elif json:
        print_json(study)
    else:
        print_tables(study)
    return 0


VERBS = {
    "report": (report, "Write a study's report."),
    "collect": (collect, "Collect a study's results as small plain text."),
    "results": (results, "Print collected results, or write a page about them."),
}


class _App:
    """`draft study FILE`, and `draft study VERB`."""

    @staticmethod
    def cli(prog: str, description: str, args: Sequence[str], config: Any) -> int:
        command, words = run, [*args]
        if words and words[0] in VERBS:
            prog = f"{prog} {words[0]}"
            command, description = VERBS[words.pop(0)]
        return tyro.cli(command, prog=prog, description=description, args=words, config=config)


app = _App()
