"""Libraries of the optional extras, imported on first use."""

from __future__ import annotations

import importlib
import importlib.util
import json
import re
from importlib.metadata import PackageNotFoundError, distribution, requires, version
from types import ModuleType

from draft.errors import DraftError, Problem


def need(module: str, extra: str = "explore") -> ModuleType:
    """Import a library of an optional extra.

    Raises:
        DraftError: it is not installed; the message says how to install it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise _missing(module, extra) from None


def check(module: str, extra: str) -> None:
    """Check that a library of an optional extra is installed, without importing it.

    Raises:
        DraftError: it is not; the message says how to install it.
    """
    if importlib.util.find_spec(module) is None:
        raise _missing(module, extra)


def installation(extra: str) -> str:
    """Return the command that installs an extra, for a checkout or a package."""
    if editable():
        return f"uv sync --inexact --extra {extra}"
    return f"pip install 'draft[{extra}]'"


def editable() -> bool:
    """Return whether Draft runs from a checkout, as pip and uv record it (PEP 610)."""
    try:
        text = distribution("draft").read_text("direct_url.json")
    except PackageNotFoundError:
        return False
    return bool(json.loads(text or "{}").get("dir_info", {}).get("editable"))


def required() -> dict[str, list[str]]:
    """Return the libraries of each extra, without those that not every system needs."""
    needed: dict[str, list[str]] = {}
    for line in requires("draft") or ():
        name = re.match(r"[\w.-]+", line)
        extra = re.search(r"""; *extra *== *['"]([\w-]+)['"]$""", line)
        if name is not None and extra is not None:
            needed.setdefault(extra[1], []).append(name[0])
    return needed


def installed(library: str) -> str | None:
    """Return the version of an installed library; None if it is missing."""
    try:
        return version(library)
    except PackageNotFoundError:
        return None


def _missing(module: str, extra: str) -> DraftError:
    name = module.split(".", maxsplit=1)[0]
    return DraftError(Problem(f"{name} is not installed", None, installation(extra)))
