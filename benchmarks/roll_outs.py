"""Roll-outs of a policy: what robots do at commands in units of their size.

With leg length L and gravity g, velocities are per sqrt(g L) and rates of turn per sqrt(g / L). A
roll-out starts near the home pose, with the noise, the delays and the errors of the training. One
that falls counts as fallen; its velocities do not count.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from rich.table import Table

from benchmarks.rows import measured
from draft.errors import DraftError
from draft.files import write
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.bodies.slots import describe
from draft.learn.engine.machine import NATIVE
from draft.learn.measuring.policies import Source
from draft.learn.measuring.utilisation import QUANTITIES, limiting, percentile
from draft.learn.policy.policy import velocity_noise
from draft.learn.policy.reduced import LegsPolicy, speed_units
from draft.learn.silence import quiet
from draft.learn.training.run import file_digest
from draft.values import Array, brief

if TYPE_CHECKING:
    from draft.learn.measuring.rollout.trial import Layout

SECONDS, SETTLE = 12.0, 3.0  # Of a roll-out, and its part that is not measured [s].
PUSH = 0.5  # Largest velocity of a push, per sqrt(g L), along x and along y.
SIDEWAYS, TURN = 0.2, 0.3
WIDTH = 140  # Of tables [characters].
FOLLOWED = 1 / 3  # Largest relative error of a velocity that counts as followed.


@dataclass(frozen=True)
class Case:
    """What is asked of a robot.

    Attributes:
        name: its name.
        command: vx and vy per sqrt(g L), and wz per sqrt(g / L).
        push: largest velocity of pushes along x and y after a quarter, a half and three quarters
            of the time, per sqrt(g L); 0 for none.
    """

    name: str
    command: tuple[float, float, float]
    push: float = 0.0

    @staticmethod
    def ahead(speed: float) -> Case:
        """A command straight ahead."""
        return Case(f"{speed:g}", (speed, 0.0, 0.0))


@dataclass(frozen=True)
class Rolled:
    """Roll-outs of robots at cases; arrays of shape (cases, replicas, robots, ...).

    Attributes:
        cases: the cases.
        fell: whether it fell.
        velocity: mean vx and vy per sqrt(g L), and wz per sqrt(g / L), shape (..., 3).
        error: mean over time of the distance of (vx, vy) from the command, per sqrt(g L).
        shares: for each robot and case the 95th percentiles of its joint classes, as shares of
            their limits, as `draft.learn.measuring.utilisation` has them.
    """

    cases: tuple[Case, ...]
    fell: Array
    velocity: Array
    error: Array
    shares: tuple[tuple[Mapping[str, Mapping[str, float | None]], ...], ...]

    def up(self, case: int) -> float:
        """Share of roll-outs that stay up."""
        return float(1.0 - self.fell[case].mean())

    def mean_error(self, case: int) -> float | None:
        """Mean error of the velocity of those that stay up, per sqrt(g L); None for none."""
        return _mean(self.error[case], self.fell[case])

    def reached(self, case: int) -> float | None:
        """Mean velocity along the command, of those that stay up; None for none."""
        wanted = np.array(self.cases[case].command)
        size = float(np.linalg.norm(wanted))
        along = self.velocity[case] @ wanted / size if size else self.velocity[case][..., 0]
        return _mean(along, self.fell[case])

    def followed(self, case: int) -> float:
        """Share of all roll-outs that stay up and whose mean velocity is within a third."""
        wanted = np.array(self.cases[case].command)
        gap = np.linalg.norm(self.velocity[case] - wanted, axis=-1)
        near = gap <= FOLLOWED * np.linalg.norm(wanted) + 1e-9
        return float((near & (self.fell[case] == 0)).mean())

    def limit(self, case: int, robot: int = 0) -> dict[str, Any] | None:
        """Joint class of a robot nearest its limit, and whether torque or speed; None if unknown.

        The sum of both over their limits is 1 on the torque-speed line.
        """
        shares = self.shares[robot][case]
        known = all(one["sum"] is not None for one in shares.values())
        return dict(limiting(shares)) if shares and known else None


def rolled_out(
    source: Source,
    members: Sequence[LeggedRobot],
    cases: Sequence[Case],
    *,
    replicas: int,
    seconds: float = SECONDS,
    seed: int = 0,
    threads: int = 1,
    velocity_noise: float | None = None,
) -> Rolled:
    """Roll out robots of one topology side by side, natively.

    Args:
        source: the policy.
        members: the robots.
        cases: what is asked.
        replicas: roll-outs of each robot at each case.
        seconds: duration of a roll-out [s].
        seed: seed of starts, noise and pushes.
        threads: threads of MuJoCo.
        velocity_noise: largest error of the observed velocity [m/s]; None for that of the training.

    Raises:
        DraftError: the policy does not drive a robot.
    """
    import torch

    from draft.learn.engine.worlds.simulate import make
    from draft.learn.measuring.rollout.evaluate import roll_out
    from draft.learn.measuring.rollout.trial import Trial
    from draft.learn.measuring.rollout.trial_env import env_cfg
    from draft.learn.task.mdp.commands import command_term
    from draft.learn.task.world.access import robot_of
    from draft.learn.task.world.task import Task

    torch.set_num_threads(1)
    plan = source.plan
    of_plan = {"see_design": plan.see_design, "see_ground": plan.see_ground, "seed": seed}
    config = plan.config
    if velocity_noise is not None:
        config = config.with_values({"observations.linear_velocity_noise": velocity_noise})
    task = Task(tuple(members), plan.stage, config, "flat", **of_plan)
    settle = seconds * SETTLE / SECONDS
    trial = Trial(task, (), replicas * len(members), seconds, settle, seed=seed)
    sizes = np.array([speed_units(member) for member in members])  # (robots, 3)
    wanted = np.array([case.command for case in cases])[:, None, None, :] * sizes
    worlds = (len(cases), replicas, len(members))
    commands = np.broadcast_to(wanted, (*worlds, 3)).reshape(-1, 3).copy()
    pushes = np.array([case.push for case in cases])[:, None, None] * sizes[:, 0]
    layout = _layout(cases, members, commands, np.broadcast_to(pushes, worlds).reshape(-1))
    with contextlib.redirect_stdout(io.StringIO()):  # mjlab prints the environment.
        env = make(env_cfg(trial, (), layout), "cpu", NATIVE, threads)
    try:
        held = torch.from_numpy(commands).float()
        command_term(env).hold(held)
        robot = robot_of(env)
        sums, errors = torch.zeros(len(held), 3).double(), torch.zeros(len(held)).double()
        count = 0

        def sample(_: str, step: int, steps: int) -> None:
            nonlocal count
            if step <= round(settle / env.step_dt):
                return
            count += 1
            linear, angular = robot.data.root_link_lin_vel_b, robot.data.root_link_ang_vel_b
            sums.add_(torch.cat((linear[:, :2], angular[:, 2:]), dim=1))
            errors.add_((linear[:, :2] - held[:, :2]).norm(dim=1))

        measures = roll_out(env, source.drive.actor("cpu")(env), trial, sample)
        fell = measures.fell.numpy().reshape(worlds)
        counts, _ = measures.samples(replicas, len(members))
    finally:
        env.close()
    velocity = sums.numpy().reshape(*worlds, 3) / max(count, 1) / sizes
    error = errors.numpy().reshape(worlds) / max(count, 1) / sizes[:, 0]
    classes = members[0].classes
    by_class = counts.reshape(len(cases), len(members), len(classes), len(QUANTITIES), -1)
    shares = tuple(
        tuple(_shares(classes, by_class[case, k]) for case in range(len(cases)))
        for k in range(len(members))
    )
    return Rolled(tuple(cases), fell, velocity, error, shares)


def _layout(
    cases: Sequence[Case], members: Sequence[LeggedRobot], commands: Array, pushes: Array
) -> Layout:
    """Assignment of the worlds: by case, replica and robot."""
    from draft.learn.measuring.rollout.trial import Layout

    each = len(pushes) // len(cases)
    names = np.array([member.name for member in members])
    return Layout(
        test=np.repeat([case.name for case in cases], each),
        level=np.repeat(np.arange(len(cases), dtype=float), each),
        member=np.tile(names, len(pushes) // len(names)),
        replica=np.tile(np.repeat(np.arange(each // len(names)), len(names)), len(cases)),
        kept=np.ones(len(pushes), bool),
        command=commands[:, 0],
        kick=pushes,
        ground=np.full(len(pushes), "flat"),
    )


def _shares(classes: Sequence[str], counts: Array) -> Mapping[str, Mapping[str, float | None]]:
    """95th percentiles of the joint classes; those of no samples are None."""
    return {
        name: {of: percentile(counts[i][k]) for k, of in enumerate(QUANTITIES)}
        for i, name in enumerate(classes)
    }


def _mean(values: Array, fell: Array) -> float | None:
    kept = values[fell == 0]
    return float(kept.mean()) if kept.size else None


def rounded(value: float | None, digits: int = 3) -> float | None:
    """A number as the results have it; None stays None."""
    return None if value is None or math.isnan(value) else round(value, digits)


def distance(legs: LegsPolicy, member: LeggedRobot) -> float:
    """How far a robot lies outside the region of the policy; 0 inside."""
    return float(legs.distances(describe(member)[1], len(member.feet)).max())


def record_of(legs: LegsPolicy) -> dict[str, Any]:
    """What the results say of a policy."""
    texts = legs.network.metadata
    return {
        "file": legs.file.name,
        "digest": file_digest(legs.file),
        "megabytes": round(legs.file.stat().st_size / 1e6, 3),
        "iterations": int(texts["iteration"]),
        "seed": int(texts["seed"]),
        "velocity_noise": velocity_noise(texts),
    }


def bar(
    what: str, value: float | None, limit: float, unit: str = "", at_least: bool = True
) -> dict[str, Any]:
    """A bar and whether it is met; without a value it is missed.

    Args:
        what: what is measured.
        value: what was found.
        limit: the bar.
        unit: unit of both; "%" for shares.
        at_least: whether the value must not be below the bar.
    """
    if value is None:
        row = {"what": what, "value": None, "unit": unit, "bar": limit, "met": False}
    else:
        row = measured(what, round(value, 4), unit, limit, at_least)
    return row | {"at_least": at_least}


def number(value: float | None, unit: str = "") -> str:
    """A number of a table: shares in percent, and "-" for none."""
    if value is None:
        return "-"
    return f"{100 * value:.0f} %" if unit == "%" else f"{brief(value)} {unit}".strip()


def bars_table(rows: Sequence[Mapping[str, Any]]) -> Table:
    """Table of bars."""
    table = Table("bar", "measured", "wanted", "", box=None)
    for row in rows:
        sign = ">=" if row["at_least"] else "<="
        wanted = f"{sign} {number(row['bar'], row['unit'])}"
        word = "met" if row["met"] else "missed"
        table.add_row(row["what"], number(row["value"], row["unit"]), wanted, word)
    return table


def save(path: Path, data: Mapping[str, Any] | Sequence[Mapping[str, Any]]) -> None:
    """Write results as JSON."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write(path, json.dumps(data, indent=1) + "\n")


def run_as_command(main: Callable[..., None], description: str | None) -> None:
    """Run a benchmark's command; what the user can correct ends it with a line."""
    quiet()
    try:
        tyro.cli(main, description=description)
    except DraftError as error:
        raise SystemExit(f"error: {error}") from None
