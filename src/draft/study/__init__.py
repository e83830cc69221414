"""Studies: designs x seeds x stages, trained and evaluated as one graph of jobs, and their report.

`run_study` runs a study's file, `write_report` writes the report of a folder of runs, `collect`
collects their results as text, and `read_study` reads and checks a file. Each is imported on first
use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.lazy import on_first_use

if TYPE_CHECKING:
    from draft.study.file import read as read_study
    from draft.study.report.collect import collect
    from draft.study.report.writing import write as write_report
    from draft.study.running import run_study

__all__ = ["collect", "read_study", "run_study", "write_report"]

_MODULES = {
    "collect": "draft.study.report.collect",
    "read_study": "draft.study.file:read",
    "run_study": "draft.study.running",
    "write_report": "draft.study.report.writing:write",
}
__getattr__ = on_first_use(__name__, _MODULES)
