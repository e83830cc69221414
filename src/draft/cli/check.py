"""`draft check`: print the verdict of the design filter, and write nothing."""

from __future__ import annotations

from draft.cli.display.record import record
from draft.cli.display.verdict import print_verdict
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Values, open_design


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    json: JsonOutput = False,
) -> int:
    """Check whether a robot can be built: exit 0 accepted, 1 refused, 2 bad input."""
    resolved, clock = open_design(reference, design, values)
    if resolved.accepted:
        resolved.build()
        clock.lap("build")
    if json:
        print(record(resolved, clock, None))
    else:
        print_verdict(resolved)
    return 0 if resolved.accepted and resolved.judged else 1
