"""Extensions: what other packages and scripts add to Draft, and the registries that hold it.

An installed package names a module in the entry-point group `draft.extensions`; a registry imports
such modules before it is read, so that their decorators have run. A script uses the decorators
itself. An extension that fails is undone and reported in one line; Draft goes on.
"""

from __future__ import annotations

import sys
import threading
import warnings
from collections.abc import Container, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from draft.errors import DraftError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "draft.extensions"
T = TypeVar("T")


class ExtensionWarning(UserWarning):
    """An extension, or something of it, does not work."""


@dataclass(frozen=True)
class Extension:
    """An entry point of the group `draft.extensions`.

    Attributes:
        name: name of the entry point.
        module: module that it names.
        package: distribution that declares it.
        version: version of the distribution.
        problem: why it was not loaded; "" if it was.
    """

    name: str
    module: str
    package: str
    version: str
    problem: str = ""


class Registry(Mapping[str, T], Generic[T]):
    """Named items of one kind: those of Draft, of installed extensions and of a script.

    Reading it loads the installed extensions.
    """

    def __init__(self, kind: str) -> None:
        """Make an empty registry.

        Args:
            kind: noun of an item in messages, such as "metric".
        """
        self.kind = kind
        self._items: dict[str, T] = {}
        self._origins: dict[str, str] = {}
        _REGISTRIES.append(self)

    def add(self, name: str, item: T, origin: str) -> None:
        """Add an item.

        Args:
            name: its name; no other item of the registry has it, except in `__main__`, where a
                cell of a notebook that runs again replaces it.
            item: the item.
            origin: module that defines it.

        Raises:
            DraftError: an item of this name exists.
        """
        first = self._origins.get(name, "")
        if name in self._items and not first == origin == "__main__":
            cause = f"the {self.kind} '{name}' of {origin} exists already in {first}"
            raise DraftError(cause, f"rename the {self.kind}")
        self._items[name] = item
        self._origins[name] = origin

    @property
    def present(self) -> dict[str, T]:
        """Items so far, without loading any: for what runs while Draft or an extension does."""
        return dict(self._items)

    def origin(self, name: str) -> str:
        """Module that defines an item; "" for one of Draft, and for none."""
        load()
        origin = self._origins.get(name, "")
        return "" if _root(origin) == "draft" else origin

    @contextmanager
    def calls(self, name: str, remedy: str) -> Iterator[None]:
        """Report what an item of an extension raises in one line.

        Args:
            name: its name.
            remedy: what to do about it.

        Raises:
            DraftError: it raises; errors of an item of Draft pass.
        """
        try:
            yield
        except Exception as error:
            origin = self.origin(name)
            if not origin:
                raise
            cause = f"the {self.kind} '{name}' of {origin} fails: {reason(error)}"
            raise DraftError(cause, remedy) from error

    def drop(self, package: str, kept: Container[str]) -> None:
        """Remove what a package defines, except some names."""
        for name, origin in [*self._origins.items()]:
            if _root(origin) == package and name not in kept:
                del self._origins[name]
                self._items.pop(name, None)

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
        return isinstance(name, str) and name in self._items


_REGISTRIES: list[Registry[Any]] = []
_LOADED: list[Extension] = []
# An extension reads registries while it is loaded; other threads wait until all are.
_BEGUN, _DONE, _LOCK = threading.Event(), threading.Event(), threading.RLock()


def load() -> list[Extension]:
    """Import the modules of the installed extensions, once, and return what became of them.

    An extension that raises is undone: nothing that it registered stays. Its line is a warning.
    """
    if _DONE.is_set():
        return _LOADED
    with _LOCK:
        if _BEGUN.is_set():
            return _LOADED
        _BEGUN.set()
        _LOADED.extend(map(_loaded, _entries()))
        _DONE.set()
    if not _is_worker():
        for one in _LOADED:
            if one.problem:
                line = f"extension '{one.name}' of {one.package} is not used: {one.problem}"
                warnings.warn(line, ExtensionWarning, stacklevel=2)
    return _LOADED


def added(extension: Extension) -> dict[str, list[str]]:
    """Names of what the package of an extension has added, by kind."""
    root = _root(extension.module)
    found = {
        registry.kind: [name for name, one in registry._origins.items() if _root(one) == root]
        for registry in _REGISTRIES
    }
    return {kind: names for kind, names in found.items() if names}


def culprit(error: BaseException) -> Extension | None:
    """Extension in whose package an error was raised, or that called what raised it."""
    roots = {_root(one.module): one for one in _LOADED}
    found, trace = None, error.__traceback__
    while trace is not None:
        found = roots.get(_root(trace.tb_frame.f_globals.get("__name__", ""))) or found
        trace = trace.tb_next
    return found


def fault(error: BaseException) -> str:
    """Message about an unexpected error: a fault of an extension, or of Draft itself."""
    if (one := culprit(error)) is not None:
        head = f"the extension '{one.name}' of {one.package} {one.version} fails"
        return f"{head}: {reason(error)[:400]}\n  DRAFT_TRACEBACK=1 shows where"
    return (
        f"this is a fault of Draft: {type(error).__name__}: {str(error)[:400]}\n"
        "  please report it to Draft's developers, with the command and the robot's files; "
        "DRAFT_TRACEBACK=1 shows where it happened"
    )


def reason(error: BaseException) -> str:
    """What an error of an extension says, in one line, with its kind."""
    words = " ".join(str(error).split())
    if isinstance(error, DraftError):
        return words
    return f"{type(error).__name__}: {words}" if words else type(error).__name__


def _entries() -> list[EntryPoint]:
    """Entry points of the group, by name; of a package that is found twice the first counts."""
    from importlib.metadata import distributions

    found: dict[str, list[EntryPoint]] = {}
    for package in distributions():
        # Most packages have none of the group: to parse all takes four times as long.
        if GROUP in (package.read_text("entry_points.txt") or ""):
            found.setdefault(package.name, [*package.entry_points.select(group=GROUP)])
    return sorted((one for many in found.values() for one in many), key=lambda one: one.name)


def _loaded(entry: EntryPoint) -> Extension:
    """Import the module of an extension, or undo what it registered and say why."""
    package, version = (entry.dist.name, entry.dist.version) if entry.dist else ("", "")
    module = entry.value.partition(":")[0].strip()
    modules, items = {*sys.modules}, {id(one): {*one._items} for one in _REGISTRIES}
    try:
        entry.load()
    # Whatever an extension raises is its author's fault, and must not end Draft.
    except (Exception, SystemExit) as error:
        root = _root(module)
        # Its import may have made registries, whose items of Draft stay.
        for registry in _REGISTRIES:
            registry.drop(root, items.get(id(registry), ()))
        # Another extension of the package registers again what this one imported.
        for name in {*sys.modules} - modules:
            if _root(name) == root:
                del sys.modules[name]
        return Extension(entry.name, module, package, version, reason(error))
    return Extension(entry.name, module, package, version)


def _root(module: str) -> str:
    return module.partition(".")[0]


def _is_worker() -> bool:
    """Whether this is a process that a pool has started: its parent has said what is wrong."""
    pools = sys.modules.get("multiprocessing.process")
    return pools is not None and pools.parent_process() is not None
