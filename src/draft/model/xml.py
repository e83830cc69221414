"""XML elements as text: escaped, indented, numbers with ten significant digits."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any
from xml.sax.saxutils import escape, unescape

import numpy as np
from numpy.typing import NDArray

from draft.values import Array, Value

# Value of an attribute; an array of shape (N,) is a number of N designs.
Attribute = str | Value | Iterable[Value] | None
# What a template has in place of a number.
PLACE = "%.10g"


class Element:
    """An XML element with attributes and children, which are written in the order of their calls.

    The value of an attribute is a string, a number or several numbers; None omits the attribute.
    `class_` is the attribute `class`, which is a keyword of Python. Once its text is written, its
    attributes do not change, so that an element of several designs is written once.
    """

    __slots__ = ("_start", "attributes", "children", "tag")

    def __init__(self, tag: str, **attributes: Attribute) -> None:
        self.tag = tag
        self.attributes: dict[str, Any] = attributes
        self.children: list[Element] = []
        self._start: list[str] = []  # its name and its attributes as text, once written

    def add(self, tag: str, **attributes: Attribute) -> Element:
        """Append a child and return it."""
        child = Element.__new__(Element)  # without a second copy of the attributes
        child.tag, child.attributes, child.children, child._start = tag, attributes, [], []
        self.children.append(child)
        return child

    def put(self, tag: str, content: Attribute, **attributes: Attribute) -> None:
        """Append a child that holds a string, a number or several numbers."""
        self.children.append(_Leaf(tag, _formatted(content), attributes))

    def alone(self) -> Element:
        """Return the element without its children; both have the same attributes."""
        one = Element.__new__(Element)
        one.tag, one.attributes, one.children = self.tag, self.attributes, []
        one._start = self._start
        return one

    def text(self) -> str:
        """Return the text of the element with all its children, ending in a newline."""
        lines: list[str] = []
        self._write(lines, "")
        lines.append("")
        return "\n".join(lines)

    def template(self, rows: NDArray[np.intp]) -> tuple[str, Array]:
        """Text with a place for each number that differs in N designs, and those of some of them.

        The numbers are as they are written, with ten digits, shape (M, places).
        """
        pieces: list[str] = []
        numbers: list[Array] = []
        self._write_many(pieces, numbers, "")
        form = _form(len(numbers))
        # Minus zero is written as zero.
        columns = [(values[rows] + 0.0).tolist() for values in numbers]
        words = [(form % row).split() for row in zip(*columns, strict=True)] or [[]] * len(rows)
        return "".join(pieces), np.array(words, dtype=np.float64)

    def _write_many(self, pieces: list[str], numbers: list[Array], indent: str) -> None:
        """Add the lines with a place for each number that differs, and these numbers."""
        pieces.append(f"{indent}<{self.tag}")
        for name, value in self.attributes.items():
            if value is None:
                continue
            key = "class" if name == "class_" else name
            each = value if isinstance(value, tuple) else (value,)
            if any(isinstance(x, np.ndarray) for x in each):
                numbers += [x for x in each if isinstance(x, np.ndarray)]
                words = [PLACE if isinstance(x, np.ndarray) else _formatted(x) for x in each]
                pieces.append(f' {key}="{" ".join(words)}"')
            else:
                pieces.append(f' {key}="{_formatted(value)}"')
        if not self.children:
            pieces.append("/>\n")
            return
        pieces.append(">\n")
        for child in self.children:
            child._write_many(pieces, numbers, indent + "  ")
        pieces.append(f"{indent}</{self.tag}>\n")

    def _write(self, lines: list[str], indent: str) -> None:
        if not self._start:
            self._start.append(self._written())
        if not self.children:
            lines.append(f"{indent}<{self._start[0]}/>")
            return
        lines.append(f"{indent}<{self._start[0]}>")
        inner = indent + "  "
        for child in self.children:
            child._write(lines, inner)
        lines.append(f"{indent}</{self.tag}>")

    def _written(self) -> str:
        """Text of its name and its attributes."""
        words = [self.tag]
        for name, value in self.attributes.items():
            kind = type(value)
            if kind is str:
                text = value if value.isidentifier() else escape(value, _QUOTE)
            elif value is None:
                continue
            elif kind is tuple:
                text = _numbers(value)
            else:
                text = _numbers((value,)) if kind is float else _formatted(value)
            words.append(f'{name}="{text}"' if name != "class_" else f'class="{text}"')
        return " ".join(words)


class _Leaf(Element):
    """An element that holds a text."""

    __slots__ = ("content",)

    def __init__(self, tag: str, content: str, attributes: dict[str, Any]) -> None:
        super().__init__(tag, **attributes)
        self.content = content

    def _write(self, lines: list[str], indent: str) -> None:
        lines.append(f"{indent}<{self._written()}>{self.content}</{self.tag}>")


def parse(text: str) -> Element:
    """Read what `Element.text` wrote; attributes stay strings.

    Raises:
        ValueError: it has another form.
    """
    root = Element("")
    path = [root]
    for line in map(str.strip, text.splitlines()):
        if len(path) > 1 and line == f"</{path[-1].tag}>":
            path.pop()
            continue
        match = _LINE.fullmatch(line)
        if match is None:
            raise ValueError(f"'{line[:60]}' is not an element")
        child = path[-1].add(match["tag"])
        for name, value in _ATTRIBUTE.findall(match["attributes"]):
            key = "class_" if name == "class" else name
            child.attributes[key] = unescape(value, {"&quot;": '"'})
        if not match["closed"]:
            path.append(child)
    if len(path) > 1 or len(root.children) != 1:
        raise ValueError("it is not one element")
    return root.children[0]


_ATTRIBUTE = re.compile(r' (\w+)="([^"<>]*)"')
_LINE = re.compile(r'<(?P<tag>\w+)(?P<attributes>(?: \w+="[^"<>]*")*)(?P<closed>/?)>')

_QUOTE = {'"': "&quot;"}


def _formatted(value: Any) -> str:
    if isinstance(value, str):
        return value if value.isidentifier() else escape(value, _QUOTE)
    return _numbers((value,) if isinstance(value, (int, float)) else tuple(value))


# Legs have most of their numbers in common, and so have a design and the next edit of it.
@lru_cache(maxsize=1 << 12)
def _numbers(values: tuple[float, ...]) -> str:
    """Numbers with ten digits; minus zero, which has the same place in the cache, as zero."""
    text = _form(len(values)) % values
    if "-0" in text:  # most matches are small negative numbers
        text = " ".join(["0" if word == "-0" else word for word in text.split(" ")])
    return text


@lru_cache(maxsize=64)
def _form(count: int) -> str:
    return " ".join([PLACE] * count)
