"""Worlds of one process of a run: an environment per topology, with its log and its bodies."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl import RslRlVecEnvWrapper

from draft.learn.bodies.legged import LeggedRobot, by_topology, kind_of
from draft.learn.engine.rows import BODIES_ERROR
from draft.learn.engine.worlds.mixture import Mixture
from draft.learn.engine.worlds.ranks import Ranks, rank_seed
from draft.learn.engine.worlds.simulate import make
from draft.learn.engine.worlds.turns import Bodies
from draft.learn.task.mdp.environment import environment
from draft.learn.task.world.task import Task
from draft.learn.training.ppo.log import Row, Tally
from draft.learn.training.ppo.snapshot import capture, restore
from draft.learn.training.progress import FASTEST
from draft.learn.training.run import Plan


def task_of(plan: Plan, members: tuple[LeggedRobot, ...] = ()) -> Task:
    """Return the task of a plan, or of those of its members that have one topology."""
    return Task(
        members=members or plan.members,
        stage=plan.stage,
        config=plan.config,
        ground="flat" if plan.ground == "flat" else "uneven",
        see_design=plan.see_design,
        see_ground=plan.see_ground,
        seed=plan.seed,
        by_slots=plan.mixed,
    )


def share(worlds: int, part: int, parts: int) -> int:
    """Number of worlds of one of several parts; the first ones get the remainder."""
    return worlds // parts + (part < worlds % parts)


def by_bodies(worlds: int, bodies: Sequence[int], processes: int) -> list[int]:
    """Divide worlds over topologies by their numbers of bodies, one for each process at least.

    Args:
        worlds: number of worlds.
        bodies: number of bodies of each topology.
        processes: number of processes that share the worlds.
    """
    least = min(processes, worlds // len(bodies))
    spare = worlds - least * len(bodies)
    ends = [round(spare * sum(bodies[: k + 1]) / sum(bodies)) for k in range(len(bodies))]
    return [least + end - start for start, end in zip([0, *ends], ends, strict=False)]


class Worlds:
    """Worlds of one process of a run.

    Attributes:
        envs: environment of each topology.
        wrapped: all of them as one, for rsl-rl.
    """

    def __init__(self, plan: Plan, device: str, engine: str, rank: int, replicas: int) -> None:
        """Make and reset the environments.

        Args:
            plan: plan of the run.
            device: "cpu" or "cuda:0" and the like.
            engine: "native" or "warp".
            rank: number of this process among those that share the run.
            replicas: number of processes on a CPU, which share the run's worlds.
        """
        self._groups = by_topology(plan.members)
        self.envs: list[ManagerBasedRlEnv] = []
        self._counts = by_bodies(
            plan.environments, [len(group) for group in self._groups], replicas
        )
        for members, of_all in zip(self._groups, self._counts, strict=True):
            before = sum(share(of_all, i, replicas) for i in range(rank))
            cfg = environment(task_of(plan, members), share(of_all, rank, replicas), before=before)
            cfg.seed = rank_seed(plan.seed, rank)
            self.envs.append(make(cfg, device, engine))
        self.wrapped = Mixture(self.envs) if plan.mixed else RslRlVecEnvWrapper(self.envs[0])

    def observe(self, plan: Plan, ranks: Ranks) -> None:
        """Begin the logs, and the turns of families of more bodies than worlds."""
        self._tallies = [Tally(env, ranks) for env in self.envs]
        self._bodies: list[Bodies | None] = []
        for env, members, count in zip(self.envs, self._groups, self._counts, strict=True):
            in_turn = len(members) > count
            taken = in_turn or (plan.mixed and len(members) > 1)
            self._bodies.append(Bodies(env, members, plan.seed, ranks) if taken else None)

    @property
    def count(self) -> int:
        """Number of worlds of this process."""
        return sum(env.num_envs for env in self.envs)

    def add(self, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, Any]) -> None:
        """Add a step of all worlds to the logs, as `Tally.add`."""
        counts = [env.num_envs for env in self.envs]
        parts = extras.get("parts", (extras,))
        steps = zip(rewards.split(counts), dones.split(counts), parts, strict=True)
        for tally, bodies, step in zip(self._tallies, self._bodies, steps, strict=True):
            tally.add(*step)
            if bodies:
                bodies.add()

    def turn(self, iteration: int) -> bool:
        """Give some worlds new bodies; their episodes end as if by time.

        Returns:
            Whether there are families that take turns.
        """
        for tally, bodies in zip(self._tallies, self._bodies, strict=True):
            if bodies:
                tally.lengths[bodies.turn(iteration)] = 0
        return any(self._bodies)

    def fetch(self) -> Row:
        """Row of the log since the last call: means over topologies, and some numbers of each."""
        rows = [
            {**tally.fetch(), **(bodies.fetch() if bodies else {})}
            for tally, bodies in zip(self._tallies, self._bodies, strict=True)
        ]
        if len(rows) == 1:
            return rows[0]
        found: Row = {}
        for name in dict.fromkeys(name for row in rows for name in row):
            known = [row[name] for row in rows if not math.isnan(row.get(name, math.nan))]
            found[name] = sum(known) / len(known) if known else math.nan
        for members, row in zip(self._groups, rows, strict=True):
            found |= {f"{kind_of(members)}/{name}": row[name] for name in _OF_EACH if name in row}
        return found

    def state(self) -> dict[str, Any]:
        """State to resume from."""
        states = [capture(env) for env in self.envs]
        bodies = [one.state() if one else None for one in self._bodies]
        lengths = [tally.lengths for tally in self._tallies]
        if len(states) == 1:  # As runs of one topology have it.
            return {"environment": states[0], "length": lengths[0], "bodies": bodies[0]}
        return {"environment": states, "length": lengths, "bodies": bodies}

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a saved state.

        Raises:
            KeyError, RuntimeError, DraftError: it is that of other worlds.
        """
        parts = [state["environment"], state["length"], state["bodies"]]
        if len(self.envs) == 1:
            parts = [[one] for one in parts]
        for k, (environment_, length, bodies) in enumerate(zip(*parts, strict=True)):
            restore(self.envs[k], environment_)
            self._tallies[k].lengths.copy_(length)
            own = self._bodies[k]
            if own:
                own.restore(bodies)

    def close(self) -> None:
        """Close the environments."""
        for env in self.envs:
            env.close()


_OF_EACH = ("tracking_error", "falls", "episode_s", BODIES_ERROR, FASTEST)
