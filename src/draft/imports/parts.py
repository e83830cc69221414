"""Parts that are bolted or held to a trunk and reach out of it: heads, handles, masts, payloads.

Each is a box of its own, as large as its shapes: the trunk is not stretched over it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.imports import names
from draft.imports.ends import Node
from draft.imports.formatting import Parameters, vector
from draft.imports.reduce import Reduced
from draft.imports.shapes import Shapes
from draft.laws import joint_roles as roles
from draft.laws import structure
from draft.values import Array

# Words of the links of bolted parts that are no part of a trunk.
CARRIED = {"handle", "payload", "backpack", "basket", "mast", "manipulator", "gripper"}
# Share of a part's box outside the trunk's from which it is a part of its own; less for one that a
# held joint would move.
OUTSIDE, OUTSIDE_HELD = 0.6, 0.3
# Smallest part: share of the trunk's box, and volume [m3].
SMALLEST_SHARE, SMALLEST = 0.01, 1e-4
Box = tuple[Array, Array]


def carried(reduced: Reduced, without: Sequence[str], shapes: Shapes) -> list[list[str]]:
    """Links of each held or carried part of the trunk that reaches out of the rest.

    Args:
        reduced: the robot.
        without: links that are already a part of their own.
        shapes: its shapes.
    """
    own = [name for name in reduced.root.links if name not in without]
    boxes = {name: box for name in own if (box := _box([name], shapes)) is not None}
    if len(boxes) < 2:
        return []
    core = max(boxes, key=lambda name: _volume(boxes[name]))
    found: list[list[str]] = []
    branches = _branches(reduced, own, core)
    bound = {joint.parent for joint in reduced.description.moving}
    limbs = {body.name for body in reduced.root.children}
    parents = {
        joint.parent if joint.child in limbs else joint.child
        for joint in reduced.description.joints.values()
        if joint.child in limbs or joint.parent in limbs
    } & bound.union(own)
    waiting = [(branch, held) for branch, held in branches if not parents & set(branch)]
    rest = [name for name in own if not any(name in branch for branch, _ in waiting)]
    middle = _box(rest, shapes)
    if middle is None:
        return []
    for branch, held in waiting:
        if not held and not any(roles.words(name) & CARRIED for name in branch):
            continue
        box = _box(branch, shapes)
        if box is None or _volume(box) < max(SMALLEST, SMALLEST_SHARE * _volume(middle)):
            continue
        if _outside(box, middle) > (OUTSIDE_HELD if held else OUTSIDE):
            found.append(branch)
    return found


def boxes(
    carried: Sequence[Sequence[str]], shapes: Shapes, parameters: Parameters, population: str
) -> list[Node]:
    """Boxes of the parts, as dense as the trunks of the population."""
    found: list[Node] = []
    unique = names.Unique()
    for links in carried:
        box = _box(links, shapes)
        if box is None:
            continue
        name = unique(names.valid(links[0]))
        words = zip(("length", "width", "height"), box[1] - box[0], strict=True)
        size = [
            parameters.add(f"{name}_{word}", float(edge), f"{word.capitalize()} of '{name}'.", 4)
            for word, edge in words
        ]
        density = structure.population(population).trunk_density
        doc = f"Mass of '{name}' over its volume: that of surveyed trunks."
        dense = parameters.add(f"{name}_density", density, doc, 1, "kg/m3")
        at = vector((box[0] + box[1]) / 2, 4)
        whole: Node = {"size": [*size], "density": dense}
        found.append({"name": name, "type": "box", "at": at, "box": whole})
    return found


def _branches(reduced: Reduced, own: Sequence[str], core: str) -> list[tuple[list[str], bool]]:
    """Links of the trunk beyond each joint at its core, and whether that joint is only held."""
    near: dict[str, list[tuple[str, bool]]] = {name: [] for name in own}
    for joint in reduced.description.joints.values():
        if joint.parent in near and joint.child in near:
            near[joint.parent].append((joint.child, joint.moves))
            near[joint.child].append((joint.parent, joint.moves))
    found: list[tuple[list[str], bool]] = []
    for first, held in near[core]:
        branch = [first]
        for name in branch:
            branch += [other for other, _ in near[name] if other not in (core, *branch)]
        found.append((branch, held))
    return found


def _box(links: Sequence[str], shapes: Shapes) -> Box | None:
    """Lowest and highest corner of the box around links' shapes [m]; None without shapes."""
    points = shapes.points(links)
    if not len(points):
        return None
    box = points.min(axis=0), points.max(axis=0)
    return box if float((box[1] - box[0]).min()) > 1e-3 else None


def _volume(box: Box) -> float:
    return float(np.prod(box[1] - box[0]))


def _outside(box: Box, other: Box) -> float:
    """Share of a box that lies outside another."""
    shared = np.minimum(box[1], other[1]) - np.maximum(box[0], other[0])
    return 1.0 - float(np.prod(np.maximum(shared, 0.0))) / _volume(box)
