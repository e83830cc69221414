"""Attachments of the chains of an imported spec, and the names of their sides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.imports import names
from draft.imports.formatting import Parameters, Record, Value, tidy
from draft.imports.reduce import Body
from draft.imports.symmetry import Copy
from draft.spec.tree import MIRRORS
from draft.values import Array

LATERAL = 0.03
Signs = tuple[float, float, float]


class Attachments:
    """Attachments of the copies of one chain, sharing parameters where they are alike."""

    def __init__(self, parameters: Parameters, chain: str, origin: Array) -> None:
        self.parameters, self.chain, self.origin = parameters, chain, origin
        self._written: list[tuple[list[Value], Record]] = []
        self._first = np.zeros(3)

    def at(self, copy: Copy, prefix: str, signs: Signs) -> list[Value]:
        """Attachment of a copy, before mirroring.

        Args:
            copy: the copy; the first is the chain's original.
            prefix: prefix of the copy, for dimensions that it does not share.
            signs: -1 for the components whose sign is opposite to the counterpart's.
        """
        at = np.array(MIRRORS[copy.mirror]) * (copy.limb.anchor - self.origin)
        if copy.shares and self._written:
            return self._written[0][0]
        text = f"First hinge of the {self.chain.replace('_', ' ')}"
        if not self._written:
            self._first = at
            with self.parameters.recording() as record:
                found = self.parameters.place(self.chain, at, text, signs)
        else:
            text = f"First hinge of {(prefix + self.chain).replace('_', ' ')}"
            signs = times(signs, same_side(at, self._first))
            with self.parameters.chain(prefix, [one[1] for one in self._written]) as record:
                found = self.parameters.place(self.chain, at, text, signs)
        self._written.append((found, record))
        return found


def opposite(limb: Body, counterpart: Body, origin: Array) -> Signs:
    """-1 for each component of a limb's attachment whose sign is not its counterpart's."""
    return same_side(limb.anchor - origin, counterpart.anchor - origin)


def same_side(own: Array, other: Array) -> Signs:
    """-1 for each component of a point that has the opposite sign of another point's."""
    x, y, z = (-1.0 if tidy(a * b, 9) < 0 else 1.0 for a, b in zip(own, other, strict=True))
    return x, y, z


def times(one: Signs, other: Signs) -> Signs:
    """Product of signs, component by component."""
    return one[0] * other[0], one[1] * other[1], one[2] * other[2]


def side_of(group: Sequence[Copy], family: Sequence[Sequence[Copy]], four: bool) -> str:
    """Prefix that tells a chain from its counterparts: "left_", "hind_", "FL_"; "" for none."""
    if len(group) == 1 and abs(group[0].limb.anchor[1]) > LATERAL:
        return names.side((1, 1, 1), list(group[0].limb.anchor), four)
    if len(family) == 1:
        return ""
    words = (("front_", "hind_"), ("left_", "right_"))
    for axis, (positive, negative) in enumerate(words):
        sides = [
            {float(np.sign(tidy(copy.limb.anchor[axis], 3))) for copy in own} for own in family
        ]
        own = {float(np.sign(tidy(copy.limb.anchor[axis], 3))) for copy in group}
        if sides.count(own) == 1 and own in ({1.0}, {-1.0}):
            return positive if own == {1.0} else negative
    return ""
