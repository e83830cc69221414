"""Safe reading of XML, with line numbers.

A DOCTYPE is refused, so that there are no entities to expand and no files to fetch; the size, the
depth and the number of elements are limited.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from draft.errors import DraftError, Location, Problem

MAX_BYTES = 50_000_000
MAX_DEPTH = 256
MAX_ELEMENTS = 200_000
MAX_ATTRIBUTES = 100


class DescriptionError(DraftError):
    """A robot description is unreadable, malformed, or not a tree of links."""


@dataclass(slots=True)
class Element:
    """An XML element.

    Attributes:
        tag: tag.
        attributes: attributes by name.
        where: place in the file.
        children: children, in the order of the file.
        content: text between the tags; "" unless it was requested.
    """

    tag: str
    attributes: dict[str, str]
    where: Location
    children: list[Element] = field(default_factory=list)
    content: str = ""

    def all(self, *tags: str) -> Iterator[Element]:
        """Children with one of these tags, in order."""
        return (child for child in self.children if child.tag in tags)

    def first(self, tag: str) -> Element | None:
        """First child with this tag; None without one."""
        return next(self.all(tag), None)

    def text(self, attribute: str) -> str:
        """Value of a required attribute.

        Raises:
            DescriptionError: the attribute is missing or blank.
        """
        value = self.attributes.get(attribute, "").strip()
        if not value:
            raise self.error(f"<{self.tag}> has no {attribute}")
        return value

    def numbers(
        self, attribute: str, count: int, default: tuple[float, ...] | None = None
    ) -> tuple[float, ...]:
        """Read an attribute of `count` finite numbers.

        Raises:
            DescriptionError: the attribute is missing and has no default, has another count, or is
                not finite numbers.
        """
        text = self.attributes.get(attribute)
        if text is None and default is not None:
            return default
        values = self.some_numbers(attribute)
        if len(values) != count:
            what = "one number" if count == 1 else f"{count} numbers"
            raise self.error(f'{attribute}="{text or ""}" of <{self.tag}> is not {what}')
        return values

    def number(self, attribute: str, default: float | None = None) -> float:
        """Read an attribute of one finite number; errors as `numbers`."""
        return self.numbers(attribute, 1, None if default is None else (default,))[0]

    def some_numbers(self, attribute: str) -> tuple[float, ...]:
        """Read an attribute of any number of finite numbers; empty if it is missing.

        Raises:
            DescriptionError: an entry is not a finite number.
        """
        text = self.attributes.get(attribute, "")
        try:
            values = tuple(map(float, text.split()))
        except ValueError:
            values = (math.nan,)
        if not all(map(math.isfinite, values)):
            remedy = "separate numbers by spaces only" if "," in text else ""
            cause = f'{attribute}="{text[:60]}" of <{self.tag}> is not a finite number'
            raise self.error(cause, remedy)
        return values

    def error(self, cause: str, remedy: str = "") -> DescriptionError:
        """Error with the place of this element."""
        return DescriptionError(Problem(cause, self.where, remedy))


def read_file(path: Path, shown: str | None = None) -> Element:
    """Read one XML file and return its root element.

    Args:
        path: the file.
        shown: name of the file in messages; default the path.

    Raises:
        DescriptionError: missing, unreadable, over 50 MB, or not plain XML.
    """
    name = shown or str(path)
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise DescriptionError(Problem("this is not a file", Location(name)))
        if size > MAX_BYTES:
            raise _too_large(size, name)
        with path.open("rb") as file:
            text = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise DescriptionError(Problem("file not found", Location(name))) from None
    except OSError as error:
        cause = f"cannot read it: {error.strerror}"
        raise DescriptionError(Problem(cause, Location(name))) from None
    return read_text(text, name)


def read_text(text: str | bytes, file: str, with_content: bool = False) -> Element:
    """Read XML text and return its root element.

    Args:
        text: the document.
        file: name of the file in messages.
        with_content: whether to keep the text between the tags, which URDF and MJCF do not use.

    Raises:
        DescriptionError: over 50 MB, not well-formed, with a DOCTYPE, or nested too deeply.
    """
    if len(text) > MAX_BYTES:
        raise _too_large(len(text), file)
    reader = _Reader(file, with_content)
    try:
        reader.parser.Parse(text, True)
    except expat.ExpatError as error:
        where = Location(file, error.lineno, error.offset + 1)
        cause = f"not well-formed XML: {expat.ErrorString(error.code)}"
        raise DescriptionError(Problem(cause, where)) from None
    except (LookupError, ValueError) as error:
        raise DescriptionError(Problem(f"not XML text: {error}", Location(file))) from None
    assert reader.root is not None  # expat refuses a document without an element
    return reader.root


def _too_large(size: int, name: str) -> DescriptionError:
    cause = f"file of {size / 1e6:.1f} MB"
    return DescriptionError(Problem(cause, Location(name), "a description may have up to 50 MB"))


class _Reader:
    """Builder of elements from the events of expat, with an explicit stack."""

    def __init__(self, file: str, with_content: bool) -> None:
        self.file = file
        self.root: Element | None = None
        self.stack: list[Element] = []
        self.pieces: list[list[str]] = []
        self.count = 0
        self.parser = expat.ParserCreate()
        self.parser.SetParamEntityParsing(expat.XML_PARAM_ENTITY_PARSING_NEVER)
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        if with_content:
            self.parser.buffer_text = True
            self.parser.buffer_size = 1 << 16
            self.parser.CharacterDataHandler = self._text

    def _where(self) -> Location:
        return Location(self.file, self.parser.CurrentLineNumber)

    def _refuse_doctype(self, *_: object) -> None:
        raise DescriptionError(
            Problem("it has a DOCTYPE", self._where(), "remove it: a description needs no entities")
        )

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise DescriptionError(
                Problem(f"more than {MAX_ELEMENTS} elements", self._where(), "split the file")
            )
        if len(self.stack) >= MAX_DEPTH:
            raise DescriptionError(
                Problem("nested too deeply", self._where(), f"the limit is {MAX_DEPTH} levels")
            )
        if len(attributes) > MAX_ATTRIBUTES:
            cause = f"<{tag[:40]}> has {len(attributes)} attributes"
            raise DescriptionError(Problem(cause, self._where(), f"at most {MAX_ATTRIBUTES}"))
        element = Element(tag, attributes, self._where())
        if self.stack:
            self.stack[-1].children.append(element)
        else:
            self.root = element
        self.stack.append(element)
        self.pieces.append([])

    def _text(self, piece: str) -> None:
        self.pieces[-1].append(piece)

    def _end(self, _: str) -> None:
        self.stack.pop().content = "".join(self.pieces.pop())
