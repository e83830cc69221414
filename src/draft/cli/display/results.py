"""Terminal output of `draft study collect` and `draft study results`."""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

from rich.markup import escape
from rich.table import Table as Rich

from draft.cli.display.verdict import console
from draft.errors import DraftError, counted
from draft.study.report import anomalies, run_tables, tables
from draft.study.report.collect import Collected
from draft.study.report.comparison import comparison
from draft.study.report.missing import missing
from draft.study.report.records import Study
from draft.study.report.table import Table, to_texts


def shown(study: Study, others: Sequence[Study] = ()) -> list[Table]:
    """Return the tables for the terminal: skills, order of the designs, others, provenance.

    Raises:
        DraftError: another study has nothing in common with this one.
    """
    skills = tables.capability(study), tables.orders(study)
    found = *skills, *(comparison(study, one) for one in others), run_tables.provenance(study)
    return [table for table in found if table is not None]


def print_tables(study: Study, others: Sequence[Study] = ()) -> None:
    """Print results as tables, then anomalies and missing parts.

    Args:
        study: the results.
        others: results to compare with, see `draft.study.report.comparison`.
    """
    out = console()
    for table in shown(study, others):
        out.print(escape(table.caption), style="dim")
        out.print(_rich(table))
        for note in table.notes:
            out.print(escape(f"  {note}"))
        out.print()
    for title, lines in (
        ("looks wrong", anomalies.anomalies(study)),
        ("missing", missing(study)),
    ):
        for line in lines:
            out.print(f"{title}: {escape(line)}")


def _rich(table: Table) -> Rich:
    made = Rich(box=None, pad_edge=False)
    heads, rows = to_texts(table)
    for i, head in enumerate(heads):
        made.add_column(escape(head), justify="left" if table.is_text(i) else "right")
    for row in rows:
        made.add_row(*(escape(cell.replace("**", "")) for cell in row))
    return made


def print_json(study: Study, others: Sequence[Study] = ()) -> None:
    """Print results as one JSON object; `others` as for `print_tables`."""
    record: dict[str, object] = {"study": study.name}
    for table in shown(study, others):
        heads, rows = to_texts(table)
        record[table.name] = [dict(zip(heads, row, strict=True)) for row in rows]
    record |= {"anomalies": anomalies.anomalies(study), "missing": missing(study)}
    print(json.dumps(record, indent=1, ensure_ascii=False))


def print_collected(done: Collected) -> None:
    """Print the outcome of a collection."""
    out = console()
    for words in done.omitted:
        out.print(f"omitted: {escape(words)}")
    for words in done.missing:
        out.print(f"missing: {escape(words)}")
    count, size = len(done.study.singles), done.size / 1e6
    what = f"{len(done.new)} new, {len(done.changed)} changed" if done.written else "unchanged"
    out.print(escape(f"{done.folder}: {counted(count, 'run')}, {what}; {size:.2f} MB"))


def write_page(study: Study, folder: Path, page: Path, others: Mapping[Path, Study]) -> None:
    """Write the page, and print its files; `others` are results to compare with, by folder.

    Raises:
        DraftError: the page is not a Markdown file, or cannot be written.
    """
    from draft.study.report.writing import write_page as written

    if page.suffix != ".md":
        cause = f"--write {page} is not a Markdown file"
        raise DraftError(cause, "name one such as docs/results.md")
    page_, *pictures = written(study, folder, page, commands(study, folder, page, others), others)
    place = pictures[0].parent if pictures else page_.parent
    print(f"{page_}, with {len(pictures)} figures in {place}")


def commands(study: Study, folder: Path, page: Path, others: Collection[Path]) -> list[str]:
    """Return the command lines that repeat a study, collect its results and write their page."""
    from draft.study.report.sections import place_of

    file, place = folder / f"{study.name}.yaml", place_of(folder)
    toy = bool(study.planned and study.planned.toy)
    made = f"studies/{study.name}{'-toy' * toy}"
    run = f"draft study {place}/{file.name}{' --toy' * toy}   # to {made}, in slices if need be"
    against = " ".join([" --against", *map(place_of, others)]) if others else ""
    relative = os.path.relpath(page)
    named = page.name if relative.startswith("..") else Path(relative).as_posix()
    return [
        *[run] * file.is_file(),
        f"draft study collect {made} --out {place}",
        f"draft study results {place}{against} --write {named}",
    ]
