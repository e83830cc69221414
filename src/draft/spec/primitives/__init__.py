"""Primitives: the types of a link. `LINKS` is their only list.

The trunk is `root`; it is not a link, and a tree has one.
"""

from __future__ import annotations

from draft.spec.primitives.basic import BasicLink, LinkBase
from draft.spec.primitives.box import BoxLink
from draft.spec.primitives.foot import FootLink
from draft.spec.primitives.sphere import SphereLink
from draft.spec.primitives.wheel import WheelLink

LINKS: tuple[type[LinkBase], ...] = (
    BasicLink,
    SphereLink,
    FootLink,
    BoxLink,
    WheelLink,
)
