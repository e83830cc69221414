"""`draft optimise`: search for the best designs with Optuna."""

from __future__ import annotations

import json as json_
from typing import Annotated, Literal

import tyro

from draft.cli import explore_options as x
from draft.cli.interrupted import AGAIN, if_interrupted
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
from draft.errors import counted

_Goals = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="METRIC ...",
        help="Metrics or expressions.",
        help_behavior_hint="(default: none; one goal is needed)",
    ),
]


def main(
    reference: DesignArgument,
    /,
    out: Annotated[str, tyro.conf.arg(metavar="DIR", help="Folder of the study and the front.")],
    vary: x.Vary = (),
    minimise: _Goals = (),
    maximise: _Goals = (),
    subject_to: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="CONDITION ...",
            help='Conditions that designs must meet, such as accepted "leg.mass < 1".',
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    trials: Annotated[
        int, tyro.conf.arg(metavar="N", help="Designs to try, including those of earlier calls.")
    ] = 2000,
    sampler: Annotated[Literal["nsga2", "tpe"], tyro.conf.arg(help="Optuna's sampler.")] = "nsga2",
    storage: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="URL",
            help="Database, which several processes may share.",
            help_behavior_hint="(default: DIR/study.db)",
        ),
    ] = None,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    policy: LearnedPolicy = None,
    outside: x.Outside = False,
    seed: x.Seed = 0,
    figure: Annotated[
        bool, tyro.conf.arg(help="Draw the front over all trials: front.png and front.pdf.")
    ] = False,
    json: JsonOutput = False,
) -> int:
    """Search for designs that no other beats in every goal, and save them as named designs."""
    check_folder(out)
    from draft.explore.runs import optimise

    robot = x.robot(reference, design)
    x.print_policy(policy)
    with if_interrupted(f"the trials so far are kept; {AGAIN}"), x.bar("optimise") as progress:
        front = optimise(
            robot,
            vary,
            out=out,
            minimise=minimise,
            maximise=maximise,
            subject_to=subject_to,
            trials=trials,
            values=parse_values(values, payload),
            sampler=sampler,
            storage=storage,
            seed=seed,
            policy=policy,
            outside=outside,
            figure=figure,
            progress=progress,
        )
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
        drawn = ", front.png, front.pdf" if figure else ""
        print(f"written to {out}: front.csv, front.json, designs/{drawn}")
    return 0
