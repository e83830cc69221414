"""`draft deploy`: write the controller of a policy for a robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.options import DESIGN_FORMS, ShippedSkill, check_folder
from draft.errors import DraftError


def main(
    design: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="DESIGN|FILE.onnx",
            help=f"The robot: {DESIGN_FORMS}; or a policy from 'draft play RUN --onnx', whose "
            "robot is the one that it was trained with.",
        ),
    ],
    /,
    *,
    out: Annotated[
        str,
        tyro.conf.arg(
            metavar="DIR", help="Folder of the controller; replaces one that Draft wrote there."
        ),
    ],
    skill: Annotated[
        ShippedSkill,
        tyro.conf.arg(help_behavior_hint="(default: machine where it drives the robot, else walk)"),
    ] = None,
    policy: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.onnx",
            help="A policy of your own for the robot.",
            help_behavior_hint="(default: one that ships)",
        ),
    ] = None,
) -> int:
    """Write the controller of a policy for a robot: plain C++, the same in Python, and a README.

    It has the order of observations and joints, signs, gains, limits and a safe stop, and needs
    neither Draft nor a library for networks.
    """
    check_folder(out)
    from draft.deployment.deploy import deploy
    from draft.learn.training.run import is_run

    if is_run(Path(design)):
        cause = f"'{design}' is a run of 'draft train'"
        raise DraftError(cause, f"write its policy by 'draft play {design} --onnx FILE.onnx'")
    found = deploy(design, out, skill, policy)
    for path in sorted(found.folder.iterdir()):
        print(path)
    period = found.policy.control_period
    print(f"{found.design}: {len(found.policy.joints)} joints at {1.0 / period:g} Hz")
    for name in found.estimated:
        print(f"{name}: no sensor gives it, so the robot must estimate it")
    for one in found.doubts:
        print(one)
    return 0
