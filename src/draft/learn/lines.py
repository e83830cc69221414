"""How far a training is, in lines for a log or for a terminal that does not renew itself."""

from __future__ import annotations

import math
import time

from draft.learn.progress import Progress

_SECONDS = 5.0


class Lines:
    """Prints progress: no more often than every few seconds, and for the last iteration."""

    def __init__(self) -> None:
        self._told = -math.inf

    def tell(self, progress: Progress) -> None:
        """An iteration is done."""
        now = time.monotonic()
        if now - self._told >= _SECONDS or progress.iteration == progress.total:
            self._told = now
            print(_line(progress), flush=True)


def _line(progress: Progress) -> str:
    row = progress.row
    rewards = " ".join(f"{name} {value:.2f}" for name, value in terms(row).items())
    return (
        f"iteration {progress.iteration}/{progress.total}  {progress.steps_per_second:,.0f} steps/s"
        f"  reward {row['reward']:.2f}/s  episode {number(row['episode_s'])} s"
        f"  falls {share(row['falls'])}  error {row['tracking_error']:.2f} m/s"
        f"  left {clock(progress.left)}\n  {rewards}"
    )


def terms(row: dict[str, float]) -> dict[str, float]:
    """Reward terms by name, weighted, per second."""
    return {n.removeprefix("reward/"): v for n, v in row.items() if n.startswith("reward/")}


def number(value: float) -> str:
    """A number, or a dash where there is none."""
    return f"{value:.1f}" if math.isfinite(value) else "-"


def share(value: float) -> str:
    """A share as a percentage, or a dash where there is none."""
    return f"{value:.0%}" if math.isfinite(value) else "-"


def clock(seconds: float) -> str:
    """Seconds as hours, minutes and seconds: 1:02:03."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}"
