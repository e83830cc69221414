"""A page as one HTML file with its pictures in it. It loads nothing."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from html import escape
from importlib.resources import files

from draft.extras import own_version
from draft.study.report import blocks
from draft.study.report.table import Column, Shown, Table
from draft.webpage import webpage

TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
MARKS = (
    (re.compile(r"\*\*(.+?)\*\*"), r"<b>\1</b>"),
    (re.compile(r"`(.+?)`"), r"<code>\1</code>"),
)


def html(page: blocks.Page) -> str:
    """Return a page as HTML."""
    links = "".join(f'<a href="#{s.name}">{escape(s.title)}</a>' for s in page.sections)
    body = "".join(
        f'<section id="{one.name}"><h2>{escape(one.title)}</h2>{_blocks(one.blocks)}</section>\n'
        for one in page.sections
    )
    css = (files("draft.study.report") / "page.css").read_text(encoding="utf-8")
    header = (
        f'<header><h1>{escape(page.title)}</h1><p class="made">Draft {escape(own_version())}.</p>'
        f"{_blocks(page.about)}<nav>{links}</nav></header>"
    )
    return webpage(page.title, css, f"{header}\n<main>{body}</main>")


def _blocks(content: Sequence[blocks.Block]) -> str:
    return "".join(map(_block, content))


def _block(block: blocks.Block) -> str:
    if isinstance(block, Table):
        return _table(block)
    if isinstance(block, blocks.Paragraph):
        return _boxed(f'<p class="{block.kind}">{_words(block.words)}</p>', block.kind)
    if isinstance(block, blocks.Items):
        above = f"<p>{_words(block.above)}</p>" if block.above else ""
        items = "".join(f"<li>{_words(item)}</li>" for item in block.items)
        return _boxed(f'{above}<ul class="plain">{items}</ul>', block.kind)
    if isinstance(block, blocks.Commands):
        return f"<pre>{escape(chr(10).join(block.lines))}</pre>"
    if isinstance(block, blocks.Key):
        lines = (
            f'<span><i style="color:{color}"></i>{escape(name)}</span>'
            if color
            else f'<span><i class="dashed"></i>{escape(name)}</span>'
            for name, color in block.colors
        )
        return f'<div class="key">{"".join(lines)}</div>'
    shown = "".join(map(_picture, block.pictures))
    return f'<div class="grid">{shown}</div>' if len(block.pictures) > 1 else shown


def _boxed(content: str, kind: str) -> str:
    return f'<div class="warning" role="note">{content}</div>' if kind == "warning" else content


def _words(words: str) -> str:
    """Return words with their marks as HTML."""
    found = escape(words)
    for mark, tag in MARKS:
        found = mark.sub(tag, found)
    return found


def _picture(one: blocks.Picture) -> str:
    data = base64.b64encode(one.path.read_bytes()).decode()
    caption = f"<figcaption>{escape(one.caption)}</figcaption>" if one.caption else ""
    return (
        f'<figure id="figure-{one.name}"><img alt="{escape(one.words)}" '
        f'src="data:{TYPES[one.path.suffix]};base64,{data}">{caption}</figure>'
    )


def _table(table: Table) -> str:
    """Return a table with its caption and notes."""
    groups = "".join(
        f'<th colspan="{n}" scope="colgroup" class="{"group" if name else ""}">{escape(name)}</th>'
        for name, n in table.groups()
    )
    head = f"<tr>{groups}</tr>" if groups else ""
    left = [' class="text"' if table.is_text(i) else "" for i in range(len(table.columns))]
    titles = "".join(
        f"<th{kind}>{escape(column.title)}{_unit(column)}</th>"
        for column, kind in zip(table.columns, left, strict=True)
    )
    body = "".join(f"<tr>{_row(row, left)}</tr>" for row in table.shown())
    notes = "".join(f"<li>{escape(note)}</li>" for note in table.notes)
    words = ' class="words"' if table.words else ""
    return (
        f'<p class="caption">{escape(table.caption)}</p>'
        f'<div class="scroll" tabindex="0"><table id="table-{table.name}"{words}>'
        f"<thead>{head}<tr>{titles}</tr></thead><tbody>{body}</tbody></table></div>"
        + (f'<ul class="notes">{notes}</ul>' if notes else "")
    )


def _unit(column: Column) -> str:
    return f" <small>{escape(column.unit)}</small>" if column.unit not in ("", "1") else ""


def _row(row: Sequence[Shown], left: Sequence[str]) -> str:
    first, *others = (_cell(cell) for cell in row)
    rest = "".join(f"<td{kind}>{cell}</td>" for cell, kind in zip(others, left[1:], strict=True))
    return f'<th scope="row">{first}</th>{rest}'


def _cell(cell: Shown) -> str:
    text = f"<b>{escape(cell.text)}</b>" if cell.strong else escape(cell.text)
    return f"{text} <small>{'–'.join(cell.band)}</small>" if cell.band else text
