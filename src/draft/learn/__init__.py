"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg.

`begin` creates or reopens a run, `train` trains it for a slice of time, and `evaluate` measures
the capabilities of its policy. Each is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.learn.evaluation import evaluate
    from draft.learn.run import open_run
    from draft.learn.training import begin, train

__all__ = ["begin", "evaluate", "open_run", "train"]

_MODULES = {
    "begin": ("draft.learn.training", "begin"),
    "evaluate": ("draft.learn.evaluation", "evaluate"),
    "open_run": ("draft.learn.run", "open_run"),
    "train": ("draft.learn.training", "train"),
}


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that importing a module of this package is fast."""
    if name not in _MODULES:
        raise AttributeError(f"module 'draft.learn' has no attribute '{name}'")
    import importlib

    module, function = _MODULES[name]
    return getattr(importlib.import_module(module), function)
