"""Capabilities of a robot with a trained policy: the table that all who show or rank them read.

`draft.learn.measuring.scalars` computes them from roll-outs; those with a `formula` are metrics of
a policy too (`draft.metrics.learned`), with maps of their own over a plane of designs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from draft.design.legs import GRAVITY
from draft.metrics.registry import Better


@dataclass(frozen=True, slots=True)
class Derived:
    """A law of another capability.

    Attributes:
        of: name of the other one.
        value: the capability from the value of the other one and the leg length [m].
    """

    of: str
    value: Callable[[float, float], float]


@dataclass(frozen=True, slots=True)
class Capability:
    """Line of the table of capabilities.

    Attributes:
        unit: SI unit, or hours; "1" for none.
        label: words in tables and plots.
        text: definition, one sentence.
        tables: tables of a study's report that have it.
        better: direction that is better; "" for neither.
        ranked: whether designs are ordered by it.
        law: law of those that follow from another one; None for those from roll-outs.
        optional: whether tables omit it where nothing was measured.
        formula: how a metric of a policy gets it from few roll-outs; "" for no such metric.
    """

    unit: str
    label: str
    text: str
    tables: tuple[str, ...] = ()
    better: Better = "more"
    ranked: bool = False
    law: Derived | None = None
    formula: str = ""
    optional: bool = False

    @property
    def title(self) -> str:
        """Label, with the unit if there is one."""
        return self.label if self.unit == "1" else f"{self.label} [{self.unit}]"


def _froude(speed: float, leg_length: float) -> float:
    return speed / math.sqrt(GRAVITY * leg_length)


_SKILL, _NORMALISED = ("capability",), ("capability_normalised",)
_WALKING, _ENERGY = ("walking",), ("energy",)
# fmt: off
CAPABILITIES = {
    "top_speed": Capability(
        "m/s", "top speed", "Largest median speed at which 80 % stay up.", _SKILL, ranked=True,
        formula="max over six commands of median |v_x|, over the last 2 s of 6 s",
    ),
    "top_speed_beyond": Capability(
        "m/s", "beyond training", "Top speed at commands that training had not reached.", _SKILL,
        optional=True,
    ),
    "sustained_speed": Capability(
        "m/s", "sustained speed", "Largest speed that the motors hold for half an hour.", _SKILL,
        formula="speed at which the worst joint's RMS torque is 1.15 of its rated one",
        optional=True,
    ),
    "hold_time": Capability(
        "s", "held for", "Time that the motors hold the top speed, by their overload law.",
        _SKILL, optional=True,
    ),
    "step": Capability(
        "m", "step", "Tallest step that half traverse, upwards and downwards.", _SKILL, ranked=True
    ),
    "step_ascent": Capability("m", "step up", "Tallest step that half climb.", _SKILL),
    "step_descent": Capability("m", "step down", "Tallest step that half descend.", _SKILL),
    "kick": Capability(
        "m/s", "kick", "Kick along x and y from which half recover.", _SKILL, ranked=True,
        formula="level at which the share of falls crosses one half; at most 8 m/s",
    ),
    "eta": Capability(
        "1", "efficiency η", "Mechanical power over that and the motors' heat, at top speed.",
        (*_SKILL, *_NORMALISED), ranked=True,
    ),
    "walk_speed": Capability(
        "m/s", "walking speed", "Median speed at a command of 0.4 m/s.", _WALKING
    ),
    "walk_survival": Capability(
        "1", "walking survival", "Share that stay up at a command of 0.4 m/s.", _WALKING
    ),
    "walk_cost_of_transport": Capability(
        "1", "walking cost of transport", "Electrical power per weight and speed, walking.",
        _ENERGY, better="less",
    ),
    "walk_endurance": Capability(
        "h", "walking lasts", "Time that the battery lasts, walking.", _ENERGY
    ),
    "walk_range": Capability(
        "m", "walking range", "Distance that the battery lasts, walking.", _ENERGY
    ),
    "cost_of_transport": Capability(
        "1", "cost of transport", "Electrical power per weight and speed, at top speed.",
        _ENERGY, better="less",
        formula="P / (m g v), P = sum of max(tau w, 0) + k tau^2, and the electronics",
    ),
    "endurance": Capability(
        "h", "lasts", "Time that the battery lasts, at the sustained speed.", _ENERGY
    ),
    "range": Capability(
        "m", "range", "Distance that the battery lasts, at the sustained speed.", _ENERGY
    ),
    "peak_command": Capability(
        "m/s", "peak command", "Command at which the top speed is reached.", better=""
    ),
    "top_speed_normalised": Capability(
        "1", "v/√(gL)", "Top speed over the square root of g and the leg length L.", _NORMALISED,
        law=Derived("top_speed", _froude),
    ),
    "step_normalised": Capability(
        "1", "step/L", "Step over the leg length L.", _NORMALISED,
        law=Derived("step", lambda step, leg_length: step / leg_length),
    ),
    "kick_normalised": Capability(
        "1", "kick/√(gL)", "Kick over the square root of g and the leg length L.", _NORMALISED,
        law=Derived("kick", _froude),
    ),
}
# fmt: on
# Those that are metrics of a policy.
MEASURED = {name: one for name, one in CAPABILITIES.items() if one.formula}
RANKED = tuple(name for name, one in CAPABILITIES.items() if one.ranked)


def of_table(table: str) -> tuple[str, ...]:
    """Names of the capabilities of a table of a study's report: a name in `Capability.tables`."""
    return tuple(name for name, one in CAPABILITIES.items() if table in one.tables)
