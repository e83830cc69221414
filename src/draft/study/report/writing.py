"""Writing of a study's pages: a report in HTML, as a whole or not at all, and Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from draft.errors import DraftError
from draft.extras import need
from draft.files import new_folder
from draft.files import write as write_file
from draft.plotting import save
from draft.study.report import figures, robots
from draft.study.report.blocks import Picture
from draft.study.report.comparison import comparison
from draft.study.report.figures import Drawing
from draft.study.report.folder import read
from draft.study.report.html import html
from draft.study.report.markdown import markdown
from draft.study.report.occupancy import Utilisation
from draft.study.report.records import Study
from draft.study.report.sections import Contents, Source
from draft.study.report.table import to_csv, to_tex
from draft.study.report.tables import all_tables

PAGE = "index.html"
# Content by which a report is recognised.
PARTS = {PAGE, "figures", "tables"}
# Resolution of the report's pictures, and of those beside Markdown [dots per inch].
DPI, SMALL = 300, 160
KINDS = ("png", "pdf", "svg")


def write(study: Path, out: Path | None = None) -> Path:
    """Write the report of a study: tables, figures and pictures, as one page and as files.

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
    need("matplotlib", "figures")
    target = (out or study / "report").resolve()
    _check_target(target)
    found = read(study)
    with new_folder(target) as temporary:
        _fill(found, temporary)
    return target / PAGE


def _fill(study: Study, folder: Path) -> None:
    used = Utilisation(study)
    tables = all_tables(study, used)
    for name, table in tables.items():
        write_file(folder / "tables" / f"{name}.csv", to_csv(table))
        write_file(folder / "tables" / f"{name}.tex", to_tex(table))
    drawings = [*figures.single(study, used)]
    place = folder / "figures"
    save(place, {one.name: one.make for one in drawings}, DPI, KINDS)
    pictures = _pictures(drawings, place, "svg")
    if study.members:
        try:
            picture = partial(robots.figure, study, *robots.render(list(study.members.values())))
            save(place, {"robots": picture}, DPI, tuple(dict.fromkeys((*KINDS, "png"))))
            words = "Home poses at true relative size."
            pictures["robots"] = [Picture("robots", words, place / "robots.png", words)]
        except DraftError as error:
            unseen = [f"the picture of the robots: {p.cause}" for p in error.problems]
            study = replace(study, warnings=(*study.warnings, *unseen))
    page = Contents(study, tables, pictures).page()
    write_file(folder / PAGE, html(page))


def _pictures(drawings: Iterable[Drawing], folder: Path, kind: str) -> dict[str, Sequence[Picture]]:
    """Return the pictures of drawings by section."""
    found: dict[str, list[Picture]] = {}
    for one in drawings:
        picture = Picture(one.name, one.words, folder / f"{one.name}.{kind}", one.caption)
        found.setdefault(one.section, []).append(picture)
    return {**found}


def _check_target(target: Path) -> None:
    """Refuse to replace anything but a report."""
    if not target.exists():
        return
    inside = {path.name for path in target.iterdir()} if target.is_dir() else {""}
    if inside - PARTS or (inside and PAGE not in inside):
        cause = f"'{target}' exists and is not a report of Draft; it is kept"
        raise DraftError(cause, "choose another `out`")


def write_page(
    study: Study,
    folder: Path,
    page: Path,
    commands: Sequence[str],
    others: Mapping[Path, Study] | None = None,
) -> list[Path]:
    """Write a page of Markdown, and its figures to `images/NAME/` beside it.

    Args:
        study: the results.
        folder: folder of the results; its `strips/` are linked.
        page: the page, NAME.md.
        commands: command lines that repeat the study, of which the last one writes the page.
        others: results to compare with, by folder, see `draft.study.report.comparison`.

    Returns:
        The files, the page first.

    Raises:
        DraftError: matplotlib is not installed, another study has nothing in common with this one,
            or the files cannot be written.
    """
    need("matplotlib", "figures")
    beside = {where: comparison(study, other) for where, other in (others or {}).items()}
    used = Utilisation(study)
    images = page.parent / "images" / page.stem
    drawings = [*figures.combined(study, used)]
    # The folder is replaced, so that figures that are no longer drawn go.
    with new_folder(images, "choose another `write`") as new:
        found = save(new, {one.name: one.make for one in drawings}, SMALL, ("png",))
        for path in found:
            figures.shrink(path)
    pictures = _pictures(drawings, images, "png")
    source = Source(folder, page, beside, commands)
    contents = Contents(study, all_tables(study, used), pictures, source)
    write_file(page, markdown(contents.page(), page.parent))
    return [page, *(images / path.name for path in found)]
