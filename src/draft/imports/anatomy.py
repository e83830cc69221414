"""Parts of a reduced robot: its trunk, and the roles and segment classes of its limbs.

Structure says which limbs are legs (`draft.imports.limbs`). Within a humanoid's limb names decide
first, by the survey's rules; where they do not cover all of its joints, geometry does: knee and
elbow are the joints nearest to the middle of their limb.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from draft.description.segments import CLOSE, TOLERANCE
from draft.imports import slides
from draft.imports.limbs import ARM_HINGES, Limbs, is_leg
from draft.imports.reduce import Body, Reduced, collapse, reroot
from draft.laws import joint_roles as roles
from draft.laws import segment_classes as classes

LEG = ("hip", "knee", "ankle")
ARM = ("shoulder", "elbow", "wrist")
SIDEWAYS = 0.03
# Most hinges of a neck.
NECK_HINGES = 3
# Largest upward part of the axis of a wheel.
LEVEL_AXIS = 0.3
# Roles that no class of the survey has: their members weigh as `other`.
SPINE, ARM_ROLE, WHEEL, CASTER = "spine", "arm", "wheel", "caster"
ROLLING = (WHEEL, CASTER)
# Furthest that the frames and centres of mass of a wheel lie from its axis [m].
TRUE = 0.02


def analyse(reduced: Reduced, key: str, limbs: Limbs) -> None:
    """Give every body its role, its class and whether it is merged into its parent's segment.

    Args:
        reduced: the robot, changed in place.
        key: the robot's key in the survey, or "".
        limbs: its population, and the ends of its legs.

    Raises:
        DescriptionError: a slide that has no member to be part of.
    """
    if limbs.population == "humanoid":
        trunk = _torso(reduced, limbs)
        if trunk is not reduced.root:
            reroot(reduced, trunk)
        _humanoid_roles(reduced, key, limbs)
    else:
        for limb in list(reduced.root.children):
            _quadruped_limb(reduced, limb, limbs)
    slides.place(reduced)
    _merge(reduced.root)
    _classes(reduced.root, limbs.population)
    slides.inherit(reduced.root)
    slides.tell(reduced)


def run(body: Body) -> list[Body]:
    """Bodies from this one down to the first that branches or ends."""
    found = [body]
    while len(found[-1].children) == 1:
        found.append(found[-1].children[0])
    return found


def _torso(reduced: Reduced, limbs: Limbs) -> Body:
    """Body that carries the arms: the root, or the end of its waist.

    Below the root hang legs; of its other limbs, the first that branches into arms leads to the
    torso. What has fewer hinges than an arm, such as an antenna of a head, tells a torso only where
    the body that carries it outweighs the root.
    """
    root = reduced.root
    legs = [limb for limb in root.children if is_leg(limb, limbs.ends)]
    others = [limb for limb in root.children if limb not in legs]
    arms = [limb for limb in others if abs(limb.anchor[1]) > SIDEWAYS]
    if len(arms) >= 2:
        return root
    for limb in others:
        way = run(limb)
        if len(way[-1].children) < 2 or not (legs or _carries_limbs(way, limbs)):
            continue
        if any(map(_is_long, way[-1].children)) or _mass(reduced, way[-1]) > _mass(reduced, root):
            return way[-1]
    if not legs:
        return root
    end = run(others[0])[-1] if len(others) == 1 else root
    waist = len(run(others[0])) <= NECK_HINGES if others else False
    return end if waist and _mass(reduced, end) > _mass(reduced, root) else root


def _is_long(limb: Body) -> bool:
    """Whether a limb has the hinges of an arm; slides do not count."""
    return len(slides.hinges(limb.all())) >= ARM_HINGES


def _mass(reduced: Reduced, body: Body) -> float:
    """Mass of a body by the maker [kg]."""
    links = (reduced.description.links[name].inertial for name in body.links)
    return sum(link.mass for link in links if link is not None)


def _carries_limbs(way: Sequence[Body], limbs: Limbs) -> bool:
    """Whether a limb is a part of the trunk that carries limbs, and not an arm with a hand."""
    below = way[-1].children
    if len(below) < 2 or not any(map(_is_long, below)):
        return False
    central = any(link in limbs.central for link in way[-1].links)
    return central or len(slides.hinges(way)) < ARM_HINGES


def _humanoid_roles(reduced: Reduced, key: str, limbs: Limbs) -> None:
    """Roles of a humanoid's hinges, limb by limb."""
    for limb in list(reduced.root.children):
        way = run(limb)
        legs = [child for child in way[-1].children if is_leg(child, limbs.ends)]
        if len(legs) > 1 or (not is_leg(limb, limbs.ends) and _carries_limbs(way, limbs)):
            for body in way:
                body.role = "waist"
            for child in way[-1].children:
                _humanoid_limb(reduced, child, key, limbs)
        else:
            _humanoid_limb(reduced, limb, key, limbs)


def _humanoid_limb(reduced: Reduced, limb: Body, key: str, limbs: Limbs) -> None:
    """Roles of a leg, an arm or a neck."""
    if is_leg(limb, limbs.ends):
        _limb(reduced, limb, LEG, key)
    elif not limbs.legs and any(reduced.description.root in one.links for one in limb.all()):
        collapse(reduced, run(limb)[-1], "branching joints")
        for body in run(limb):
            body.role = "waist"  # It carries the torso on the maker's base.
    elif (
        _sideways(limb)
        or (_is_arm(limb) and not _between_arms(limb, limbs))
        or (not limbs.legs and _is_longest(limb))
    ):
        _limb(reduced, limb, ARM, key, holds=bool(limbs.legs))
    else:
        way = run(limb)
        if limbs.legs:
            collapse(reduced, way[-1], "branching joints")
        for body in way:
            body.role = "neck"
    end = run(limb)[-1]
    if is_wheel(reduced, end):
        end.role = WHEEL if is_leg(limb, limbs.ends) else CASTER


def _is_arm(limb: Body) -> bool:
    """Whether a limb in the middle has more hinges to its first branch than a neck.

    Of a branched limb those beyond count too if one of its branches is an arm's.
    """
    way = run(limb)
    branched = any(map(_is_long, way[-1].children))
    return len(slides.hinges(limb.all() if branched else way)) > NECK_HINGES


def _sideways(limb: Body) -> bool:
    """Whether a limb begins beside the middle plane."""
    return abs(float(limb.anchor[1])) > SIDEWAYS


def _between_arms(limb: Body, limbs: Limbs) -> bool:
    """Whether a limb begins between two others that are no legs: it is a neck then."""
    beside = limb.parent.children if limb.parent is not None else []
    return sum(_sideways(one) and not is_leg(one, limbs.ends) for one in beside) > 1


def _is_longest(limb: Body) -> bool:
    """Whether no limb beside it has more hinges: of an arm or a hand, it is no neck."""
    beside = limb.parent.children if limb.parent is not None else []
    own = len(slides.hinges(limb.all()))
    return all(len(slides.hinges(one.all())) <= own for one in beside)


def _limb(
    reduced: Reduced, limb: Body, allowed: Sequence[str], key: str, holds: bool = True
) -> None:
    """Roles of the hinges of one leg or arm; what branches at its end is held, if it `holds`."""
    if holds:
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
    if not way:
        return []
    first = min(2, len(way) - 1)
    middle = max(first, _middle(way))
    upper, joint, lower = allowed
    return [upper if i < middle else joint if i == middle else lower for i in range(len(way))]


def _middle(way: Sequence[Body]) -> int:
    """Hinge nearest to half of the way from a limb's first hinge to its last."""
    points = np.array([body.anchor for body in way])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return int(np.argmin(np.abs(along - along[-1] / 2)))


def _quadruped_limb(reduced: Reduced, limb: Body, limbs: Limbs) -> None:
    """Roles of a quadruped's limb: of its legs, of a part of its trunk, or of an arm."""
    way = run(limb)
    legs = [child for child in way[-1].children if is_leg(child, limbs.ends)]
    if len(legs) > 1 or (not is_leg(limb, limbs.ends) and _carries_limbs(way, limbs)):
        # A joint of the spine carries a part of the trunk with its own limbs.
        for body in way:
            body.role = SPINE
        for child in way[-1].children:
            _quadruped_limb(reduced, child, limbs)
        return
    collapse(reduced, way[-1], "branching joints")
    way = slides.hinges(run(limb))
    if not is_leg(limb, limbs.ends):
        for body in way:
            body.role = "sensor" if len(way) < 2 else ARM_ROLE
        if way and is_wheel(reduced, way[-1]):
            way[-1].role = CASTER
        return
    _leg_roles(reduced, way)


def _leg_roles(reduced: Reduced, way: Sequence[Body]) -> None:
    """Roles of a leg's hinges from its end: a wheel, then knee, flexion and abduction upwards.

    In a leg of more than three the knee is the hinge nearest to the middle; ankles are beyond it.
    """
    order = ["abduction", "flexion", "knee"]
    whole = way
    if len(way) > 1 and is_wheel(reduced, way[-1]):
        way[-1].role = WHEEL
        way = way[:-1]
    if len(way) > len(order):
        knee = max(len(order) - 1, _middle(whole))
        for body in way[knee + 1 :]:
            body.role = "ankle"
        way = way[: knee + 1]
    for i, body in enumerate(reversed(way)):
        body.role = order[max(2 - i, 0)]


def is_wheel(reduced: Reduced, body: Body) -> bool:
    """Whether a limb's last body rolls: it turns without end about a level axis through it."""
    joint = body.joint
    if joint is None or body.slides or body.children or abs(float(body.axis[2])) > LEVEL_AXIS:
        return False
    if "wheel" in joint.name.lower():
        return True
    turns = joint.limits is None or joint.limits[1] - joint.limits[0] > 8 * np.pi
    for name in body.links:
        at, turn = reduced.poses[name]
        own = reduced.description.links[name].inertial
        places = [at] if own is None or own.mass <= 0 else [at, at + turn @ np.array(own.com)]
        for place in places:
            turns &= float(np.linalg.norm(np.cross(place - body.anchor, body.axis))) < TRUE
    return turns


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
            kind = classes.quadruped(found) or ("shank" if found[0] == "ankle" else "")
        else:
            kind = classes.humanoid(found, below)
        kind = "waist_link" if kind == "torso" else kind
        for one in own:
            one.kind = kind
