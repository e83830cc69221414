"""Copies of descriptions from the optional package `robot_descriptions`, which downloads them.

This is the only module of Draft that uses the network.
"""

from __future__ import annotations

import importlib
import shutil
from collections.abc import Iterable
from pathlib import Path

from draft.errors import DraftError, suggest
from draft.extras import remedy
from draft.fitting.structure.robots import Robot, robots

NO_DOWNLOAD = "the shipped table needs no download"
NETWORK = f"check the network; {NO_DOWNLOAD}"


def available() -> list[Robot]:
    """Robots of the survey that the package contains."""
    return [robot for robot in robots().values() if robot.package]


def choose(keys: Iterable[str]) -> list[Robot]:
    """Robots by key; all that the package contains if no key is given.

    Raises:
        DraftError: the package lacks a key; the message suggests the nearest.
    """
    table = {robot.key: robot for robot in available()}
    chosen: list[Robot] = []
    for key in keys:
        if key not in table:
            cause = f"robot_descriptions has no '{key}' of the survey"
            raise DraftError(cause, suggest(key, table, "robots"))
        chosen.append(table[key])
    return chosen or list(table.values())


def fetch(robot: Robot, folder: Path) -> Path:
    """Download one robot's repository into the package's cache and copy its description.

    Raises:
        DraftError: the package is not installed, the download fails, or the package has no URDF or
            MJCF file of the robot.
    """
    try:
        importlib.import_module("robot_descriptions")
    except ImportError:
        cause = "the package robot_descriptions is not installed"
        raise DraftError(cause, f"{remedy('survey')}; {NO_DOWNLOAD}") from None
    try:
        module = importlib.import_module(f"robot_descriptions.{robot.package}")
    except Exception as error:
        # The package clones with git, whose failures have many types.
        lines = str(error).strip().splitlines()
        cause = f"cannot fetch '{robot.key}': {lines[-1] if lines else type(error).__name__}"
        raise DraftError(cause, NETWORK) from None
    path = getattr(module, "URDF_PATH", None) or getattr(module, "MJCF_PATH", None)
    if path is None or not Path(path).is_file():
        cause = f"robot_descriptions has no plain URDF or MJCF file of '{robot.key}'"
        raise DraftError(cause, "expand its xacro file yourself")
    folder.mkdir(parents=True, exist_ok=True)
    target = folder / f"{robot.key}{Path(path).suffix}"
    shutil.copyfile(path, target)
    return target
