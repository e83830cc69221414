"""Study folders with made-up but plausible results: what a report is written from."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from draft.learn.bodies.legged import CLASSES, LeggedRobot, legged_robot
from draft.learn.measuring.results import OCCUPANCY, UTILISATION
from draft.learn.measuring.summary import FORMAT
from draft.learn.measuring.utilisation import BINS, CELL, CELLS, WIDTH
from draft.learn.task.stages import PUBLISHED
from draft.learn.training.members import robots_digest
from draft.learn.training.run import Plan, Run, create
from draft.model.folder import design_text
from draft.spec import load
from tests.learn.small import member, plan

DESIGNS = ("cheetah", "bear", "giraffe")
SPEED = [0.2, 0.4, 0.6, 0.8, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5, 5, 5.5, 6, 7, 8, 10, 12, 14, 17, 20]
STEPS = [round(0.05 + 0.025 * i, 3) for i in range(19)]
KICKS = [1 + 0.5 * i for i in range(23)]
TESTS = {"base": ["walk"], "velocity": ["speed"], "terrain": ["ascent", "descent"]}
TESTS |= {"push": ["push"]}
ITERATIONS = {"base": 1200, "velocity": 1800, "terrain": 2000, "push": 1500}
# Top speed, step, kick and efficiency that the made-up policies are about.
ABLE = {
    "cheetah": (3.4, 0.22, 3.1, 0.42),
    "bear": (3.0, 0.31, 4.2, 0.55),
    "giraffe": (1.7, 0.41, 3.6, 0.68),
}


def study(
    folder: Path,
    designs: Sequence[str] = DESIGNS,
    seeds: Sequence[int] = (0, 1, 2),
    arms: Sequence[str] = ("nominal", "perturbed"),
    stages: Iterable[str] = tuple(stage.name for stage in PUBLISHED),
    protocols: Sequence[str] = ("walking",),
) -> Path:
    """Write a study of designs trained each for itself."""
    for design in designs:
        for stage in stages:
            for seed in seeds:
                run = trained(folder, design, stage, seed)
                for arm in arms:
                    for protocol in protocols:
                        evaluated(run, arm, protocol)
    return folder


def trained(folder: Path, design: str, stage: str, seed: int, name: str | None = None) -> Run:
    """Write a run with its progress."""
    made = plan(design, stage=stage, seed=seed, environments=4096, values=_long(stage))
    text = design_text(load("quadruped").resolve(design))
    one = create(folder / "runs" / (name or f"{design}-{stage}-{seed}"), made, {_name(made): text})
    progress(one)
    return one


def _long(stage: str) -> dict[str, Any]:
    return {f"learning.iterations_{stage}": ITERATIONS[stage], "learning.steps": 24}


def _name(made: Plan) -> str:
    return made.members[0].name


def progress(run: Run) -> None:
    """Write how a run learned."""
    rng = _rng(run)
    stage = run.plan.stage
    count = ITERATIONS[stage] // 10
    at = np.arange(1, count + 1) * 10
    slow = 0.15 + 0.03 * len(run.plan.members[0].name) / 10 + 0.02 * rng.random()
    done = 1 - np.exp(-at / at[-1] / slow)
    rows = zip(
        at,
        2.8 * done + 0.1 * rng.standard_normal(count) * (1.2 - done) + 0.2 * rng.random(),
        np.abs(0.75 - 0.55 * done + 0.02 * rng.standard_normal(count)),
        np.where(at < 30, np.nan, np.clip(1.05 - done + 0.03 * rng.standard_normal(count), 0, 1)),
        strict=True,
    )
    with (run.folder / "progress.csv").open("w", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["iteration", "reward", "tracking_error", "falls"])
        table.writerows([[f"{x:.6g}" for x in row] for row in rows])
    run.note(ITERATIONS[stage], 2.1 * ITERATIONS[stage], 1, "warp", ITERATIONS[stage])


def able(design: str, seed: int, arm: str) -> tuple[float, float, float, float]:
    """What a made-up policy can do: top speed, step, kick, efficiency."""
    lose = 0.93 if arm == "perturbed" else 1.0
    vary = 1 + 0.03 * ((seed * 7) % 5 - 2)
    speed, step, kick, eta = ABLE[design]
    return speed * vary * lose, step * vary * lose, kick * vary * lose, eta * (0.5 + vary / 2)


def evaluated(
    run: Run, arm: str = "nominal", protocol: str = "walking", change: Any = None
) -> Path:
    """Write an evaluation of a run of one design; `change` may alter its summary."""
    design = run.plan.members[0].name.partition(":")[2]
    values = able(design, run.plan.seed, arm)
    summary = _summary(run, arm, protocol)
    summary["tests"] = {name: _curve(name, values) for name in TESTS[run.plan.stage]}
    summary["scalars"] = _scalars(run.plan.stage, values, run.plan.members[0].leg_length)
    levels = {name: _level(name, summary) for name in summary["tests"]}
    summary["utilisation_level"] = levels
    counts, planes = _counts(run, levels)
    summary["utilisation"] = {name: _shares(counts[name]) for name in levels}
    summary["limiting"] = {
        name: {"joint": "knee", "by": "speed", "value": shares["knee"]["speed"]}
        for name, shares in summary["utilisation"].items()
    }
    if change is not None:
        change(summary)
    folder = run.folder / "evaluation" / f"{arm}-{protocol}"
    folder.mkdir(parents=True)
    _parquet(folder, counts, planes, levels, run.plan.members[0].name)
    (folder / "summary.json").write_text(json.dumps(summary, indent=2) + "\n")
    return folder


def _summary(run: Run, arm: str, protocol: str) -> dict[str, Any]:
    one = run.plan.members[0]
    return {
        "format": FORMAT,
        "design": one.name,
        "members": [m.name for m in run.plan.members],
        **{"leg_length": one.leg_length, "mass": one.mass, "top_speed_estimate": one.top_speed},
        **{"stage": run.plan.stage, "seed": run.plan.seed, "checkpoint": "0" * 16},
        "iteration": ITERATIONS[run.plan.stage],
        "robots": robots_digest(run.plan.members),
        **{"arm": arm, "protocol": protocol, "replicas": 256, "seconds": 12.0, "settle": 2.0},
        "errors": "twins" if arm == "perturbed" else None,
        **{"evaluation_seed": 1, "versions": {"draft": "0"}, "device": "made up", "took_s": 30.0},
        "flags": ["7 m/s and more are outside of the commands that it was trained on"]
        if run.plan.stage == "velocity"
        else [],
        "reasons": {},
    }


def _drop(x: Any, middle: float, width: float) -> list[float]:
    """A share that falls from 1 to 0 about a value."""
    share = 1 / (1 + np.exp((np.asarray(x) - middle) / width))
    return [round(float(s) * 256) / 256 for s in share]


def _curve(name: str, able: tuple[float, float, float, float]) -> dict[str, Any]:
    speed, step, kick, eta = able
    if name == "speed":
        reached = [speed * math.tanh((x / speed) ** 1.3) ** (1 / 1.3) for x in SPEED]
        survival = _drop(SPEED, 2.6 * speed, 0.35 * speed)
        etas = [eta * (v / speed) ** 0.45 for v in reached]
        known = [s > 0 for s in survival]
        return {
            "levels": SPEED,
            "survival": survival,
            "speed": [v if k else None for v, k in zip(reached, known, strict=True)],
            "eta": [v if k else None for v, k in zip(etas, known, strict=True)],
        }
    if name == "walk":
        return {"levels": [0.4], "survival": [0.996], "speed": [0.39], "eta": [eta * 0.6]}
    if name == "push":
        recovered = _drop(KICKS, kick, 0.45)
        return {"levels": KICKS, "survival": recovered, "recovered": recovered} | _unknown(KICKS)
    share = _drop(STEPS, step * (1.08 if name == "descent" else 0.94), 0.025)
    return {"levels": STEPS, "survival": share, "traversed": share} | _unknown(STEPS)


def _unknown(levels: Sequence[float]) -> dict[str, Any]:
    return {name: [None] * len(levels) for name in ("speed", "eta")}


def _scalars(stage: str, able: tuple[float, ...], leg: float) -> dict[str, float]:
    speed, step, kick, eta = able
    froude = math.sqrt(9.81 * leg)
    return {
        "base": {"walk_speed": 0.39, "walk_survival": 0.996},
        "velocity": {"top_speed": speed, "peak_command": 5.0, "eta": eta}
        | {"top_speed_normalised": speed / froude},
        "terrain": {"step": step, "step_ascent": 0.94 * step, "step_descent": 1.08 * step}
        | {"step_normalised": step / leg},
        "push": {"kick": kick, "kick_normalised": kick / froude},
    }[stage]


def _level(name: str, summary: dict[str, Any]) -> float:
    return {"speed": 5.0, "walk": 0.4, "push": 2.5}.get(name, 0.1)


Counts = dict[str, dict[tuple[str, str], np.ndarray]]
Planes = dict[str, dict[str, np.ndarray]]


def _counts(run: Run, levels: dict[str, float]) -> tuple[Counts, Planes]:
    """Samples by bin and by cell; the knee is the fastest, the hip pitch the strongest."""
    rng = _rng(run)
    found: Counts = {}
    planes: Planes = {}
    for test in levels:
        found[test], planes[test] = {}, {}
        for joint, strong, quick in zip(CLASSES, (2.0, 3.2, 2.6), (1.4, 2.4, 4.2), strict=True):
            torque = rng.beta(strong, 6, 20_000) * 1.05
            speed = rng.beta(quick, 5, 20_000) * 1.15
            for name, values in (("torque", torque), ("speed", speed), ("sum", torque + speed)):
                bins = np.minimum(values / WIDTH, BINS - 1).astype(int)
                found[test][joint, name] = np.bincount(bins, minlength=BINS)
            row, column = (np.minimum(v / CELL, CELLS - 1).astype(int) for v in (torque, speed))
            cells = np.bincount(row * CELLS + column, minlength=CELLS * CELLS)
            planes[test][joint] = cells.reshape(CELLS, CELLS)
    return found, planes


def _shares(counts: dict[tuple[str, str], np.ndarray]) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for (joint, quantity), bins in counts.items():
        at = int(np.searchsorted(np.cumsum(bins), 0.95 * bins.sum()))
        found.setdefault(joint, {"near_peak": 0.01})[quantity] = 0.005 * (at + 1)
    return found


def _parquet(
    folder: Path, counts: Counts, planes: Planes, levels: dict[str, float], name: str
) -> None:
    bins = [
        (test, levels[test], name, joint, quantity, bin_, int(count))
        for test, found in counts.items()
        for (joint, quantity), values in found.items()
        for bin_, count in enumerate(values)
        if count
    ]
    cells = [
        (test, levels[test], name, joint, *at, int(values[tuple(at)]))
        for test, found in planes.items()
        for joint, values in found.items()
        for at in np.argwhere(values).tolist()
    ]
    whose = ("test", "level", "member", "joint")
    for file, own, rows in (
        (UTILISATION, ("quantity", "bin", "count"), bins),
        (OCCUPANCY, ("torque", "speed", "count"), cells),
    ):
        columns = [list(column) for column in zip(*rows, strict=True)]
        pq.write_table(pa.table(dict(zip((*whose, *own), columns, strict=True))), folder / file)


def family(
    folder: Path,
    value: Callable[[float, float], float],
    thighs: Sequence[float] = (0.21, 0.24, 0.27, 0.3),
    reductions: Sequence[float] = (5.0, 6.0, 8.0, 10.0),
    stage: str = "velocity",
    seed: int = 0,
) -> Run:
    """Write a family's run whose members' top speed is a function of thigh and reduction."""
    spec = load("quadruped")
    cheetah = dict(spec.resolve("cheetah").values)
    members: list[LeggedRobot] = []
    texts: dict[str, str] = {}
    scalars: dict[str, float] = {}
    for thigh in thighs:
        for ratio in reductions:
            changed = {"thigh_length": thigh, "actuators.leg.gear_ratio": ratio}
            design = spec.resolve(cheetah | changed)
            one = replace(legged_robot(design), name=f"quadruped-{len(members) + 1}")
            members.append(one)
            texts[one.name] = design_text(design)
            scalars[one.name] = value(thigh, ratio)
    small = plan(stage=stage, seed=seed, environments=4096, values=_long(stage))
    run = create(
        folder / "runs" / f"family-{stage}-{seed}", replace(small, members=tuple(members)), texts
    )
    progress(run)
    summary = _summary(run, "nominal", "walking")
    summary["tests"] = {}
    summary["scalars"] = {"top_speed": None}
    summary["reasons"] = {"top_speed": "a family has one for each member"}
    summary["by_member"] = {one.name: _of_member(one, scalars[one.name]) for one in members}
    target = run.folder / "evaluation" / "nominal-walking"
    target.mkdir(parents=True)
    (target / "summary.json").write_text(json.dumps(summary))
    return run


def _of_member(one: LeggedRobot, speed: float) -> dict[str, Any]:
    """What a family's evaluation tells of a member that reaches a speed."""
    joint = "knee" if one.leg_length > 0.5 else "hip pitch"
    return {
        "leg_length": one.leg_length,
        "mass": one.mass,
        "tests": {"speed": _curve("speed", (speed, 0.2, 3.0, 0.5))},
        "scalars": {"top_speed": speed, "peak_command": 5.0},
        "limiting": {"speed": {"joint": joint, "by": "speed", "value": 0.97}},
    }


def _rng(run: Run) -> np.random.Generator:
    names = "".join(one.name for one in run.plan.members)
    return np.random.default_rng([sum(map(ord, names + run.plan.stage)), run.plan.seed])


__all__ = ["able", "evaluated", "family", "member", "progress", "study", "trained"]
