"""The report on a study: its tables, figures and pictures, as one page and as files."""

from __future__ import annotations

from pathlib import Path


def write(study: Path, out: Path | None = None) -> Path:
    """Write the report on a study.

    Args:
        study: the study's folder, with `runs/`.
        out: folder for the report; `report/` in the study's for None. A report that is there is
            replaced.

    Returns:
        The page. Figures and tables lie beside it in `figures/` and `tables/`.

    Raises:
        DraftError: the folder holds no run, an extra is not installed, or the report cannot be
            written.
    """
    from draft.study.report.writing import write as written

    return written(study, out)
