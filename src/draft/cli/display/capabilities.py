"""Terminal output of `draft twin --capabilities`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.table import Table

from draft.cli.display.verdict import console
from draft.cli.spelling import spelt
from draft.validation.capabilities import Estimate
from draft.values import brief

if TYPE_CHECKING:
    from draft.validation.compare import RealRobot
    from draft.validation.verdicts import Verdict

# Capabilities that are shown: label and unit.
SHOWN = {
    "mass": ("mass", "kg"),
    "payload_peak": ("standing load, peak torque", "kg"),
    "payload_rated": ("standing load, rated torque", "kg"),
    "jump_height": ("jump", "m"),
    "top_speed": ("top speed", "m/s"),
    "step_up": ("step up", "m"),
    "step_down": ("step down", "m"),
    "kick": ("kick", "m/s"),
    "walking_speed": ("speed of a walk", "m/s"),
    "walking_power": ("power of a walk", "W"),
    "cost_of_transport": ("cost of transport", "1"),
    "endurance": ("endurance, walking", "h"),
    "range": ("range, walking", "m"),
    "standing_power": ("power, standing", "W"),
    "endurance_standing": ("endurance, standing", "h"),
}


def print_capabilities(found: RealRobot) -> None:
    """Print the three columns, verdicts and notes."""
    out = console()
    table = Table(box=None, pad_edge=False, title=f"capabilities of {escape(found.key)}")
    table.title_justify = "left"
    table.add_column("")
    table.add_column("", style="dim")
    for heading in ("maker's masses", "predicted", "ratio", "published"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
    judged = {verdict.quantity: verdict for verdict in found.verdicts}
    nothing = Estimate.none("not measured")
    for name, (label, unit) in SHOWN.items():
        if name not in found.predicted and name not in judged:
            continue
        theirs, ours = (arm.get(name, nothing) for arm in (found.maker, found.predicted))
        ratio = ours.value / theirs.value if theirs.value else math.nan
        verdict = judged.get(name)
        table.add_row(
            label,
            unit,
            _interval(theirs),
            _interval(ours),
            "" if math.isnan(ratio) else f"{ratio:.2f}",
            "" if verdict is None else _published(verdict),
            "" if verdict is None else verdict.word,
        )
    out.print(table)
    if found.policy:
        out.print(f"policy: {found.policy}", markup=False)
    for note in found.notes:
        out.print(f"[yellow]note[/] {escape(spelt(note))}")


def record(found: RealRobot) -> dict[str, Any]:
    """The columns as plain data; None where there is no number."""
    return {
        "robot": found.key,
        "policy": found.policy,
        "maker": {name: _plain(one) for name, one in found.maker.items()},
        "predicted": {name: _plain(one) for name, one in found.predicted.items()},
        "published": [
            {
                "quantity": one.quantity,
                "value": one.published,
                "bound": one.figure.bound,
                "condition": one.figure.condition,
                "confidence": one.figure.confidence,
                "source": one.figure.source,
                "physical": one.physical,
                "verdict": one.word,
            }
            for one in found.verdicts
        ],
        "notes": list(found.notes),
    }


def _plain(one: Estimate) -> dict[str, Any]:
    if math.isnan(one.value):
        return {"value": None, "reason": one.reason}
    return {"value": one.value, "low": one.low, "high": one.high}


def _interval(one: Estimate) -> str:
    if math.isnan(one.value):
        return "-"
    if one.low == one.high:
        return brief(one.value)
    return f"{brief(one.value)} ({brief(one.low)}..{brief(one.high)})"


def _published(verdict: Verdict) -> str:
    sign = {"least": "> ", "most": "< ", "": ""}[verdict.figure.bound]
    return f"{sign}{brief(verdict.published)} {verdict.figure.confidence}"
