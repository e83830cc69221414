"""What a metric is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True, slots=True)
class Metric:
    """A named number.

    Attributes:
        name: as commands and expressions spell it.
        unit: SI unit; "1" for none, "bool" for a mask.
        doc: what it is, in a sentence.
        formula: how it is computed.
        source: where the formula comes from.
        better: which way is better; "" where neither is.
        needs: "design", or "model" where MuJoCo computes it, one design at a time.
        function: from a Design to a Value (NaN where the robot has no such thing), or from a Model
            to a float.
    """

    name: str
    unit: str
    doc: str
    formula: str
    source: str
    better: Literal["less", "more", ""]
    needs: Literal["design", "model"]
    function: Callable[[Any], Any]
