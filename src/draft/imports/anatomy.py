"""What the parts of a reduced robot are: population, trunk, limbs, roles and segment classes.

Names are heard first, by the survey's rules; a limb whose joints they do not all name is read by
its geometry: knee and elbow are the joints nearest to the middle of their limb.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.description.description import Description
from draft.description.segments import CLOSE, TOLERANCE
from draft.fitting.structure import classes, roles
from draft.fitting.structure.robots import robots
from draft.imports import slides
from draft.imports.reduce import Body, Reduced, collapse, reroot

LEG = ("hip", "knee", "ankle")
ARM = ("shoulder", "elbow", "wrist")
ARM_WORDS = {"shoulder", "elbow", "wrist", "arm", "waist", "torso", "neck"}
SIDEWAYS = 0.03


def population_of(description: Description, key: str) -> str:
    """Population of a robot: the survey's word, else what its joints are called, else its legs."""
    known = robots().get(key)
    if known is not None and known.population in ("humanoid", "quadruped"):
        return known.population
    names = [joint.name for joint in description.moving]
    if sum(bool(roles.words(name) & ARM_WORDS) for name in names) >= 2:
        return "humanoid"
    ends = sum(1 for name in description.links if not description.children[name])
    found = [roles.role(name, key, "humanoid") for name in names]
    if found.count("ankle") >= 2 or len(names) < 8 or ends < 4:
        return "humanoid"
    tops = [joint for joint in description.children[description.root] if joint.moves]
    return "quadruped" if len(tops) >= 4 or len(names) in (8, 12, 16) else "humanoid"


def analyse(reduced: Reduced, key: str, population: str) -> None:
    """Give every body its role, its class and whether it is merged into its parent's segment.

    Raises:
        DescriptionError: a slide that has no member to be part of.
    """
    if population == "humanoid":
        trunk = _torso(reduced.root)
        if trunk is not reduced.root:
            reroot(reduced, trunk)
        _humanoid_roles(reduced, key)
    else:
        for limb in list(reduced.root.children):
            _quadruped_limb(reduced, limb, key)
    slides.place(reduced)
    _merge(reduced.root)
    _classes(reduced.root, population)
    slides.inherit(reduced.root)
    slides.tell(reduced)


def lowest(body: Body) -> float:
    """Lowest hinge of a body and those below it [m]."""
    return min(float(one.anchor[2]) for one in body.all())


def run(body: Body) -> list[Body]:
    """Bodies from this one down to the first that branches or ends."""
    found = [body]
    while len(found[-1].children) == 1:
        found.append(found[-1].children[0])
    return found


def _torso(root: Body) -> Body:
    """Body that carries the arms: the root, or the end of its waist.

    Below the root hang legs; of its other limbs, the first that branches leads to the torso.
    """
    bottom = lowest(root)
    legs = [limb for limb in root.children if _is_leg(limb, root, bottom)]
    if not legs:
        return root
    arms = [limb for limb in root.children if limb not in legs and abs(limb.anchor[1]) > SIDEWAYS]
    if len(arms) >= 2:
        return root
    for limb in root.children:
        if limb not in legs:
            way = run(limb)
            if len(way[-1].children) >= 2:
                return way[-1]
    middle = [limb for limb in root.children if limb not in legs]
    return run(middle[0])[-1] if len(middle) == 1 and len(run(middle[0])) <= 3 else root


def _is_leg(limb: Body, root: Body, bottom: float) -> bool:
    reach = lowest(limb)
    return reach < bottom + 0.25 * (float(root.anchor[2]) - bottom) and len(limb.all()) >= 3


def _humanoid_roles(reduced: Reduced, key: str) -> None:
    """Roles of a humanoid's hinges, limb by limb."""
    root = reduced.root
    bottom = lowest(root)
    for limb in list(root.children):
        way = run(limb)
        if way[-1].children and _is_leg(limb, root, bottom):
            for body in way:
                body.role = "waist"
            for leg in way[-1].children:
                _limb(reduced, leg, LEG, key)
        elif _is_leg(limb, root, bottom):
            _limb(reduced, limb, LEG, key)
        elif abs(limb.anchor[1]) > SIDEWAYS or len(limb.all()) > 3:
            _limb(reduced, limb, ARM, key)
        else:
            collapse(reduced, way[-1], "branching joints")
            for body in way:
                body.role = "neck"


def _limb(reduced: Reduced, limb: Body, allowed: Sequence[str], key: str) -> None:
    """Roles of the hinges of one leg or arm; what branches at its end is held."""
    collapse(reduced, run(limb)[-1], "branching joints")
    way = slides.hinges(run(limb))
    names = [body.joint.name if body.joint else "" for body in way]
    found = [roles.role(name, key, "humanoid") or "" for name in names]
    order = [allowed.index(name) if name in allowed else -1 for name in found]
    if -1 in order or order != sorted(order):
        found = _by_place(way, allowed)
    for body, name in zip(way, found, strict=True):
        body.role = name


def _by_place(way: Sequence[Body], allowed: Sequence[str]) -> list[str]:
    """Roles by place along a limb: its middle joint is nearest to half of its length."""
    points = np.array([body.anchor for body in way])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    if not way:
        return []
    first = min(2, len(way) - 1)
    middle = max(first, int(np.argmin(np.abs(along - along[-1] / 2))))
    upper, joint, lower = allowed
    return [upper if i < middle else joint if i == middle else lower for i in range(len(way))]


def _quadruped_limb(reduced: Reduced, limb: Body, key: str) -> None:
    """Roles of a quadruped's leg: wheel at its end, then knee, flexion and abduction upwards."""
    collapse(reduced, run(limb)[-1], "branching joints")
    way = slides.hinges(run(limb))
    if len(way) < 2:
        for body in way:
            body.role = "sensor"
        return
    names = [body.joint.name if body.joint else "" for body in way]
    wheel = len(way) >= 4 or "wheel" in names[-1].lower() or "foot" in names[-1].lower()
    wheel = wheel and len(way) >= 3
    order = ["abduction", "flexion", "knee"]
    if wheel:
        way[-1].role = "wheel"
        way = way[:-1]
    for i, body in enumerate(reversed(way)):
        body.role = order[max(2 - i, 0)]


def _merge(root: Body) -> None:
    """Mark bodies whose hinge lies within 2 cm of their parent's joint, the trunk's apart."""
    for body in root.all():
        above = body.parent
        if above is not None and above.parent is not None and not body.slides:
            apart = float(np.linalg.norm(body.anchor - above.anchor))
            body.merged = apart < CLOSE - TOLERANCE


def cluster(body: Body) -> list[Body]:
    """Bodies of the structural segment that begins at a body, parents first."""
    found = [body]
    for one in found:
        found.extend(child for child in one.children if child.merged)
    return found


def _classes(root: Body, population: str) -> None:
    for body in root.all()[1:]:
        on_slide = body.parent is not None and body.parent.slides
        if body.slides or (body.merged and not on_slide):
            continue
        own = cluster(body)
        found = [one.role for one in own]
        # What slides is part of the member above it: the next hinge is the one beyond.
        below = {
            c.role for one in own for c in slides.beyond(one) if c.parent is not one or not c.merged
        }
        if population == "quadruped":
            kind = classes.quadruped(found)
        else:
            kind = classes.humanoid(found, below)
        kind = "waist_link" if kind == "torso" else kind
        for one in own:
            one.kind = kind
