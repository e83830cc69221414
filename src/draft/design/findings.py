"""Findings of the design filter."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from draft.design.checks import is_error
from draft.design.reuse import Reuse
from draft.errors import listed
from draft.values import Mask, Value, brief, scalar, some

_NAME = re.compile(r"'[^']*'")
T = TypeVar("T")


@dataclass(frozen=True, slots=True, repr=False)
class Finding:
    """A finding of the design filter: an error refuses the design, a warning does not.

        >>> design = draft.load("quadruped").resolve({"actuators.leg.peak_torque": 5000})
        >>> [finding.id for finding in design.findings if finding.severity == "error"]
        ['torque', 'torque_density', 'power_density', 'actuator_overlap']

    Attributes:
        id: kind of the finding, see `draft.design.checks.kinds`.
        severity: "error" (refuses the design) or "warning".
        where: actuator class, body, or pair of bodies.
        text: the message, with the placeholders {value} and {limit}.
        value: the number.
        limit: its limit.
        unit: unit of both.
        source: source of the limit.
        mask: designs that the finding holds for, shape (N,); True for a single design.
        allowed: entry of `allow` that makes a warning of the error.
    """

    id: str
    severity: str
    where: str
    text: str
    value: Value | None
    limit: Value | None
    unit: str
    source: str
    mask: Mask
    allowed: str | None = None

    def __repr__(self) -> str:
        head = f"{self.severity} '{self.id}:{self.where}'"
        if isinstance(self.mask, np.ndarray):
            head += f" of {np.count_nonzero(self.mask)} of {len(self.mask)} designs"
        return f"Finding({head}: {self.message})"

    @property
    def message(self) -> str:
        """Message with its numbers; for many designs with their ranges."""
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        return self.text.format(
            value=self._text(self.value) + unit, limit=self._text(self.limit) + unit
        )

    @property
    def remedy(self) -> str:
        """How to accept an error as a warning; "" if that is impossible."""
        if self.severity != "error" or self.id == "not_physical":
            return ""
        return f"to allow it, add '{self.id}:{self.where}' to 'allow' in parameters.yaml"

    def record(self) -> dict[str, Any]:
        """Plain data for a report of one design."""
        return {
            "id": self.id,
            "severity": self.severity,
            "where": self.where,
            "message": self.message,
            "value": self.value,
            "limit": self.limit,
            "unit": self.unit,
            "source": self.source,
            "allowed_by": self.allowed,
            "remedy": self.remedy,
        }

    def _text(self, value: Value | None) -> str:
        """Text of a number; of N designs its range over those of the mask."""
        if value is None:
            return ""
        if isinstance(value, np.ndarray) and isinstance(self.mask, np.ndarray):
            value = value[self.mask]
        return brief(value)


def note(
    kind: str,
    where: str,
    mask: Mask,
    text: str,
    source: str,
    value: Value | None = None,
    limit: Value | None = None,
    unit: str = "",
) -> Iterator[Finding]:
    """Yield a finding if it holds for any design."""
    if not some(mask):
        return
    severity = "error" if is_error(kind) else "warning"
    yield Finding(kind, severity, where, text, value, limit, unit, source, mask)


def each(
    check: str, find: Callable[[T], Iterable[Finding]], parts: Iterable[T], reuse: Reuse
) -> Iterator[Finding]:
    """Findings of a check of each part of a design alone; those of parts that stayed are known.

    Args:
        check: name of the check.
        find: it, of one part.
        parts: the parts.
        reuse: results of the last design.
    """
    for k, part in enumerate(parts):
        yield from reuse.result(("check", check, k), lambda part: [*find(part)], part)


def grouped(findings: Iterable[Finding]) -> list[Finding]:
    """Findings of one design for people, errors first.

    Warnings of one kind and class of parts become one: that with the largest value per limit, with
    the places of the others. Each error stays, as each is allowed at its own place.
    """
    groups: dict[tuple[str, ...], list[Finding]] = {}
    for one in findings:
        kind = one.where if one.severity == "error" else _NAME.sub("''", one.text)
        groups.setdefault((one.severity, one.id, kind, one.allowed or ""), []).append(one)
    found = [_worst(group) for group in groups.values()]
    return sorted(found, key=lambda one: one.severity != "error")


def _worst(group: Sequence[Finding]) -> Finding:
    """Worst of findings that are alike, with the places of the others in its text."""
    worst = max(group, key=_excess)
    others = list(dict.fromkeys(f"'{one.where}'" for one in group if one is not worst))
    if not others:
        return worst
    alike = listed(others).replace("{", "{{").replace("}", "}}")
    return replace(worst, text=f"{worst.text}; {len(others)} more like it: {alike}")


def _excess(finding: Finding) -> float:
    """Size of a value per its limit, either way; of a value without one the value."""
    value, limit = (
        abs(scalar(x)) if x is not None else 0.0 for x in (finding.value, finding.limit)
    )
    return max(value / limit, limit / value) if value and limit else value


def first_error(findings: Iterable[Finding], row: int) -> str:
    """Kind of the first error among the findings of N designs that holds for one; "" for none."""
    errors = (one for one in findings if one.severity == "error" and np.asarray(one.mask)[row])
    return next((one.id for one in errors), "")


def refusal(findings: Iterable[Finding], row: int) -> str:
    """Errors among the findings of N designs that hold for one of them, in a line."""
    wrong = [
        f"{finding.id}:{finding.where}"
        for finding in findings
        if finding.severity == "error" and np.asarray(finding.mask)[row]
    ]
    return f"refused: {', '.join(wrong)}"
