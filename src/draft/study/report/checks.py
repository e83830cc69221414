"""Checks of a summary.json, so that what follows can rely on its shape."""

from __future__ import annotations

import json
import math
from typing import Any

from draft.learn.inertia import SOURCES
from draft.learn.results import FORMAT

ARMS = ("nominal", "perturbed")
PROTOCOLS = ("walking", "published")
QUANTITIES = ("survival", "speed", "eta", "traversed", "recovered")


# Numbers that a report may do without.
COUNTS = ("replicas", "seconds", "iteration", "took_s")


def parse(text: str) -> dict[str, Any]:
    """Read a summary.

    Raises:
        ValueError: it is no summary of an evaluation; the message says why.
    """
    return check(json.loads(text, parse_constant=_no_constant))


def check(data: Any) -> dict[str, Any]:
    """Check a summary, and complete it with empty tables.

    Raises:
        ValueError: it is no summary of an evaluation; the message says why.
    """
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        raise ValueError("it is no summary of this version")
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
            raise ValueError(f"member {name} is no table")
        _table(member, "reasons")
        try:
            _check_curves(member)
            _check_utilisation(member)
        except ValueError as error:
            raise ValueError(f"member {name}: {error}") from None
    _numbers([data.get(name) for name in COUNTS], "counts and times", True)
    if not isinstance(data.setdefault("flags", []), list):
        raise ValueError("its flags are no list")
    return data


def _check_curves(data: dict[str, Any]) -> None:
    """Check curves by battery, and scalars."""
    batteries = _table(data, "batteries")
    for name, battery in batteries.items():
        if not isinstance(battery, dict):
            raise ValueError(f"battery {name} is no table")
        count = len(_numbers(battery.get("levels"), f"levels of {name}", False))
        for quantity, values in battery.items():
            if quantity not in QUANTITIES:
                continue
            if len(_numbers(values, f"{quantity} of {name}", True)) != count:
                raise ValueError(f"{quantity} of {name} has not one value for each level")
    for name, value in _table(data, "scalars").items():
        _numbers([value], name, True)


def _check_utilisation(data: dict[str, Any]) -> None:
    """Check the shares by battery, joint class and quantity, and what is said of each battery."""
    for name in ("utilisation", "utilisation_level", "limiting"):
        _table(data, name)
    for battery, classes in data["utilisation"].items():
        for joint in classes.values() if isinstance(classes, dict) else [None]:
            if not isinstance(joint, dict):
                raise ValueError(f"utilisation of {battery} is no table by joint class")
            _numbers(list(joint.values()), f"utilisation of {battery}", True)
    for battery, told in data["limiting"].items():
        if told is not None:
            if not isinstance(told, dict):
                raise ValueError(f"limiting joint of {battery} is no table")
            _numbers([told.get("value")], f"limiting joint of {battery}", True)
    _numbers(list(data["utilisation_level"].values()), "levels of the utilisation", True)


def _table(data: dict[str, Any], name: str) -> dict[str, Any]:
    found = data.setdefault(name, {})
    if not isinstance(found, dict):
        raise ValueError(f"its {name} are no table")
    return found


def _numbers(values: Any, what: str, null: bool) -> list[Any]:
    """Finite numbers, or null where that may be."""
    if not isinstance(values, list):
        raise ValueError(f"{what} are no list")
    for value in values:
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not (number and math.isfinite(value)) and not (null and value is None):
            raise ValueError(f"{what}: '{str(value)[:20]}' is no number")
    return values


def _no_constant(name: str) -> float:
    raise ValueError(f"'{name}' is no number of JSON")
