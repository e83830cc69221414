"""`draft new`: start a robot of your own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import tyro

from draft.spec.new import new_robot


def main(
    name: Annotated[
        tyro.conf.Positional[Path],
        tyro.conf.arg(metavar="NAME", help="Name of the robot, or the path of its new folder."),
    ],
    /,
    like: Annotated[
        str, tyro.conf.arg(metavar="ROBOT", help="Shipped robot to start from.")
    ] = "hopper",
) -> int:
    """Start a robot of your own from a shipped one."""
    folder = new_robot(name, like)
    print(f"made {folder}: edit {folder}/parameters.yaml, then run 'draft show {folder}'")
    return 0
