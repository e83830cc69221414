"""Write the mean of the weights of a policy of all legs before and after a training.

    python -m scripts.mean_of_policies BEFORE.onnx AFTER.onnx OUT.onnx

What a training gains where it learnt most, and loses where it learnt less, the mean of both often
keeps (Wortsman et al. 2022, arXiv:2109.01903). The statistics and metadata are those of AFTER, from
whose weights `--share` is taken, one half by default. AFTER must have been trained from BEFORE: the
hidden units of other networks mean other things.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.roll_outs import run_as_command
from draft.errors import DraftError
from draft.files import write
from draft.learn.policy.onnx_file import Array
from draft.learn.policy.onnx_write import chain
from draft.learn.policy.reduced import open_legs_policy

_CONSTANT = 1e-2  # Divisor of an entry that is constant, as exports write it.


def main(before: Path, after: Path, out: Path, /, share: float = 0.5) -> None:
    """Write the mean of two policies of all legs."""
    old, new = open_legs_policy(before).network, open_legs_policy(after).network
    mean, divisor, layers = new.layers()
    old_mean, old_divisor, (first, *others) = old.layers()
    moved = [_restated(old_mean, old_divisor, first, mean, divisor), *others]
    if [weight.shape for weight, _ in moved] != [weight.shape for weight, _ in layers]:
        raise DraftError(f"{before} has other layers than {after}", "train one from the other")
    mixed = [
        ((1 - share) * weight + share * own, (1 - share) * bias + share * own_bias)
        for (weight, bias), (own, own_bias) in zip(moved, layers, strict=True)
    ]
    # A divisor is infinite for entries that no body of the training had: they have no say.
    write(out, chain(mean, np.where(np.isfinite(divisor), divisor, _CONSTANT), mixed, new.metadata))


def _restated(
    mean: Array,
    divisor: Array,
    first: tuple[Array, Array],
    new_mean: Array,
    new_divisor: Array,
) -> tuple[Array, Array]:
    """First layer for other statistics of its input: the same function of what is observed."""
    weight, bias = first
    known = np.isfinite(divisor) & np.isfinite(new_divisor)
    ratio = np.where(known, np.where(known, new_divisor, 1.0) / np.where(known, divisor, 1.0), 0.0)
    shift = np.where(known, (new_mean - mean) / np.where(known, divisor, 1.0), 0.0)
    return weight * ratio, bias + weight @ shift


if __name__ == "__main__":
    run_as_command(main, __doc__)
