"""The nearest design that meets conditions on learned metrics: a screen first, roll-outs last.

Conditions in closed form are screened by arrays. A first batch of designs around the nearest that
meets them is rolled out, and linear predictions of the learned conditions, and of the features
that bound the policy's region, are fitted to the results. Each round searches by the predictions,
rolls out designs around what it finds and between there and the given design, and fits again with
more weight on near ones. Only designs that were rolled out are solutions. All bodies have the same
noise, starts and kicks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.explore.goals import Constraint
from draft.explore.learned_effects import open_policy, quantile, silent
from draft.explore.settings import TargetSettings
from draft.explore.solve import Conflict, Search, Solution, by_rollouts
from draft.learn.bodies.features import family_features
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.paired_metrics import RESAMPLES, paired
from draft.metrics import of_design
from draft.values import Array, Value
from draft.variation.axes import Axis

_INSIDE = "learned.inside"
_FIRST, _EACH, _ROUNDS = 24, 20, 3  # Bodies of the first batch and of each round; rounds.
_LAST = 3  # Batches of a solution with one number as it was.
_SCREENED = 512  # Designs of which the first batch is taken.
_ONE_SIDED = 0.95
_NOISE = 1e-2  # Standard deviation of a gap by roll-outs, over that of its slopes.
_NEAR = 0.1  # Least distance over which predictions are fitted.
_WIDTH, _SHRINK = 0.3, 0.6  # Of a round's designs around its target, over its change.
_PULLS = (1.0, 1.08, 0.92, 1.2, 0.84, 0.7)
_WORST = 1.0  # Gap of a robot that falls.


class _Rolled(NamedTuple):
    """Designs that were rolled out, one row each.

    Attributes:
        drawn: their numbers, shape (N, numbers).
        gap: gap of each learned condition, above zero where it is not met, shape (N, conditions).
        margin: what it has to be below zero by to be sure, same shape.
        closed: violation of the conditions in closed form, shape (N,).
        inside: whether they are in the policy's region, shape (N,).
        features: their features, shape (N, features).
        values: learned metrics, shape (N, metrics).
    """

    drawn: Array
    gap: Array
    margin: Array
    closed: Array
    inside: NDArray[np.bool_]
    features: Array
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
        self._rolled: _Rolled | None = None
        self._fit = np.zeros((0, 0))
        self._done = 0

    def run(self) -> Solution:
        """Search, and explain."""
        zero = np.zeros((1, len(self._axes)))
        centre, violation = zero[0], self._violations(zero, self._closed)
        if violation.any():
            centre, violation = self._nearest(self._closed)
            if violation.any():  # No roll-out can help.
                return Search(self._design, self._closed, self._axes, self._rng).run()
        rolled = self._roll(np.concatenate([zero, centre[None], self._spread(centre)]))
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
            self._predict_around(target if best is None else best)
            target, violation = self._nearest(self._conditions)
            if not violation.any():
                target = self._tidied(target)
            self._roll(self._around(target, best, _WIDTH * _SHRINK**k))
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
        """Accepted designs around one in rising distance, those that meet the conditions first."""
        size = self._rng.uniform(0.05, 0.5, (_SCREENED, 1))
        drawn = self._inside(centre + size * self._rng.uniform(-1, 1, (_SCREENED, len(centre))))
        violation = self._violations(drawn, self._closed)
        met = violation.sum(axis=1) == 0
        accepted = violation[:, -1] == 0  # The last condition, see `solve`.
        for chosen in (met, accepted):
            if chosen.sum() >= _FIRST:
                break
        drawn = drawn[chosen]
        order = np.argsort(((drawn - centre) ** 2).sum(axis=1), kind="stable")
        return drawn[order[np.unique(np.linspace(0, len(order) - 1, _FIRST - 2).astype(int))]]

    def _around(self, target: Array, best: Array | None, width: float) -> Array:
        """Designs of a round that meet the conditions in closed form."""
        rows = [target * pull for pull in _PULLS]
        if best is not None:
            rows += [best * pull for pull in (0.97, 0.92, 0.85)] + [(best + target) / 2]
        aside = self._rng.normal(0, width, (4 * _EACH, len(target))) * (target != 0)
        rows += [*(target * (1 + aside))]
        aside = self._rng.normal(0, width, aside.shape) * np.sqrt(np.mean(target**2))
        rows += [*(target + aside * (self._rng.random(aside.shape) < 0.3))]
        drawn = np.unique(self._inside(np.array(rows)), axis=0, return_index=True)[1]
        drawn = self._inside(np.array(rows))[np.sort(drawn)]
        drawn = drawn[(self._places(drawn) < 0) & drawn.any(axis=1)]
        violation = self._violations(drawn, self._closed)
        met = violation.sum(axis=1) == 0
        chosen = met if met.any() else violation[:, -1] == 0
        fixed = drawn[chosen][: _EACH // 2]
        others = drawn[chosen][_EACH // 2 :]
        return np.concatenate([fixed, self._rng.permutation(others)[: _EACH - len(fixed)]])

    def _roll(self, drawn: Array) -> _Rolled:
        """Roll out designs, and add them to those of before."""
        many = self._design.spec.resolve(self._design.values, self._values(drawn))
        found = paired(self._source, many, self._names, self._rollouts, self._report)
        self._done += found.rollouts
        closed: Mapping[str, Value] = of_design(many, self._metrics)
        gaps = np.array([self._gaps(one, many, closed, found.values) for one in self._learned])
        again = np.array(
            [
                [
                    self._gaps(
                        one, many, closed, {name: x[k] for name, x in found.resampled.items()}
                    )
                    for one in self._learned
                ]
                for k in range(RESAMPLES)
            ]
        )  # (resamples, conditions, N)
        margin = quantile(self._rollouts.replicas, _ONE_SIDED) * again.std(axis=0)
        rows = np.array([*found.members], dtype=np.intp)
        own = family_features(tuple(found.members.values())) if len(rows) else []
        more = _Rolled(
            drawn[rows],
            gaps.T[rows],
            margin.T[rows],
            self._violations(drawn, self._closed).sum(axis=1)[rows],
            found.values[_INSIDE][rows] > 0,
            np.array(own).reshape(len(rows), -1),
            np.array([found.values[name] for name in self._names]).T[rows],
        )
        if self._rolled is not None and len(rows):
            pairs = zip(self._rolled, more, strict=True)
            more = _Rolled(*(np.concatenate(pair) for pair in pairs))
        if len(rows):
            self._rolled = more
        if self._rolled is None:
            raise DraftError("no design of the ranges can be rolled out", "give other ranges")
        return self._rolled

    def _gaps(
        self, one: Constraint, many: Design, closed: Mapping[str, Value], learned: dict[str, Array]
    ) -> Array:
        """Smaller less larger side of a condition, over the larger; 1 where it is undefined."""
        metrics = {**closed, **learned}
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

    def _best(self) -> Array | None:
        """The nearest design that meets all conditions, of those that were rolled out."""
        known = self._known
        sure = ((known.gap + known.margin) <= 0).all(axis=1) & (known.closed == 0)
        sure &= known.inside | bool(self._outside)
        if not sure.any():
            return None
        met = known.drawn[sure]
        return met[np.argmin((met**2).sum(axis=1))]

    def _least(self) -> Array:
        """The design that misses least, of those that were rolled out."""
        known = self._known
        miss = np.maximum(known.gap + known.margin, 0).sum(axis=1) + known.closed
        miss += 0.0 if self._outside else np.where(known.inside, 0.0, _WORST)
        return known.drawn[miss.argmin()]

    def _predict_around(self, centre: Array) -> None:
        """Fit gaps and features as linear functions of the numbers, by designs near one."""
        known = self._known
        away = ((known.drawn - centre) ** 2).sum(axis=1)
        reach = max(_NEAR, 2 * float(np.linalg.norm(centre)))
        weight = np.exp(-away / reach**2 / 2)[:, None]
        inputs = np.column_stack([np.ones(len(known.drawn)), known.drawn])
        outputs = np.column_stack([known.gap, known.features])
        prior = _NOISE * np.eye(inputs.shape[1])[1:]
        left = np.concatenate([weight * inputs, prior])
        right = np.concatenate([weight * outputs, np.zeros((len(prior), outputs.shape[1]))])
        self._fit = np.linalg.lstsq(left, right, rcond=None)[0]

    def _violation(
        self, one: Constraint, drawn: Array, many: Design, found: Mapping[str, Value]
    ) -> Array:
        if one not in self._learned:
            return super()._violation(one, drawn, many, found)
        known, place = self._known, self._learned.index(one)
        columns = len(self._learned)
        predicted = np.column_stack([np.ones(len(drawn)), drawn]) @ self._fit
        gap = predicted[:, place] + np.median(known.margin[:, place])
        if not self._outside:
            low, high = np.array(self._source.region.low), np.array(self._source.region.high)
            size = np.maximum(high - low, 1e-9)
            beyond = np.maximum(predicted[:, columns:] - high, low - predicted[:, columns:]) / size
            gap = np.maximum(gap, beyond.max(axis=1, initial=-1.0))
        at = self._places(drawn)
        sure = (known.gap + known.margin)[at, place]
        return np.maximum(np.where(at >= 0, sure, gap), 0.0)

    def _places(self, drawn: Array) -> NDArray[np.intp]:
        """Place of each design among those that were rolled out; -1 for others."""
        rows = {row.tobytes(): i for i, row in enumerate(self._known.drawn + 0.0)}
        return np.array([rows.get(row.tobytes(), -1) for row in drawn + 0.0], dtype=np.intp)

    def _reached(self, one: Constraint, design: Design, drawn: Array) -> str:
        at = self._places(drawn[None])[0]
        if one not in self._learned or at < 0:
            return one.text if one in self._learned else super()._reached(one, design, drawn)
        if not (self._outside or self._known.inside[at]):
            return f"{one.text}, and it is outside the region of the policy"
        sure = "" if self._known.gap[at, self._learned.index(one)] > 0 else " (by chance, perhaps)"
        return super()._reached(one, design, drawn) + sure

    def _measured(self, design: Design, drawn: Array, names: Sequence[str]) -> Mapping[str, Value]:
        closed = of_design(design, [name for name in names if name not in self._names])
        values = self._known.values[self._places(drawn[None])[0]].tolist()
        return {**closed, **dict(zip(self._names, values, strict=True))}
