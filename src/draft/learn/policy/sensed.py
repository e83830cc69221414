"""Policies with other inputs, for machines whose sensors do not give the trunk's velocity."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from draft.errors import DraftError
from draft.learn.policy.onnx_file import of_layers
from draft.learn.policy.policy import Policy

VELOCITY, _COMMAND = "base_lin_vel", "command"


def with_inputs(policy: Policy, terms: Sequence[tuple[str, int]], past: Sequence[int]) -> Policy:
    """Return a policy with other inputs that acts as before while the trunk moves as commanded.

    Past steps have no influence at first. Instead of a velocity that it does not observe, it takes
    the one that is commanded, and none upwards.

    Args:
        policy: a policy that observes the present alone.
        terms: names and lengths of its new terms in order.
        past: for each of them, the number of steps that are observed, the present included.

    Raises:
        DraftError: a term is not one that the policy knows, or it observes the past already.
    """
    mean, divisor, layers = policy.network.layers()
    weight, bias = layers[0]
    starts = np.cumsum([0, *(length for _, length in policy.terms)])
    known = {
        name: slice(start, start + length)
        for (name, length), start in zip(policy.terms, starts, strict=False)
    }
    for (name, length), steps in zip(terms, past, strict=True):
        at = known.get(name, slice(0, 0))
        if length != steps * (at.stop - at.start) or max(policy.history) > 1:
            own = ", ".join(f"{one} {size}" for one, size in policy.terms)
            cause = f"{policy.file} observes {own}, and this training {name} {length}"
            raise DraftError(cause, "start from a policy that observes the velocity and no past")
    lost = [name for name in known if name not in dict(terms)]
    if lost == [VELOCITY]:
        speed, asked = known[VELOCITY], known[_COMMAND]
        wanted = slice(asked.start, asked.start + 2)
        of_speed = weight[:, speed] / divisor[speed]  # Per m/s.
        bias = bias - of_speed @ mean[speed] + of_speed[:, :2] @ mean[wanted]
        weight = weight.copy()
        weight[:, wanted] += of_speed[:, :2] * divisor[wanted]
    elif lost:
        cause = f"{policy.file} observes {', '.join(lost)}, and this training does not"
        raise DraftError(cause, "start from a policy with the same observations")
    blocks = [known[name] for name, _ in terms]
    columns = np.concatenate(
        [np.tile(np.r_[at], steps) for at, steps in zip(blocks, past, strict=True)]
    )
    present = np.concatenate(
        [
            np.arange(length) >= length - (at.stop - at.start)
            for at, (_, length) in zip(blocks, terms, strict=True)
        ]
    )
    layers[0] = weight[:, columns] * present, np.asarray(bias, np.float32)
    network = of_layers(mean[columns], divisor[columns], layers, policy.network.metadata)
    return replace(policy, network=network, terms=tuple(terms), history=tuple(past))
