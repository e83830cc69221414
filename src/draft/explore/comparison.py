"""Why designs differ: metrics side by side, what each changed number contributes, what limits.

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
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.design import Design, Finding
from draft.design.error_samples import sample_errors
from draft.design.findings import grouped
from draft.errors import DraftError, ResolveError
from draft.explore.sensitivity import STILL, closed_metrics, stated_numbers
from draft.metrics import Limit, find, limits, of_design
from draft.metrics.registry import reads_verdict
from draft.spec.payload import MASS
from draft.values import Array, Value, scalar

EXACT = 10  # Numbers whose orders are all counted.
SAMPLES, ORDERS = 2000, 200
_ROUNDING = 1e-12  # Share of a metric's value that is rounding.
Setting = Value | str | None
Measure = Callable[[Design], Mapping[str, Value]]
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
        names: their names, each another.
        metrics: names of the closed-form metrics.
        values: shape (designs, metrics).
        parts: for each other design why it differs; None for another robot.
        findings: findings of the filter that not all designs have, for each design.
        limits: what limits each design by metric, the limit that binds first (`metrics.limits`).
    """

    designs: tuple[Design, ...]
    names: tuple[str, ...]
    metrics: tuple[str, ...]
    values: Array
    parts: tuple[Part | None, ...]
    findings: tuple[tuple[str, ...], ...]
    limits: tuple[Mapping[str, tuple[Limit, ...]], ...]

    def record(self) -> dict[str, Any]:
        """Plain data; None where there is no number."""

        def row(values: Array) -> dict[str, float | None]:
            known = (float(x) if math.isfinite(x) else None for x in values)
            return dict(zip(self.metrics, known, strict=True))

        others = []
        for name, part in zip(self.names[1:], self.parts, strict=True):
            record: dict[str, Any] = {"design": name, "same_robot": part is not None}
            if part is not None:
                record["better"] = row(part.better)
                record["exact"] = part.exact
                record["shares"] = {
                    number: {"from": part.before[i], "to": part.after[i], **row(part.shares[i])}
                    for i, number in enumerate(part.names)
                }
            others.append(record)
        return {
            "designs": {
                name: row(values) for name, values in zip(self.names, self.values, strict=True)
            },
            "against_first": others,
            "limits": {
                name: {metric: _limits(found) for metric, found in own.items()}
                for name, own in zip(self.names, self.limits, strict=True)
            },
            "findings_alone": {
                name: list(own) for name, own in zip(self.names, self.findings, strict=True)
            },
        }


def _limits(found: Sequence[Limit]) -> dict[str, Any]:
    """The limit that binds, the next one, and how far that is."""
    first, *others = [one._asdict() | {"joints": list(one.joints)} for one in found[:2]]
    margin = abs(found[1].value - found[0].value) if others else None
    return {**first, "next": others[0] if others else None, "margin": margin}


def unique(names: Sequence[str]) -> tuple[str, ...]:
    """Names of which a later one that is there already has a number."""
    found: list[str] = []
    for name in names:
        number, made = 2, name
        while made in found:
            number, made = number + 1, f"{name} {number}"
        found.append(made)
    return tuple(found)


def titles(designs: Sequence[Design]) -> list[str]:
    """Unique titles: the name of the robot, of the design, or both."""
    robots = {design.name for design in designs}
    titles: list[str] = []
    for design in designs:
        label = "" if design.label == "default" else design.label
        if len(robots) == 1:
            title = label or (design.name if len(designs) == 1 else "default")
        else:
            title = f"{design.name} {label}".strip()
        titles.append(title)
    # The design files of all saved models have the same name, `design`.
    return list(unique(titles))


def compare(
    designs: Sequence[Design],
    of: Sequence[str] = (),
    *,
    names: Sequence[str] = (),
    seed: int = 0,
    samples: int = SAMPLES,
) -> DesignComparison:
    """Compare designs by their closed-form metrics, and say why they differ and what limits each.

        >>> spec = draft.load("quadruped")
        >>> found = draft.compare([spec.resolve("cheetah"), spec.resolve("bear")], ["mass"])
        >>> part = found.parts[0]
        >>> part.names[int(part.shares[:, 0].argmax())]
        'actuators.leg.peak_torque'

    Args:
        designs: two single designs or more.
        of: metrics; empty for all that need no model.
        names: names of the designs; empty for their references.
        seed: seed of the samples.
        samples: samples of the errors of the laws.

    Raises:
        DraftError: there are fewer than two designs, one is several, or a metric is unknown.
    """
    if len(designs) < 2:
        raise DraftError("there is nothing to compare", "give two designs or more")
    if any(one.count is not None for one in designs):
        raise DraftError("comparisons are of single designs", "select one, such as `design[0]`")
    metrics = closed_metrics(designs[0].spec, of)
    if not of:
        metrics = tuple(x for x in metrics if all(find(x).fits(one.spec) for one in designs))
    # A metric of an extension that fails is NaN unless it is named.
    measure = partial(of_design, names=metrics if of else None)
    table = [measure(one) for one in designs]
    values = np.array([[scalar(row[name]) for name in metrics] for row in table])
    first, *others = designs
    parts = tuple(
        _part(first, other, metrics, measure, seed, samples) if _same_robot(first, other) else None
        for other in others
    )
    shared = set.intersection(*({_kind(f) for f in one.findings} for one in designs))
    findings = tuple(
        tuple(
            f"{f.severity} {f.id}: {f.message}"
            for f in grouped(f for f in one.findings if _kind(f) not in shared)
        )
        for one in designs
    )
    return DesignComparison(
        designs=tuple(designs),
        names=unique(names or [one.reference for one in designs]),
        metrics=metrics,
        values=values,
        parts=parts,
        findings=findings,
        limits=tuple(limits(one, of) for one in designs),
    )


def _kind(finding: Finding) -> tuple[str, ...]:
    """What two designs have in common that have a finding alike, with other numbers."""
    return finding.severity, finding.id, finding.where


def _same_robot(a: Design, b: Design) -> bool:
    """Whether two designs are of one robot, so that numbers of one can be those of the other."""
    return a.spec is b.spec or (a.spec.name, a.spec.folder) == (b.spec.name, b.spec.folder)


def _part(
    a: Design, b: Design, metrics: tuple[str, ...], measure: Measure, seed: int, samples: int
) -> Part:
    before, after = _differing(a, b)
    names = tuple(before)
    spec = a.spec if "payload" in a.spec.parameters else b.spec
    judge = reads_verdict(metrics)
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
            try:
                row = measure(spec.resolve(given, judge=judge))
            except ResolveError:
                continue  # No robot between the two has these settings.
            for k, name in enumerate(metrics):
                found[rows, k] = row[name]
        return found

    exact = len(names) <= EXACT
    with np.errstate(invalid="ignore"):  # A time without a limit has no difference.
        shares = _shapley(len(names), measured, seed, exact)
        better = _better(a, b, metrics, measure, seed, samples)
        ends = measured(np.array([[False], [True]]).repeat(len(names), axis=1))
        rounding = np.where(abs(ends) < math.inf, _ROUNDING * abs(ends), 0.0).max(axis=0)
        least = np.fmax(STILL * abs(shares).max(axis=0, initial=0.0), rounding)
        shares[abs(shares) <= least] = 0.0
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


def _better(
    a: Design, b: Design, metrics: Sequence[str], measure: Measure, seed: int, samples: int
) -> Array:
    """Probability that the other design is better in each metric, shape (metrics,)."""
    errors = sample_errors(a, samples, seed, b)
    judge = reads_verdict(metrics)
    rows = [measure(one.spec.resolve(one.values, errors=errors, judge=judge)) for one in (a, b)]
    found = np.full(len(metrics), np.nan)
    for k, name in enumerate(metrics):
        direction = find(name).better
        if direction:
            own, other = (np.broadcast_to(row[name], samples) for row in rows)
            gain = (other - own) if direction == "more" else (own - other)
            even = np.isclose(other, own, rtol=1e-9, equal_nan=True)
            found[k] = np.mean(np.where(even, 0.5, gain > 0))
    return found
