"""`draft study`: train and evaluate designs x seeds x stages, and report on them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.options import JsonOutput, check_folder
from draft.errors import DraftError, Problem

if TYPE_CHECKING:
    from draft.study.capacity import Hands
    from draft.study.file import Study
    from draft.study.workers import Worker


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
    begun = time.monotonic()
    check_folder(out)
    _check(minutes, workers, rate, address, ray)
    from draft.cli.display import study as display
    from draft.study import file as files
    from draft.study.graph import graph
    from draft.study.store import Store

    study = files.read(Path(file), toy)
    groups = display.groups(study)
    folder = Path(out) if out else Path("studies") / (study.name + "-toy" * toy)
    store = Store(folder, study, groups, graph(study, groups))
    if dry_run:
        hands = _foreseen(study, engine, replicas, ray, device, workers)
        display.print_plan(store, rate, hands, json)
        return 0
    # Whoever only looks whether all is done need not wait for PyTorch.
    done = store.finished()
    at_work = [] if done else _workers(study, engine, replicas, ray, address, device, workers)
    try:
        store.open()
        return display.execute(store, at_work, begun, minutes, json)
    finally:
        store.close()


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


def _check(
    minutes: float | None,
    workers: int | None,
    rate: float | None,
    address: str | None,
    ray: bool,
) -> None:
    """Refuse numbers that make no sense."""
    for name, value, most in (("minutes", minutes, 10**6), ("rate", rate, 1e12)):
        if value is not None and not 0 < value <= most:
            cause = f"--{name} {value} is not above 0 and at most {most:g}"
            raise DraftError(Problem(cause, None, "leave it away for the default"))
    if workers is not None and not 1 <= workers <= 1024:
        raise DraftError(Problem(f"--workers {workers} is not from 1 to 1024", None, "such as 2"))
    if address is not None and not ray:
        raise DraftError(Problem("--address goes with --ray", None, "add --ray, or leave it away"))


def _foreseen(
    study: Study, engine: str, replicas: int | None, ray: bool, device: str, workers: int | None
) -> Hands | None:
    """What would do the jobs; None where nothing here could, and GPUs are assumed.

    A GPU that is named need not be here: its hours are an estimate anywhere.
    """
    from draft.learn.machine import machine
    from draft.study.capacity import on_cpu, on_gpus

    if device == "auto" and not ray:
        here = machine()
        if here.engine is None:
            return None
        device = "cpu" if here.on_cpu else "all"
    if device == "cpu":
        return on_cpu(study, engine, replicas, workers, alone=not ray)
    return on_gpus(engine, replicas, workers)


def _workers(
    study: Study,
    engine: str,
    replicas: int | None,
    ray: bool,
    address: str | None,
    device: str,
    workers: int | None,
) -> Sequence[Worker]:
    """Who does the jobs."""
    from draft.learn.devices import visible
    from draft.study.capacity import on_cpu, on_gpus
    from draft.study.workers import LocalWorker

    if ray:
        return _cluster(study, engine, replicas, address, device, workers)
    chosen = _devices(device)
    if chosen == ["cpu"]:
        hands = on_cpu(study, engine, replicas, workers)
        return [LocalWorker("cpu", physics=hands.physics) for _ in range(hands.at_once or 1)]
    hands, gpus = on_gpus(engine, replicas, workers), visible(chosen)
    return [
        LocalWorker("cuda", gpus[k % len(gpus)], physics=hands.physics)
        for k in range(workers or len(gpus))
    ]


def _cluster(
    study: Study,
    engine: str,
    replicas: int | None,
    address: str | None,
    device: str,
    workers: int | None,
) -> Sequence[Worker]:
    """Tasks of a Ray cluster."""
    from draft.explore.engines import RayEngine
    from draft.extras import need
    from draft.study.capacity import on_cpu, on_gpus
    from draft.study.workers import RayWorker

    ray = need("ray", "cluster")
    RayEngine(address).join(ray)
    found = ray.cluster_resources()
    if device == "cpu":
        hands = on_cpu(study, engine, replicas, workers, alone=False)
        count = workers or max(1, int(found.get("CPU", 1)) // hands.processes)
        return [RayWorker(ray, 0, hands.physics) for _ in range(count)]
    gpus = int(found.get("GPU", 0))
    if not gpus:
        cause = "the Ray cluster has no GPU"
        raise DraftError(Problem(cause, None, "add a node that has, or give --device cpu"))
    hands = on_gpus(engine, replicas, workers)
    return [RayWorker(ray, 1, hands.physics) for _ in range(workers or gpus)]


def _devices(word: str) -> list[str]:
    """Devices, where auto is all GPUs."""
    from draft.extras import need
    from draft.learn.devices import devices

    torch = need("torch", "learn")
    if word == "auto":
        word = "all" if torch.cuda.is_available() else "cpu"
    return devices(word)
