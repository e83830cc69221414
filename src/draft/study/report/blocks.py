"""Content of a page as data, which `html` and `markdown` write.

Words may hold **bold** text and `code`; all else in them is plain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from draft.study.report.table import Table


@dataclass(frozen=True)
class Paragraph:
    """A paragraph.

    Attributes:
        words: its words.
        kind: "", "caption" or "warning".
    """

    words: str
    kind: str = ""


@dataclass(frozen=True)
class Items:
    """A list with an optional line above it; `kind` as that of a paragraph."""

    items: Sequence[str]
    above: str = ""
    kind: str = ""


@dataclass(frozen=True)
class Commands:
    """Commands of a terminal, one per line."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Key:
    """Colours of lines by name, for pages that show them in colour; a dashed line has none."""

    colors: Sequence[tuple[str, str | None]]


@dataclass(frozen=True)
class Picture:
    """A picture.

    Attributes:
        name: name in links to it.
        words: description for those who do not see it.
        path: file.
        caption: words below it.
    """

    name: str
    words: str
    path: Path
    caption: str = ""


@dataclass(frozen=True)
class Pictures:
    """Pictures side by side, where the page has room."""

    pictures: Sequence[Picture]


Block = Paragraph | Items | Commands | Key | Pictures | Table


@dataclass(frozen=True)
class Section:
    """A section.

    Attributes:
        name: name in links to it.
        title: heading.
        blocks: content.
    """

    name: str
    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Page:
    """A page.

    Attributes:
        title: heading.
        about: content above the first section.
        sections: sections.
        comment: remark for those who read the source of the page.
    """

    title: str
    about: Sequence[Block]
    sections: Sequence[Section]
    comment: str = ""
