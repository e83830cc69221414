"""Roles of joints in legs and arms, from their names, by the rules of a table.

Rules for single robots precede the general ones. A name that matches no rule, or rules of different
roles, has no role and is reported.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import lru_cache
from pathlib import Path

FILE = Path(__file__).resolve().parent / "data" / "roles.csv"
# Joints of these roles have no actuator in the survey and start no class.
UNPRICED = ("finger", "wheel", "linkage", "sensor")
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


@dataclass(frozen=True, slots=True)
class Rule:
    """One row of the table.

    Attributes:
        population: population that it applies to.
        robot: pattern of the keys of robots that it applies to; "*" for all.
        match: "word" for a word in the name, "name" for a pattern of the whole name in lower case.
        pattern: the word or pattern.
        role: role of a joint with such a name.
    """

    population: str
    robot: str
    match: str
    pattern: str
    role: str


@lru_cache(maxsize=1)
def rules() -> tuple[Rule, ...]:
    """The shipped rules."""
    with FILE.open(newline="", encoding="utf-8") as file:
        return tuple(Rule(**row) for row in csv.DictReader(file))


def role(name: str, robot: str, population: str) -> str | None:
    """Role of a joint; None without a matching rule.

    Args:
        name: the joint's name.
        robot: the robot's key.
        population: "humanoid" or "quadruped".
    """
    general: list[Rule] = []
    for rule in rules():
        if rule.population != population:
            continue
        if rule.robot == "*":
            general.append(rule)
        elif fnmatchcase(robot, rule.robot) and _matches(rule, name):
            return rule.role
    matching = {rule.role for rule in general if _matches(rule, name)}
    return matching.pop() if len(matching) == 1 else None


def priced(name: str | None) -> bool:
    """Whether joints of this role have an actuator whose mass the survey subtracts."""
    return name is not None and name not in UNPRICED


def words(name: str) -> set[str]:
    """Words of a name in lower case: `hipPitch_Left` has hip, pitch and left."""
    return {word.lower() for word in _WORD.findall(name)}


def _matches(rule: Rule, name: str) -> bool:
    if rule.match == "word":
        return rule.pattern in words(name)
    return fnmatchcase(name.lower(), rule.pattern)
