"""`draft check`: print the verdict of the design filter, and write nothing."""

from __future__ import annotations

from typing import Annotated

import tyro

from draft.cli.display.record import record
from draft.cli.display.verdict import print_verdict
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Values, open_design


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    simulate: Annotated[
        bool,
        tyro.conf.arg(
            help="Let servos hold the home pose on a floor for two seconds too: reports "
            "penetrations of the start pose, falls and servos that swing or give way."
        ),
    ] = False,
    json: JsonOutput = False,
) -> int:
    """Check whether a robot can be built: exit 0 accepted, 1 refused, 2 bad input."""
    resolved, clock = open_design(reference, design, values)
    simulated = simulate and bool(resolved.accepted)
    if resolved.accepted:
        model = resolved.build()
        clock.lap("build")
        if simulate:
            resolved = model.simulate()
            clock.lap("simulate")
    if json:
        print(record(resolved, clock, None, {"simulated": simulated} if simulate else None))
    else:
        print_verdict(resolved)
        if simulate and not simulated:
            print("not simulated: correct the errors first")
    return 0 if resolved.accepted and resolved.judged else 1
