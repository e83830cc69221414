"""Bodies of a family that has more of them than worlds: worlds take new ones during training.

The bodies are divided into cells of similar ones. Cells whose commands are tracked badly are drawn
more often, and speeds that grow with the tracking do so for each cell on its own, so that weak
bodies are not given up; the worst cell is logged beside the mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from numpy.typing import ArrayLike, NDArray

from draft.learn.bodies.features import family_features
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.bodies.slots import slot_features, traits
from draft.learn.engine.rows import BODIES_ERROR, BODIES_WORST, Row
from draft.learn.engine.worlds.ranks import Ranks, rank_seed
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.mdp.world_models import redraw
from draft.learn.task.world.access import command_of, robot_of

CELLS = 16  # Most groups of similar bodies.
TURNS = 40  # Iterations that a world keeps a body: about an episode of 20 s.
EVEN = 0.5  # Share of the draws that ignores how well cells are tracked.
_KEPT = 0.9  # Share of a cell's previous error in its mean over iterations.
_LOST = 2.0  # Time that a fall counts for, with a relative error of 1 [s].
_SLOW = 0.5  # Speed that is added to the command in the relative error [m/s], times sqrt(scale).


class Bodies:
    """The bodies of the worlds of one process, and how well each cell of them is tracked.

    Attributes:
        member: index of each world's body, shape (worlds,).
        cell: index of each body's cell, shape (bodies,).
        error: mean relative tracking error of each cell, over all processes, shape (cells,).
    """

    def __init__(
        self, env: ManagerBasedRlEnv, members: Sequence[LeggedRobot], seed: int, ranks: Ranks
    ) -> None:
        """Prepare the cells; the worlds keep the bodies that they have.

        Args:
            env: the environment of the family.
            members: all bodies.
            seed: seed of the run.
            ranks: processes that share the run.
        """
        self._env, self._members, self._ranks = env, members, ranks
        self._seed = rank_seed(seed, ranks.rank)
        self.member = robot_of(env).host_member.copy()
        self.cell = cells(alike(env, members))
        self.error = np.ones(self.cell.max() + 1)
        self._sums = torch.zeros(2, len(self.error), device=env.device)
        command_term(env).divide(self._cells(), len(self.error))

    def _cells(self) -> torch.Tensor:
        """Cell of each world's body, shape (worlds,)."""
        return torch.from_numpy(self.cell[self.member]).to(self._env.device)

    def add(self) -> None:
        """Add a step to the tracking errors of the cells."""
        robot = robot_of(self._env)
        command = command_of(self._env)[:, :2]
        error = (command - robot.data.root_link_lin_vel_b[:, :2]).norm(dim=1)
        relative = error / (command.norm(dim=1) + _SLOW * robot.leg_scale.sqrt())
        cell, steps = self._cells(), torch.ones_like(relative)
        if robot.cfg.by_slots:  # A fall ends an episode, and with it what it would err.
            lost = self._env.termination_manager.terminated * (_LOST / self._env.step_dt)
            relative, steps = relative + lost, steps + lost
        self._sums[0].index_add_(0, cell, relative)
        self._sums[1].index_add_(0, cell, steps)

    def fetch(self) -> Row:
        """Update the errors of the cells by those of an iteration; return their mean and worst."""
        total, count = self._ranks.sum(self._sums).cpu().double().numpy()
        seen = count > 0
        self.error[seen] *= _KEPT
        self.error[seen] += (1 - _KEPT) * total[seen] / count[seen]
        row = {
            BODIES_ERROR: float(total.sum() / count.sum()),
            BODIES_WORST: float((total[seen] / count[seen]).max()),
        }
        self._sums = torch.zeros_like(self._sums)
        return row

    @torch.inference_mode()
    def turn(self, iteration: int) -> torch.Tensor:
        """Give the worlds whose turn it is new bodies, and restart them.

        Args:
            iteration: iterations done; 0 gives all worlds new bodies.

        Returns:
            Indices of these worlds.
        """
        worlds = np.arange(self._env.num_envs)
        if iteration:
            worlds = worlds[iteration % TURNS :: TURNS]
        if not len(worlds):
            return torch.arange(0)
        chosen = self.draw(len(worlds), iteration)
        self.member[worlds] = chosen
        turned = torch.from_numpy(worlds).to(self._env.device)
        redraw(self._env, turned, [self._members[i] for i in chosen])
        command_term(self._env).group = self._cells()
        self._env.reset(env_ids=turned)
        return turned

    def draw(self, count: int, iteration: int) -> NDArray[np.intp]:
        """Indices of bodies drawn for some worlds after an iteration."""
        random = np.random.default_rng([self._seed, iteration])
        count_of_cells = len(self.error)
        chance = EVEN / count_of_cells + (1 - EVEN) * self.error / self.error.sum()
        wanted = random.choice(count_of_cells, count, p=chance / chance.sum())
        groups = [np.flatnonzero(self.cell == cell) for cell in range(count_of_cells)]
        return np.array([random.choice(groups[cell]) for cell in wanted], dtype=np.intp)

    def state(self) -> dict[str, Any]:
        """State to resume from."""
        return {
            "member": torch.from_numpy(self.member),
            "error": torch.from_numpy(self.error),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a saved state; the environment restores the bodies themselves.

        Raises:
            KeyError, RuntimeError: it is that of other worlds.
        """
        for name in ("member", "error"):
            torch.from_numpy(getattr(self, name)).copy_(state[name])


def alike(env: ManagerBasedRlEnv, members: Sequence[LeggedRobot]) -> ArrayLike:
    """Numbers of bodies in which those of one cell are alike, shape (bodies, numbers)."""
    if not robot_of(env).cfg.by_slots:
        return family_features(tuple(members))
    values = traits(np.array(slot_features(members)))
    # The weights set the order in which they are halved, which rounding would set otherwise.
    return values / values.std(axis=0).clip(min=1e-9) * np.array([1.03, 1.02, 1.01, 1.0])


def cells(features: ArrayLike, most: int = CELLS) -> NDArray[np.intp]:
    """Divide bodies into cells of the same size, by halving along the feature that varies most.

    Features are logarithms, or of equal variances, so that these compare. The cells are those of a
    k-d tree (Bentley, "Multidimensional binary search trees used for associative searching", 1975).

    Args:
        features: shape (bodies, features).
        most: largest number of cells; they are halved until there would be more than this, or
            more than bodies.

    Returns:
        Index of each body's cell, shape (bodies,).
    """
    values = np.asarray(features, float)
    found = np.zeros(len(values), dtype=np.intp)
    groups = [np.arange(len(values))]
    while 2 * len(groups) <= min(most, len(values)):
        halves = []
        for group in groups:
            own = values[group]
            axis = int(own.var(axis=0).argmax()) if own.shape[1] else 0
            order = group[own[:, axis].argsort(kind="stable")] if own.shape[1] else group
            middle = len(order) // 2
            halves += [order[:middle], order[middle:]]
        groups = halves
    for cell, group in enumerate(groups):
        found[group] = cell
    return found
