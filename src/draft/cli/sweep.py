"""`draft sweep`: compiled models and their metrics, into a folder of Parquet parts."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro

from draft.cli import explore_options as x
from draft.cli.options import (
    DesignName,
    JsonOutput,
    Robot,
    Values,
    check_folder,
    parse_values,
    resolve,
)
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
    check_folder(out)
    if address is not None and engine != "ray":
        raise DraftError(Problem("--address goes with --engine ray", None, "leave it away"))
    from draft.explore.engines import RayEngine
    from draft.explore.runs import sweep

    robot = load(spec) if design is None else resolve(load(spec), design, ())
    with x.bar("sweep", None if json else n) as progress:
        rows = sweep(
            robot,
            vary,
            out=out,
            n=n,
            where=where,
            metrics=metrics or None,
            values=parse_values(values),
            sampler=sampler,
            seed=seed,
            workers=workers,
            engine=RayEngine(address) if engine == "ray" else None,
            progress=progress,
        )
    x.print_rows(rows, out, json)
    return 0
