"""Texts of a family of robots: one template, and the numbers of each.

Texts that `draft.model.mjcf` writes for designs of one topology differ in numbers only.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from draft.model.xml import PLACE
from draft.values import Array

_NUMBER = re.compile(r'(?<=[" ])(-?\d[\d.e+-]*)(?=[" ])')


@dataclass(frozen=True, eq=False)
class Text:
    """MJCF of a robot.

    Attributes:
        template: the text, with `PLACE` in place of each of the numbers.
        numbers: numbers in which the robots of a family differ, shape (places,).
    """

    template: str
    numbers: Array = field(default_factory=lambda: np.empty(0))

    def __str__(self) -> str:
        if not len(self.numbers):
            return self.template
        form = self.template.replace("%", "%%").replace(f"%{PLACE}", PLACE)
        return form % tuple(self.numbers.tolist())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Text) and str(self) == str(other)

    def __hash__(self) -> int:
        return hash(str(self))


def of_template(template: str, numbers: Array) -> list[Text]:
    """Texts of a template.

    Args:
        template: the text.
        numbers: numbers of each, shape (N, places).

    Raises:
        ValueError: there are more or fewer numbers than places for them.
    """
    places = template.count(PLACE)
    if numbers.ndim != 2 or numbers.shape[1] != places:
        raise ValueError(f"{places} numbers have a place, not those of shape {numbers.shape}")
    return [Text(template, row) for row in numbers]


def with_template(texts: Sequence[Text]) -> list[Text]:
    """Texts with one template, but those that differ from the first in more than numbers."""
    if all(text.template == texts[0].template for text in texts):
        return list(texts)
    parts = [_NUMBER.split(str(text)) for text in texts]
    first = parts[0]
    alike = [part[::2] == first[::2] for part in parts]
    columns = np.array([part[1::2] for part, same in zip(parts, alike, strict=True) if same]).T
    differs = (columns != columns[:, :1]).any(axis=1)
    pieces = [*first]
    pieces[1::2] = np.where(differs, PLACE, first[1::2]).tolist()
    try:
        made = iter(of_template("".join(pieces), columns[differs].astype(np.float64).T))
    except ValueError:  # A name has what marks a place.
        return list(texts)
    pairs = (
        (next(made), text) if same else (text, text)
        for same, text in zip(alike, texts, strict=True)
    )
    return [new if new == text else text for new, text in pairs]
