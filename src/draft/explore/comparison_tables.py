"""A comparison of designs as tables of text, which the command, reports and the studio show."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from draft.explore.comparison import DesignComparison, Part
from draft.metrics import Limit, find
from draft.metrics.limiting import where
from draft.metrics.registry import USUAL
from draft.values import brief, signed

# Metrics whose limits are told unless some are named.
LIMITED = (
    *("top_speed", "payload_rated", "jump_height"),
    *("standing_torque_rated", "endurance_standing"),
)
_SMALL = 0.005  # Share of a difference below which a number is left out.
_NAMED = 2  # Numbers that are named as the largest shares.


class TextTable(NamedTuple):
    """A table of text.

    Attributes:
        title: what it is about.
        head: words above its columns; a line break stands between those of a cell.
        rows: cells of its rows.
        note: words below it.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""


class Section(NamedTuple):
    """A comparison as text.

    Attributes:
        summary: of some metrics the unit, the values, for each other design of the same robot the
            probability that it is better than the first, and, of two designs, the largest shares.
        metrics: the same of all metrics that a design has, without shares.
        shares: what each number contributes to the differences, for each other design; a text for
            another robot.
        limits: what limits each design.
        alone: findings that not all designs have.
    """

    summary: TextTable
    metrics: TextTable
    shares: tuple[TextTable | str, ...]
    limits: TextTable
    alone: tuple[str, ...]


def section(found: DesignComparison, of: Sequence[str] = ()) -> Section:
    """Tables of a comparison.

    Args:
        found: the comparison.
        of: metrics that are divided and whose limits are told; empty for the usual ones.
    """
    titles = [name.rpartition(":")[2] for name in found.names]
    titles = titles if len({*titles}) == len(titles) else list(found.names)
    divided = [k for name in of or USUAL for k, one in enumerate(found.metrics) if one == name]
    known = [
        k
        for k, name in enumerate(found.metrics)
        if name in of or not np.isnan(found.values[:, k]).all()
    ]
    shares = tuple(
        _another(titles[0], title) if part is None else _shares(found, part, divided, titles, title)
        for title, part in zip(titles[1:], found.parts, strict=True)
    )
    alone = tuple(
        f"{title} alone: {message}"
        for title, messages in zip(titles, found.findings, strict=True)
        for message in messages
    )
    return Section(
        summary=_metrics(found, titles, divided, len(titles) == 2),
        metrics=_metrics(found, titles, known, False),
        shares=shares,
        limits=_limits(found, titles, of),
        alone=alone,
    )


def _another(first: str, other: str) -> str:
    text = "another robot, so no number of one is one of the other"
    return f"from {first} to {other}: {text}"


def _metrics(
    found: DesignComparison, titles: Sequence[str], chosen: Sequence[int], largest: bool
) -> TextTable:
    """Values of metrics, the probability that each other design is better, and largest shares."""
    known = [(t, p) for t, p in zip(titles[1:], found.parts, strict=True) if p is not None]
    rows = []
    for k in chosen:
        metric = find(found.metrics[k])
        cells = [metric.name, metric.unit.removeprefix("1")]
        cells += [value_text(x) for x in found.values[:, k]]
        for _, part in known:
            cells += [odds_text(part.better[k]), *[_largest(part, k)] * largest]
        rows.append(tuple(cells))
    heads = [(f"{title} better", *["largest shares"] * largest) for title, _ in known]
    head = ("metric", "", *titles, *(word for words in heads for word in words))
    return TextTable("", head, tuple(rows))


def _shares(
    found: DesignComparison, part: Part, chosen: list[int], titles: Sequence[str], title: str
) -> TextTable:
    """What each number contributes to the differences of some metrics."""
    total = part.shares.sum(axis=0)
    larger = np.nan_to_num(np.abs(part.shares).max(axis=0, initial=0.0))[chosen]
    rows, small = [], []
    for i, name in enumerate(part.names):
        own = part.shares[i, chosen]
        if not (np.abs(np.nan_to_num(own)) > _SMALL * larger).any():
            small.append(name)
            continue
        cells = ("" if not x else signed(x) for x in own)
        rows.append((_short(name), part.before[i], part.after[i], *cells))
    notes = []
    if small:
        notes.append(f"without effect on these: {', '.join(small)}")
    if not part.exact:
        notes.append("shares of many numbers, by samples of their orders")
    changes = (f"{found.metrics[k]}\n{signed(total[k])}" for k in chosen)
    heading = f"from {titles[0]} to {title}"
    return TextTable(heading, ("number", "from", "to", *changes), tuple(rows), "\n".join(notes))


def _largest(part: Part, k: int) -> str:
    """The numbers that contribute most to the difference of a metric."""
    own = np.nan_to_num(part.shares[:, k])
    order = np.argsort(-abs(own), kind="stable")[:_NAMED]
    most = abs(own).max(initial=0.0)
    named = [i for i in order if abs(own[i]) > _SMALL * most]
    return ", ".join(f"{_short(part.names[i])} {signed(float(own[i]))}" for i in named)


def _limits(found: DesignComparison, titles: Sequence[str], of: Sequence[str]) -> TextTable:
    """What limits each design in the capabilities that are the smallest of several numbers."""
    rows = []
    for name in of or LIMITED:
        for title, own in zip(titles, found.limits, strict=True):
            if name not in own or name not in found.metrics:
                continue
            first, *others = own[name]
            unit = find(name).unit.removeprefix("1")
            value = found.values[titles.index(title), found.metrics.index(name)]
            cells = (limit_text(one, own[name]) for one in (first, *others[:1]))
            now, *after = cells
            more = f"{after[0]}, {value_text(others[0].value)} {unit}".rstrip() if after else ""
            rows.append((name, title, f"{value_text(value)} {unit}".rstrip(), now, more))
    head = ("metric", "design", "value", "limit", "next limit, and what it allows")
    return TextTable("what limits each", head, tuple(rows))


def limit_text(limit: Limit, among: Sequence[Limit]) -> str:
    """Joints, quantity and actuator of a limit, among all of the capability."""
    joints = where(limit, among)
    place = f"{joints}: " if joints else ""
    return f"{place}{limit.quantity}" + (f" ({limit.actuator})" if limit.actuator else "")


def value_text(x: float) -> str:
    """Text of the value of a metric."""
    if math.isnan(x):
        return "-"
    return "no limit" if math.isinf(x) else brief(x)


def odds_text(share: float) -> str:
    """Text of a probability; "" for none."""
    if math.isnan(share):
        return ""
    if 0.005 <= share <= 0.995:
        return f"{100 * share:.0f} %"
    return "> 99 %" if share > 0.5 else "< 1 %"


def _short(name: str) -> str:
    return name.removeprefix("actuators.")
