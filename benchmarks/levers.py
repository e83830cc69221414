"""Effects of numbers and targets: how fast they are found, and how right they are.

`python -m benchmarks.levers` prints a table and writes `benchmarks/results/levers.json`. Effects
are held against models that MuJoCo compiles, solutions and conflicts against a plain search of two
million designs. Speeds hold for two idle cores.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

import draft
from benchmarks.rows import measured, publish, timed
from draft.design import Design
from draft.explore.goals import constraints
from draft.explore.sensitivity import sensitivity, stated_numbers
from draft.metrics import of_design, of_model
from draft.variation.axes import parse

ROUNDS = 5
PAIRS = 100
PROBLEMS, CONFLICTS = 50, 30
SEARCHED, EACH = 2_000_000, 250_000
MODELS = ("mass", "impact_mitigation", "foot_inertia", "reflected_share")
METRICS = ("mass", "payload_rated", "jump_height", "top_speed", "hold_time", "reach")
ROBOTS = ("cheetah", "bear", "giraffe")


def main() -> None:
    """Measure everything, print a table and write it as JSON."""
    publish("levers", [*speeds(), *effects(), *solutions(), *conflicts()])


def speeds() -> list[dict[str, Any]]:
    """The command from start to end, the warm call, and a search of four conditions."""
    command = [sys.executable, "-m", "draft", "sensitivity", "bear"]
    whole = min(
        timed(lambda: subprocess.run(command, capture_output=True, check=True))[0]
        for _ in range(ROUNDS)
    )
    bear = _designs()["bear"]
    sensitivity(bear)
    warm = statistics.median(timed(lambda: sensitivity(bear))[0] for _ in range(ROUNDS))
    rng = np.random.default_rng(0)
    search = statistics.median(
        timed(lambda one=one: draft.solve(*one))[0]
        for one in (_problem(rng, count=4) for _ in range(ROUNDS))
    )
    return [
        measured("draft sensitivity bear, whole command, best of 5", whole, "s", 1.0),
        measured("the same call when warm", 1000 * warm, "ms", 100),
        measured("solve, five numbers, four conditions", search, "s", 2.0),
    ]


def effects() -> list[dict[str, Any]]:
    """Effects of random numbers of designs, against models that MuJoCo compiles one by one."""
    rng = np.random.default_rng(0)
    designs, errors = list(_designs().values()), dict.fromkeys(MODELS, 0.0)
    pairs = 0
    while pairs < PAIRS:
        design = designs[rng.integers(len(designs))]
        name = str(rng.choice(list(stated_numbers(design))))
        found = sensitivity(design, MODELS, [name])
        moved = {name: stated_numbers(design)[name] + float(found.steps[0])}
        after = design.spec.resolve(design.values, moved)
        if not after.accepted or np.isnan(found.step_up[0]).any():
            continue
        pairs += 1
        values = [of_model(one.build(), MODELS) for one in (design, after)]
        for k, metric in enumerate(MODELS):
            wanted = values[1][metric] - values[0][metric]
            if abs(wanted) > 1e-9 * abs(values[0][metric]):
                error = abs(float(found.step_up[0, k]) / wanted - 1)
                errors[metric] = max(errors[metric], error)
    return [
        measured(f"effects on {metric}, {PAIRS} models, largest error", 100 * error, "%", 1.0)
        for metric, error in errors.items()
    ]


def solutions() -> list[dict[str, Any]]:
    """Changes that solve finds, over those that a plain search finds."""
    rng = np.random.default_rng(1)
    ratios: list[float] = []
    while len(ratios) < PROBLEMS:
        design, conditions, vary = _problem(rng, count=3)
        found = draft.solve(design, conditions, vary)
        if not found.moved and found.conflict is None:
            continue
        best = searched(design, conditions, vary, seed=len(ratios))
        if best is not None:
            ratios.append(np.inf if found.conflict is not None else found.change / best)
    near = 100 * float(np.mean(np.array(ratios) <= 1.02))
    return [
        measured(
            f"solutions within 2 % of a search of 2e6, {PROBLEMS} problems", near, "%", 90, True
        ),
        measured("change / change of that search, median", statistics.median(ratios), ""),
    ]


def conflicts() -> list[dict[str, Any]]:
    """Sets that are named as excluding each other: no design meets them, some meet each part."""
    rng = np.random.default_rng(2)
    right = count = 0
    while count < CONFLICTS:
        design, conditions, vary = _problem(rng, count=4, hard=True)
        conflict = draft.solve(design, conditions, vary).conflict
        if conflict is None:
            continue
        count += 1
        named = list(conflict.conditions)
        whole = searched(design, named, vary, seed=count)
        parts = [
            searched(design, [one for one in named if one != left], vary, seed=count)
            for left in named
        ]
        good = whole is None and all(part is not None for part in parts)
        right += good
        if not good:
            print(design.reference, vary, named, whole, parts)
    return [
        measured(
            f"conflicts that a search of 2e6 confirms, of {CONFLICTS}", right, "", CONFLICTS, True
        )
    ]


def searched(
    design: Design, conditions: Sequence[str], vary: dict[str, tuple[float, float]], seed: int
) -> float | None:
    """Least change of the accepted designs that meet conditions; None where there is none.

    Half of the designs are uniform over the ranges, half lie in boxes around the start.
    """
    rng = np.random.default_rng(seed)
    axes = parse(design.spec, vary)
    numbers = stated_numbers(design)
    start = np.array([numbers[axis.name] for axis in axes])
    low, high = (np.array([getattr(a, end) for a in axes]) for end in ("low", "high"))
    wanted = constraints(design.spec, conditions)
    metrics = sorted({name for one in wanted for name in one.holds.metrics})
    best: float | None = None
    for k in range(SEARCHED // EACH):
        if k % 2:
            drawn = rng.uniform(low, high, (EACH, len(axes)))
        else:
            size = rng.random((EACH, 1))
            drawn = np.clip(
                start + size * rng.uniform(-1, 1, (EACH, len(axes))) * (high - low), low, high
            )
        change = np.sqrt((((drawn - start) / (high - low)) ** 2).mean(axis=1))
        if best is not None:
            drawn, change = drawn[change < best], change[change < best]
            if not len(drawn):
                continue
        many = design.spec.resolve(design.values, {a.name: drawn[:, i] for i, a in enumerate(axes)})
        values = of_design(many, metrics)
        met = np.broadcast_to(many.accepted, len(drawn)).copy()
        for one in wanted:
            met &= np.asarray(one.violation(many, values)) == 0
        if met.any():
            best = float(change[met].min())
    return best


def _designs() -> dict[str, Design]:
    spec = draft.load("quadruped")
    return {name: spec.resolve(name) for name in ROBOTS}


def _problem(
    rng: np.random.Generator, count: int, hard: bool = False
) -> tuple[Design, list[str], dict[str, tuple[float, float]]]:
    """A random target: five numbers may change, each condition asks for more than there is."""
    design = _designs()[ROBOTS[rng.integers(len(ROBOTS))]]
    numbers = {k: x for k, x in stated_numbers(design).items() if x > 0}
    vary = {}
    for name in rng.permutation(list(numbers))[:5]:
        bounds = getattr(design.spec.parameters.get(str(name)), "bounds", None) or (0.0, np.inf)
        value = numbers[str(name)]
        vary[str(name)] = max(value / 1.6, bounds[0]), min(value * 1.6, bounds[1])
    conditions = []
    for metric in rng.permutation(METRICS)[:count]:
        value = float(of_design(design, [metric])[metric])
        if not np.isfinite(value):
            continue
        more = rng.uniform(0.02, 0.6 if hard else 0.25)
        sign, by = ("<=", 1 - more) if metric == "mass" else (">=", 1 + more)
        conditions.append(f"{metric} {sign} {value * by:.6g}")
    return design, conditions, vary


if __name__ == "__main__":
    main()
