"""Search for the nearest design that meets conditions in closed form.

The change of a design is the root mean square of the changes of its numbers, each as a share of
its range. Designs are drawn around the given one in rising distance, the nearest that meet all
conditions are kept, and the search shrinks around them; all by arrays, so that kinks of metrics
and of the filter are no obstacle. Equal seeds give equal solutions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import yaml

from draft.design import Design
from draft.explore.goals import Constraint
from draft.explore.sensitivity import stated_numbers
from draft.metrics import LEARNED, find, of_design
from draft.values import Array, Value, scalar, told_apart
from draft.variation.axes import Axis

_FIRST, _EACH = 8192, 2048  # Designs of the first look, and of each round.
_FEWER = 32  # This many times fewer where a metric takes thousands of poses of each design.
_ROUNDS, _SHRINK = 24, 0.72
MARK = "Nearest to"  # Begins the description of a design file that a search wrote.
_BEST = 8  # Solutions that a round searches around.
_TIDY = 1.01  # A change may grow by this for fewer numbers that change.
_LARGER = np.array([1.0, 1.0003, 1.001, 1.003, 1.01, 1.03])
_REPAIRS = 8  # Rounds towards designs that meet more.


@dataclass(frozen=True)
class Moved:
    """A number that had to change.

    Attributes:
        name: the number.
        before, after: its values, in its unit.
        why: conditions that fail where it keeps its value, with what they would be.
    """

    name: str
    before: float
    after: float
    why: tuple[str, ...]


@dataclass(frozen=True)
class Conflict:
    """Conditions that no design of the ranges meets together.

    Attributes:
        conditions: a smallest set: the search meets each of its parts.
        misses: conditions that the design that misses least does not meet, with what it reaches.
    """

    conditions: tuple[str, ...]
    misses: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Solution:
    """What a search for the nearest design found.

    Attributes:
        design: the design that meets all conditions, or else that which misses least.
        change: its change, see above; 0 where the given design meets all.
        moved: the numbers that changed, the largest changes first.
        conflict: why no design meets all; None where one does.
        tried: designs that were computed.
        rollouts: roll-outs for learned conditions.
        notes: sentences on them.
    """

    design: Design
    change: float
    moved: tuple[Moved, ...]
    conflict: Conflict | None
    tried: int
    rollouts: int = 0
    notes: tuple[str, ...] = ()

    def record(self) -> dict[str, Any]:
        """Plain data."""
        conflict = self.conflict
        return {
            "met": conflict is None,
            "change": self.change,
            "moved": [
                {"name": one.name, "from": one.before, "to": one.after, "why": list(one.why)}
                for one in self.moved
            ],
            "excluded_together": [] if conflict is None else list(conflict.conditions),
            "misses": [] if conflict is None else list(conflict.misses),
            "designs_computed": self.tried,
            **({"rollouts": self.rollouts, "notes": list(self.notes)} if self.rollouts else {}),
        }

    def design_file(self, start: Design, conditions: Sequence[str]) -> str:
        """Text of the design file: the values, and above them why each number moved."""
        doc = f"{MARK} {start.reference} with {', '.join(conditions)}."
        lines = []
        for one in self.moved:
            why = f"; else {'; '.join(one.why)}" if one.why else ""
            lines.append(f"# {one.name}: {' -> '.join(told_apart(one.before, one.after))}{why}")
        values = dict(start.values) | {one.name: one.after for one in self.moved}
        document = {"doc": doc, "values": values}
        text = yaml.safe_dump(document, sort_keys=False, allow_unicode=True, width=1000)
        return "\n".join([*lines, text])


class Search:
    """Search for the nearest design; numbers are shares of their ranges from the given ones."""

    def __init__(
        self,
        design: Design,
        conditions: tuple[Constraint, ...],
        axes: tuple[Axis, ...],
        rng: np.random.Generator,
    ) -> None:
        self._design, self._conditions, self._axes, self._rng = design, conditions, axes, rng
        known = stated_numbers(design)
        self._start = np.array([known[axis.name] for axis in axes])
        self._low, self._high = (
            np.array([getattr(a, end) for a in axes]) for end in ("low", "high")
        )
        self._size = self._high - self._low
        self._metrics = sorted(
            {name for one in conditions for name in one.holds.metrics if name not in LEARNED}
        )
        fewer = _FEWER if any(find(name).sampled for name in self._metrics) else 1
        self._first, self._each = _FIRST // fewer, _EACH // fewer
        self.tried = 0

    def run(self) -> Solution:
        """Search, and explain."""
        if not self._violations(np.zeros((1, len(self._axes)))).any():
            return Solution(self._design, 0.0, (), None, self.tried)
        best, violation = self._nearest(self._conditions)
        conflict = None
        if violation.any():
            conflict = Conflict(self._smallest(), self._misses(best))
        else:
            best = self._tidied(best)
        found = self._resolved(best)
        change = float(np.sqrt(np.mean(best**2)))
        return Solution(found, change, self._moved(best, conflict is None), conflict, self.tried)

    def _nearest(self, conditions: Sequence[Constraint]) -> tuple[Array, Array]:
        """Nearest design that meets conditions, or that which misses least; and its violations."""
        count = len(self._axes)
        spread = (
            self._rng.uniform(-1, 1, (self._first, count))
            * self._rng.uniform(0, 1, (self._first, 1)) ** 2
        )
        box = self._low + self._rng.random((self._first // 2, count)) * self._size
        drawn = np.concatenate(
            [np.zeros((1, count)), self._inside(spread), (box - self._start) / self._size]
        )
        violation = self._violations(drawn, conditions)
        for k in range(_REPAIRS):
            if not violation.sum(axis=1).min():
                break
            # No design meets all: look around those that miss least.
            order = np.argsort(violation.sum(axis=1), kind="stable")[:64]
            around = np.repeat(drawn[order], self._each // 64, axis=0)
            more = self._inside(around + self._rng.normal(0, 0.25 * 0.6**k, around.shape))
            drawn = np.concatenate([drawn[order], more])
            violation = np.concatenate([violation[order], self._violations(more, conditions)])
        miss = violation.sum(axis=1)
        if miss.min() > 0:
            least = int(miss.argmin())
            return drawn[least], violation[least]
        kept = self._kept(drawn[miss == 0])
        width = 0.3
        for _ in range(_ROUNDS):
            around = np.repeat(kept, -(-self._each // len(kept)), axis=0)
            # Towards the given design, and aside.
            pull = self._rng.random((len(around), 1)) ** 2
            aside = self._rng.normal(0, width, around.shape) * np.linalg.norm(kept[0])
            aside *= self._rng.random(around.shape) < 0.6
            more = self._inside(around * (1 - width * pull) + aside)
            nearer = (more**2).sum(axis=1) < (kept[0] ** 2).sum()
            if nearer.any():
                more = more[nearer]
                met = more[self._violations(more, conditions).sum(axis=1) == 0]
                kept = self._kept(np.concatenate([kept, met]))
            width *= _SHRINK
        return kept[0], np.zeros(len(conditions))

    def _kept(self, drawn: Array) -> Array:
        """The nearest designs."""
        return drawn[np.argsort((drawn**2).sum(axis=1), kind="stable")[:_BEST]]

    def _inside(self, drawn: Array) -> Array:
        """Designs within the ranges; the given one may lie outside them."""
        low, high = ((end - self._start) / self._size for end in (self._low, self._high))
        return np.clip(drawn, np.minimum(low, 0.0), np.maximum(high, 0.0))

    def _values(self, drawn: Array) -> dict[str, Value]:
        values = self._start + drawn * self._size
        return {axis.name: values[:, i] for i, axis in enumerate(self._axes)}

    def _violations(self, drawn: Array, conditions: Sequence[Constraint] | None = None) -> Array:
        """Violation of each condition by designs, shape (designs, conditions)."""
        chosen = self._conditions if conditions is None else conditions
        self.tried += len(drawn)
        many = self._design.spec.resolve(self._design.values, self._values(drawn))
        with np.errstate(all="ignore"):
            found = of_design(many, self._metrics)
            rows = [self._violation(one, drawn, many, found) for one in chosen]
        return np.stack([np.broadcast_to(row, len(drawn)) for row in rows], axis=1)

    def _violation(
        self, one: Constraint, drawn: Array, many: Design, found: Mapping[str, Value]
    ) -> Array:
        """Violation of a condition by designs, shape (designs,)."""
        del drawn
        if one.text == "accepted":
            return np.where(many.accepted, 0.0, 1.0)
        return one.violation(many, found)

    def _tidied(self, best: Array) -> Array:
        """The solution without changes that hardly matter, the others a little larger for it."""
        most, before = _TIDY * np.linalg.norm(best), None
        while before is None or (best != before).any():  # One less may make another needless.
            before = best
            for i in np.argsort(abs(best)):
                if not best[i]:
                    continue
                fewer = best.copy()
                fewer[i] = 0.0
                drawn = self._inside(fewer * _LARGER[:, None])
                drawn = drawn[np.linalg.norm(drawn, axis=1) <= most]
                if not len(drawn):
                    continue
                met = self._violations(drawn).sum(axis=1) == 0
                if met.any():
                    best = drawn[met.argmax()]
        return best

    def _resolved(self, best: Array) -> Design:
        own = {name: float(np.asarray(x)[0]) for name, x in self._values(best[None]).items()}
        moved = {
            axis.name: own[axis.name] for axis, x in zip(self._axes, best, strict=True) if x != 0
        }
        return self._design.spec.resolve(self._design.values, moved)

    def _moved(self, best: Array, meets: bool) -> tuple[Moved, ...]:
        """Numbers that changed, and which conditions fail without the change."""
        changed = [i for i in np.argsort(-abs(best)) if best[i] != 0]
        if not changed:
            return ()
        rows = np.repeat(best[None], len(changed), axis=0)
        rows[np.arange(len(changed)), changed] = 0.0
        failed = self._violations(rows) > 0
        after = self._start + best * self._size
        found = []
        for row, i in enumerate(changed):
            without = self._resolved(rows[row])
            why = tuple(
                self._reached(one, without, rows[row])
                for one, fails in zip(self._conditions, failed[row], strict=True)
                if fails and meets
            )
            found.append(Moved(self._axes[i].name, float(self._start[i]), float(after[i]), why))
        return tuple(found)

    def _misses(self, best: Array) -> tuple[str, ...]:
        design = self._resolved(best)
        violation = self._violations(best[None])[0]
        pairs = zip(self._conditions, violation, strict=True)
        return tuple(self._reached(one, design, best) for one, miss in pairs if miss > 0)

    def _reached(self, one: Constraint, design: Design, drawn: Array) -> str:
        """A condition, with what a design reaches in its place."""
        if one.text == "accepted":
            errors = dict.fromkeys(f.id for f in design.findings if f.severity == "error")
            return f"the filter refuses it: {', '.join(errors)}"
        if one.gap is None:
            return one.text
        left = one.text.split("<")[0].split(">")[0].strip()
        values = [
            scalar(side.value(design, self._measured(design, drawn, side.metrics)))
            for side in one.gap
        ]
        if one.gap[0].expression.text.strip() != left:
            values.reverse()
        return f"{one.text}, and it is {told_apart(values[1], values[0])[1]}"

    def _measured(self, design: Design, drawn: Array, names: Sequence[str]) -> Mapping[str, Value]:
        del drawn
        return of_design(design, names)

    def _smallest(self) -> tuple[str, ...]:
        """A smallest set of conditions that exclude each other."""
        left = list(self._conditions)
        for one in self._conditions:
            rest = [other for other in left if other is not one]
            if rest and self._nearest(rest)[1].any():
                left = rest
        return tuple(one.text for one in left)
