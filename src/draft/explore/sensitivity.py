"""Effects of the numbers of a design on its metrics, by one call with arrays.

Each number is moved by one per cent and by a step that a designer would take, up and down, so that
both sides of a kink are seen: a `max`, a module of the catalogue, the verdict of the filter. The
effect of a step stands beside what the trends leave open about it: both designs are resolved with
the same samples of the laws' errors, of which most cancel in the difference.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.design.error_samples import sample_errors
from draft.errors import DraftError, suggest
from draft.explore.settings import EffectSettings, Progress
from draft.metrics import LEARNED, find, of_design
from draft.metrics.measure import needs_more, of_batch
from draft.metrics.registry import closed, misfit, reads_verdict
from draft.spec import Spec
from draft.spec.check import key_problem
from draft.spec.payload import with_payload
from draft.values import Array, Value, scalar
from draft.variation.axes import unit_of

PER_CENT = 0.01
SAMPLES = 64
_ENDS = (0.05, 0.95)
_SHARE = 0.1  # A designer's step, about this share of a number.
_DIGITS = (1.0, 2.0, 5.0, 10.0)
STILL = 1e-9  # Relative change that is rounding.
_COLUMNS = ("up", "down", "step_up", "step_down", "low", "high")
_DOWN = ("down_low", "down_high")
_KINK = 0.1  # Difference of both sides, over the larger, from which both are shown.


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Effects of P numbers of a design on M metrics.

    Attributes:
        design: the design.
        names: the numbers.
        units: their units; "" for none.
        values: their values, shape (P,).
        steps: step of each, in its unit, shape (P,).
        metrics: names of the metrics.
        base: their values, shape (M,).
        up, down: relative change of each metric for one per cent more, and for one less, shape
            (P, M); NaN where there is none, as beyond the range of a parameter. A number that is
            zero has no per cent.
        step_up, step_down: change of each metric for a step more, and for one less, in the unit of
            the metric, shape (P, M).
        low, high: ends of the 90 % band of `step_up` over the errors of the laws, shape (P, M); of
            a learned metric, of its 95 % interval over roll-outs.
        down_low, down_high: those of `step_down` of learned metrics; NaN of others.
        accepted: whether the filter accepts each design with a step less, as it is, and with a step
            more, shape (P, 3).
        notes: sentences on the learned metrics.
    """

    design: Design
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    steps: Array
    metrics: tuple[str, ...]
    base: Array
    up: Array
    down: Array
    step_up: Array
    step_down: Array
    low: Array
    high: Array
    accepted: NDArray[np.bool_]
    down_low: Array
    down_high: Array
    notes: tuple[str, ...] = ()

    @property
    def learned(self) -> NDArray[np.bool_]:
        """Metrics that are measured by roll-outs, shape (M,)."""
        return np.array([name in LEARNED for name in self.metrics], dtype=bool)

    @property
    def sizes(self) -> Array:
        """Size of the larger side of each effect, shape (P, M).

        It is 0 where neither changes; a side of a learned metric counts if its interval excludes 0.
        """
        sides = (
            (self.step_up, self.low, self.high),
            (self.step_down, self.down_low, self.down_high),
        )
        found = [
            np.where(self.learned & ~((low > 0) | (high < 0)), 0.0, np.nan_to_num(abs(side)))
            for side, low, high in sides
        ]
        return np.maximum(*found)

    @property
    def still(self) -> NDArray[np.bool_]:
        """Numbers that change no metric, as far as roll-outs can tell, shape (P,)."""
        flips = (self.accepted != self.accepted[:, 1:2]).any(axis=1)
        return ~((self.sizes > 0).any(axis=1) | flips)

    @property
    def kinked(self) -> NDArray[np.bool_]:
        """Whether both sides of a step differ by more than a tenth, and chance, shape (P, M)."""
        up, down = self.step_up, -self.step_down
        larger = np.fmax(abs(up), abs(down))
        chance = (self.high - self.low + self.down_high - self.down_low) / 2
        return abs(up - down) > np.fmax(_KINK * larger, np.where(self.learned, chance, 0.0))

    def record(self) -> dict[str, object]:
        """Plain data; None where there is no number."""
        by_rollouts = self.learned.any()

        def row(values: Array) -> dict[str, float | None]:
            known = (float(x) if math.isfinite(x) else None for x in values)
            return dict(zip(self.metrics, known, strict=True))

        return {
            "design": self.design.reference,
            "metrics": row(self.base),
            "numbers": {
                name: {
                    "value": float(self.values[i]),
                    "unit": self.units[i],
                    "step": float(self.steps[i]),
                    **{
                        key: row(getattr(self, key)[i])
                        for key in _COLUMNS + (_DOWN if by_rollouts else ())
                    },
                    "accepted": dict(
                        zip(("step_down", "now", "step_up"), self.accepted[i].tolist(), strict=True)
                    ),
                }
                for i, name in enumerate(self.names)
            },
            **({"notes": list(self.notes)} if by_rollouts else {}),
        }


def sensitivity(
    design: Design,
    of: Sequence[str] = (),
    by: Sequence[str] = (),
    *,
    samples: int = SAMPLES,
    seed: int = 0,
    verdicts: bool = True,
    replicas: int = 12,
    policy: str | Path | None = None,
    progress: Progress | None = None,
) -> Sensitivity:
    """Effects of a design's numbers on its metrics.

        >>> found = draft.sensitivity(draft.load("quadruped").resolve("bear"), of=["mass"])
        >>> i = found.names.index("actuators.leg.peak_torque")
        >>> round(100 * float(found.up[i, 0]), 2)  # per cent of mass for one per cent of torque
        0.36

    Args:
        design: one design.
        of: metrics; empty for all that need no model and no policy.
        by: parameters (`thigh_length`) and quantities of actuators (`actuators.leg.peak_torque`);
            empty for all that the design states as numbers.
        samples: samples of the errors of the laws.
        seed: seed of the samples, and of the roll-outs.
        replicas: roll-outs of each body at each speed and kick, for learned metrics; each number
            has two bodies.
        policy: see `draft.metrics.of_policy`.
        progress: called with the bodies rolled out and their number.
        verdicts: whether to run the filter on each design, which takes most of the time; without
            it all have the verdict of the design.

    Raises:
        DraftError: the design is several or has no number to change, a name is unknown or given by
            an expression, or a learned metric cannot be measured.
    """
    if design.count is not None:
        raise DraftError("sensitivities are of one design", "select one, such as `design[0]`")
    learned = tuple(dict.fromkeys(name for name in of if name in LEARNED))
    closed = tuple(name for name in of if name not in LEARNED)
    metrics = () if learned and not closed else closed_metrics(design.spec, closed, models=True)
    numbers = _chosen(design, by)
    values = np.array(list(numbers.values()))
    steps = np.array([step_of(design, *one) for one in numbers.items()])
    moves = np.array([PER_CENT * values, -PER_CENT * values, steps, -steps])  # (4, P)
    count, kinds = len(values), len(moves)
    known = _allowed(design, tuple(numbers), values + moves) & (moves != 0)
    # Rows: the design, each move of each number, and the design and each step with each sample.
    plain = 1 + kinds * count
    rows = np.tile(values, (plain + samples * (1 + count), 1))
    own = np.arange(count)
    for k in range(kinds):
        rows[1 + k * count + own, own] += np.where(known[k], moves[k], 0.0)
    for i in range(count):
        start = plain + samples * (1 + i)
        rows[start : start + samples, i] += steps[i] if known[2, i] else 0.0
    errors = sample_errors(design, samples, seed).repeated(1 + count).after(plain)
    arrays: dict[str, Value] = {name: rows[:, i] for i, name in enumerate(numbers)}
    judge = verdicts or reads_verdict(metrics)
    many = design.spec.resolve(design.values, arrays, errors=errors, judge=judge)
    table = _measured(many, metrics)
    base = table[:, 0]
    moved = table[:, 1:plain].reshape(len(metrics), kinds, count).transpose(1, 2, 0)
    drawn = table[:, plain:].reshape(len(metrics), 1 + count, samples)
    with np.errstate(all="ignore"):  # A time without a limit has no change.
        change = np.where(known[..., None], moved - base, np.nan)  # (4, P, M)
        change = np.where(abs(change) <= STILL * abs(base), 0.0, change)
        relative = change[:2] / abs(base)
        apart = drawn[:, 1:] - drawn[:, :1]
    ends = np.quantile(apart, _ENDS, axis=2).swapaxes(1, 2)
    low, high = np.where(known[2][:, None], ends, np.nan)
    accepted = np.broadcast_to((many if verdicts else design).accepted, many.count or 1)
    less, more = (accepted[1 + k * count + own] for k in (3, 2))
    none = np.full_like(low, np.nan)
    result = Sensitivity(
        design=design,
        names=tuple(numbers),
        units=tuple(unit_of(design.spec, name) for name in numbers),
        values=values,
        steps=steps,
        metrics=metrics,
        base=base,
        up=relative[0],
        down=relative[1],
        step_up=change[2],
        step_down=change[3],
        low=low,
        high=high,
        accepted=np.stack([less, np.full(count, accepted[0]), more], axis=1),
        down_low=none,
        down_high=none,
    )
    if not learned:
        return result
    from draft.explore.learned_effects import learned_effects

    given = {"replicas": replicas, "policy": policy, "progress": progress}
    effects = learned_effects(
        design, numbers, steps, known[2:], learned, seed, EffectSettings.of(given)
    )
    unknown = np.full(effects.change.shape[1:], np.nan)
    more_columns = {
        "base": effects.base,
        **dict.fromkeys(("up", "down"), unknown),
        **dict(zip(("step_up", "step_down"), effects.change, strict=True)),
        **dict(zip(("low", "down_low"), effects.low, strict=True)),
        **dict(zip(("high", "down_high"), effects.high, strict=True)),
    }
    names = (*metrics, *learned)
    order = [names.index(name) for name in dict.fromkeys(of)]
    columns = {
        name: np.concatenate([getattr(result, name), own], axis=-1)[..., order]
        for name, own in more_columns.items()
    }
    metrics = tuple(names[k] for k in order)
    return replace(result, metrics=metrics, notes=effects.notes, **columns)


def stated_numbers(design: Design) -> dict[str, float]:
    """Numbers that a design states, by name: parameters and quantities of actuators.

    Those that follow from an expression or a law are not among them.
    """
    spec, found = design.spec, {}
    for name, parameter in spec.parameters.items():
        if _states(design, name, parameter.value.constant is not None):
            found[name] = scalar(design.parameters[name])
    for owner, actuator in design.actuators.items():
        written = spec.actuators[owner].stated
        for quantity, origin in actuator.origins.items():
            name = f"actuators.{owner}.{quantity}"
            constant = quantity in written and written[quantity].constant is not None
            if origin.kind == "stated" and _states(design, name, constant):
                found[name] = scalar(getattr(actuator, quantity))
    return found


def _states(design: Design, name: str, constant: bool) -> bool:
    """Whether a number is stated as one, by the design's values or by its spec."""
    given = design.values.get(name)
    return not isinstance(given, str) if name in design.values else constant


def step_of(design: Design, name: str, value: float) -> float:
    """A step of a number that a designer would take: about a tenth, with one digit of 1, 2 or 5.

    Of a number that is zero it is about a twentieth of its parameter's range, or of one.
    """
    parameter = design.spec.parameters.get(name)
    size = _SHARE * abs(value)
    if not size:
        low, high = (parameter.bounds if parameter is not None else None) or (0.0, 2.0)
        size = _SHARE / 2 * (high - low)
    decade = 10.0 ** math.floor(math.log10(size))
    digit = min(_DIGITS, key=lambda one: abs(math.log(size / decade / one)))
    return float(f"{digit * decade:.6g}")


def _allowed(design: Design, names: Sequence[str], moved: Array) -> NDArray[np.bool_]:
    """Whether moved values are within the ranges of parameters, and above zero, shape as moved."""
    allowed = np.ones(moved.shape, dtype=bool)
    for i, name in enumerate(names):
        parameter = design.spec.parameters.get(name)
        if parameter is None:
            allowed[:, i] = moved[:, i] > 0
        elif parameter.bounds is not None:
            low, high = parameter.bounds
            allowed[:, i] = (moved[:, i] >= low) & (moved[:, i] <= high)
    return allowed


def _measured(many: Design, metrics: Sequence[str]) -> Array:
    """Metrics of N designs, shape (M, N); those of models NaN for designs without one."""
    count = many.count or 1
    closed = [name for name in metrics if find(name).needs == "design"]
    found: dict[str, Value] = dict(of_design(many, closed))
    rest = [name for name in metrics if name not in found]
    if rest:
        from draft.model.batch import build_batch

        batch = build_batch(many, np.flatnonzero(np.broadcast_to(many.accepted, count)))
        for name, values in of_batch(batch, rest).items():
            of_all = np.full(count, np.nan)
            of_all[batch.rows] = values
            found[name] = of_all
    table = np.array([np.broadcast_to(found[name], count) for name in metrics], float)
    return table.reshape(len(metrics), count)


def closed_metrics(spec: Spec, of: Sequence[str], models: bool = False) -> tuple[str, ...]:
    """Metrics of a robot that need no model, all or those that are named.

    Args:
        spec: the robot.
        of: names of metrics.
        models: whether those of models that are built by arrays may be named too.

    Raises:
        DraftError: one is unknown, or needs a model or a policy.
    """
    if not of:
        return tuple(name for name in closed(spec) if find(name).unit != "bool")
    for name in of:
        metric = find(name)
        if (problem := misfit(name, spec)) is not None:
            raise DraftError(problem)
        allowed = metric.needs == "design" or (models and metric.needs == "model" and metric.batch)
        if not allowed:
            raise DraftError(needs_more(metric).cause, "omit it: this takes closed forms")
    return tuple(dict.fromkeys(of))


def _chosen(design: Design, by: Sequence[str]) -> dict[str, float]:
    """The numbers to change, with their values."""
    known = stated_numbers(design)
    if not by:
        if not known:
            cause = f"{design.reference} states no number that could change"
            raise DraftError(cause, "give a parameter a number")
        return known
    found = {}
    for name in dict.fromkeys(by):
        if name not in known:
            raise _no_number(design, name, known)
        found[name] = known[name]
    return found


def _no_number(design: Design, name: str, known: dict[str, float]) -> DraftError:
    """Error of a name that is no stated number of the design."""
    problem = key_problem(with_payload(design.spec, (name,)), name, None)
    if problem is not None:
        return DraftError(problem)
    parameter = design.spec.parameters.get(name)
    if parameter is not None:
        given = design.values.get(name, parameter.value.text)
        return DraftError(f"'{name}' follows from '{given}'", "name what it follows from")
    return DraftError(f"{design.reference} does not state '{name}'", suggest(name, known, "stated"))
