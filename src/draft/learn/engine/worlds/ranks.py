"""Communication between the processes of a run: each has a rank, 0 for the first.

With one process nothing is sent.
"""

from __future__ import annotations

import hashlib

import torch
from torch import distributed


def rank_seed(seed: int, rank: int) -> int:
    """Seed of a rank's random numbers, from 0 to 2**31 - 1; that of the run for the first.

    The others are hashed, as seed + rank would give two runs the same worlds.
    """
    if rank == 0:
        return seed
    digest = hashlib.sha256(f"{seed} {rank}".encode()).digest()
    return int.from_bytes(digest[:4], "big") % 2**31


class Ranks:
    """The processes of a run; all must call the same methods in the same order.

    Attributes:
        rank: rank of this process.
        count: number of processes.
    """

    def __init__(self, rank: int, count: int, device: str) -> None:
        """Store rank and count; PyTorch's process group must exist if there are several."""
        self.rank, self.count, self._device = rank, count, device

    def of_first(self, value: int) -> int:
        """Return the first process's value."""
        if self.count == 1:
            return value
        sent = torch.tensor(value, dtype=torch.int64, device=self._device)
        distributed.broadcast(sent, src=0)
        return int(sent)

    def all(self, flag: bool) -> bool:
        """Return whether a flag is true in every process."""
        if self.count == 1:
            return flag
        least = torch.tensor(int(flag), dtype=torch.int64, device=self._device)
        distributed.all_reduce(least, op=distributed.ReduceOp.MIN)
        return bool(least)

    def sum(self, values: torch.Tensor) -> torch.Tensor:
        """Sum values over the processes, in place."""
        if self.count > 1:
            distributed.all_reduce(values)
        return values

    def most(self, values: torch.Tensor) -> torch.Tensor:
        """Replace each value by its maximum over the processes, in place."""
        if self.count > 1:
            distributed.all_reduce(values, op=distributed.ReduceOp.MAX)
        return values

    def wait(self) -> None:
        """Wait until every process calls this."""
        self.all(True)
