"""Studies: designs x seeds x stages, trained and evaluated as one graph of jobs, and their report.

`write_report` writes the report of a folder of runs. It is imported on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from draft.study.report import write as write_report

__all__ = ["write_report"]


def __getattr__(name: str) -> object:
    """Import the functions on first use, so that a module of this package stays light."""
    if name != "write_report":
        raise AttributeError(f"module 'draft.study' has no attribute '{name}'")
    from draft.study.report import write

    return write
