"""Learning on mjlab: tasks for any quadruped with hip roll, hip pitch and knee per leg.

`train` trains designs and resumes runs, `open_run` opens a run, `evaluate` measures its policy,
and `begin` creates a run of a plan of your own. Each is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.lazy import on_first_use

if TYPE_CHECKING:
    from draft.learn.measuring.evaluation import evaluate
    from draft.learn.training.run import open_run
    from draft.learn.training.session import begin
    from draft.learn.training.train import train

__all__ = ["begin", "evaluate", "open_run", "train"]

_MODULES = {
    "begin": "draft.learn.training.session",
    "evaluate": "draft.learn.measuring.evaluation",
    "open_run": "draft.learn.training.run",
    "train": "draft.learn.training.train",
}
__getattr__ = on_first_use(__name__, _MODULES)
