"""Tables: a record that pages write as HTML and Markdown, and their files in CSV and LaTeX."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

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
_NEGATIVE = re.compile(r"-\d+(\.\d+)?")


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

    def is_text(self, at: int) -> bool:
        """Return whether a column holds no number."""
        return not any(isinstance(row[at], (float, int, Strong, Spread)) for row in self.rows)

    def groups(self) -> list[tuple[str, int]]:
        """Return the headings of groups and the number of columns of each; empty without any."""
        found: list[tuple[str, int]] = []
        for column in self.columns:
            if found and found[-1][0] == column.group:
                found[-1] = (column.group, found[-1][1] + 1)
            else:
                found.append((column.group, 1))
        return found if any(name for name, _ in found) else []

    def shown(self) -> list[list[Shown]]:
        """Return the cells as shown to readers."""
        return [[_shown(cell, self.digits(i)) for i, cell in enumerate(row)] for row in self.rows]


class Shown(NamedTuple):
    """A cell as shown to readers.

    Attributes:
        text: words, or a number with the decimals of its column.
        strong: whether the cell is emphasised.
        band: least and greatest value; empty where both read the same.
    """

    text: str
    strong: bool = False
    band: Sequence[str] = ()


def _shown(cell: Cell, digits: int) -> Shown:
    if isinstance(cell, Spread):
        band = [f"{end:.{digits}f}" for end in (cell.low, cell.high)]
        return Shown(f"{cell.median:.{digits}f}", cell.best, band if band[0] != band[1] else ())
    if isinstance(cell, Strong):
        return Shown(f"{cell.value:.{digits}f}", True)
    if isinstance(cell, float):
        return Shown(f"{cell:.{digits}f}")
    return Shown("" if cell is None else str(cell))


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
    kinds = "".join("l" if table.is_text(i) else "r" for i in range(len(table.columns)))
    lines = [
        "% \\usepackage{booktabs}",
        f"\\begin{{tabular}}{{{kinds}}}",
        "\\toprule",
        *_tex_groups(table),
        " & ".join(_tex_text(column.head) for column in table.columns) + r" \\",
        "\\midrule",
    ]
    lines += [" & ".join(map(_tex_cell, row)) + r" \\" for row in table.shown()]
    lines += ["\\bottomrule", "\\end{tabular}"]
    lines += [f"% {' '.join(note.split())}" for note in (table.caption, *table.notes)]
    return "\n".join(lines) + "\n"


def _tex_groups(table: Table) -> list[str]:
    groups = table.groups()
    if not groups:
        return []
    cells = [rf"\multicolumn{{{n}}}{{c}}{{{_tex_text(name)}}}" for name, n in groups]
    rules, at = [], 1
    for name, n in groups:
        if name:
            rules.append(rf"\cmidrule(lr){{{at}-{at + n - 1}}}")
        at += n
    return [" & ".join(cells) + r" \\", " ".join(rules)]


def _tex_cell(cell: Shown) -> str:
    text, *band = (
        f"${word}$" if _NEGATIVE.fullmatch(word) else _tex_text(word)
        for word in (cell.text, *cell.band)
    )
    text = rf"\textbf{{{text}}}" if cell.strong else text
    return f"{text} ({'--'.join(band)})" if band else text


def _tex_text(text: str) -> str:
    """Escape a text for LaTeX."""
    out, at = "", 0
    while at < len(text):
        key = next((k for k in ("√(gL)",) if text.startswith(k, at)), text[at])
        out += _TEX.get(key, key)
        at += len(key)
    return out


def to_texts(table: Table) -> tuple[list[str], list[list[str]]]:
    """Return headings and cells as shown to readers; emphasised numbers have two asterisks."""
    heads = [f"{c.group}: {c.head}" if c.group else c.head for c in table.columns]
    return heads, [[_text(cell) for cell in row] for row in table.shown()]


def _text(cell: Shown) -> str:
    text = f"**{cell.text}**" if cell.strong else cell.text
    return f"{text} ({'–'.join(cell.band)})" if cell.band else text
