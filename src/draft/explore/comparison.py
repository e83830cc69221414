"""Why designs differ: their metrics side by side, and what each changed number contributes.

A difference between two designs of one robot is divided over the numbers that differ by Shapley
values: the mean effect of a number over all orders in which the numbers may be changed (Shapley
1953). Up to `EXACT` numbers all orders count, above that samples of them; in both cases the parts
sum to the difference.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.design.error_samples import sample_errors
from draft.errors import DraftError
from draft.explore.sensitivity import STILL, stated_numbers
from draft.metrics import METRICS, find, of_design
from draft.spec.payload import MASS
from draft.values import Array, Value, scalar

EXACT = 10  # Numbers whose orders are all counted.
SAMPLES, ORDERS = 2000, 200
Setting = Value | str | None
_MISSING = object()  # A design does not state the number.


@dataclass(frozen=True, eq=False)
class Part:
    """What makes two designs of one robot differ.

    Attributes:
        names: numbers and catalogue parts that differ.
        before, after: their settings in the first and in the other design, as text.
        shares: contribution of each to the difference of each metric, shape (names, metrics).
        better: probability that the other design is better in each metric, given the errors of the
            laws, shape (metrics,); NaN for metrics without a better direction.
        exact: whether all orders were counted.
    """

    names: tuple[str, ...]
    before: tuple[str, ...]
    after: tuple[str, ...]
    shares: Array
    better: Array
    exact: bool


@dataclass(frozen=True, eq=False)
class DesignComparison:
    """Designs side by side.

    Attributes:
        designs: the designs; the others are compared with the first.
        metrics: names of the closed-form metrics.
        values: shape (designs, metrics).
        parts: for each other design why it differs; None for another robot.
        findings: messages of the filter that not all designs have, for each design.
    """

    designs: tuple[Design, ...]
    metrics: tuple[str, ...]
    values: Array
    parts: tuple[Part | None, ...]
    findings: tuple[tuple[str, ...], ...]

    def record(self) -> dict[str, Any]:
        """Plain data; None where there is no number."""

        def row(values: Array) -> dict[str, float | None]:
            known = (float(x) if math.isfinite(x) else None for x in values)
            return dict(zip(self.metrics, known, strict=True))

        others = []
        for design, part in zip(self.designs[1:], self.parts, strict=True):
            record: dict[str, Any] = {"design": design.reference, "same_robot": part is not None}
            if part is not None:
                record["better"] = row(part.better)
                record["exact"] = part.exact
                record["shares"] = {
                    name: {"from": part.before[i], "to": part.after[i], **row(part.shares[i])}
                    for i, name in enumerate(part.names)
                }
            others.append(record)
        return {
            "designs": {
                one.reference: row(values)
                for one, values in zip(self.designs, self.values, strict=True)
            },
            "against_first": others,
            "findings_alone": {
                one.reference: list(own)
                for one, own in zip(self.designs, self.findings, strict=True)
            },
        }


def compare(
    designs: Sequence[Design], of: Sequence[str] = (), *, seed: int = 0, samples: int = SAMPLES
) -> DesignComparison:
    """Compare designs by their closed-form metrics, and say why they differ.

        >>> spec = draft.load("quadruped")
        >>> found = draft.compare([spec.resolve("cheetah"), spec.resolve("bear")], ["mass"])
        >>> part = found.parts[0]
        >>> part.names[int(part.shares[:, 0].argmax())]
        'actuators.leg.peak_torque'

    Args:
        designs: two single designs or more.
        of: metrics; empty for all that need no model.
        seed: seed of the samples.
        samples: samples of the errors of the laws.

    Raises:
        DraftError: there are fewer than two designs, one is several, or a metric is unknown.
    """
    if len(designs) < 2:
        raise DraftError("there is nothing to compare", "give two designs or more")
    if any(one.count is not None for one in designs):
        raise DraftError("comparisons are of single designs", "select one, such as `design[0]`")
    names = tuple(of) or tuple(
        one.name for one in METRICS.values() if one.needs == "design" and one.unit != "bool"
    )
    table = [of_design(one, names) for one in designs]
    values = np.array([[scalar(row[name]) for name in names] for row in table])
    first, *others = designs
    parts = tuple(
        _part(first, other, names, seed, samples) if _same_robot(first, other) else None
        for other in others
    )
    messages = [{f"{f.id}: {f.message}" for f in one.findings} for one in designs]
    shared = set.intersection(*messages)
    findings = tuple(tuple(sorted(own - shared)) for own in messages)
    return DesignComparison(tuple(designs), names, values, parts, findings)


def _same_robot(a: Design, b: Design) -> bool:
    """Whether two designs are of one robot, so that numbers of one can be those of the other."""
    return a.spec is b.spec or (a.spec.name, a.spec.folder) == (b.spec.name, b.spec.folder)


def _part(a: Design, b: Design, metrics: tuple[str, ...], seed: int, samples: int) -> Part:
    before, after = _differing(a, b)
    names = tuple(before)
    spec = a.spec if "payload" in a.spec.parameters else b.spec
    base = {key: value for key, value in {**b.values, **a.values}.items() if key not in before}
    numeric = [i for i, n in enumerate(names) if _real(before[n]) and _real(after[n])]
    others = [i for i in range(len(names)) if i not in numeric]

    def measured(chosen: NDArray[np.bool_]) -> Array:
        """Metrics of designs that have some settings of the other, shape (rows, metrics)."""
        found = np.full((len(chosen), len(metrics)), np.nan)
        for combination in np.unique(chosen[:, others], axis=0):
            rows = np.flatnonzero((chosen[:, others] == combination).all(axis=1))
            given: dict[str, Setting] = dict(base)
            for i, other in zip(others, combination, strict=True):
                setting = (after if other else before)[names[i]]
                if setting is not _MISSING:
                    given[names[i]] = setting
            for i in numeric:
                given[names[i]] = np.where(chosen[rows, i], after[names[i]], before[names[i]])
            row = of_design(spec.resolve(given), metrics)
            for k, name in enumerate(metrics):
                found[rows, k] = row[name]
        return found

    exact = len(names) <= EXACT
    with np.errstate(invalid="ignore"):  # A time without a limit has no difference.
        shares = _shapley(len(names), measured, seed, exact)
        shares[abs(shares) <= STILL * abs(shares).max(axis=0, initial=0.0)] = 0.0
        better = _better(a, b, metrics, seed, samples)
    texts = [tuple(_text(of[name]) for name in names) for of in (before, after)]
    return Part(names, texts[0], texts[1], shares, better, exact)


def _differing(a: Design, b: Design) -> tuple[dict[str, Any], dict[str, Any]]:
    """Settings that differ, in both designs."""
    # A design without a payload has one of zero.
    if any(one.spec.payload is not None for one in (a, b)):
        a, b = (one if one.spec.payload is not None else _loaded(one) for one in (a, b))
    numbers = [stated_numbers(one) for one in (a, b)]
    before, after = {}, {}
    for name in dict.fromkeys([*a.values, *b.values, *numbers[0], *numbers[1]]):
        pair = [
            of.get(name, _plain(one.values.get(name, _MISSING)))
            for of, one in zip(numbers, (a, b), strict=True)
        ]
        if pair[0] is not pair[1] and pair[0] != pair[1]:
            before[name], after[name] = pair
    return before, after


def _loaded(design: Design) -> Design:
    """The design with a payload of zero."""
    return design.spec.resolve({**design.values, MASS: 0.0})


def _plain(setting: Any) -> Any:
    return float(setting) if _real(setting) else setting


def _real(setting: object) -> bool:
    kinds = (int, float, np.integer, np.floating)
    return isinstance(setting, kinds) and not isinstance(setting, bool)


def _text(setting: object) -> str:
    if setting is _MISSING:
        return "as in the robot"
    return f"{setting:.4g}" if isinstance(setting, float) else str(setting)


def _shapley(
    count: int, measured: Callable[[NDArray[np.bool_]], Array], seed: int, exact: bool
) -> Array:
    """Shapley values of players, shape (players, metrics)."""
    if not count:
        return np.zeros((0, measured(np.zeros((1, 0), dtype=bool)).shape[1]))
    if exact:
        masks = np.array(list(itertools.product((False, True), repeat=count)))
        worth = measured(masks)
        size = masks.sum(axis=1)
        weight = np.array([1.0 / (count * math.comb(count - 1, s)) for s in range(count)])
        place = 1 << np.arange(count - 1, -1, -1)
        index = masks @ place
        shares = []
        for i in range(count):
            without = np.flatnonzero(~masks[:, i])
            gain = worth[index[without] + place[i]] - worth[without]
            shares.append(weight[size[without]] @ gain)
        return np.array(shares)
    rng = np.random.default_rng(seed)
    orders = np.array([rng.permutation(count) for _ in range(ORDERS)])
    steps = np.zeros((ORDERS, count + 1, count), dtype=bool)
    for k in range(count):
        steps[:, k + 1] = steps[:, k]
        steps[np.arange(ORDERS), k + 1, orders[:, k]] = True
    worth = measured(steps.reshape(-1, count)).reshape(ORDERS, count + 1, -1)
    gain, shares = np.diff(worth, axis=1), np.zeros((count, worth.shape[2]))
    np.add.at(shares, orders, gain)
    return shares / ORDERS


def _better(a: Design, b: Design, metrics: Sequence[str], seed: int, samples: int) -> Array:
    """Probability that the other design is better in each metric, shape (metrics,)."""
    errors = sample_errors(a, samples, seed, b)
    rows: list[Mapping[str, Value]] = [
        of_design(one.spec.resolve(one.values, errors=errors), metrics) for one in (a, b)
    ]
    found = np.full(len(metrics), np.nan)
    for k, name in enumerate(metrics):
        direction = find(name).better
        if direction:
            own, other = (np.broadcast_to(row[name], samples) for row in rows)
            gain = (other - own) if direction == "more" else (own - other)
            even = np.isclose(other, own, rtol=1e-9, equal_nan=True)
            found[k] = np.mean(np.where(even, 0.5, gain > 0))
    return found
