"""A page as Markdown."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from draft.study.report.blocks import Block, Commands, Items, Page, Paragraph, Picture, Pictures
from draft.study.report.table import Table, to_texts


def markdown(page: Page, folder: Path) -> str:
    """Return a page as Markdown.

    Args:
        page: the page.
        folder: folder of its file; links to pictures start there.
    """
    parts = [f"# {page.title}"]
    parts += [f"<!-- {page.comment} -->"] if page.comment else []
    parts += _blocks(page.about, folder)
    for section in page.sections:
        parts += [f"## {section.title}", *_blocks(section.blocks, folder)]
    return "\n\n".join(parts) + "\n"


def _blocks(blocks: Sequence[Block], folder: Path) -> Iterator[str]:
    for block in blocks:
        if isinstance(block, Table):
            yield from _table(block)
        elif isinstance(block, Paragraph):
            yield f"**{block.words}**" if block.kind == "warning" else block.words
        elif isinstance(block, Items):
            yield from [block.above] if block.above else []
            yield _items(block.items)
        elif isinstance(block, Commands):
            yield "```sh\n" + "\n".join(block.lines) + "\n```"
        elif isinstance(block, Pictures):
            for one in block.pictures:
                yield from _picture(one, folder)


def _picture(one: Picture, folder: Path) -> Iterator[str]:
    link = Path(os.path.relpath(one.path.resolve(), folder.resolve())).as_posix()
    yield f"![{one.words}]({link})"
    if one.caption:
        yield one.caption


def _table(table: Table) -> Iterator[str]:
    heads, rows = to_texts(table)
    rules = ["---" if table.is_text(i) else "---:" for i in range(len(heads))]
    cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    yield table.caption
    yield "\n".join(f"| {' | '.join(line)} |" for line in (heads, rules, *cells))
    if table.notes:
        yield _items(table.notes)


def _items(items: Sequence[str]) -> str:
    return "\n".join(f"- {item}" for item in items)
