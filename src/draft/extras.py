"""Libraries of the optional extras, imported where they are used."""

from __future__ import annotations

import importlib
from typing import Any

from draft.errors import DraftError, Problem


def need(module: str, extra: str = "explore") -> Any:
    """Import a library of an optional extra.

    Raises:
        DraftError: it is not installed; the message says how to.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        name = module.split(".", maxsplit=1)[0]
        remedy = f"pip install 'draft[{extra}]'"
        raise DraftError(Problem(f"{name} is not installed", None, remedy)) from None
