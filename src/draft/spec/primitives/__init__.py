"""Primitives: the types of a link. `LINKS` is their only list, to which `@primitive` adds one.

The root of a tree is not a link: a trunk, `root`, or a base that is bolted to the world, `fixed`.
"""

from __future__ import annotations

from typing import Literal, TypeVar, get_args, get_origin

from draft.errors import DraftError
from draft.extensions import Registry
from draft.spec.primitives.base import COLORS, HIDDEN, HIDDEN_COLOR, Color, End
from draft.spec.primitives.basic import BasicLink, LinkBase
from draft.spec.primitives.box import BoxLink
from draft.spec.primitives.foot import FootLink
from draft.spec.primitives.sphere import SphereLink
from draft.spec.primitives.wheel import WheelLink

L = TypeVar("L", bound=type[LinkBase])

LINKS: Registry[type[LinkBase]] = Registry("link primitive")


def primitive(link: L) -> L:
    """Register a class of links, so that `type: NAME` in tree.yaml makes one.

    Its fields are the keys of the file, and its `end` gives the numbers of what is at its tip:

        @primitive
        class PadLink(LinkBase):
            \"\"\"A cylinder that ends in a round pad.\"\"\"

            type: Literal["pad"]
            pad: Pad
            end: ClassVar = PadPart

    Args:
        link: a subclass of `LinkBase` with `type: Literal["NAME"]`, and an `end` whose `key` is a
            field of it.

    Raises:
        DraftError: the class lacks one of these, or its type, its key or a colour is another one's.
    """
    cause = _fault(link)
    if cause:
        name = f"{getattr(link, '__qualname__', link)} of {getattr(link, '__module__', '?')}"
        raise DraftError(f"the link primitive {name} {cause}", "see draft.extend.primitive")
    LINKS.add(link.type_name(), link, link.__module__)
    return link


def colors() -> dict[str, Color]:
    """Colours by kind of geom; the kinds that any robot may have come first."""
    ends = [link.end for link in LINKS.values() if link.end is not None]
    own = {kind: color for end in ends for kind, color in end.colors.items()}
    return COLORS | {HIDDEN: HIDDEN_COLOR} | own


def _fault(link: type[LinkBase]) -> str:
    """What is wrong with a class of links; "" for nothing."""
    if not (isinstance(link, type) and issubclass(link, LinkBase)):
        return "is no subclass of LinkBase"
    kind = link.model_fields.get("type")
    if kind is None or get_origin(kind.annotation) is not Literal:
        return "has no 'type: Literal[\"NAME\"]'"
    if len(get_args(kind.annotation)) != 1 or not isinstance(link.type_name(), str):
        return "has a 'type' that is not one name"
    end = link.end
    if end is None:
        return ""
    if not issubclass(end, End) or end.key not in link.model_fields.keys() - LinkBase.model_fields:
        return "has an 'end' that is no End with the 'key' of one of its fields"
    # A cell of a notebook that runs again replaces its own link.
    ends = (one.end for name, one in LINKS.present.items() if name != link.type_name())
    others = [one for one in ends if one is not None and one is not end]
    if end.key in {one.key for one in others}:
        return f"has the key '{end.key}' of another one"
    # A compiled model knows the kind of a geom by its colour.
    known = COLORS | {kind: color for one in others for kind, color in one.colors.items()}
    for name, color in end.colors.items():
        if name in known or tuple(color) in map(tuple, known.values()):
            return f"has the kind or the colour of another one for its geoms '{name}'"
    return ""


for _link in (BasicLink, SphereLink, FootLink, BoxLink, WheelLink):
    primitive(_link)
