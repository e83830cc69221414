"""Random numbers that all bodies share, so that noise cancels in the differences between them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import torch
from torch.overrides import TorchFunctionMode

_KINDS = {torch.rand: torch.rand, torch.rand_like: torch.rand}
_KINDS |= {torch.randn: torch.randn, torch.randn_like: torch.randn}


class CommonDraws(TorchFunctionMode):
    """Give all worlds of a replica the same noise, start, errors and kicks, at all levels.

    It replaces what is drawn for every world at once. Draws for some worlds are those of robots
    that start again after a fall, which are not measured.
    """

    def __init__(self, replica: np.ndarray, seed: int) -> None:
        """Start the streams.

        Args:
            replica: replica of each world, from 0, shape (worlds,).
            seed: seed of the draws.
        """
        super().__init__()
        self._replica, self._seed = torch.from_numpy(replica), seed
        self._count = int(replica.max()) + 1
        # A robot that falls draws its delay anew, for all worlds: a stream for each shape keeps
        # this from the noise of the others.
        self._streams: dict[tuple[int, ...], torch.Generator] = {}

    def __torch_function__(
        self,
        func: Callable[..., Any],
        types: Sequence[type],
        args: Sequence[Any] = (),
        kwargs: Mapping[str, Any] | None = None,
    ) -> Any:
        """Call a function; draws for all worlds become those of their replicas."""
        found = func(*args, **(kwargs or {}))
        if func not in _KINDS or found.shape[:1] != (len(self._replica),):
            return found
        rest = tuple(found.shape[1:])
        if rest not in self._streams:
            first = int(np.random.SeedSequence((self._seed, *rest)).generate_state(1)[0])
            self._streams[rest] = torch.Generator().manual_seed(first)
        drawn = _KINDS[func](self._count, *rest, generator=self._streams[rest], dtype=found.dtype)
        return drawn[self._replica].to(found.device)
