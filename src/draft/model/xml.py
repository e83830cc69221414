"""Writing XML elements: escaped, indented, numbers at ten significant digits."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any
from xml.sax.saxutils import quoteattr


class Element:
    """An XML element with attributes and children, in the order they are given.

    An attribute is a string, a number, or numbers; None leaves it out. A trailing underscore of its
    name falls away (`class_`).
    """

    __slots__ = ("attributes", "children", "tag")

    def __init__(self, tag: str, **attributes: Any) -> None:
        self.tag = tag
        self.attributes = attributes
        self.children: list[Element] = []

    def add(self, tag: str, **attributes: Any) -> Element:
        """Append a child and return it."""
        child = Element(tag, **attributes)
        self.children.append(child)
        return child

    def text(self) -> str:
        """The element and all in it, ending in a newline."""
        lines: list[str] = []
        self._write(lines, "")
        lines.append("")
        return "\n".join(lines)

    def _write(self, lines: list[str], indent: str) -> None:
        parts = [f"{indent}<{self.tag}"]
        for name, value in self.attributes.items():
            if value is None:
                continue
            parts.append(f"{name.rstrip('_')}={_quoted(value)}")
        head = " ".join(parts)
        if not self.children:
            lines.append(head + "/>")
            return
        lines.append(head + ">")
        for child in self.children:
            child._write(lines, indent + "  ")
        lines.append(f"{indent}</{self.tag}>")


def _quoted(value: str | float | Iterable[float]) -> str:
    if isinstance(value, str):
        return quoteattr(value)
    if isinstance(value, (int, float)):
        return f'"{value + 0.0:.10g}"'
    return '"' + " ".join([f"{x + 0.0:.10g}" for x in value]) + '"'
