"""Policies that a training starts from: those of runs, or exported ones.

An exported policy has no critic. The critic then learns alone for the first `ALONE` iterations:
with the advantages of a random one the first updates of the actor would undo what it has learnt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from rsl_rl.algorithms import PPO

from draft.errors import DraftError
from draft.learn.policy.matching import OF_JOINTS, Match
from draft.learn.policy.onnx_file import of_layers, read
from draft.learn.policy.policy import Policy
from draft.learn.policy.reduced import open_legs_policy
from draft.learn.training.ppo.checkpoint import first_sentence, read_checkpoint
from draft.learn.training.run import Origin, file_digest

Change = Callable[[dict[str, Any]], dict[str, Any]]
Numbers = NDArray[np.floating[Any]]
# Iterations of the critic alone.
ALONE = 10
# Number of samples that statistics of observations count for when inputs are added, and those of
# an exported policy, which are to stay: a design's own features would else tend to a mean of zero.
_KNOWN_SAMPLES, _TRAINED_SAMPLES = 50_000, 10_000_000
# Standard deviation of the actions of a policy whose file does not state it.
_ACTION_STD = 0.5


def widened(
    state: dict[str, torch.Tensor], start: int, count: int, seen: torch.Tensor, keep: bool = False
) -> dict[str, torch.Tensor]:
    """Add inputs without influence to the weights of a model.

    Args:
        state: state of rsl-rl's model with normalised observations.
        start: index of the first new input.
        count: number of new inputs.
        seen: observations with them, for their mean and variance, shape (worlds, inputs).
        keep: whether the statistics are to stay, as those of a design's own features.
    """

    def joined(old: torch.Tensor, new: torch.Tensor) -> torch.Tensor:
        return torch.cat((old[:, :start], new.to(old), old[:, start:]), dim=1)

    weight, values = state["mlp.0.weight"], seen[:, start : start + count]
    wide = dict(state)
    wide["mlp.0.weight"] = joined(weight, torch.zeros(len(weight), count))
    mean, variance = values.mean(0, keepdim=True), values.var(0, unbiased=False, keepdim=True)
    for name, new in (("_mean", mean), ("_var", variance), ("_std", variance.sqrt())):
        wide[f"obs_normalizer.{name}"] = joined(state[f"obs_normalizer.{name}"], new)
    if not keep:  # The statistics must soon follow the new inputs.
        count_name = "obs_normalizer.count"
        wide[count_name] = state[count_name].clamp(max=_KNOWN_SAMPLES)
    return wide


def load_exported(
    alg: PPO,
    policy: Policy,
    origin: Origin,
    of_joints: Match,
    fit: Change = lambda content: content,
) -> None:
    """Load the actor, with its statistics of observations, from an ONNX file.

    Args:
        alg: rsl-rl's algorithm, into which it is loaded.
        policy: the policy.
        origin: what the run knows of it.
        of_joints: joints of the robot for those of the policy.
        fit: changes the content of the checkpoint before it is loaded.

    Raises:
        DraftError: it has changed, or has other observations or layers.
    """
    known = policy.action_std
    noise = known if len(known) else np.full(len(policy.joints), _ACTION_STD)
    joints = np.array(of_joints.inverse.joints)
    state = _state(alg, *_layers(policy, of_joints), noise[joints])
    _load(alg, policy.file, origin, {"actor_state_dict": state}, fit)


def teacher(policy: Policy, of_joints: Match) -> Callable[[torch.Tensor], torch.Tensor]:
    """Return the actions of a policy, for what the critic of a training observes.

    It observes first what an actor with the velocity does, in the same order, without noise.

    Args:
        policy: the policy.
        of_joints: joints of the robot for those of the policy.
    """
    network = of_layers(*_layers(policy, of_joints), {})

    def actions(seen: torch.Tensor) -> torch.Tensor:
        return torch.from_numpy(network(seen[:, : network.size].cpu().numpy())).to(seen)

    return actions


def load_of_legs(alg: PPO, file: Path, origin: Origin) -> None:
    """Load the actor of a policy of all legs into one of a mixture, which has the same slots.

    Args:
        alg: rsl-rl's algorithm, into which it is loaded.
        file: ONNX file of the policy.
        origin: what the run knows of it.

    Raises:
        DraftError: as `load_exported`.
    """
    mean, divisor, layers = read(file).layers()
    known = open_legs_policy(file).action_std
    noise = known if len(known) else np.full(len(layers[-1][1]), _ACTION_STD)
    state = _state(alg, mean, divisor, layers, noise)
    _load(alg, file, origin, {"actor_state_dict": state}, lambda content: content)


def _state(
    alg: PPO,
    mean: Numbers,
    divisor: Numbers,
    layers: Sequence[tuple[Numbers, Numbers]],
    noise: Numbers,
) -> dict[str, torch.Tensor]:
    """State of rsl-rl's model with given layers, statistics and deviation of actions."""
    normaliser: Any = alg.get_policy().obs_normalizer  # rsl-rl declares no type of it.
    deviation = torch.tensor(divisor[None]) - normaliser.eps
    state = {
        "obs_normalizer._mean": torch.tensor(mean[None]),
        "obs_normalizer._var": deviation.square(),
        "obs_normalizer._std": deviation,
        "obs_normalizer.count": torch.tensor(_TRAINED_SAMPLES),
        "distribution.std_param": torch.tensor(noise, dtype=torch.float32),
    }
    for i, (weight, bias) in enumerate(layers):
        name = f"mlp.{2 * i}"  # Between the layers there is a function.
        state |= {f"{name}.weight": torch.tensor(weight), f"{name}.bias": torch.tensor(bias)}
    return state


def _layers(
    policy: Policy, of_joints: Match
) -> tuple[Numbers, Numbers, list[tuple[Numbers, Numbers]]]:
    """Mean and divisor of the inputs, and layers, of a policy for a robot with other joints."""
    mean, divisor, layers = policy.network.layers()
    order, sign = _inputs(policy, of_joints)
    inverse = of_joints.inverse
    joints, turned = np.array(inverse.joints), np.array(inverse.sign, np.float32)
    first, bias = layers[0]
    layers[0] = first[:, order] * sign, bias
    last, offset = layers[-1]
    layers[-1] = last[joints] * turned[:, None], offset[joints] * turned
    return sign * mean[order], divisor[order], layers


def _inputs(policy: Policy, of_joints: Match) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """Input of the policy for each input of a robot with other joints, and its sign."""
    order, sign, start = np.arange(policy.network.size), np.ones(policy.network.size, np.float32), 0
    for name, length in policy.terms:
        if name in OF_JOINTS:
            entries, turned = of_joints.inverse.entries(name, policy.rolls.tolist(), length)
            order[start : start + length] = start + np.array(entries)
            sign[start : start + length] = turned
        start += length
    return order, sign


def load_policy(
    alg: PPO,
    run: Path,
    origin: Origin,
    device: str,
    fit: Change = lambda content: content,
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
    _load(alg, file, origin, read_checkpoint(file, device), fit, "critic")


def check_unchanged(file: Path, origin: Origin) -> None:
    """Check that a file is the one of the run's plan.

    Raises:
        DraftError: it is not, or is gone.
    """
    if not file.is_file() or file_digest(file) != origin.digest:
        cause = f"{file} has changed since this run was created"
        raise DraftError(cause, "start a new run")


def _load(
    alg: PPO, file: Path, origin: Origin, content: dict[str, Any], fit: Change, *more: str
) -> None:
    """Load the actor, and more, from a file that must be the one of the run's plan."""
    check_unchanged(file, origin)
    try:
        alg.load(fit(content), dict.fromkeys(("actor", *more), True), strict=True)
    except (KeyError, RuntimeError) as error:
        cause = f"the policy of {file} does not fit: {first_sentence(error)}"
        remedy = "use one with the same observations and layers"
        raise DraftError(cause, remedy) from None
