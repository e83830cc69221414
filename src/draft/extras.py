"""Draft as it is installed: its version, and libraries of the optional extras on first use."""

from __future__ import annotations

import importlib
import importlib.util
import re
import shlex
import sys
from functools import cache
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from types import ModuleType

from draft.errors import DraftError

# Name for pip; the package and the command are called `draft`.
DISTRIBUTION = "draft-robotics"
UNKNOWN = "unknown"
_TOOL = "pytest"  # One of the developers' tools, none of which an extra brings.


@cache
def own_version() -> str:
    """Version of Draft; "unknown" for a source tree that is not installed."""
    try:
        return version(DISTRIBUTION)
    except PackageNotFoundError:
        return UNKNOWN


def checkout() -> Path | None:
    """Folder of the checkout whose own environment runs this Draft; None for a package."""
    folder = Path(__file__).resolve().parents[2]
    own = (folder / "uv.lock").is_file() and Path(sys.prefix).resolve() == folder / ".venv"
    return folder if own else None


def remedy(extra: str) -> str:
    """Return the command that installs an optional extra where this Draft was installed from.

    In the environment of a checkout, `uv sync` adds the extra and keeps the others; without the
    developers' tools it is not to add these. Elsewhere, pip finds Draft installed and adds only
    what the extra needs.
    """
    folder = checkout()
    if folder is not None:
        inside = Path.cwd().resolve().is_relative_to(folder)
        project = [] if inside else ["--project", str(folder)]
        tools = [] if importlib.util.find_spec(_TOOL) else ["--no-dev"]
        return shlex.join(["uv", "sync", *project, *tools, "--inexact", "--extra", extra])
    pip = "pip" if importlib.util.find_spec("pip") else "uv pip"
    return f"{pip} install '{DISTRIBUTION}[{extra}]'"


def missing(module: str, extra: str) -> DraftError:
    """Error of a library that is not installed; it says how to install its extra."""
    name = module.split(".", maxsplit=1)[0]
    return DraftError(f"{name} is not installed", remedy(extra))


def need_posix(what: str, remedy: str) -> None:
    """Check that this is not Windows.

    Args:
        what: what cannot be done there, as the subject of a sentence.
        remedy: what to do instead.

    Raises:
        DraftError: it is Windows.
    """
    if sys.platform == "win32":
        raise DraftError(f"{what} needs Linux or macOS", remedy)


def need(module: str, extra: str = "explore") -> ModuleType:
    """Import a library of an optional extra.

    Raises:
        DraftError: it is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise missing(module, extra) from None


def check(module: str, extra: str) -> None:
    """Check that a library of an optional extra is installed, without importing it.

    Raises:
        DraftError: it is not; the message says how to install it.
    """
    if importlib.util.find_spec(module) is None:
        raise missing(module, extra)


def usd_possible() -> bool:
    """Whether the library of the extra `usd` has wheels for this Python and system."""
    return sys.version_info < (3, 13) and sys.platform != "darwin"


def required() -> dict[str, list[str]]:
    """Return the libraries of each extra, without those not for every or for this system."""
    needed: dict[str, list[str]] = {}
    for line in requires(DISTRIBUTION) or ():
        name = re.match(r"[\w.-]+", line)
        extra = re.search(r"""; *(.* and +)?extra *== *['"]([\w-]+)['"]$""", line)
        if name is None or extra is None:
            continue
        if extra[1] is None or (extra[2] == "usd" and usd_possible()):
            needed.setdefault(extra[2], []).append(name[0])
    return needed


def installed(library: str) -> str | None:
    """Return the version of an installed library; None if it is missing."""
    try:
        return version(library)
    except PackageNotFoundError:
        return None
