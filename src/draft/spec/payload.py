"""Payload: a block on the trunk that any robot can be given.

The key `payload` of a table of values [kg] puts a block of the primitive `box` on the highest point
of the trunk, over the middle of its outline. It is a cube, of `payload_density` [kg/m3]. A robot
that has a parameter of its own by that name keeps it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from weakref import WeakKeyDictionary

from draft.errors import Location
from draft.spec.expressions import Triple, parse
from draft.spec.links import Link
from draft.spec.primitives.base import Written
from draft.spec.primitives.box import Box, BoxPart
from draft.spec.spec import Parameter, Spec
from draft.spec.tree import UNMIRRORED, Body, Placement

MASS, DENSITY = "payload", "payload_density"
KEYS = (MASS, DENSITY)
# Default density [kg/m3]: that of packed parcels and tools, half of water.
USUAL_DENSITY = 500.0
HEAVIEST, DENSEST = 1e4, 2e4
# Names of the place in an evaluator: the middle of the trunk's outline, and its highest point [m].
PLACE = ("payload.x", "payload.y", "payload.top")
# A block has a size even if it weighs nothing [kg].
_LEAST = 1e-6
_WHERE = Location("`payload`")

_loaded: WeakKeyDictionary[Spec, Spec] = WeakKeyDictionary()


def with_payload(spec: Spec, keys: Iterable[str]) -> Spec:
    """Return the robot with a block on its trunk if any key asks for one, else the robot."""
    if spec.payload is not None or not any(asks(spec, key) for key in keys):
        return spec
    known = _loaded.get(spec)
    if known is None:
        known = _loaded[spec] = _with_block(spec)
    return known


def asks(spec: Spec, key: str) -> bool:
    """Return whether a key of a table of values asks for the block; a fixed base has none."""
    return spec.floating and key in KEYS and MASS not in spec.parameters


def _with_block(spec: Spec) -> Spec:
    parameters = {
        MASS: Parameter(
            MASS, parse(0.0), "kg", (0.0, HEAVIEST), "Mass of the payload on the trunk.", _WHERE
        ),
        DENSITY: Parameter(
            DENSITY,
            parse(USUAL_DENSITY),
            "kg/m3",
            (1.0, DENSEST),
            "Mass over volume of the payload, a cube.",
            _WHERE,
        ),
    }
    names = {body.name for body in spec.bodies}
    name = MASS
    while name in names:
        name += "_"
    side = f"(max({MASS}, {_LEAST}) / {DENSITY}) ** (1 / 3)"
    x, y, top = PLACE
    size: Triple = (parse(side), parse(side), parse(side))
    shift: Triple = (parse(x), parse(y), parse(f"{top} + {side} / 2"))
    fields = Box(size=[side] * 3, mass=MASS, shift=[x, y, top])
    numbers = {"size": size, "mass": parse(MASS), "shift": shift}
    places = dict.fromkeys(Box.model_fields, _WHERE)
    block = Link(name, None, None, None, None, BoxPart, Written(fields, numbers, places), _WHERE)
    origin: Triple = (parse(0.0), parse(0.0), parse(0.0))
    body = Body(name, "", 0, block, Placement(origin, None), UNMIRRORED)
    return replace(
        spec,
        parameters={**spec.parameters, **parameters},
        bodies=(*spec.bodies, body),
        payload=len(spec.bodies),
    )
