"""Roll-outs made by hand."""

from __future__ import annotations

from typing import Any

import numpy as np

from draft.learn.measuring.scalars import Worlds


def worlds(test: str, rows: list[dict[str, Any]]) -> Worlds:
    """Roll-outs of a test; what a row does not say is that of a robot that stands."""
    usual = {"level": 1.0, "member": "a", "fell": False, "speed": 0.0}
    usual |= {"mechanical": 1.0, "heat": 1.0, "copper": 1.0, "driving": 1.0}
    usual |= {"rise": 0.0, "kept": True}
    full = [usual | {"replica": i} | row for i, row in enumerate(rows)]
    columns = {name: np.array([row[name] for row in full]) for name in full[0]}
    return Worlds(test=np.array([test] * len(rows)), **columns)


def stood(test: str, shares: dict[float, int], of: int = 10, **more: Any) -> Worlds:
    """Roll-outs of which so many of `of` do not fall, by level."""
    rows = [
        {"level": level, "fell": i >= up} | more for level, up in shares.items() for i in range(of)
    ]
    return worlds(test, rows)
