"""`draft check`: the verdict alone; nothing is written."""

from __future__ import annotations

from typing import Annotated

import tyro

from draft.cli.build import Clock, record
from draft.cli.options import DesignName, Robot, Values, resolve
from draft.cli.verdict import print_findings, verdict
from draft.spec import load


def main(
    spec: Robot,
    /,
    design: DesignName = None,
    values: Values = (),
    json: Annotated[bool, tyro.conf.arg(help="Print one JSON object and nothing else.")] = False,
) -> int:
    """Say whether a robot could be built: exit 0 accepted, 1 refused, 2 bad input."""
    clock = Clock()
    robot = load(spec)
    clock.lap("load")
    resolved = resolve(robot, design, values)
    clock.lap("resolve")
    if resolved.accepted:
        resolved.build()
        clock.lap("build")
    if json:
        print(record(resolved, clock.laps, None))
    else:
        print_findings(resolved)
        print(verdict(resolved))
    return 0 if resolved.accepted else 1
