"""The nearest design that meets conditions on learned metrics: a screen first, roll-outs last.

Conditions in closed form and the policy's region are screened first. A batch of designs around the
nearest that meets them is rolled out, and predictions of the learned conditions are fitted
to the results. Each round searches by the predictions, rolls out designs around what it finds and
between there and the given design, and fits again with more weight on near ones. Only designs that
were rolled out are solutions.

All bodies have the same noise, starts and kicks. The given design is rolled out more often, and the
others are judged by their differences from it, in which most of what chance does cancels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.explore.goals import Constraint
from draft.explore.learned_effects import open_policy, silent
from draft.explore.settings import TargetSettings
from draft.explore.solve import Conflict, Search, Solution, by_rollouts
from draft.learn.bodies.features import family_features
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.learned_metrics import walkers
from draft.learn.measuring.paired_metrics import RESAMPLES, paired
from draft.metrics import of_design
from draft.values import Array, Value
from draft.variation.axes import Axis

_INSIDE = "learned.inside"
_PAIRS, _STEP = 12, 0.06  # Of the first batch: pairs of designs, and their change.
_EACH, _ROUNDS = 14, 3  # Bodies of a round; rounds.
_LAST = 3  # Batches of a solution with one number as it was.
_BASE = 16  # Roll-outs of the given design, over those of others.
_SURE = 1.645  # Standard deviations that a normal number exceeds in 5 % of cases.
_NOISE = 1e-2  # Standard deviation of a gap by roll-outs, over that of its slopes.
_NEAR = 0.25  # Least distance over which predictions are fitted.
_WIDTH, _SHRINK = 0.3, 0.6  # Of a round's designs around its target, over its change.
_PULLS = (1.0, 1.08, 0.92, 1.2, 0.84, 0.7)
_WORST = 1.0  # Gap of a robot that falls.
_ONLY_FIRST = np.array([0])


class _Rolled(NamedTuple):
    """Designs that were rolled out, one row each.

    Attributes:
        drawn: their numbers, shape (N, numbers).
        gap: gap of each learned condition, above zero where it is not met, shape (N, conditions).
        deviation: standard deviation of the gap by chance, same shape.
        closed: violation of the conditions in closed form, shape (N,).
        values: learned metrics, shape (N, metrics).
    """

    drawn: Array
    gap: Array
    deviation: Array
    closed: Array
    values: Array


class RolledOutSearch(Search):
    """Search of which some conditions need roll-outs."""

    def __init__(
        self,
        design: Design,
        conditions: tuple[Constraint, ...],
        axes: tuple[Axis, ...],
        rng: np.random.Generator,
        settings: TargetSettings,
        seed: int,
    ) -> None:
        super().__init__(design, conditions, axes, rng)
        self._source = open_policy(design, settings)
        self._report = settings.progress or silent
        self._rollouts = BodyRollOuts.of({"replicas": settings.replicas, "seed": seed})
        self._learned = tuple(one for one in conditions if by_rollouts(one))
        self._closed = tuple(one for one in conditions if one not in self._learned)
        named = {name for one in self._learned for name in one.holds.metrics}
        self._names = (*sorted(named - {*self._metrics, _INSIDE}), _INSIDE)
        self._outside = self._source.warning(legged_robot(design))
        self._done, self._base, self._own = 0, {}, {}
        count = len(axes)
        self._rolled: _Rolled | None = None
        self._seen = np.zeros((0, count)), np.zeros((0, len(self._source.region.low)))
        self._fits: tuple[Array, ...] = ()

    def run(self) -> Solution:
        """Search, and explain."""
        zero = np.zeros((1, len(self._axes)))
        centre, violation = zero[0], self._violations(zero, self._closed)
        if violation.any():
            centre, violation = self._nearest(self._closed)
            if violation.any():  # No roll-out can help.
                return Search(self._design, self._closed, self._axes, self._rng).run()
        first = np.concatenate([zero, centre[None] if centre.any() else zero[:0]])
        rolled = self._roll(np.concatenate([first, self._spread(centre)]))
        if np.isnan(rolled.values[0]).any():
            missing = [
                name for name, x in zip(self._names, rolled.values[0], strict=True) if np.isnan(x)
            ]
            cause = f"{self._design.reference} has no {', '.join(missing)}: it falls"
            raise DraftError(cause, "start from a design that walks")
        if not rolled.closed[0] and (rolled.gap[0] <= 0).all():
            return self._solution(zero[0], None)
        target = centre
        for k in range(_ROUNDS):
            best = self._best()
            centre = self._least() if best is None else best
            self._predict_around(centre)
            target, violation = self._nearest(self._conditions)
            if not violation.any():
                target = self._tidied(target)
            self._roll(self._around(target, centre, _WIDTH * _SHRINK**k))
        best = self._best()
        if best is None:
            known = tuple(one.text for one in self._conditions if one.text != "accepted")
            least = self._least()
            together = self._smallest() if violation.any() else known
            return self._solution(least, Conflict(together, self._misses(least)))
        for _ in range(_LAST):
            changed = np.flatnonzero(best)
            without = np.repeat(best[None], len(changed), axis=0)
            without[np.arange(len(changed)), changed] = 0.0
            self._roll(without[self._places(without) < 0])
            nearer = self._best()
            if nearer is None or np.array_equal(nearer, best):
                break
            best = nearer
        return self._solution(best, None)

    def _solution(self, best: Array, conflict: Conflict | None) -> Solution:
        notes = ()
        if self._outside:
            notes = (f"the learned metrics are of a design {self._outside}",)
        return Solution(
            design=self._resolved(best) if best.any() else self._design,
            change=float(np.sqrt(np.mean(best**2))),
            moved=self._moved(best, conflict is None),
            conflict=conflict,
            tried=self.tried,
            rollouts=self._done,
            notes=notes,
        )

    def _spread(self, centre: Array) -> Array:
        """Pairs of designs on both sides of one, that tell the slopes best: orthogonal columns."""
        count = max(_PAIRS, len(centre) + 1)
        turned = np.linalg.qr(self._rng.normal(size=(count, count)))[0][:, : len(centre)]
        step = _STEP * np.sqrt(count) * turned[:_PAIRS]
        drawn = self._inside(centre + np.concatenate([step, -step]))
        accepted = self._violations(drawn, self._closed)[:, -1] == 0
        drawn = np.where(accepted[:, None], drawn, centre + (drawn - centre) / 2)
        self._walking(drawn)  # Their features tell where the region ends.
        return drawn

    def _around(self, target: Array, centre: Array, width: float) -> Array:
        """Designs of a round: around a target, and between a known design and the given one."""
        rows = [target * pull for pull in _PULLS]
        rows += [centre * pull for pull in (0.95, 0.85, 0.7)] + [(centre + target) / 2]
        rows = [row for row in rows if row.any()]
        scale = np.sqrt(np.mean(target**2))
        shape = (2 * _EACH, len(target))
        for middle in (target, centre):
            aside = self._rng.normal(0, width, shape) * np.maximum(abs(middle), scale / 2)
            rows += [*(middle + aside * (self._rng.random(shape) < 0.5))]
        drawn = self._walking(self._screened(self._inside(np.array(rows))))
        drawn = drawn[np.sort(np.unique(drawn, axis=0, return_index=True)[1])]
        drawn = drawn[self._places(drawn) < 0]
        first, rest = drawn[: _EACH // 2], drawn[_EACH // 2 :]
        return np.concatenate([first, self._rng.permutation(rest)[: _EACH - len(first)]])

    def _screened(self, drawn: Array) -> Array:
        """Designs that meet the conditions in closed form; if none does, that are accepted."""
        violation = self._violations(drawn, self._closed)
        met = violation.sum(axis=1) == 0
        return drawn[met if met.any() else violation[:, -1] == 0]  # `accepted` is the last.

    def _walking(self, drawn: Array) -> Array:
        """Designs that the policy drives, in its region if the given one is."""
        many = self._design.spec.resolve(self._design.values, self._values(drawn))
        members, _ = walkers(self._source, many, None)
        if not members:
            return drawn[:0]
        own = np.array(family_features(tuple(members.values())))
        rows = np.array([*members])
        seen = zip(self._seen, (drawn[rows], own), strict=True)
        drawn_before, own_before = (np.concatenate(pair) for pair in seen)
        self._seen = drawn_before, own_before
        region, match = self._source.region, self._source.match
        inside = [
            bool(self._outside) or region.includes(one, features, match(one).joints)
            for one, features in zip(members.values(), own, strict=True)
        ]
        return drawn[rows[inside]]

    def _roll(self, drawn: Array) -> _Rolled:
        """Roll out designs, and add them to those of before; the given one is the first of all."""
        if not len(drawn):
            return self._known
        many = self._design.spec.resolve(self._design.values, self._values(drawn))
        found = paired(self._source, many, self._names, self._rollouts, self._report)
        self._done += found.rollouts
        if not self._base:
            more = {"replicas": _BASE * self._rollouts.replicas, "seed": self._rollouts.seed}
            base = paired(self._source, many, self._names, BodyRollOuts.of(more), rows=_ONLY_FIRST)
            self._done += base.rollouts
            for name in self._names:
                self._base[name] = base.values[name][0], base.resampled[name][:, 0]
                self._own[name] = found.values[name][0], found.resampled[name][:, 0]
        values = {n: x + self._base[n][0] - self._own[n][0] for n, x in found.values.items()}
        again = {
            n: x + (self._base[n][1] - self._own[n][1])[:, None] for n, x in found.resampled.items()
        }
        closed = of_design(many, self._metrics)

        def gaps(learned: dict[str, Array]) -> Array:
            each = [self._gap(one, many, {**closed, **learned}) for one in self._learned]
            return np.stack(each, axis=1)

        spread = np.std([gaps({n: x[k] for n, x in again.items()}) for k in range(RESAMPLES)], 0)
        more_rows = _Rolled(
            drawn,
            gaps(values),
            spread,
            self._violations(drawn, self._closed).sum(axis=1),
            np.stack([values[name] for name in self._names], axis=1),
        )
        if self._rolled is not None:
            pairs = zip(self._rolled, more_rows, strict=True)
            more_rows = _Rolled(*(np.concatenate(pair) for pair in pairs))
        self._rolled = more_rows
        return more_rows

    def _gap(self, one: Constraint, many: Design, metrics: Mapping[str, Value]) -> Array:
        """Smaller less larger side of a condition, over the larger; 1 where it is undefined."""
        with np.errstate(all="ignore"):
            if one.gap is None:
                gap = np.where(one.holds.holds(many, metrics), -1.0, 1.0)
            else:
                small, large = (np.asarray(side.value(many, metrics)) for side in one.gap)
                gap = (small - large) / np.maximum(np.maximum(abs(small), abs(large)), 1e-9)
        gap = np.broadcast_to(gap, (many.count or 1,))
        return np.clip(np.where(np.isnan(gap), _WORST, gap), -_WORST, _WORST)

    @property
    def _known(self) -> _Rolled:
        if self._rolled is None:
            raise RuntimeError("nothing was rolled out")
        return self._rolled

    @property
    def _sure(self) -> Array:
        """Gaps that the designs rolled out so far exceed in 5 % of cases, shape as `gap`."""
        known = self._known
        # The deviation of one body by few roll-outs may be too small by chance.
        return known.gap + _SURE * np.maximum(known.deviation, np.median(known.deviation, axis=0))

    def _best(self) -> Array | None:
        """The nearest design that meets all conditions, of those that were rolled out."""
        known = self._known
        sure = (self._sure <= 0).all(axis=1) & (known.closed == 0)
        if not sure.any():
            return None
        met = known.drawn[sure]
        return met[np.argmin((met**2).sum(axis=1))]

    def _least(self) -> Array:
        """The design that misses least, of those that were rolled out."""
        known = self._known
        miss = np.maximum(self._sure, 0).sum(axis=1) + known.closed
        return known.drawn[miss.argmin()]

    def _predict_around(self, centre: Array) -> None:
        """Fit gaps, and features of the policy's region, as functions of the numbers."""
        known = self._known
        pairs = ((known.drawn, known.gap), self._seen)
        self._fits = tuple(_fitted(drawn, values, centre) for drawn, values in pairs)

    def _violation(
        self, one: Constraint, drawn: Array, many: Design, found: Mapping[str, Value]
    ) -> Array:
        if one not in self._learned:
            return super()._violation(one, drawn, many, found)
        known, place = self._known, self._learned.index(one)
        inputs = _inputs(drawn)
        gap = inputs @ self._fits[0][:, place] + _SURE * np.median(known.deviation[:, place])
        if not self._outside:
            low, high = np.array(self._source.region.low), np.array(self._source.region.high)
            features = inputs @ self._fits[1]
            beyond = np.maximum(features - high, low - features) / np.maximum(high - low, 1e-9)
            gap = np.maximum(gap, beyond.max(axis=1, initial=-1.0))
        at = self._places(drawn)
        return np.maximum(np.where(at >= 0, self._sure[at, place], gap), 0.0)

    def _places(self, drawn: Array) -> NDArray[np.intp]:
        """Place of each design among those that were rolled out; -1 for others."""
        rows = {row.tobytes(): i for i, row in enumerate(self._known.drawn + 0.0)}
        return np.array([rows.get(row.tobytes(), -1) for row in drawn + 0.0], dtype=np.intp)

    def _reached(self, one: Constraint, design: Design, drawn: Array) -> str:
        at = self._places(drawn[None])[0]
        if one not in self._learned or at < 0:
            return one.text if one in self._learned else super()._reached(one, design, drawn)
        text = super()._reached(one, design, drawn)
        if one.gap is None:
            return text
        sides = [
            abs(float(np.asarray(x.value(design, self._measured(design, drawn, x.metrics)))))
            for x in one.gap
        ]
        chance = _SURE * self._known.deviation[at, self._learned.index(one)] * max(sides)
        return f"{text} ± {chance:.2g}"

    def _measured(self, design: Design, drawn: Array, names: Sequence[str]) -> Mapping[str, Value]:
        closed = of_design(design, [name for name in names if name not in self._names])
        values = self._known.values[self._places(drawn[None])[0]].tolist()
        return {**closed, **dict(zip(self._names, values, strict=True))}


def _inputs(drawn: Array) -> Array:
    """Inputs of predictions: one, the numbers, and the square of the change."""
    return np.column_stack([np.ones(len(drawn)), drawn, (drawn**2).sum(axis=1)])


def _fitted(drawn: Array, values: Array, centre: Array) -> Array:
    """Coefficients of the inputs, with more weight on designs near one, shape (inputs, values)."""
    away = ((drawn - centre) ** 2).sum(axis=1)
    weight = np.exp(-away / max(_NEAR, float(np.linalg.norm(centre))) ** 2 / 2)[:, None]
    inputs = _inputs(drawn)
    prior = _NOISE * np.eye(inputs.shape[1])[1:]
    left = np.concatenate([weight * inputs, prior])
    right = np.concatenate([weight * values, np.zeros((len(prior), values.shape[1]))])
    found: Array = np.linalg.lstsq(left, right, rcond=None)[0].astype(np.float64)
    return found
