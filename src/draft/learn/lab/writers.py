"""Where progress goes besides progress.csv: TensorBoard, and Weights & Biases where asked for."""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Problem
from draft.extras import need
from draft.learn.lab.log import Row


class Writers:
    """Scalars of each iteration, to TensorBoard and perhaps to Weights & Biases."""

    def __init__(self, folder: Path, iteration: int, config: Any, wandb: str | None = None) -> None:
        """Open them.

        Args:
            folder: the run's; TensorBoard's files go below it.
            iteration: iterations done; what was written of later ones is hidden.
            config: the plan as plain data.
            wandb: project of Weights & Biases; None for none.

        Raises:
            DraftError: Weights & Biases cannot be reached.
        """
        from torch.utils.tensorboard import SummaryWriter

        self._board = SummaryWriter(str(folder / "tensorboard"), purge_step=iteration + 1)
        self._wandb = _start(folder, wandb, config) if wandb else None

    def add(self, row: Row) -> None:
        """Write the numbers of an iteration; those that are not known are left out."""
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


def _start(folder: Path, project: str, config: Any) -> Any:
    wandb = need("wandb", "learn")
    name = hashlib.sha256(str(folder.resolve()).encode()).hexdigest()[:12]
    try:
        return wandb.init(
            project=project, name=folder.name, id=name, resume="allow", dir=folder, config=config
        )
    except Exception as error:  # Network, login, quota: whatever its client raises.
        cause = f"Weights & Biases cannot be used: {error}"
        remedy = "'wandb login', WANDB_MODE=offline, or leave --wandb away"
        raise DraftError(Problem(cause, None, remedy)) from None
