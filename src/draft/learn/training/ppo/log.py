"""Log of a training: sums over an iteration, progress.csv, TensorBoard and Weights & Biases.

Sums stay on the device and are fetched once per iteration.
"""

from __future__ import annotations

import csv
import hashlib
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from mjlab.envs import ManagerBasedRlEnv

from draft.errors import DraftError
from draft.extras import need
from draft.files import write
from draft.learn.engine.worlds.ranks import Ranks
from draft.learn.task.mdp import curriculums
from draft.learn.task.world.access import command_of, robot_of
from draft.learn.task.world.ground import worlds_on
from draft.learn.training.progress import FASTEST, STAIRS, Row, read


class Tally:
    """Sums over the steps of an iteration.

    Attributes:
        lengths: steps of the current episode, shape (worlds,).
    """

    def __init__(self, env: ManagerBasedRlEnv, ranks: Ranks) -> None:
        self._env, self._ranks = env, ranks
        self._terms = list(env.reward_manager.active_terms)
        self._stairs = worlds_on(env, "stairs")
        self.lengths = torch.zeros(env.num_envs, device=env.device)
        self._curriculum: dict[str, float | torch.Tensor] = {}
        self._clear()

    def add(self, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, Any]) -> None:
        """Add a step.

        Args:
            rewards: reward of each world, shape (worlds,).
            dones: worlds that ended an episode, shape (worlds,).
            extras: mjlab's extras of the step, with `time_outs`.
        """
        env = self._env
        ended = dones.bool()
        fell = ended & ~extras["time_outs"].bool()
        self.lengths += 1
        ones = torch.ones((), device=env.device)
        velocity = robot_of(env).data.root_link_lin_vel_b
        error = (command_of(env)[:, :2] - velocity[:, :2]).norm(dim=1)
        sums = (
            *(ones, rewards.mean(), ended.sum(), fell.sum()),
            *((self.lengths * ended).sum(), error.mean()),
        )
        self._sums += torch.stack([x.float() for x in sums])
        self._by_term += env.reward_manager._step_reward.mean(0)
        self.lengths *= ~ended
        self._curriculum = {
            name: value
            for name, value in extras.get("log", {}).items()
            if name.startswith("Curriculum/")
        } or self._curriculum

    def fetch(self) -> Row:
        """Return means since the last call, by name, over the worlds of all processes.

        Rewards are per second; the length of an episode is in seconds, NaN if none ended; `falls`
        is the share of episodes that ended in a fall; `tracking_error` is in m/s. Curriculum
        values are those of this process; the hardest row of stairs is the present one, over all
        processes.
        """
        sums = torch.cat((self._ranks.sum(self._sums), self._hardest_row())).tolist()
        steps, reward, ended, fell, length, error, *stairs = sums
        dt = self._env.step_dt
        row = {
            "reward": reward / steps / dt,
            "episode_s": length / ended * dt if ended else float("nan"),
            "falls": fell / ended if ended else float("nan"),
            "tracking_error": error / steps,
        }
        row |= dict(zip((STAIRS,), stairs, strict=False))
        terms = (self._ranks.sum(self._by_term) / steps).tolist()
        row |= {f"reward/{name}": value for name, value in zip(self._terms, terms, strict=True)}
        row |= {name.lower(): float(value) for name, value in self._curriculum.items()}
        if "fastest" in self._env.curriculum_manager.active_terms:
            # mjlab computes it where a robot restarts: robots that do not fall do so seldom.
            row[FASTEST] = float(curriculums.fastest(self._env, torch.arange(0)))
        self._clear()
        return row

    def _hardest_row(self) -> torch.Tensor:
        """Hardest row of a robot on stairs, shape (1,), NaN for none; (0,) without stairs."""
        terrain = self._env.scene.terrain
        if self._stairs is None or terrain is None:
            return self._sums[:0]
        rows = terrain.terrain_levels.float()
        most = self._ranks.most(torch.where(self._stairs, rows, -1.0).max()[None])
        return torch.where(most < 0, torch.nan, most)

    def _clear(self) -> None:
        self._sums = torch.zeros(6, device=self._env.device)
        self._by_term = torch.zeros(len(self._terms), device=self._env.device)


class Table:
    """Rows of progress.csv; a run that resumes drops the rows after its checkpoint."""

    def __init__(self, path: Path, iteration: int) -> None:
        self._path = path
        self._names: list[str] = []
        rows = read(path)
        kept = [row for row in rows if row["iteration"] <= iteration]
        if rows:
            self._names = list(rows[0])
            write(path, _text(self._names, kept, header=True))

    def add(self, row: Row) -> None:
        """Append a row; a row with a new name rewrites the table with one more column."""
        try:
            new = [name for name in row if name not in self._names]
            if new:
                rows = [*read(self._path), row] if self._names else [row]
                self._names += new
                write(self._path, _text(self._names, rows, header=True))
                return
            with self._path.open("a", encoding="utf-8") as file:
                file.write(_text(self._names, [row], header=False))
        except OSError as error:
            cause = f"cannot write {self._path}: {error.strerror}"
            raise DraftError(cause, "the last checkpoint is kept") from None


def _text(names: Sequence[str], rows: Sequence[Row], header: bool) -> str:
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    if header:
        table.writerow(names)
    for row in rows:
        table.writerow([f"{row.get(name, float('nan')):.6g}" for name in names])
    return out.getvalue()


class Writers:
    """Writers of each iteration's numbers to TensorBoard and, on request, to Weights & Biases."""

    def __init__(
        self, folder: Path, iteration: int, config: Mapping[str, Any], wandb: str | None = None
    ) -> None:
        """Open the writers.

        Args:
            folder: folder of the run; TensorBoard's files are written to a folder in it.
            iteration: iterations done; earlier records of later iterations are hidden.
            config: the plan as plain data.
            wandb: project of Weights & Biases; None for none.

        Raises:
            DraftError: Weights & Biases cannot be reached.
        """
        from torch.utils.tensorboard import SummaryWriter

        self._board = SummaryWriter(str(folder / "tensorboard"), purge_step=iteration + 1)
        self._wandb = _start_wandb(folder, wandb, config) if wandb else None

    def add(self, row: Row) -> None:
        """Write the finite numbers of an iteration."""
        step = int(row["iteration"])
        known = {k: v for k, v in row.items() if k != "iteration" and math.isfinite(v)}
        for name, value in known.items():
            self._board.add_scalar(name, value, step)
        if self._wandb is not None:
            self._wandb.log(known, step=step)

    def close(self) -> None:
        """Flush and close."""
        self._board.close()
        if self._wandb is not None:
            self._wandb.finish()


def _start_wandb(folder: Path, project: str, config: Mapping[str, Any]) -> Any:
    wandb = need("wandb", "learn")
    name = hashlib.sha256(str(folder.resolve()).encode()).hexdigest()[:12]
    try:
        return wandb.init(
            project=project, name=folder.name, id=name, resume="allow", dir=folder, config=config
        )
    except Exception as error:  # Network, login, quota: whatever its client raises.
        cause = f"Weights & Biases cannot be used: {error}"
        remedy = "run 'wandb login', set WANDB_MODE=offline, or omit `wandb`"
        raise DraftError(cause, remedy) from None
