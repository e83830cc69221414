"""Tables as CSV, LaTeX (booktabs), HTML and Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from draft.study.report.spread import Spread, decimals

_TEX = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "√(gL)": r"$\sqrt{gL}$",
    **{"η": r"$\eta$", "τ": r"$\tau$", "ω": r"$\omega$", "×": r"$\times$", "≥": r"$\geq$"},
    **{"–": "--", "…": r"\dots{}", "±": r"$\pm$", "<": r"$<$", ">": r"$>$"},
}


@dataclass(frozen=True)
class Strong:
    """A number that is emphasised."""

    value: float


Cell = str | float | int | Strong | Spread | None


@dataclass(frozen=True)
class Column:
    """A column.

    Attributes:
        title: title.
        unit: unit; "1" and "" are not shown.
        digits: decimals; None to choose them by the column's bands.
        group: heading above neighbouring columns of the same group.
    """

    title: str
    unit: str = ""
    digits: int | None = None
    group: str = ""

    @property
    def head(self) -> str:
        """Title with its unit."""
        return f"{self.title} [{self.unit}]" if self.unit not in ("", "1") else self.title


@dataclass(frozen=True)
class Table:
    """A table.

    Attributes:
        name: name of its files.
        caption: a sentence or two.
        columns: columns.
        rows: cells of each row, one per column; None for an empty one.
        notes: notes below the table.
        words: whether most columns are text.
    """

    name: str
    caption: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Cell]]
    notes: Sequence[str] = ()
    words: bool = False

    def digits(self, at: int) -> int:
        """Return the decimals of a column."""
        fixed = self.columns[at].digits
        if fixed is not None:
            return fixed
        cells = [row[at] for row in self.rows]
        return decimals(cell for cell in cells if isinstance(cell, Spread))


def to_csv(table: Table) -> str:
    """Return a table as CSV with one number per cell: a band takes three columns."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    wide = [
        any(isinstance(row[i], Spread) for row in table.rows) for i in range(len(table.columns))
    ]
    head: list[str] = []
    for column, band in zip(table.columns, wide, strict=True):
        title = f"{column.group}, {column.head}" if column.group else column.head
        head += [title, f"{title}, least", f"{title}, greatest"] if band else [title]
    writer.writerow(head)
    for row in table.rows:
        line: list[str] = []
        for cell, band in zip(row, wide, strict=True):
            if isinstance(cell, Spread):
                line += [f"{x:.6g}" for x in (cell.median, cell.low, cell.high)]
            else:
                line += [_plain(cell), *([""] * 2 if band else [])]
        writer.writerow(line)
    return out.getvalue()


def _plain(cell: Cell) -> str:
    if isinstance(cell, Strong):
        return f"{cell.value:.6g}"
    if isinstance(cell, float):
        return f"{cell:.6g}"
    return "" if cell is None else str(cell)


def to_tex(table: Table) -> str:
    """Return a table as LaTeX with booktabs, with the decimals of the page."""
    kinds = "".join("l" if is_text(table, i) else "r" for i in range(len(table.columns)))
    lines = [
        "% \\usepackage{booktabs}",
        f"\\begin{{tabular}}{{{kinds}}}",
        "\\toprule",
        *_tex_groups(table),
        " & ".join(_tex_text(column.head) for column in table.columns) + r" \\",
        "\\midrule",
    ]
    for row in table.rows:
        cells = [_tex_cell(cell, table.digits(i)) for i, cell in enumerate(row)]
        lines.append(" & ".join(cells) + r" \\")
    lines += ["\\bottomrule", "\\end{tabular}"]
    lines += [f"% {' '.join(note.split())}" for note in (table.caption, *table.notes)]
    return "\n".join(lines) + "\n"


def is_text(table: Table, at: int) -> bool:
    """Return whether a column holds no number."""
    return not any(isinstance(row[at], (float, int, Strong, Spread)) for row in table.rows)


def _groups(table: Table) -> list[tuple[str, int]]:
    """Return the headings of groups, and the number of columns of each."""
    found: list[tuple[str, int]] = []
    for column in table.columns:
        if found and found[-1][0] == column.group:
            found[-1] = (column.group, found[-1][1] + 1)
        else:
            found.append((column.group, 1))
    return found if any(name for name, _ in found) else []


def _tex_groups(table: Table) -> list[str]:
    groups = _groups(table)
    if not groups:
        return []
    cells = [rf"\multicolumn{{{n}}}{{c}}{{{_tex_text(name)}}}" for name, n in groups]
    rules, at = [], 1
    for name, n in groups:
        if name:
            rules.append(rf"\cmidrule(lr){{{at}-{at + n - 1}}}")
        at += n
    return [" & ".join(cells) + r" \\", " ".join(rules)]


def _tex_cell(cell: Cell, digits: int) -> str:
    if isinstance(cell, Spread):
        middle, low, high = (_signed(x, digits) for x in (cell.median, cell.low, cell.high))
        middle = rf"\textbf{{{middle}}}" if cell.best else middle
        return middle if cell.count < 2 else f"{middle} ({low}--{high})"
    if isinstance(cell, Strong):
        return rf"\textbf{{{_signed(cell.value, digits)}}}"
    if isinstance(cell, float):
        return _signed(cell, digits)
    return "" if cell is None else _tex_text(str(cell))


def _signed(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return f"${text}$" if text.startswith("-") else text


def _tex_text(text: str) -> str:
    """Escape a text for LaTeX."""
    out, at = "", 0
    while at < len(text):
        key = next((k for k in ("√(gL)",) if text.startswith(k, at)), text[at])
        out += _TEX.get(key, key)
        at += len(key)
    return out


def to_html(table: Table) -> str:
    """Return a table as HTML, with its notes."""
    head = ""
    groups = _groups(table)
    if groups:
        cells = "".join(
            f'<th colspan="{n}" scope="colgroup" class="{"group" if name else ""}">'
            f"{escape(name)}</th>"
            for name, n in groups
        )
        head = f"<tr>{cells}</tr>"
    texts = [is_text(table, i) for i in range(len(table.columns))]
    titles = "".join(
        f"<th{_left(text)}>{escape(column.title)}{_unit(column)}</th>"
        for column, text in zip(table.columns, texts, strict=True)
    )
    body = "".join(f"<tr>{_html_row(table, row, texts)}</tr>" for row in table.rows)
    notes = "".join(f"<li>{escape(note)}</li>" for note in table.notes)
    words = ' class="words"' if table.words else ""
    return (
        f'<p class="caption">{escape(table.caption)}</p>'
        f'<div class="scroll" tabindex="0"><table id="table-{table.name}"{words}>'
        f"<thead>{head}<tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>"
        + (f'<ul class="notes">{notes}</ul>' if notes else "")
    )


def _left(text: bool) -> str:
    return ' class="text"' if text else ""


def _unit(column: Column) -> str:
    return f" <small>{escape(column.unit)}</small>" if column.unit not in ("", "1") else ""


def _html_row(table: Table, row: Sequence[Cell], texts: Sequence[bool]) -> str:
    cells = []
    for i, cell in enumerate(row):
        if i == 0:
            cells.append(f'<th scope="row">{escape(str(cell))}</th>')
        else:
            cells.append(f"<td{_left(texts[i])}>{_html_cell(cell, table.digits(i))}</td>")
    return "".join(cells)


def _html_cell(cell: Cell, digits: int) -> str:
    if isinstance(cell, Spread):
        middle, low, high = (f"{x:.{digits}f}" for x in (cell.median, cell.low, cell.high))
        middle = f"<b>{middle}</b>" if cell.best else middle
        return middle if cell.count < 2 else f"{middle} <small>{low}–{high}</small>"
    if isinstance(cell, Strong):
        return f"<b>{cell.value:.{digits}f}</b>"
    if isinstance(cell, float):
        return f"{cell:.{digits}f}"
    return "" if cell is None else escape(str(cell))


def to_texts(table: Table) -> tuple[list[str], list[list[str]]]:
    """Return headings and cells as shown to readers; emphasised numbers have two asterisks."""
    heads = [f"{c.group}: {c.head}" if c.group else c.head for c in table.columns]
    rows = [[_text(cell, table.digits(i)) for i, cell in enumerate(row)] for row in table.rows]
    return heads, rows


def _text(cell: Cell, digits: int) -> str:
    if isinstance(cell, Spread):
        middle, low, high = (f"{x:.{digits}f}" for x in (cell.median, cell.low, cell.high))
        alone = cell.count < 2 or low == high
        middle = f"**{middle}**" if cell.best else middle
        return middle if alone else f"{middle} ({low}–{high})"
    if isinstance(cell, Strong):
        return f"**{cell.value:.{digits}f}**"
    if isinstance(cell, float):
        return f"{cell:.{digits}f}"
    return "" if cell is None else str(cell)


def to_markdown(table: Table) -> str:
    """Return a table as Markdown: caption, table, notes."""
    heads, rows = to_texts(table)
    lines = [
        _markdown_row(heads),
        _markdown_row(["---" if is_text(table, i) else "---:" for i in range(len(heads))]),
        *(_markdown_row([cell.replace("|", "\\|") for cell in row]) for row in rows),
    ]
    notes = "".join(f"- {note}\n" for note in table.notes)
    return f"{table.caption}\n\n" + "\n".join(lines) + "\n" + (f"\n{notes}" if notes else "")


def _markdown_row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
