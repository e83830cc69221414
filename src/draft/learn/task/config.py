"""All numbers of the learning tasks together, and changing them by name."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import Field, asdict, dataclass, field, fields, replace
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from draft.errors import DraftError, suggest
from draft.learn.task.constants import Row, Within, rows
from draft.learn.task.groups import (
    KINDS,
    Actuation,
    Climbing,
    Commands,
    Episodes,
    Ground,
    Learning,
    Observations,
    Physics,
    Pushing,
    Rewards,
    Velocity,
)
from draft.learn.task.stages import STAGES, is_like
from draft.learn.task.terms import defaults

T = TypeVar("T")


@dataclass(frozen=True)
class Config:
    """All numbers by group."""

    physics: Physics = field(default_factory=Physics)
    actuation: Actuation = field(default_factory=Actuation)
    observations: Observations = field(default_factory=Observations)
    commands: Commands = field(default_factory=Commands)
    rewards: Rewards = field(default_factory=Rewards)
    episodes: Episodes = field(default_factory=Episodes)
    ground: Ground = field(default_factory=Ground)
    velocity: Velocity = field(default_factory=Velocity)
    terrain: Climbing = field(default_factory=Climbing)
    push: Pushing = field(default_factory=Pushing)
    learning: Learning = field(default_factory=Learning)
    terms: tuple[tuple[str, Any], ...] = field(default_factory=defaults)
    """Numbers of the terms and stages of extensions, by their names."""

    def groups(self) -> dict[str, Any]:
        """Return the groups of numbers by name, those of extensions last."""
        own = {one.name: getattr(self, one.name) for one in fields(self) if one.name != "terms"}
        return own | dict(self.terms)

    def _replaced(self, name: str, group: Any) -> Config:
        """Return the configuration with another group of a name."""
        terms = dict(self.terms)
        if name not in terms:
            return replace(self, **{name: group})
        return replace(self, terms=tuple((terms | {name: group}).items()))

    def with_values(self, values: Mapping[str, Any]) -> Config:
        """Return the configuration with some numbers changed.

        Args:
            values: numbers by GROUP.NAME; lists for ranges.

        Raises:
            DraftError: there is no such number, the value is of another type or out of range, or no
                ground has a share.
        """
        config = self
        known = {f"{g}.{f.name}": f for g, group in self.groups().items() for f in fields(group)}
        for name, value in values.items():
            group_name, _, key = name.partition(".")
            if name not in known:
                remedy = suggest(name, known, "numbers")
                raise DraftError(f"there is no number '{name}'", remedy)
            group = config.groups()[group_name]
            cast = _cast(name, value, getattr(group, key))
            _check(name, cast, known[name])
            config = config._replaced(group_name, replace(group, **{key: cast}))
        config._check_ground()
        return config

    def _check_ground(self) -> None:
        """Refuse a stage whose kinds of ground all have a share of zero."""
        for name, mix in (("ground", self.ground), ("terrain", self.terrain)):
            if not any(getattr(mix, kind) for kind in KINDS):
                cause = f"no ground is left: {', '.join(f'{name}.{k}' for k in KINDS)} are all 0"
                raise DraftError(cause, f"for flat ground: {name}.flat=1")

    def iterations(self, stage: str) -> int:
        """Return the iterations of a stage."""
        terms = dict(self.terms)
        if stage in terms:
            return terms[stage].iterations
        return getattr(self.learning, f"iterations_{stage}")

    def of_stage(self, stage: str) -> Config:
        """Return the configuration without the numbers of stages of extensions that are not used.

        What an extension adds beside a stage does not make its runs others.
        """
        unused = {name for name in STAGES if not is_like(stage, name)}
        return replace(self, terms=tuple(term for term in self.terms if term[0] not in unused))

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers by group and name, as plain data."""
        return json.loads(json.dumps({name: asdict(one) for name, one in self.groups().items()}))

    def rows(self, scale: float = 1.0, stage: str | None = None) -> dict[str, list[Row]]:
        """Return the numbers by group, as rows of a table.

        Args:
            scale: s = L / 0.48 m.
            stage: omit the numbers that only other stages use; None for all numbers.
        """
        omitted = [other for other in STAGES if stage is not None and other != stage]
        return {
            name: [
                row
                for row in rows(name, group, scale)
                if row.name not in [f"learning.iterations_{other}" for other in omitted]
            ]
            for name, group in self.groups().items()
            if stage is None or name not in omitted or is_like(stage, name)
        }


def from_dict(data: Mapping[str, Mapping[str, Any]]) -> Config:
    """Return the configuration of the data from `Config.as_dict`.

    It has the terms of extensions that the data has, and no others.

    Raises:
        DraftError: there is no such number, or the value is of another type or out of range.
    """
    terms = tuple((name, numbers) for name, numbers in defaults() if name in data)
    flat = {f"{group}.{name}": v for group, numbers in data.items() for name, v in numbers.items()}
    return Config(terms=terms).with_values(flat)


def _cast(name: str, value: Any, like: T) -> T:
    """Convert a value to the type of another: bool, int, float, or a tuple of such."""
    try:
        return _alike(value, like)
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError):
        cause = f"'{str(value)[:80]}' is not a value of {name}"
        raise DraftError(cause, f"such as {json.dumps(like)}") from None


def _check(name: str, value: Any, number: Field[Any]) -> None:
    """Refuse a value out of the range of its number."""
    within: Within = number.metadata["within"]
    if not within.holds(np.ravel(value).tolist()):
        cause = f"{name} must be {within.words}, and is {json.dumps(value)}"
        raise DraftError(cause, f"such as {json.dumps(number.default)}")


def _alike(value: Any, like: Any) -> Any:
    if isinstance(like, bool):
        return {"true": True, "false": False}[str(value).lower()]
    if isinstance(like, tuple):
        return _tuple(value, like)
    number = float(value)
    if not math.isfinite(number) or (isinstance(like, int) and number != int(number)):
        raise ValueError
    return int(number) if isinstance(like, int) else number


def _tuple(value: Any, like: tuple[Any, ...]) -> tuple[Any, ...]:
    """Convert a tuple: ramps and layers have any length, a range or a push has that of `like`."""
    if isinstance(value, str):
        text = value.strip().replace("(", "[").replace(")", "]")
        value = json.loads(text if text.startswith("[") else f"[{text}]")
    ramp = isinstance(like[0], tuple)
    kinds = [like[0]] * len(value) if ramp or all(type(n) is int for n in like) else like
    items = tuple(_alike(item, kind) for item, kind in zip(value, kinds, strict=True))
    starts = [item[0] for item in items] if ramp else [0]
    if not items or starts[0] != 0 or any(a >= b for a, b in pairwise(starts)):
        raise ValueError
    return items
