"""What tests of the report read: tables and pages of a folder, without figures."""

from __future__ import annotations

from pathlib import Path

from draft.study.report.blocks import Page
from draft.study.report.folder import read
from draft.study.report.html import html
from draft.study.report.occupancy import Utilisation
from draft.study.report.sections import Contents
from draft.study.report.table import Table
from draft.study.report.tables import all_tables


def tables_of(folder: Path) -> dict[str, Table]:
    study = read(folder)
    return all_tables(study, Utilisation(study))


def page_of(folder: Path) -> str:
    """The page without figures."""
    study = read(folder)
    used = Utilisation(study)
    return html(Contents(study, all_tables(study, used), {}).page())


def to_html(table: Table) -> str:
    """A page with a table and nothing else."""
    return html(Page("", [table], []))
