"""Copy descriptions out of the optional package `robot_descriptions`, which downloads them.

The only place in Draft that opens the network.
"""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Iterable
from pathlib import Path

from draft.errors import DraftError, Problem, suggest
from draft.fitting.structure.robots import Robot, robots

REMEDY = "pip install 'draft[survey]' brings it; the shipped table needs no download"


def available() -> list[Robot]:
    """Robots of the survey that the package has."""
    return [robot for robot in robots().values() if robot.package]


def choose(keys: Iterable[str]) -> list[Robot]:
    """Robots by key; none given: all that the package has.

    Raises:
        DraftError: a key that the package does not have; the nearest is named.
    """
    table = {robot.key: robot for robot in available()}
    chosen: list[Robot] = []
    for key in keys:
        if key not in table:
            cause = f"robot_descriptions has no '{key}' of the survey"
            raise DraftError(Problem(cause, None, suggest(key, table, "robots")))
        chosen.append(table[key])
    return chosen or list(table.values())


def fetch(robot: Robot, folder: Path) -> Path:
    """Download one robot's repository into the package's cache and copy its description.

    Raises:
        DraftError: the package is absent, the network is, or it holds no plain file.
    """
    try:
        importlib.import_module("robot_descriptions")
    except ImportError:
        cause = "the package robot_descriptions is not installed"
        raise DraftError(Problem(cause, None, REMEDY)) from None
    try:
        module = importlib.import_module(f"robot_descriptions.{robot.package}")
    except Exception as error:
        # The package clones with git: what goes wrong there has many types, all of them offline.
        lines = str(error).strip().splitlines()
        cause = f"cannot fetch '{robot.key}': {lines[-1] if lines else type(error).__name__}"
        raise DraftError(Problem(cause, None, "is there a network? " + REMEDY)) from None
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if path is None or not Path(path).is_file():
        cause = f"robot_descriptions has no plain URDF or MJCF file of '{robot.key}'"
        raise DraftError(Problem(cause, None, "expand its xacro file yourself"))
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{robot.key}{Path(path).suffix}"
    shutil.copyfile(path, target)
    return target
