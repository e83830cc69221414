"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg.

`begin` creates or reopens a run, `train` trains it for a slice of time, and `evaluate` measures
what its policy can do. Each is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.learn.evaluating import evaluate
    from draft.learn.run import open_run
    from draft.learn.training import begin, train

__all__ = ["begin", "evaluate", "open_run", "train"]

_HOMES = {
    "begin": ("draft.learn.training", "begin"),
    "evaluate": ("draft.learn.evaluating", "evaluate"),
    "open_run": ("draft.learn.run", "open_run"),
    "train": ("draft.learn.training", "train"),
}


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that a module of this package stays light."""
    if name not in _HOMES:
        raise AttributeError(f"module 'draft.learn' has no attribute '{name}'")
    import importlib

    module, function = _HOMES[name]
    return getattr(importlib.import_module(module), function)
