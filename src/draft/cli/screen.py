"""`draft screen`: very many designs by arrays, into one Parquet file."""

from __future__ import annotations

import json as json_
import sys
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli import explore_options as x
from draft.cli.options import DesignName, JsonOutput, Robot, Values
from draft.spec import load


def main(
    spec: Robot,
    /,
    out: Annotated[Path, tyro.conf.arg(metavar="FILE", help="The Parquet file of the rows.")],
    vary: x.Vary = (),
    n: x.Number = "1e5",
    sampler: x.Sampler = "sobol",
    where: x.Where = None,
    metrics: x.Metrics = (),
    design: DesignName = None,
    values: Values = (),
    seed: x.Seed = 0,
    workers: x.Workers = 2,
    json: JsonOutput = False,
) -> int:
    """Screen very many designs by closed-form metrics and the filter, into one file."""
    x.check_workers(workers)
    x.check_file(out)
    from draft.explore import job as jobs
    from draft.explore.engines import LocalEngine
    from draft.explore.screen import CHUNK, screen

    robot = load(spec)
    job = jobs.make(
        robot,
        "screen",
        vary,
        n,
        values=x.base(robot, design, values),
        sampler=sampler,
        seed=seed,
        condition=where,
        metrics=metrics or None,
        chunk=CHUNK,
    )
    note = x.rounded_words(n, job.n)
    if note and not json:
        print(note, file=sys.stderr)
    with x.bar("screen", job.n) as watch:
        summary = screen(job, out, LocalEngine(min(workers, job.parts)), watch)
    if json:
        print(json_.dumps({"out": str(out), **summary}, indent=1))
    else:
        x.print_summary(summary, str(out))
    return 0
