"""Quantiles of metrics over the errors of the laws: `q10(jump_height)` in a condition or a goal.

All designs have the same samples of the errors (common random numbers), so that two designs differ
in their values alone.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from draft.design import Design
from draft.design.error_samples import sample_errors
from draft.errors import DraftError, Location, Problem
from draft.values import Array, Value, is_array

SAMPLES = 64
_ROWS = 200_000  # Designs that are resolved at once, for the memory.
_CALL = re.compile(r"(?<![\w.])q(\d\d)\s*\(")
_NAME = "quantile_{}"


@dataclass(frozen=True, slots=True)
class Quantile:
    """A quantile of an expression over the errors of the laws.

    Attributes:
        name: name that stands for it in the expression around it.
        share: 0.1 for `q10`.
        value: the expression inside, of N designs.
    """

    name: str
    share: float
    value: Callable[[Design], Value]

    def of(self, design: Design) -> Value:
        """The quantile for one design, or for N, shape (N,); NaN where the expression has none."""
        count = design.count or 1
        first = design if design.count is None else design[0]
        errors = sample_errors(first, SAMPLES)
        arrays = {name: x for name, x in design.values.items() if is_array(x)}
        each = max(1, min(SAMPLES, _ROWS // count))
        rows: list[Array] = []
        for start in range(0, SAMPLES, each):
            chosen = np.arange(start, min(start + each, SAMPLES))
            tiled = {name: np.tile(np.asarray(x), len(chosen)) for name, x in arrays.items()}
            own = errors.of(np.repeat(chosen, count))
            many = design.spec.resolve({**design.values, **tiled}, errors=own)
            found = np.broadcast_to(np.asarray(self.value(many), float), many.count or 1)
            rows.append(found.reshape(len(chosen), count))
        table = np.concatenate(rows)
        found = np.sort(table, axis=0)  # NaN last, so that a quantile of such is NaN or careful.
        place = self.share * (SAMPLES - 1)
        low = int(place)
        above = found[min(low + 1, SAMPLES - 1)]
        with np.errstate(invalid="ignore"):
            step = np.where(above == found[low], 0.0, above - found[low])
        result = found[low] + (place - low) * step
        return result if design.count is not None else float(result[0])


def split(
    text: str, read: Callable[[str, int], Callable[[Design], Value]], where: Location
) -> tuple[str, tuple[Quantile, ...]]:
    """Replace quantiles in a text by names of the same length or longer.

    Args:
        text: an expression.
        read: reads the expression inside, and its place in the text.
        where: place of the text, for messages.

    Raises:
        DraftError: a parenthesis is not closed, or a quantile is within another.
    """
    found: list[Quantile] = []
    while (match := _CALL.search(text)) is not None:
        end = _closing(text, match.end() - 1)
        if end is None:
            at = Location(where.file, where.line, match.start() + 1)
            raise DraftError(Problem(f"'{match[0]}' is not closed", at, "close its parenthesis"))
        inside = text[match.end() : end]
        if _CALL.search(inside):
            at = Location(where.file, where.line, match.start() + 1)
            cause = "a quantile cannot be within another"
            raise DraftError(Problem(cause, at, "take it out"))
        name = _NAME.format(len(found))
        found.append(Quantile(name, int(match[1]) / 100, read(inside, match.end())))
        text = text[: match.start()] + name + text[end + 1 :]
    return text, tuple(found)


def _closing(text: str, start: int) -> int | None:
    """Place of the parenthesis that closes the one at `start`."""
    depth = 0
    for i in range(start, len(text)):
        depth += (text[i] == "(") - (text[i] == ")")
        if not depth:
            return i
    return None


def names(found: Sequence[Quantile]) -> set[str]:
    """Names that stand for quantiles."""
    return {one.name for one in found}
