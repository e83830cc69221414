"""Extensions: what other packages and scripts add to Draft, and the registries that hold it.

An installed package names a module in the entry-point group `draft.extensions`; a registry imports
such modules before it is read, so that their decorators have run. A script uses the decorators
itself. An extension that fails is undone and reported in one line; Draft goes on.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar

from draft.errors import DraftError

GROUP = "draft.extensions"
T = TypeVar("T")


class ExtensionWarning(UserWarning):
    """An extension could not be loaded."""


@dataclass(frozen=True)
class Extension:
    """An entry point of the group `draft.extensions`.

    Attributes:
        name: name of the entry point.
        module: module that it names.
        package: distribution that declares it; "" if unknown.
        problem: why it was not loaded; "" if it was.
    """

    name: str
    module: str
    package: str
    problem: str = ""


class Registry(Mapping[str, T], Generic[T]):
    """Named items of one kind: those of Draft, of installed extensions and of a script.

    Reading it loads the installed extensions; adding to it does not.
    """

    def __init__(self, kind: str) -> None:
        """Make an empty registry.

        Args:
            kind: noun of an item in messages, such as "metric".
        """
        self.kind = kind
        self._items: dict[str, T] = {}
        _REGISTRIES.append(self)

    def add(self, name: str, item: T, origin: str) -> None:
        """Add an item.

        Args:
            name: its name; no other item of the registry has it.
            item: the item.
            origin: module that defines it.

        Raises:
            DraftError: an item of this name exists.
        """
        if name in self._items:
            cause = f"{origin}: there is a {self.kind} '{name}' already"
            raise DraftError(cause, f"Rename the {self.kind}.")
        self._items[name] = item

    def __getitem__(self, name: str) -> T:
        """Return an item by its name."""
        load()
        return self._items[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, in the order in which they were added."""
        load()
        return iter(list(self._items))

    def __len__(self) -> int:
        """Return the number of items."""
        load()
        return len(self._items)

    def __contains__(self, name: object) -> bool:
        """Return whether there is an item of a name."""
        load()
        return name in self._items


_REGISTRIES: list[Registry[Any]] = []
_PENDING = [GROUP]  # Groups whose entry points were not imported yet.
_LOADED: list[Extension] = []


def load() -> list[Extension]:
    """Import the modules of the installed extensions, once, and return what became of them.

    An extension that raises is undone: nothing that it registered stays. Its line is a warning.
    """
    while _PENDING:
        # Taken out first: an extension reads registries while it is imported.
        for entry in sorted(entry_points(group=_PENDING.pop()), key=lambda entry: entry.name):
            _LOADED.append(_loaded(entry))
    return _LOADED


def _loaded(entry: EntryPoint) -> Extension:
    """Import the module of an extension, or undo what it registered and say why."""
    package = entry.dist.name if entry.dist else ""
    before = [dict(registry._items) for registry in _REGISTRIES]
    try:
        entry.load()
    # Whatever an extension raises is its author's fault, and must not end Draft.
    except Exception as error:
        for registry, items in zip(_REGISTRIES, before, strict=False):
            registry._items = items
        reason = " ".join(str(error).split()) or type(error).__name__
        line = f"extension '{entry.name}' of package '{package}' is not used: {reason}"
        warnings.warn(line, ExtensionWarning, stacklevel=2)
        return Extension(entry.name, entry.value, package, reason)
    return Extension(entry.name, entry.value, package)
