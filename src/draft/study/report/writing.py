"""Writing of a report, as a whole or not at all."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from draft.errors import DraftError
from draft.extras import need
from draft.files import new_folder
from draft.files import write as write_file
from draft.plotting import save
from draft.study.report import curves, learning, plane, robots
from draft.study.report.gather import gather
from draft.study.report.occupancy import Utilisation
from draft.study.report.page import Page
from draft.study.report.records import Study
from draft.study.report.table import to_csv, to_tex
from draft.study.report.tables import all_tables

PAGE = "index.html"
# Content by which a report is recognised.
PARTS = {PAGE, "figures", "tables"}
DPI = 300
KINDS = ("png", "pdf", "svg")


def write(study: Path, out: Path | None = None) -> Path:
    """Write the report of a study; see `draft.study.report.write`."""
    need("matplotlib", "figures")
    target = (out or study / "report").resolve()
    _check_target(target)
    found = gather(study)
    with new_folder(target) as temporary:
        _fill(found, temporary)
    return target / PAGE


def _fill(study: Study, folder: Path) -> None:
    used = Utilisation(study)
    tables = all_tables(study, used)
    for name, table in tables.items():
        write_file(folder / "tables" / f"{name}.csv", to_csv(table))
        write_file(folder / "tables" / f"{name}.tex", to_tex(table))
    makers = {
        **curves.makers(study),
        **plane.makers(study, used),
        **learning.makers(study),
    }
    figures = folder / "figures"
    save(figures, makers, DPI, KINDS)
    pictures = {name: figures / f"{name}.svg" for name in makers}
    warnings = [*study.warnings, *used.warnings]
    if study.members:
        try:
            picture = partial(robots.figure, study, *robots.render(list(study.members.values())))
            save(figures, {"robots": picture}, DPI, tuple(dict.fromkeys((*KINDS, "png"))))
            pictures["robots"] = figures / "robots.png"
        except DraftError as error:
            warnings += [f"the picture of the robots: {p.cause}" for p in error.problems]
    page = Page(study, tables, pictures, warnings)
    write_file(folder / PAGE, page.text())


def _check_target(target: Path) -> None:
    """Refuse to replace anything but a report."""
    if not target.exists():
        return
    inside = {path.name for path in target.iterdir()} if target.is_dir() else {""}
    if inside - PARTS or (inside and PAGE not in inside):
        cause = f"'{target}' exists and is not a report of Draft; it is kept"
        raise DraftError(cause, "choose another --out")
