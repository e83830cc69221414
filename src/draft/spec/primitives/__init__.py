"""The primitives: what a link of each type is. This is their only list.

The trunk, of which a tree has one and which is no link, is `root`.
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
