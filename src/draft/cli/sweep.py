"""`draft sweep`: compiled models and their metrics, into a folder of Parquet parts."""

from __future__ import annotations

import json as json_
import sys
from pathlib import Path
from typing import Annotated, Literal

import tyro

from draft.cli import explore_options as x
from draft.cli.options import DesignName, JsonOutput, Robot, Values, check_folder
from draft.errors import DraftError, Problem
from draft.spec import load


def main(
    spec: Robot,
    /,
    out: Annotated[str, tyro.conf.arg(metavar="DIR", help="Folder of the rows.")],
    vary: x.Vary = (),
    n: x.Number = "1e3",
    sampler: x.Sampler = "sobol",
    where: x.Where = None,
    metrics: x.Metrics = (),
    design: DesignName = None,
    values: Values = (),
    seed: x.Seed = 0,
    engine: Annotated[
        Literal["local", "ray"],
        tyro.conf.arg(help="Processes of this machine, or a Ray cluster."),
    ] = "local",
    workers: x.Workers = 2,
    address: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="HOST:PORT",
            help="The Ray cluster.",
            help_behavior_hint="(default: this machine's)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Build very many designs and measure their models, into a folder of Parquet parts."""
    x.check_workers(workers)
    check_folder(out)
    if address is not None and engine != "ray":
        raise DraftError(Problem("--address goes with --engine ray", None, "leave it away"))
    from draft.explore import job as jobs
    from draft.explore.engines import LocalEngine, RayEngine
    from draft.explore.sweep import chunk, sweep

    robot = load(spec)
    job = jobs.make(
        robot,
        "sweep",
        vary,
        n,
        values=x.base(robot, design, values),
        sampler=sampler,
        seed=seed,
        condition=where,
        metrics=metrics or None,
        chunk=chunk(jobs.whole(n)),
    )
    note = x.rounded_words(n, job.n)
    if note and not json:
        print(note, file=sys.stderr)
    local = LocalEngine(min(workers, job.parts))
    with x.bar("sweep", job.n) as watch:
        summary = sweep(job, Path(out), RayEngine(address) if engine == "ray" else local, watch)
    if json:
        print(json_.dumps({"out": out, **summary}, indent=1))
    else:
        x.print_summary(summary, out)
    return 0
