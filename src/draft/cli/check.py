"""`draft check`: the verdict alone; nothing is written."""

from __future__ import annotations

from draft.cli.display.record import record
from draft.cli.display.verdict import print_verdict
from draft.cli.options import DesignName, JsonOutput, Robot, Values, open_design


def main(
    spec: Robot,
    /,
    design: DesignName = None,
    values: Values = (),
    json: JsonOutput = False,
) -> int:
    """Say whether a robot could be built: exit 0 accepted, 1 refused, 2 bad input."""
    resolved, clock = open_design(spec, design, values)
    if resolved.accepted:
        resolved.build()
        clock.lap("build")
    if json:
        print(record(resolved, clock, None))
    else:
        print_verdict(resolved)
    return 0 if resolved.accepted and resolved.judged else 1
