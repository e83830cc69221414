"""Checks of the structure of summary.json."""

from __future__ import annotations

import json
import math
from typing import Any

from draft.learn.inertia import SOURCES
from draft.learn.results import FORMAT

ARMS = ("nominal", "perturbed")
PROTOCOLS = ("walking", "published")
QUANTITIES = ("survival", "speed", "eta", "traversed", "recovered")

# Numbers that may be missing.
COUNTS = ("replicas", "seconds", "iteration", "took_s")


def parse(text: str) -> dict[str, Any]:
    """Read a summary.

    Raises:
        ValueError: the text is not the summary of an evaluation.
    """
    return check(json.loads(text, parse_constant=_no_constant))


def check(data: object) -> dict[str, Any]:
    """Check a summary, and add missing tables, empty.

    Raises:
        ValueError: the data is not the summary of an evaluation.
    """
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ValueError("it is not a summary of this version")
    if data.get("arm") not in ARMS or data.get("protocol") not in PROTOCOLS:
        raise ValueError("its arm or protocol is not known")
    if data.get("errors") not in (None, *SOURCES):
        raise ValueError("its inertia errors are not known")
    _check_curves(data)
    for name in ("reasons", "versions"):
        _table(data, name)
    _check_utilisation(data)
    for name, member in _table(data, "by_member").items():
        if not isinstance(member, dict):
            raise ValueError(f"member {name} is not a table")
        _table(member, "reasons")
        try:
            _check_curves(member)
            _check_utilisation(member)
        except ValueError as error:
            raise ValueError(f"member {name}: {error}") from None
    _numbers([data.get(name) for name in COUNTS], "counts and times", True)
    if not isinstance(data.setdefault("flags", []), list):
        raise ValueError("its flags are not a list")
    return data


def _check_curves(data: dict[str, Any]) -> None:
    """Check curves by battery, and scalars."""
    batteries = _table(data, "batteries")
    for name, battery in batteries.items():
        if not isinstance(battery, dict):
            raise ValueError(f"battery {name} is not a table")
        count = len(_numbers(battery.get("levels"), f"levels of {name}", False))
        for quantity, values in battery.items():
            if quantity not in QUANTITIES:
                continue
            if len(_numbers(values, f"{quantity} of {name}", True)) != count:
                raise ValueError(f"{quantity} of {name} does not have one value for each level")
    for name, value in _table(data, "scalars").items():
        _numbers([value], name, True)


def _check_utilisation(data: dict[str, Any]) -> None:
    """Check shares by battery, joint class and quantity, levels, and limiting joints."""
    for name in ("utilisation", "utilisation_level", "limiting"):
        _table(data, name)
    for battery, classes in data["utilisation"].items():
        for joint in classes.values() if isinstance(classes, dict) else [None]:
            if not isinstance(joint, dict):
                raise ValueError(f"utilisation of {battery} is not a table by joint class")
            _numbers(list(joint.values()), f"utilisation of {battery}", True)
    for battery, limit in data["limiting"].items():
        if limit is not None:
            if not isinstance(limit, dict):
                raise ValueError(f"limiting joint of {battery} is not a table")
            _numbers([limit.get("value")], f"limiting joint of {battery}", True)
    _numbers(list(data["utilisation_level"].values()), "levels of the utilisation", True)


def _table(data: dict[str, Any], name: str) -> dict[str, Any]:
    found = data.setdefault(name, {})
    if not isinstance(found, dict):
        raise ValueError(f"its {name} are not a table")
    return found


def _numbers(values: object, what: str, null: bool) -> list[Any]:
    """Return a list of finite numbers, with null where it is allowed."""
    if not isinstance(values, list):
        raise ValueError(f"{what} are not a list")
    for value in values:
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (number and math.isfinite(value)) and not (null and value is None):
            raise ValueError(f"{what}: '{str(value)[:20]}' is not a number")
    return values


def _no_constant(name: str) -> float:
    raise ValueError(f"'{name}' is not a number of JSON")
