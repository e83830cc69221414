"""What the processes of a run on several GPUs agree on: each is a rank, 0 the first.

With one process every question is its own, and nothing is sent.
"""

from __future__ import annotations

import hashlib

import torch
from torch import distributed


def rank_seed(seed: int, rank: int) -> int:
    """Seed of a rank's random numbers, from 0 to 2**31 - 1; the first keeps the run's.

    The others' are hashed, for seed + rank would give two runs the same worlds.
    """
    if rank == 0:
        return seed
    digest = hashlib.sha256(f"{seed} {rank}".encode()).digest()
    return int.from_bytes(digest[:4], "big") % 2**31


class Ranks:
    """The processes of a run; all must ask the same questions in the same order.

    Attributes:
        rank: of this process.
        count: how many there are.
    """

    def __init__(self, rank: int, count: int, device: str) -> None:
        """Note them; where there are several, PyTorch's process group has been started."""
        self.rank, self.count, self._device = rank, count, device

    def of_first(self, value: int) -> int:
        """The first process's value."""
        if self.count == 1:
            return value
        sent = torch.tensor(value, dtype=torch.int64, device=self._device)
        distributed.broadcast(sent, src=0)
        return int(sent)

    def all(self, flag: bool) -> bool:
        """Whether it is so for every process."""
        if self.count == 1:
            return flag
        least = torch.tensor(int(flag), dtype=torch.int64, device=self._device)
        distributed.all_reduce(least, op=distributed.ReduceOp.MIN)
        return bool(least)

    def sum(self, values: torch.Tensor) -> torch.Tensor:
        """Sum over the processes, in place."""
        if self.count > 1:
            distributed.all_reduce(values)
        return values

    def most(self, values: torch.Tensor) -> torch.Tensor:
        """The largest of each value over the processes, in place."""
        if self.count > 1:
            distributed.all_reduce(values, op=distributed.ReduceOp.MAX)
        return values

    def wait(self) -> None:
        """Wait until every process is here."""
        self.all(True)
