"""`draft sweep`: compile designs and measure their models, into a folder of Parquet parts."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro

from draft.cli import explore_options as x
from draft.cli.interrupted import if_interrupted
from draft.cli.options import (
    DesignArgument,
    DesignName,
    JsonOutput,
    LearnedPolicy,
    Payload,
    Values,
    check_folder,
    parse_values,
)
from draft.errors import DraftError


def main(
    reference: DesignArgument,
    /,
    out: Annotated[str, tyro.conf.arg(metavar="DIR", help="Folder of the Parquet parts.")],
    vary: x.Vary = (),
    n: x.Number = "1e3",
    sampler: x.Sampler = "sobol",
    where: x.Where = None,
    metrics: x.Metrics = (),
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    policy: LearnedPolicy = None,
    outside: x.Outside = False,
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
            help="Address of the Ray cluster.",
            help_behavior_hint="(default: this machine's)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Build very many designs and measure their models, into a folder of Parquet parts."""
    check_folder(out)
    if address is not None and engine != "ray":
        raise DraftError("--address is for a Ray cluster", "add --engine ray, or omit --address")
    from draft.explore.engines import RayEngine
    from draft.explore.runs import sweep

    robot = x.robot(reference, design)
    x.print_policy(policy)
    with if_interrupted(x.PARTS_KEPT), x.bar("sweep", None if json else n) as progress:
        rows = sweep(
            robot,
            vary,
            out=out,
            n=n,
            where=where,
            metrics=metrics or None,
            values=parse_values(values, payload),
            sampler=sampler,
            seed=seed,
            policy=policy,
            outside=outside,
            workers=workers,
            engine=RayEngine(address) if engine == "ray" else None,
            progress=progress,
        )
    x.print_rows(rows, out, json)
    return 0
