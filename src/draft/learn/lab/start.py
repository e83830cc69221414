"""Policies that a training starts from."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from rsl_rl.algorithms import PPO

from draft.errors import DraftError, Problem
from draft.learn.lab.checkpoint import first_sentence, read_checkpoint
from draft.learn.run import Origin, file_digest

# Number of samples that statistics of observations count for when inputs are added.
_KNOWN_SAMPLES = 50_000


def widened(
    state: dict[str, torch.Tensor], start: int, count: int, seen: torch.Tensor
) -> dict[str, torch.Tensor]:
    """Add inputs without influence to the weights of a model.

    Args:
        state: state of rsl-rl's model with normalised observations.
        start: index of the first new input.
        count: number of new inputs.
        seen: observations with them, for their mean and variance, shape (worlds, inputs).
    """

    def joined(old: torch.Tensor, new: torch.Tensor) -> torch.Tensor:
        return torch.cat((old[:, :start], new.to(old), old[:, start:]), dim=1)

    weight, values = state["mlp.0.weight"], seen[:, start : start + count]
    wide = dict(state)
    wide["mlp.0.weight"] = joined(weight, torch.zeros(len(weight), count))
    mean, variance = values.mean(0, keepdim=True), values.var(0, unbiased=False, keepdim=True)
    for name, new in (("_mean", mean), ("_var", variance), ("_std", variance.sqrt())):
        wide[f"obs_normalizer.{name}"] = joined(state[f"obs_normalizer.{name}"], new)
    # The statistics must soon follow the new inputs.
    count_name = "obs_normalizer.count"
    wide[count_name] = state[count_name].clamp(max=_KNOWN_SAMPLES)
    return wide


def load_policy(
    alg: PPO,
    run: Path,
    origin: Origin,
    device: str,
    fit: Callable[[dict[str, Any]], dict[str, Any]] = lambda content: content,
) -> None:
    """Load actor and critic, with their statistics of observations, from a run.

    Args:
        alg: rsl-rl's algorithm, into which they are loaded.
        run: folder of the run.
        origin: checkpoint to load.
        device: device of the algorithm.
        fit: changes the content of the checkpoint before it is loaded.

    Raises:
        DraftError: it cannot be read, has changed, or has other observations.
    """
    file = run / f"model_{origin.iteration}.pt"
    content = read_checkpoint(file, device)
    if file_digest(file) != origin.digest:
        cause = f"{file} has changed since this run was created"
        raise DraftError(Problem(cause, None, "start a new run"))
    try:
        alg.load(fit(content), {"actor": True, "critic": True}, strict=True)
    except (KeyError, RuntimeError) as error:
        cause = f"the policy of {file} does not fit: {first_sentence(error)}"
        remedy = "use a run with the same layers, --see-design and height scan"
        raise DraftError(Problem(cause, None, remedy)) from None
