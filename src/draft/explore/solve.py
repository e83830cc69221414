"""The nearest design that meets conditions, and what stands in the way where none does.

The conditions, the numbers that may change and their ranges are read here; `nearest` searches by
closed forms, `learned_solve` by roll-outs.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from draft.design import Design
from draft.errors import DraftError
from draft.explore import goals, where
from draft.explore.goals import Constraint, by_rollouts
from draft.explore.nearest import Search, Solution
from draft.explore.sensitivity import stated_numbers
from draft.explore.settings import Progress, TargetSettings
from draft.metrics import LEARNED, find, of_design
from draft.spec.expressions import syntax_tree
from draft.variation.axes import Axis, Vary, parse

REACH = 2.0  # A number without a range of its own is varied from its half to its double.


def solve(
    design: Design,
    conditions: Sequence[str],
    vary: Vary = (),
    keep: Sequence[str] = (),
    *,
    seed: int = 0,
    replicas: int = 6,
    policy: str | Path | None = None,
    progress: Progress | None = None,
) -> Solution:
    """Find the nearest accepted design that meets all conditions.

        >>> bear = draft.load("quadruped").resolve("bear")
        >>> found = draft.solve(bear, ["mass <= 100", "payload_rated >= 200"])
        >>> found.design.accepted, round(float(found.design.mass)) <= 100
        (True, True)

    Args:
        design: one design.
        conditions: expressions of metrics, parameters and values of actuators, as `where` of a
            screen: "top_speed >= 3", "mass <= 30 and jump_height > 0.3". Those of learned metrics
            hold where they do so in 95 % of what roll-outs leave open.
        vary: ranges of the numbers that may change, by name or as words; empty for all that the
            design states, each within the range of its parameter and at most doubled or halved.
        keep: numbers that stay as they are.
        seed: seed of the designs that are drawn, and of the roll-outs.
        replicas: roll-outs of each body at each speed and kick, for learned conditions; there are
            about 120 bodies.
        policy: see `draft.metrics.of_policy`.
        progress: called with the bodies rolled out and their number, in each round.

    Raises:
        DraftError: the design is several, nothing may vary, a name is unknown or both kept and
            varied, or a condition is no comparison of known names, needs a model, or is undefined
            for the design; or a learned metric cannot be measured.
    """
    if design.count is not None:
        raise DraftError("a search starts from one design", "select one, such as `design[0]`")
    wanted = _conditions(design, conditions)
    axes = _axes(design, vary, keep)
    rng = np.random.default_rng(seed)
    if not any(by_rollouts(one) for one in wanted):
        return Search(design, wanted, axes, rng).run()
    from draft.explore.learned_solve import RolledOutSearch

    settings = TargetSettings.of({"replicas": replicas, "policy": policy, "progress": progress})
    return RolledOutSearch(design, wanted, axes, rng, settings, seed).run()


def _conditions(design: Design, texts: Sequence[str]) -> tuple[Constraint, ...]:
    """Conditions of a target, and that the filter accepts the design."""
    if not texts:
        raise DraftError("there is no condition", 'such as "top_speed >= 3"')
    found = goals.constraints(design.spec, [*texts, "accepted"])
    for one in found:
        if any(find(name).needs == "model" for name in one.holds.metrics):
            cause = f"`{one.text}` needs a compiled model"
            remedy = "use closed-form or learned metrics: 'draft metrics' lists them"
            raise DraftError(cause, remedy)
        if one.gap is None or one.text == "accepted":
            continue
        needed = {name for side in one.gap for name in side.metrics if name not in LEARNED}
        values = of_design(design, needed)
        undefined = [name for name in needed if np.isnan(np.asarray(values[name])).any()]
        if undefined:
            cause = f"`{one.text}`: {design.reference} has no {', '.join(sorted(undefined))}"
            raise DraftError(cause, "use metrics that it has")
    contradictory(texts)
    return found


def contradictory(texts: Sequence[str]) -> None:
    """Refuse conditions that exclude each other whatever the design.

    Raises:
        DraftError: two compare the same with numbers that leave nothing between them.
    """
    ends: dict[str, dict[bool, tuple[float, bool, str]]] = {}
    for text in texts:
        for node in where.conjuncts(syntax_tree(text.strip()).body):
            match node:
                case ast.Compare(
                    left=left, ops=[ast.Lt() | ast.LtE() as sign], comparators=[right]
                ):
                    below = True
                case ast.Compare(
                    left=left, ops=[ast.Gt() | ast.GtE() as sign], comparators=[right]
                ):
                    below = False
                case _:
                    continue
            number = _number(right)
            if number is None:
                continue
            name, strict = ast.unparse(left), isinstance(sign, ast.Lt | ast.Gt)
            known = ends.setdefault(name, {}).get(below)
            closer = known is None or (number < known[0] if below else number > known[0])
            if closer:
                ends[name][below] = number, strict, ast.unparse(node)
    for name, of in ends.items():
        if len(of) < 2:
            continue
        (high, open_high, above), (low, open_low, under) = of[True], of[False]
        if low > high or (low == high and (open_high or open_low)):
            cause = f"`{above}` and `{under}` exclude each other: no {name} meets both"
            raise DraftError(cause, "omit one of them")


def _number(node: ast.expr) -> float | None:
    try:
        value = ast.literal_eval(node)
    except ValueError:
        return None
    return float(value) if isinstance(value, int | float) else None


def _axes(design: Design, vary: Vary, keep: Sequence[str]) -> tuple[Axis, ...]:
    """Ranges of the numbers that may change."""
    known = stated_numbers(design)
    if len(vary):
        axes = parse(design.spec, vary)
        for axis in axes:
            if axis.name in keep:
                raise DraftError(f"'{axis.name}' is both kept and varied", "name it once")
            if axis.name not in known:
                cause = f"{design.reference} does not state '{axis.name}' as a number"
                raise DraftError(cause, "vary numbers that it states")
        return axes
    for name in keep:
        if name not in known:
            cause = f"'{name}' cannot be kept: {design.reference} does not state it as a number"
            raise DraftError(cause, f"its numbers are {', '.join(known)}")
    axes = []
    for name, value in known.items():
        if name in keep or value == 0:
            continue
        low, high = sorted((value / REACH, value * REACH))
        parameter = design.spec.parameters.get(name)
        if parameter is not None and parameter.bounds is not None:
            low, high = max(low, parameter.bounds[0]), min(high, parameter.bounds[1])
        if low < high:
            axes.append(Axis(name, low, high))
    if not axes:
        raise DraftError("no number may change", "give `vary`, or keep fewer")
    return tuple(axes)
