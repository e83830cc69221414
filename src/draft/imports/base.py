"""The base of an imported machine that is bolted to the world, as of an arm or a hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.errors import Location, Problem
from draft.imports.anatomy import run
from draft.imports.ends import FINGER, Node
from draft.imports.formatting import Value, tidy
from draft.imports.limbs import NO_LEGS, NO_REACH, Limbs
from draft.imports.motors import Motor, all_servos, with_kinds
from draft.imports.reduce import Body, Reduced
from draft.imports.shapes import Shapes

LEAST = 0.01  # Smallest edge of a pedestal [m].
LONGEST = 0.25  # Distance of a finger's joints from its first, at most [m].


def name_fingers(reduced: Reduced, limbs: Limbs, stated: bool) -> None:
    """Give the fingers of a hand, or of one on an arm, that is bolted to the world their role."""
    if _is_fixed(reduced, limbs, stated):
        for finger in _fingers(reduced.root):
            for body in finger.all():
                body.role = FINGER


def _is_fixed(reduced: Reduced, limbs: Limbs, stated: bool) -> bool:
    """Whether no limb reaches the ground, and nothing says that the robot floats."""
    free = bool(reduced.description.floats) or reduced.description.root not in reduced.root.links
    return not (limbs.legs or stated or free)


def families(
    motors: Sequence[Motor], reduced: Reduced, limbs: Limbs, stated: bool
) -> tuple[Sequence[Motor], str]:
    """Actuator classes with their families, and the class of all links of a fixed machine.

    A robot is bolted to the world where no limb reaches the ground, nothing says that it floats,
    and no population is `stated`. The class is "" for others. What it is taken for is noted.
    """
    if limbs.legs:
        return motors, ""
    where = Location(reduced.description.file)
    if not _is_fixed(reduced, limbs, stated):
        remedy = "masses are those of arms of humanoids; `population` names another population"
        reduced.notes.append(Problem(NO_LEGS, where, remedy))
        return motors, ""
    kind = _link_class(reduced, motors)
    cause = f"{NO_REACH}: it is taken for a machine on a fixed base, whose links have the class "
    remedy = "edit 'segment' in tree.yaml; `population` makes it a robot with a trunk instead"
    reduced.notes.append(Problem(cause + kind, where, remedy))
    return with_kinds(motors), kind


def _link_class(reduced: Reduced, motors: Sequence[Motor]) -> str:
    """Links of fingers, of a collaborative arm, or of one whose motors carry it.

    Fingers on an arm have their own.
    """
    if reduced.root.children == _fingers(reduced.root):
        return FINGER
    return "light_link" if all_servos(motors) else "cobot_link"


def _fingers(base: Body) -> list[Body]:
    """Limbs that branch from a body or further out, the joints of each near its first."""
    palm = run(base)[-1]
    near = all(
        float(np.linalg.norm(body.anchor - limb.anchor)) < LONGEST
        for limb in palm.children
        for body in limb.all()
    )
    return palm.children if near else [one for limb in palm.children for one in _fingers(limb)]


def pedestal(reduced: Reduced, shapes: Shapes) -> Node:
    """Keys of the base: its height above the floor, and the box of its shapes with their mass.

    The mass is the maker's: what stands still loads no joint, and no law predicts it.
    """
    links = list(reduced.root.links)
    own = shapes.points(links)
    every = [shapes.points(body.links) for body in reduced.root.all()]
    every.append(np.array([body.anchor for body in reduced.root.all()]))
    lowest = min(float(points[:, 2].min()) for points in every if len(points))
    found: Node = {}
    if lowest < 0:
        found["at"] = [0, 0, tidy(float(np.ceil(-lowest * 1000) / 1000), 3)]
    inertials = (reduced.description.links[name].inertial for name in links)
    mass = sum(one.mass for one in inertials if one is not None)
    if not len(own) and not shapes.box(links).any():
        return found
    foot = np.zeros(3)  # middle of the lower face of its box
    edges = shapes.box(links)
    if len(own):
        low, edges = own.min(axis=0), np.ptp(own, axis=0)
        foot = low + edges / 2 * (1, 1, 0)
    size: list[Value] = [tidy(max(float(edge), LEAST), 4) for edge in edges]
    solid: Node = {"size": size, "shift": [tidy(float(x), 4) for x in foot]}
    if mass > 0:
        solid["mass"] = tidy(mass, 3)
    found["pedestal"] = solid
    return found
