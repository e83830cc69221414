"""YAML with positions, read such that no file can run code, expand or hang.

The text is read as a stream of parser events, never through a constructor: tags and aliases are
refused (so anchors cannot multiply), and size, depth and number of nodes are limited.
Scalars follow YAML 1.2's core schema (`yes` and `on` are strings, `1e3` is a number).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from draft.errors import Location, Problem, SpecError

MAX_BYTES = 1_000_000
MAX_DEPTH = 64
MAX_NODES = 50_000

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_INTEGER = re.compile(r"[-+]?[0-9]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_NULL = frozenset(("", "~", "null", "Null", "NULL"))
_BOOLEAN = {"true": True, "True": True, "TRUE": True, "false": False, "False": False}

Path_ = tuple[str | int, ...]
_Container = dict[str, object] | list[object]
_NodeEvent = yaml.ScalarEvent | yaml.CollectionStartEvent


@dataclass(frozen=True, slots=True)
class Source:
    """Content of a YAML file, with positions.

    Attributes:
        file: its name in messages.
        data: plain dicts, lists, strings, floats, ints, booleans and None.
        places: (line, column) of every key's value, list item and mapping key, by its path; the
            place of a key itself is stored under `(*path, KEY)`. Empty for a mapping in memory.
    """

    file: str
    data: Any
    places: dict[Path_, tuple[int, int]] = field(repr=False, default_factory=dict)

    def at(self, path: Path_, *, key: bool = False) -> Location:
        """Place of the value at a path, or of the innermost value around it that exists.

        In a mapping, which has no lines, it is the path.
        """
        if not self.places:
            return Location(self.file, keys=path)
        if key and (*path, KEY) in self.places:
            return Location(self.file, *self.places[(*path, KEY)])
        while path and path not in self.places:
            path = path[:-1]
        return Location(self.file, *self.places.get(path, (1, 1)))


KEY = "\0key"


def read_file(path: Path, missing: str = "check its path") -> Source:
    """Read one YAML file.

    Args:
        path: the file.
        missing: remedy if there is no such file.

    Raises:
        SpecError: the file is missing, unreadable, too large, not UTF-8, or not plain YAML.
    """
    name = str(path)
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise SpecError(Problem("this is not a file", Location(name)))
        if size > MAX_BYTES:
            raise SpecError(
                Problem(
                    f"a file of {size / 1e6:.1f} MB is too large",
                    Location(name),
                    "the limit is 1 MB",
                )
            )
        content = path.read_bytes()
    except FileNotFoundError:
        raise SpecError(
            Problem(
                "file not found",
                Location(name),
                missing,
            )
        ) from None
    except OSError as error:
        raise SpecError(
            Problem(f"cannot read the file: {error.strerror}", Location(name))
        ) from None
    return read_text(content, name)


def read_text(text: str | bytes, file: str) -> Source:
    """Read YAML text; `file` is its name in messages.

    Raises:
        SpecError: the text is not UTF-8, not plain YAML, too deep, or has too many nodes.
    """
    try:
        text = text if isinstance(text, str) else text.decode("utf-8")
    except UnicodeDecodeError as error:
        raise SpecError(
            Problem(f"byte {error.start} is not UTF-8 text", Location(file), "save it as UTF-8")
        ) from None
    if len(text) > MAX_BYTES:
        raise SpecError(Problem("the text is too large", Location(file), "the limit is 1 MB"))
    try:
        try:
            reader = _taken(text, file, _Loader)
        except yaml.MarkedYAMLError as error:
            if "nesting depth" not in str(error.problem):
                raise
            # Newer LibYAML has a limit of its own, which it meets before the event of ours.
            reader = _taken(text, file, yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        raise SpecError(_not_yaml(error, file)) from None
    except yaml.reader.ReaderError as error:
        raise SpecError(_not_text(error, text, file)) from None
    except (yaml.YAMLError, RecursionError) as error:
        raise SpecError(Problem(f"not valid YAML: {error}", Location(file))) from None
    return Source(file, reader.root, reader.places or {(): (1, 1)})


def read_mapping(text: bytes, file: str) -> Source:
    """Read the JSON text of a mapping; errors as `read_text`, with keys in place of lines."""
    return replace(read_text(text, file), places={})


def _taken(text: str, file: str, loader: type) -> _Reader:
    """Reader that has taken all events of a text."""
    reader = _Reader(file)
    for event in yaml.parse(text, Loader=loader):
        reader.take(event)
    return reader


def _not_text(error: yaml.reader.ReaderError, text: str, file: str) -> Problem:
    before = text[: error.position]
    where = Location(file, before.count("\n") + 1, len(before) - before.rfind("\n"))
    code = text[error.position : error.position + 1].encode("unicode_escape").decode()
    return Problem(f"not valid YAML: the control character {code}", where, "remove it")


def _not_yaml(error: yaml.MarkedYAMLError, file: str) -> Problem:
    mark, begin = error.problem_mark or error.context_mark, error.context_mark
    where = Location(file, mark.line + 1, mark.column + 1) if mark else Location(file)
    cause = f"not valid YAML: {error.problem}"
    if error.context and begin:
        cause += f" {error.context} that begins at {begin.line + 1}:{begin.column + 1}"
    return Problem(cause, where, "check indentation (by spaces), brackets and quotes")


class _Reader:
    """Builds plain data from parser events with an explicit stack."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.root: object = None
        self.places: dict[Path_, tuple[int, int]] = {}
        self.nodes = 0
        self.documents = 0
        # Each frame: container, its path, and the key without a value yet (mappings only).
        self.stack: list[tuple[_Container, Path_, list[str]]] = []

    def take(self, event: yaml.Event) -> None:
        """Handle one parser event."""
        if isinstance(event, yaml.ScalarEvent):
            self._refuse_tag(event)
            self._scalar(event)
        elif isinstance(event, (yaml.MappingStartEvent, yaml.SequenceStartEvent)):
            self._refuse_tag(event)
            container: _Container = {} if isinstance(event, yaml.MappingStartEvent) else []
            path = self._put(container, event)
            self.stack.append((container, path, []))
            if len(self.stack) > MAX_DEPTH:
                raise self._error(event, "nested too deeply", f"the limit is {MAX_DEPTH} levels")
        elif isinstance(event, (yaml.MappingEndEvent, yaml.SequenceEndEvent)):
            self.stack.pop()
        elif isinstance(event, yaml.AliasEvent):
            raise self._error(
                event,
                f"the alias '*{event.anchor}' is not allowed",
                "Draft's files use no anchors and aliases; name the number as a parameter, "
                "or the links as a chain",
            )
        elif isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                raise self._error(
                    event, "a second document begins here", "write one document per file"
                )

    def _refuse_tag(self, event: _NodeEvent) -> None:
        if event.tag not in (None, "!"):
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            raise self._error(event, f"the tag '{tag}' is not allowed", "remove it")

    def _scalar(self, event: yaml.ScalarEvent) -> None:
        frame = self.stack[-1] if self.stack else None
        if frame and isinstance(frame[0], dict) and not frame[2]:
            if event.value in frame[0]:
                raise self._error(event, f"duplicate key '{event.value}'", "remove one of them")
            frame[2].append(event.value)
            mark = event.start_mark
            self.places[(*frame[1], event.value, KEY)] = (mark.line + 1, mark.column + 1)
            return
        self._put(self._value(event), event)

    def _value(self, event: yaml.ScalarEvent) -> object:
        text: str = event.value
        if not event.implicit[0]:
            return text
        if text in _NULL:
            return None
        if text in _BOOLEAN:
            return _BOOLEAN[text]
        if _INTEGER.fullmatch(text):
            return int(text) if len(text) < 19 else float(text)
        if _FLOAT.fullmatch(text):
            number = float(text)
            if not math.isfinite(number):
                raise self._error(event, f"{text} is too large a number", "use a smaller one")
            return number
        return text

    def _put(self, value: object, event: yaml.Event) -> Path_:
        """Add a value to the open container and return its path."""
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise self._error(event, "too many entries", f"the limit is {MAX_NODES}")
        if not self.stack:
            self.root = value
            path: Path_ = ()
        else:
            container, parent, waiting = self.stack[-1]
            if isinstance(container, list):
                path = (*parent, len(container))
                container.append(value)
            elif waiting:
                key = waiting.pop()
                path = (*parent, key)
                container[key] = value
            else:
                raise self._error(event, "a mapping or list cannot be a key", "write plain text")
        mark = event.start_mark
        # Columns of an expression count from its first character, inside the quotes.
        quoted = getattr(event, "style", None) in ("'", '"')
        self.places[path] = (mark.line + 1, mark.column + 1 + quoted)
        return path

    def _error(self, event: yaml.Event, cause: str, remedy: str) -> SpecError:
        mark = event.start_mark
        where = Location(self.file, mark.line + 1, mark.column + 1)
        return SpecError(Problem(cause, where, remedy))
