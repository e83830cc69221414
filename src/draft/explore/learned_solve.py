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
from draft.explore.goals import Constraint, by_rollouts
from draft.explore.learned_effects import open_policy, silent
from draft.explore.nearest import Conflict, Search, Solution
from draft.explore.settings import TargetSettings
from draft.learn.bodies.legged import legged_robot
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.learned_metrics import walkers
from draft.learn.measuring.paired_metrics import RESAMPLES, Paired, paired
from draft.metrics import of_design
from draft.values import Array, Value
from draft.variation.axes import Axis

_INSIDE, _TOP_SPEED = "learned.inside", "learned.top_speed"
_PAIRS, _STEP = 12, 0.06  # Of the first batch: pairs of designs, and their change.
_EACH, _ROUNDS = 10, 3  # Bodies of a round; rounds.
_BASE = 16  # Roll-outs of the given design, over those of a first look.
_NEAREST, _TIMES = 2, 3  # Designs that are looked at again, and by how many roll-outs more.
_LAST = 4  # Batches of a solution with one number as it was.
_SURE = 1.645  # Standard deviations that a normal number exceeds in 5 % of cases.
_NOISE = 1e-2  # Standard deviation of a gap by roll-outs, over that of its slopes.
_NEAR = 0.25  # Least distance over which predictions are fitted.
_WIDTH, _SHRINK = 0.3, 0.6  # Of a round's designs around its target, over its change.
_PULLS, _MORE = (1.08, 0.92, 1.2, 0.84, 0.7), 1.1
_WORST = 1.0  # Gap of a robot that falls.
_ONLY_FIRST = np.array([0])


class _Rolled(NamedTuple):
    """Designs that were rolled out, one row each.

    Attributes:
        drawn: their numbers, shape (N, numbers).
        gap: gap of each learned condition, above zero where it is not met, shape (N, conditions).
        deviation: standard deviation of the gap by chance, same shape.
        closed: violation of the conditions in closed form, shape (N,).
        times: roll-outs, over those of a first look, shape (N,).
        values: learned metrics, shape (N, metrics).
    """

    drawn: Array
    gap: Array
    deviation: Array
    closed: Array
    times: Array
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
        self._replicas, self._seed = settings.replicas, seed
        self._learned = tuple(one for one in conditions if by_rollouts(one))
        self._closed = tuple(one for one in conditions if one not in self._learned)
        named = {name for one in self._learned for name in one.holds.metrics}
        self._names = (*sorted(named - {*self._metrics, _INSIDE}), _INSIDE)
        robot = legged_robot(design)
        self._outside = self._source.warning(robot)
        self._ends = self._source.drive.ends(robot)
        self._done = 0
        self._base: dict[str, tuple[float, Array]] = {}
        count = len(axes)
        self._rolled: _Rolled | None = None
        self._seen = np.zeros((0, count)), np.zeros((0, len(self._ends[0])))
        self._fits: tuple[Array, ...] = ()

    def run(self) -> Solution:
        """Search, and explain."""
        zero = np.zeros((1, len(self._axes)))
        centre, violation = zero[0], self._violations(zero, self._closed)
        if violation.any():
            centre, violation = self._nearest(self._closed)
            if violation.any():  # No roll-out can help.
                return Search(self._design, self._closed, self._axes, self._rng).run()
        first = [centre[None]] if centre.any() else []
        self._look(np.concatenate([*first, self._spread(centre)]))
        rolled = self._known
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
            self._look(self._around(target, centre, _WIDTH * _SHRINK**k))
        best = self._best()
        if best is not None:
            self._look(self._walking(self._screened(_sparser(best))))
        for _ in range(_LAST):
            best = self._best()
            if best is None:
                break
            changed = np.flatnonzero(best)
            without = np.repeat(best[None], len(changed), axis=0)
            without[np.arange(len(changed)), changed] = 0.0
            self._look(self._walking(without))
            after = self._best()
            if after is not None and np.array_equal(after, best):
                return self._solution(best, None)
        best = self._best()
        if best is not None:
            return self._solution(best, None)
        least = self._least()
        known = tuple(one.text for one in self._conditions if one.text != "accepted")
        together = self._smallest() if violation.any() else known
        return self._solution(least, Conflict(together, self._misses(least)))

    def _solution(self, best: Array, conflict: Conflict | None) -> Solution:
        notes = []
        if self._outside:
            notes.append(f"the learned metrics are of a design {self._outside}")
        if any(_TOP_SPEED in one.holds.metrics for one in self._learned):
            most = self._source.forward_for(legged_robot(self._design))
            notes.append(
                f"the policy was commanded up to {most:.2f} m/s at this size: "
                "a top speed near that is a lower bound"
            )
        return Solution(
            design=self._resolved(best) if best.any() else self._design,
            change=float(np.sqrt(np.mean(best**2))),
            moved=self._moved(best, conflict is None),
            conflict=conflict,
            tried=self.tried,
            rollouts=self._done,
            notes=tuple(notes),
        )

    def _spread(self, centre: Array) -> Array:
        """Pairs of designs on both sides of one, that tell the slopes best: orthogonal columns."""
        count = max(_PAIRS, len(centre) + 1)
        turned = np.linalg.qr(self._rng.normal(size=(count, count)))[0][:, : len(centre)]
        step = _STEP * np.sqrt(count) * turned[:_PAIRS]
        drawn = self._inside(centre + np.concatenate([step, -step]))
        walking = self._walking(drawn)
        others = drawn[~(drawn[:, None] == walking).all(axis=2).any(axis=1)]
        return np.concatenate([walking, self._walking(centre + (others - centre) / 2)])

    def _around(self, target: Array, centre: Array, width: float) -> Array:
        """Designs of a round: around a target, and between a known design and the given one."""
        few = _sparser(target)[-3:-1] * _MORE
        rows = [target, *few, *(target * pull for pull in _PULLS)]
        rows += [centre * pull for pull in (0.95, 0.85, 0.7)] + [(centre + target) / 2]
        rows = [row for row in rows if row.any()]
        scale = np.sqrt(np.mean(target**2))
        shape = (2 * _EACH, len(target))
        for middle in (target, centre):
            aside = self._rng.normal(0, width, shape) * np.maximum(abs(middle), scale / 2)
            rows += [*(middle + aside * (self._rng.random(shape) < 0.5))]
        drawn = self._walking(self._screened(self._inside(np.array(rows))))
        drawn = drawn[np.sort(np.unique(drawn, axis=0, return_index=True)[1])]
        first, rest = drawn[: _EACH // 2], drawn[_EACH // 2 :]
        return np.concatenate([first, self._rng.permutation(rest)[: _EACH - len(first)]])

    def _screened(self, drawn: Array) -> Array:
        """Designs that meet the conditions in closed form; if none does, that are accepted."""
        violation = self._violations(drawn, self._closed)
        met = violation.sum(axis=1) == 0
        return drawn[met if met.any() else violation[:, -1] == 0]  # `accepted` is the last.

    def _walking(self, drawn: Array) -> Array:
        """Designs that the policy drives, in its region if the given one is."""
        if not len(drawn):
            return drawn
        many = self._design.spec.resolve(self._design.values, self._values(drawn))
        members, _ = walkers(self._source, many, None)
        if not members:
            return drawn[:0]
        drive = self._source.drive
        own = drive.features([*members.values()])
        rows = np.array([*members])
        seen = zip(self._seen, (drawn[rows], own), strict=True)
        drawn_before, own_before = (np.concatenate(pair) for pair in seen)
        self._seen = drawn_before, own_before
        inside = [
            bool(self._outside) or drive.includes(one, features)
            for one, features in zip(members.values(), own, strict=True)
        ]
        return drawn[rows[inside]]

    def _look(self, drawn: Array) -> None:
        """Roll out designs, and again the nearest that may be solutions, more often."""
        new = drawn[self._places(drawn) < 0] if self._rolled is not None else drawn
        self._roll(new)
        known, best = self._known, self._best()
        size = np.linalg.norm(known.drawn, axis=1)
        most = np.inf if best is None else float(np.linalg.norm(best))
        hopeful = (known.gap <= 0).all(axis=1) & (known.closed == 0) & (known.times == 1)
        rows = np.flatnonzero(hopeful & (size > 0) & (size <= most))
        if len(rows):
            self._roll(known.drawn[rows[np.argsort(size[rows], kind="stable")[:_NEAREST]]], _TIMES)

    def _roll(self, drawn: Array, times: int = 1) -> None:
        """Roll out designs with the given one, and keep them in the place of a look before.

        The given design is the first that is kept.
        """
        if not len(drawn) and self._rolled is not None:
            return
        drawn = np.concatenate([np.zeros((1, len(self._axes))), drawn])
        many = self._design.spec.resolve(self._design.values, self._values(drawn))

        def rolled(times: int, rows: NDArray[np.intp] | None = None) -> Paired:
            more = {"replicas": times * self._replicas, "seed": self._seed}
            found = paired(
                self._source, many, self._names, BodyRollOuts.of(more), self._report, rows
            )
            self._done += found.rollouts
            return found

        found = rolled(times)
        if not self._base:
            base = rolled(_BASE, np.array([0]))
            for name in self._names:
                self._base[name] = float(base.values[name][0]), base.resampled[name][:, 0]
        values, again = {}, {}
        for name, (value, resampled) in self._base.items():
            own, own_again = found.values[name], found.resampled[name]
            values[name] = value + own - own[0]
            again[name] = resampled[:, None] + own_again - own_again[:, :1]
        closed = of_design(many, self._metrics)

        def gaps(learned: dict[str, Array]) -> Array:
            each = [self._gap(one, many, {**closed, **learned}) for one in self._learned]
            return np.stack(each, axis=1)

        more = _Rolled(
            drawn,
            gaps(values),
            np.std([gaps({n: x[k] for n, x in again.items()}) for k in range(RESAMPLES)], axis=0),
            self._violations(drawn, self._closed).sum(axis=1),
            np.full(len(drawn), times),
            np.stack([values[name] for name in self._names], axis=1),
        )
        if self._rolled is not None:
            taken = self._places(drawn)
            kept = np.ones(len(self._rolled.drawn), dtype=bool)
            kept[taken[taken > 0]] = False
            pairs = zip(self._rolled, more, strict=True)
            more = _Rolled(*(np.concatenate([a[kept], b[1:]]) for a, b in pairs))
        self._rolled = more

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
        least = np.median(known.deviation, axis=0) / np.sqrt(known.times)[:, None]
        return known.gap + _SURE * np.maximum(known.deviation, least)

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
        chance = np.median(known.deviation[:, place]) / np.sqrt(_TIMES)
        gap = inputs @ self._fits[0][:, place] + _SURE * chance
        if not self._outside:
            low, high = self._ends
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


def _sparser(drawn: Array) -> Array:
    """A design with more and more of its numbers as they were, the smallest changes first."""
    order = np.argsort(abs(drawn))
    changed = order[drawn[order] != 0]
    return np.array(
        [
            np.where(np.isin(np.arange(len(drawn)), changed[:k]), 0.0, drawn)
            for k in range(1, max(len(changed), 2))
        ]
    )


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
