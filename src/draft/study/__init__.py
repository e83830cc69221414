"""Studies: designs x seeds x stages, trained and evaluated as one graph of jobs, and their report.

`run_study` runs a study's file, `write_report` writes the report of a folder of runs, `collect`
collects their results as text, and `read_study` reads and checks a file. Each is imported on first
use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.study.file import read as read_study
    from draft.study.report.collect import collect
    from draft.study.report.writing import write as write_report
    from draft.study.running import run_study

__all__ = ["collect", "read_study", "run_study", "write_report"]

_HOMES = {
    "collect": ("draft.study.report.collect", "collect"),
    "read_study": ("draft.study.file", "read"),
    "run_study": ("draft.study.running", "run_study"),
    "write_report": ("draft.study.report.writing", "write"),
}


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that a module of this package stays light."""
    if name not in _HOMES:
        raise AttributeError(f"module 'draft.study' has no attribute '{name}'")
    import importlib

    module, function = _HOMES[name]
    return getattr(importlib.import_module(module), function)
