"""What an iteration of training is told about: rewards by term, falls, tracking.

Sums stay on the device and are fetched once per iteration.
"""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import Any

import torch
from mjlab.envs import ManagerBasedRlEnv

from draft.errors import DraftError, Problem
from draft.files import write
from draft.learn.lab.ground import worlds_on
from draft.learn.lab.ranks import Ranks
from draft.learn.progress import STAIRS, Row, read


class Tally:
    """Sums over the steps of an iteration.

    Attributes:
        lengths: steps of the episode at hand, shape (worlds,).
    """

    def __init__(self, env: ManagerBasedRlEnv, ranks: Ranks) -> None:
        self._env, self._ranks = env, ranks
        self._terms = list(env.reward_manager.active_terms)
        self._stairs = worlds_on(env, "stairs")
        self.lengths = torch.zeros(env.num_envs, device=env.device)
        self._clear()

    def add(self, rewards: torch.Tensor, dones: torch.Tensor, extras: dict[str, Any]) -> None:
        """Count a step.

        Args:
            rewards: of each world, shape (worlds,).
            dones: which worlds ended an episode, shape (worlds,).
            extras: of the step; has `time_outs`.
        """
        env = self._env
        ended = dones.bool()
        fell = ended & ~extras["time_outs"].bool()
        self.lengths += 1
        ones = torch.ones((), device=env.device)
        command = env.command_manager.get_command("twist")
        velocity = env.scene["robot"].data.root_link_lin_vel_b
        error = (command[:, :2] - velocity[:, :2]).norm(dim=1)  # type: ignore[index]
        sums = (
            *(ones, rewards.mean(), ended.sum(), fell.sum()),
            *((self.lengths * ended).sum(), error.mean()),
        )
        self._sums += torch.stack([x.float() for x in sums])
        self._by_term += env.reward_manager._step_reward.mean(0)
        self.lengths *= ~ended
        self.last = {
            name: value
            for name, value in extras.get("log", {}).items()
            if name.startswith("Curriculum/")
        } or self.last

    def fetch(self) -> Row:
        """Means since the last call, by name, over the worlds of all processes.

        Rewards are per second; an episode's length is in seconds, NaN where none ended; `falls` is
        the share of episodes that ended by a fall; `tracking_error` is in m/s. What the curriculum
        says is of this process; the hardest row of stairs is that of the moment, of all.
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
        row |= {name.lower(): float(value) for name, value in self.last.items()}
        self._clear()
        return row

    def _hardest_row(self) -> torch.Tensor:
        """Hardest row of a robot on stairs, shape (1,), NaN for none; (0,) without stairs."""
        if self._stairs is None:
            return self._sums[:0]
        rows: torch.Tensor = self._env.scene.terrain.terrain_levels  # type: ignore[union-attr]
        most = self._ranks.most(torch.where(self._stairs, rows.float(), -1.0).max()[None])
        return torch.where(most < 0, torch.nan, most)

    def _clear(self) -> None:
        self._sums = torch.zeros(6, device=self._env.device)
        self._by_term = torch.zeros(len(self._terms), device=self._env.device)
        self.last: dict[str, Any] = getattr(self, "last", {})


class Table:
    """Rows of progress.csv; a run that goes on drops those past its checkpoint."""

    def __init__(self, path: Path, iteration: int) -> None:
        self._path = path
        self._names: list[str] = []
        rows = read(path)
        kept = [row for row in rows if row["iteration"] <= iteration]
        if rows:
            self._names = list(rows[0])
            write(path, _text(self._names, kept, header=True))

    def add(self, row: Row) -> None:
        """Append a row; one with a name that is new makes the table wider."""
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
            raise DraftError(Problem(cause, None, "the last checkpoint is kept")) from None


def _text(names: list[str], rows: list[Row], header: bool) -> str:
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    if header:
        table.writerow(names)
    for row in rows:
        table.writerow([f"{row.get(name, float('nan')):.6g}" for name in names])
    return out.getvalue()
