"""`draft optimise`: search for the best designs with Optuna."""

from __future__ import annotations

import json as json_

from draft.cli import explore_options as x
from draft.cli.interrupted import AGAIN, if_interrupted
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values
from draft.errors import counted
from draft.explore.settings import SearchSettings


@x.options(SearchSettings)
def main(
    reference: DesignArgument,
    /,
    *,
    settings: SearchSettings,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    json: JsonOutput = False,
) -> int:
    """Search for designs that no other beats in every goal, and save them as named designs."""
    from draft.explore.optimise import optimise

    robot = x.robot(reference, design)
    x.print_policy(settings.policy, robot)
    with if_interrupted(f"the trials so far are kept; {AGAIN}"), x.bar("optimise") as progress:
        front = optimise(robot, **x.given(settings, values, payload, progress))
    out = str(settings.out)
    if json:
        record = {"out": out, "trials": front.trials, "front": front.best, "failed": front.failed}
        print(json_.dumps(record, indent=1))
    else:
        if front:
            designs = counted(len(front), "design")
            print(f"{counted(front.trials, 'trial', ',')}, {designs} that no other beats")
        else:
            print(f"{counted(front.trials, 'trial', ',')}, and none meets all conditions:")
            for condition, count in front.failed.items():
                print(f"  {condition}: fails in {count:,} of {front.trials:,}")
            if len(front.failed) > 1 and max(front.failed.values()) < front.trials:
                print("  each condition is met by some trials, but never all by one")
        for one in front[:10]:
            words = ", ".join(f"{name} {value:.4g}" for name, value in one["goals"].items())
            print(f"  {one['design']}: {words}")
        made = [*["designs/"] * bool(front), *["front.png", "front.pdf"] * settings.figure]
        print(f"written to {out}: {', '.join(['front.csv', 'front.json', *made])}")
    return 0
