"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg.

`train` trains designs and resumes runs, `open_run` opens a run, `evaluate` measures its policy,
and `begin` creates a run of a plan of your own. Each is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.learn.entries import train
    from draft.learn.evaluation import evaluate
    from draft.learn.run import open_run
    from draft.learn.training import begin

__all__ = ["begin", "evaluate", "open_run", "train"]

_MODULES = {
    "begin": ("draft.learn.training", "begin"),
    "evaluate": ("draft.learn.evaluation", "evaluate"),
    "open_run": ("draft.learn.run", "open_run"),
    "train": ("draft.learn.entries", "train"),
}


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that importing a module of this package is fast."""
    if name not in _MODULES:
        raise AttributeError(f"module 'draft.learn' has no attribute '{name}'")
    import importlib

    module, function = _MODULES[name]
    return getattr(importlib.import_module(module), function)
