"""One content is written as HTML and as Markdown."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from draft.study.report.blocks import (
    Block,
    Commands,
    Items,
    Key,
    Page,
    Paragraph,
    Picture,
    Pictures,
    Section,
)
from draft.study.report.folder import read
from draft.study.report.html import html
from draft.study.report.markdown import markdown
from draft.study.report.occupancy import Utilisation
from draft.study.report.sections import Contents
from draft.study.report.table import Column, Table
from draft.study.report.tables import all_tables


def test_html_and_markdown_have_the_same_sections_and_tables(source: Path, tmp_path: Path) -> None:
    study = read(source)
    used = Utilisation(study)
    page = Contents(study, all_tables(study, used), {}).page()
    said, marked = html(page), markdown(page, tmp_path)
    headings = re.findall(r"<h2>(.+?)</h2>", said)
    assert headings == re.findall(r"^## (.+)$", marked, re.MULTILINE)
    assert len(headings) >= 8
    (row,) = [line for line in marked.splitlines() if line.startswith("| cheetah | 0.48 | 33.6 | n")
              and "3.4" in line]  # fmt: skip
    for cell in ("3.4", "0.22"):
        assert cell in row
        assert cell in said
    assert "<b>Top speed</b> [m/s]: " in said
    assert "- **Top speed** [m/s]: " in marked


def test_each_kind_of_block_is_written(tmp_path: Path) -> None:
    path = tmp_path / "images/a.png"
    path.parent.mkdir()
    path.write_bytes(b"png")
    blocks: list[Block] = [
        Paragraph("plain `code` <b>"),
        Paragraph("look out", "warning"),
        Items(["one", "two"], "Above:"),
        Commands(["draft study"]),
        Key([("bear", "#123456"), ("perturbed", None)]),
        Pictures([Picture("a", "words", path, "caption")]),
        Table("t", "Caption.", [Column("design"), Column("kick", "m/s", 2)], [["a|b", 1.0]], ["n"]),
    ]
    page = Page("Title", blocks[:2], [Section("name", "Heading", blocks[2:])], "comment")
    assert markdown(page, tmp_path) == (
        "# Title\n\n<!-- comment -->\n\nplain `code` <b>\n\n**look out**\n\n## Heading\n\n"
        "Above:\n\n- one\n- two\n\n```sh\ndraft study\n```\n\n![words](images/a.png)\n\ncaption\n\n"
        "Caption.\n\n| design | kick [m/s] |\n| --- | ---: |\n| a\\|b | 1.00 |\n\n- n\n"
    )
    said = html(page)
    for words in (
        *("plain <code>code</code> &lt;b&gt;", '<div class="warning" role="note">'),
        *("<p>Above:</p>", "<li>two</li>", "<pre>draft study</pre>", "color:#123456"),
        *('alt="words"', "data:image/png;base64,cG5n", "<figcaption>caption</figcaption>"),
        *('<th scope="row">a|b</th><td>1.00</td>', '<section id="name"><h2>Heading</h2>'),
    ):
        assert words in said
