"""Libraries of the optional extras, imported on first use."""

from __future__ import annotations

import importlib
import importlib.util
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


def _missing(module: str, extra: str) -> DraftError:
    name = module.split(".", maxsplit=1)[0]
    return DraftError(Problem(f"{name} is not installed", None, f"pip install 'draft[{extra}]'"))
