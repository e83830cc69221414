"""The shipped designs, each built once for all tests that do not change its model."""

from __future__ import annotations

from functools import cache

import draft

SHIPPED = [(name, label) for name in draft.shipped() for label in (None, *draft.load(name).designs)]


@cache
def built(name: str, label: str | None) -> draft.Model:
    """Model of a shipped design; nobody changes it."""
    return draft.load(name).resolve(label).build()
