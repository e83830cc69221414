"""Devices as the command line names them."""

from __future__ import annotations

import os
from collections.abc import Sequence

from draft.errors import DraftError, Problem
from draft.extras import need


def devices(word: str) -> list[str]:
    """Devices that a word of the command line names.

    Args:
        word: "auto", "cpu", "cuda", "cuda:1", "all" (GPUs), or numbers of GPUs such as "0,1".

    Raises:
        DraftError: no such device.
    """
    torch = need("torch", "learn")
    count = torch.cuda.device_count() if torch.cuda.is_available() else 0
    if word == "cpu" or (word == "auto" and not count):
        return ["cpu"]
    numbers = word.removeprefix("cuda").removeprefix(":")
    if word in ("auto", "cuda"):
        numbers = "0"
    elif word == "all":
        numbers = ",".join(map(str, range(count)))
    chosen = [part.strip() for part in numbers.split(",")]
    if word != "all" and not all(part.isdigit() for part in chosen):
        remedy = "cpu, cuda, cuda:1, all, or numbers of GPUs such as 0,1"
        raise DraftError(Problem(f"there is no device '{word}'", None, remedy))
    if not count:
        cause = f"--device {word}: PyTorch finds no GPU"
        remedy = "--device cpu works for trying things out, with few worlds"
        raise DraftError(Problem(cause, None, remedy))
    if any(int(part) >= count for part in chosen) or len(set(chosen)) < len(chosen):
        cause = f"--device {word}: this machine has {count} GPUs, from 0 on, each once"
        raise DraftError(Problem(cause, None, "name those"))
    return [f"cuda:{part}" for part in chosen]


def visible(chosen: Sequence[str]) -> list[str]:
    """Names of GPUs for CUDA_VISIBLE_DEVICES of another process.

    PyTorch numbers the GPUs that this process sees; where CUDA_VISIBLE_DEVICES narrows them, the
    number is a place in its list, of numbers or of names such as GPU-8932f937 and MIG-GPU-8932f937.

    Args:
        chosen: GPUs as `devices` names them: "cuda:1".
    """
    seen = [name.strip() for name in os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",")]
    numbers = [int(name.removeprefix("cuda:")) for name in chosen]
    return [seen[n] if n < len(seen) and seen[n] else str(n) for n in numbers]
