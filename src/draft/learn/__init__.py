"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg.

`train` trains designs and resumes runs, `open_run` opens a run, `evaluate` measures its policy,
and `begin` creates a run of a plan of your own. Each is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.learn.measuring.evaluation import evaluate
    from draft.learn.training.run import open_run
    from draft.learn.training.session import begin
    from draft.learn.training.train import train

__all__ = ["begin", "evaluate", "open_run", "train"]

_MODULES = {
    "begin": ("draft.learn.training.session", "begin"),
    "evaluate": ("draft.learn.measuring.evaluation", "evaluate"),
    "open_run": ("draft.learn.training.run", "open_run"),
    "train": ("draft.learn.training.train", "train"),
}


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that importing a module of this package is fast."""
    if name not in _MODULES:
        raise AttributeError(f"module 'draft.learn' has no attribute '{name}'")
    import importlib

    module, function = _MODULES[name]
    return getattr(importlib.import_module(module), function)
