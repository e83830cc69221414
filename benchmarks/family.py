"""Does the policy of a family tell what a body can do? Its robots against policies of their own.

    python -m benchmarks.family --out runs/truth                # 12 bodies of the family's ranges
    python -m benchmarks.family --out runs/truth --family RUN   # with another family
    python -m benchmarks.family --out runs/front --speed-only --tuned 0 \
        --files FRONT/designs/front_001.yaml FRONT/designs/front_002.yaml

Each body is also trained alone by recipe `laptop` (base, velocity, push), and both policies are
rolled out at the same commands and kicks with the definitions of `draft evaluate`. The first bodies
are fine-tuned from the family's policy by recipe `tune`, in a quarter of their own iterations. It
prints a table and draws `OUT/family.png`. What was measured of a body is in `ROWS/BODY.json`
(`--rows`, by default OUT), and is not measured again: rows of policies that were trained elsewhere
can be copied there. It takes some 12 minutes a body on two cores; the same command resumes it.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro
import yaml
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table
from scipy.stats import spearmanr

import draft
from draft.learn.bodies.designs import open_bodies
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.engine.machine import NATIVE, cores
from draft.learn.measuring.levels import PUSH, SKILL_TESTS, SPEED, settle
from draft.learn.measuring.policies import open_source
from draft.learn.measuring.rollout.evaluate import evaluate, trained
from draft.learn.measuring.rollout.trial import Trial
from draft.learn.measuring.scalars import Curve, curves, scalars
from draft.learn.silence import quiet
from draft.learn.task.recipes import LAPTOP, TUNE, RecipeName
from draft.learn.training.ppo.worlds import task_of
from draft.learn.training.run import Plan, Run
from draft.values import scalar

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.training.ppo.loaded import Policy

    Maker = Callable[[ManagerBasedRlEnv], Policy]

ROBOT = "quadruped"
# Ranges of the family that ships (docs/learning.md).
RANGES = {
    "thigh_length": (0.2, 0.36),
    "shank_length": (0.2, 0.36),
    "payload": (0.5, 12.0),
    "actuators.leg.peak_torque": (60.0, 180.0),
    "actuators.leg.no_load_speed": (15.0, 45.0),
}
SKILLS = {"top_speed": "top speed", "kick": "kick", "eta": "efficiency"}
SPEEDS = tuple(0.5 * i for i in range(1, 15))  # [m/s]
KICKS = tuple(float(i) for i in range(1, 11))  # [m/s]
SECONDS = 12.0
STAGES = ("base", "velocity", "push")  # Of the policies of a body alone.
MEDIAN, WORST, FINE = 0.95, 0.85, 0.98  # Bars.


@dataclass(frozen=True)
class Body:
    """A design of the quadruped: its name, the values that make it, and the robot."""

    name: str
    values: dict[str, float]
    robot: LeggedRobot


def main(
    out: str = "runs/truth",
    designs: int = 12,
    seed: int = 1,
    files: tuple[str, ...] = (),
    rows: str | None = None,
    family: str | None = None,
    replicas: int = 32,
    workers: int | None = None,
    iterations: int | None = None,
    tuned: int = 3,
    speed_only: bool = False,
) -> None:
    """Train, measure, print and draw.

    Args:
        out: folder of the runs and of the results.
        designs: number of bodies drawn from the ranges of the family that ships.
        seed: seed of the draws; the family that ships was drawn with 0.
        files: designs to measure instead, as files of `values`.
        rows: folder of what was measured; by default `out`.
        family: run or ONNX file of the family; by default the policy that ships.
        replicas: roll-outs at each command and kick.
        workers: bodies at a time, which share the cores; by default one for each core.
        iterations: of each training, instead of the recipe's: to try the benchmark.
        tuned: number of bodies that are fine-tuned, the first ones.
        speed_only: train no policy that withstands kicks.
    """
    quiet()
    folder, kept = Path(out), Path(rows or out)
    for one in (folder, kept):
        one.mkdir(parents=True, exist_ok=True)
    count = min(workers or cores(), cores())
    bodies = _named(files) if files else drawn(designs, seed)
    stages = STAGES[:-1] if speed_only else STAGES
    measure = partial(_row, folder, kept, family, replicas, cores() // count, iterations, stages)
    with ProcessPoolExecutor(count, get_context("spawn")) as pool:
        found = list(pool.map(measure, bodies, (i < tuned for i in range(len(bodies)))))
    _print(found)
    picture(found).savefig(folder / "family.png", dpi=150)


def drawn(count: int, seed: int) -> list[Body]:
    """Bodies of the family's ranges that its policy was not trained with.

    Args:
        count: number of bodies.
        seed: seed of the draws; the family that ships was drawn with 0.
    """
    vary = [f"{name}={low}:{high}" for name, (low, high) in RANGES.items()]
    found = open_bodies([ROBOT], vary, count, seed=seed)
    return [
        Body(f"body{i:02d}", yaml.safe_load(text)["values"], robot)
        for i, (robot, text) in enumerate(zip(found.members, found.texts, strict=True))
    ]


def _named(files: Sequence[str]) -> list[Body]:
    """Bodies of design files, such as those of a search."""
    found = []
    for path in map(Path, files):
        values = yaml.safe_load(path.read_text(encoding="utf-8"))["values"]
        design = draft.load(ROBOT).resolve(values)
        found.append(Body(path.stem, values, legged_robot(design)))
    return found


def _row(
    folder: Path,
    kept: Path,
    family: str | None,
    replicas: int,
    processes: int,
    iterations: int | None,
    stages: Sequence[str],
    body: Body,
    tune: bool,
) -> dict[str, Any]:
    """Capabilities of a body with each policy; measurements that exist are not repeated."""
    quiet()
    file = kept / f"{body.name}.json"
    row: dict[str, Any] = {"name": body.name, "values": body.values, "leg": body.robot.leg_length}
    if file.is_file():
        row = json.loads(file.read_text(encoding="utf-8"))
        if row["values"] != body.values:
            raise SystemExit(f"{file} is of another body: use another --rows")
    train = partial(_trained, body, folder, processes)
    measure = partial(_measured, body, replicas, processes)
    if "alone" not in row:
        runs = {stage: train(stage, stage, iterations) for stage in stages}
        kick = measure(*_of(runs["push"]))["kick"] if "push" in runs else None
        row["alone"] = {**measure(*_of(runs["velocity"])), "kick": kick}
        _write(file, row)
    source = open_source(family, robot=body.robot)
    if row.get("policy") != source.digest:
        row.pop("tuned", None)
        row["policy"] = source.digest
        row["family"] = measure(source.plan, source.drive.actor("cpu"))
        _write(file, row)
    if tune and "tuned" not in row:
        name = f"tuned-{source.digest[:6]}"
        run = train("velocity", name, iterations, origin=family or "family", recipe=TUNE.name)
        row["tuned"] = measure(*_of(run))
        _write(file, row)
    return row


def _write(file: Path, row: dict[str, Any]) -> None:
    file.write_text(json.dumps(row, indent=1) + "\n", encoding="utf-8")


def _trained(
    body: Body,
    folder: Path,
    processes: int,
    stage: str,
    name: str,
    iterations: int | None,
    origin: str | None = None,
    recipe: RecipeName = LAPTOP.name,
) -> Run:
    """A policy of the body alone."""
    print(f"{body.name}: {name}", flush=True)
    return draft.train(
        ROBOT,
        folder / f"{body.name}-{name}-0",
        stage=stage,
        origin=origin,
        recipe=recipe,
        values=body.values,
        iterations=iterations,
        replicas=processes,
    )


def _of(run: Run) -> tuple[Plan, Maker]:
    return run.plan, trained(run, run.checkpoint()[0], "cpu")


def _measured(
    body: Body, replicas: int, threads: int, plan: Plan, policy: Maker
) -> dict[str, float | None]:
    """Top speed [m/s], kick [m/s] and efficiency of a body with a policy; None for none."""
    by_test = rolled_out((body.robot,), plan, policy, SPEEDS, KICKS, replicas, SECONDS, threads)
    values = scalars(by_test, body.robot.leg_length).values
    return {skill: values.get(skill) for skill in SKILLS}


def rolled_out(
    robots: tuple[LeggedRobot, ...],
    plan: Plan,
    policy: Maker,
    speeds: tuple[float, ...],
    kicks: tuple[float, ...],
    replicas: int,
    seconds: float,
    threads: int,
) -> dict[str, Curve]:
    """Curves of robots together with a policy: `SPEED` over speeds, `PUSH` over kicks.

    Args:
        robots: robots of one topology.
        plan: plan of the policy's run.
        policy: returns the policy for an environment.
        speeds: commands [m/s].
        kicks: largest kicks along x and y [m/s].
        replicas: roll-outs of each robot at each speed and kick.
        seconds: duration of a roll-out [s].
        threads: threads of native MuJoCo.
    """
    tests = (replace(SKILL_TESTS[SPEED], levels=speeds), replace(SKILL_TESTS[PUSH], levels=kicks))
    task = replace(task_of(plan), members=robots)
    start = settle(seconds, tests)
    trial = Trial(task, tests, replicas * len(robots), seconds=seconds, settle=start)
    worlds, _ = evaluate(trial, policy, "cpu", engine=NATIVE, threads=threads)
    return curves(worlds)


def _ratio(row: dict[str, Any], skill: str, policy: str = "family") -> float:
    """Capability with a policy over that with the body's own; NaN if the latter has none."""
    one, own = row[policy][skill], row["alone"][skill]
    if own is None:
        return math.nan
    return 0.0 if one is None else one / own


def _print(rows: Sequence[dict[str, Any]]) -> None:
    table = Table(box=None, title="of the family / alone / ratio")
    table.add_column("body")
    for words in SKILLS.values():
        table.add_column(words, justify="right")
    for row in rows:
        cells = []
        for skill in SKILLS:
            numbers = (row["family"][skill], row["alone"][skill])
            both = " / ".join("none" if one is None else f"{one:.2f}" for one in numbers)
            cells.append(f"{both} / {_ratio(row, skill):.2f}")
        table.add_row(row["name"], *cells)
    console = Console()
    console.print(table)
    for skill, words in SKILLS.items():
        known = [row for row in rows if row["alone"][skill] is not None]
        found = [_ratio(row, skill) for row in known]
        if found:
            console.print(
                f"{words}: median {statistics.median(found):.2f} (bar {MEDIAN}), worst "
                f"{min(found):.2f} (bar {WORST}), {len(found)} bodies{_order(known, skill)}"
            )
    for row in rows:
        if "tuned" in row:
            ratio = _ratio(row, "top_speed", "tuned")
            console.print(f"{row['name']}, fine-tuned: {ratio:.2f} of its top speed (bar {FINE})")


def _order(rows: Sequence[dict[str, Any]], skill: str) -> str:
    """How well the order of bodies by the family's policy is that by their own, in words."""
    if len(rows) < 3:
        return ""
    family = [row["family"][skill] or 0.0 for row in rows]
    found: Any = spearmanr(family, [row["alone"][skill] for row in rows])  # Untyped by SciPy.
    return f", rank correlation {found.statistic:.2f}"


def picture(rows: Sequence[dict[str, Any]]) -> Figure:
    """Map of the ratios over leg length and peak torque, one panel for each skill."""
    drawn = Figure(figsize=(9.0, 3.4), layout="constrained")
    norm, cmap = Normalize(0.7, 1.3), "RdBu"
    axes = drawn.subplots(1, len(SKILLS), sharey=True)
    design = draft.load(ROBOT)
    leg = [row["leg"] for row in rows]
    torque = [scalar(design.resolve(row["values"]).actuators["leg"].peak_torque) for row in rows]
    for ax, (skill, words) in zip(axes, SKILLS.items(), strict=True):
        ratios = [_ratio(row, skill) for row in rows]
        ax.scatter(leg, torque, c=ratios, s=70, norm=norm, cmap=cmap, edgecolors="0.3")
        for i, ratio in enumerate(ratios):
            y = -7 if _below(leg, torque, i) else 7
            at = {"xytext": (0, y), "textcoords": "offset points"}
            side = {"ha": "center", "va": "top" if y < 0 else "bottom"}
            ax.annotate(f"{ratio:.2f}", (leg[i], torque[i]), fontsize=7, **at, **side)
        ax.set_title(words, fontsize=9)
        ax.set_xlabel("leg length [m]")
        ax.margins(0.15)
    axes[0].set_ylabel("peak torque [N m]")
    drawn.colorbar(ScalarMappable(norm, cmap), ax=axes[-1], label="family / alone", extend="both")
    return drawn


def _below(leg: Sequence[float], torque: Sequence[float], i: int) -> bool:
    """Whether the number of a body is written below its dot, because another one is above it."""
    near = (0.1 * (max(leg) - min(leg)), 0.15 * (max(torque) - min(torque)))
    return any(
        abs(leg[k] - leg[i]) < near[0] and 0 <= torque[k] - torque[i] < near[1]
        for k in range(len(leg))
        if k != i
    )


if __name__ == "__main__":
    tyro.cli(main)
