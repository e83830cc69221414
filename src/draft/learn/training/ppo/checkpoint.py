"""Checkpoints of rsl-rl: read without executing code in them, written atomically."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from draft.errors import DraftError
from draft.files import new_file


def read_checkpoint(
    file: Path, device: str, remedy: str = "use another checkpoint"
) -> dict[str, Any]:
    """Read a checkpoint; no code in it is executed.

    Args:
        file: the checkpoint.
        device: device for its tensors.
        remedy: what to do if it is broken.

    Raises:
        DraftError: it is missing, truncated, or not a checkpoint.
    """
    try:
        content = torch.load(file, map_location=device, weights_only=True)
    except FileNotFoundError:
        raise DraftError(f"there is no {file}", "use a run that has it") from None
    except Exception as error:  # Whatever a broken archive leads to.
        cause = f"{file} cannot be read as a checkpoint: {first_sentence(error)}"
        raise DraftError(cause, remedy) from None
    if not isinstance(content, dict):
        raise DraftError(f"{file} is not a checkpoint", remedy)
    return content


def misfit(file: Path, error: Exception) -> DraftError:
    """Error of a checkpoint whose policy does not fit its run."""
    cause = f"the policy of {file} does not fit the run's design and numbers: "
    return DraftError(cause + first_sentence(error), "use another checkpoint")


def write_checkpoint(file: Path, content: dict[str, Any]) -> None:
    """Write a checkpoint atomically."""
    remedy = "the last checkpoint is kept"
    with new_file(file, remedy) as temporary, temporary.open("wb") as stream:
        try:
            torch.save(content, stream)
        except RuntimeError as error:  # how torch reports a full disk
            cause = f"cannot write {file}: {first_sentence(error)}"
            raise DraftError(cause, remedy) from None


def first_sentence(error: Exception) -> str:
    """First sentence of a library's message."""
    line = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return line.partition(". ")[0]
