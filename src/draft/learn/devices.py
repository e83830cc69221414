"""Devices as the command line names them."""

from __future__ import annotations

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
        remedy = "--device cpu works for trying things out, with tens of worlds (--envs 16)"
        raise DraftError(Problem(cause, None, remedy))
    if any(int(part) >= count for part in chosen) or len(set(chosen)) < len(chosen):
        cause = f"--device {word}: this machine has {count} GPUs, from 0 on, each once"
        raise DraftError(Problem(cause, None, "name those"))
    return [f"cuda:{part}" for part in chosen]
