"""`draft screen`: screen designs by arrays, into one Parquet file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from draft.cli import explore_options as x
from draft.cli.interrupted import if_interrupted
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values, parse_values


def main(
    reference: DesignArgument,
    /,
    out: Annotated[Path, tyro.conf.arg(metavar="FILE", help="Parquet file of the rows.")],
    vary: x.Vary = (),
    n: x.Number = "1e5",
    sampler: x.Sampler = "sobol",
    where: x.Where = None,
    metrics: x.Metrics = (),
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    seed: x.Seed = 0,
    workers: x.Workers = 2,
    json: JsonOutput = False,
) -> int:
    """Screen very many designs by closed-form metrics and the filter, into one file."""
    from draft.explore.runs import screen

    robot = x.robot(reference, design)
    with if_interrupted(x.PARTS_KEPT), x.bar("screen", None if json else n) as progress:
        rows = screen(
            robot,
            vary,
            out=out,
            n=n,
            where=where,
            metrics=metrics or None,
            values=parse_values(values, payload),
            sampler=sampler,
            seed=seed,
            workers=workers,
            progress=progress,
        )
    x.print_rows(rows, str(out), json)
    return 0
