"""Report of a study: tables, figures and pictures, as one page and as files."""

from __future__ import annotations

from pathlib import Path


def write(study: Path, out: Path | None = None) -> Path:
    """Write the report of a study.

    Args:
        study: folder of the study, or any folder of runs in `runs/`.
        out: folder for the report, which replaces an existing one; None for `report/` in the
            study's folder.

    Returns:
        Path of the page; figures and tables are beside it in `figures/` and `tables/`.

    Raises:
        DraftError: the folder holds no run, an extra is not installed, or the report cannot be
            written.
    """
    from draft.study.report.writing import write as written

    return written(study, out)
