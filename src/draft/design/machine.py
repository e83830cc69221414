"""What kind of machine a design is taken for, in words and for metrics."""

from __future__ import annotations

from draft.design.design import Design
from draft.design.legs import count
from draft.design.limbs import branches
from draft.errors import counted
from draft.spec import Spec
from draft.spec.primitives.wheel import WheelPart
from draft.spec.tree import Body


def kinds(spec: Spec) -> frozenset[str]:
    """Kinds of machine of a robot.

    "floating", with "wheels" if it stands on driven ones, or "fixed" with "arm", "hand", both or
    neither.
    """
    if spec.floating:
        return frozenset({"floating", *(["wheels"] if any(map(_rolls, spec.bodies)) else [])})
    arm, fingers = branches(spec)
    return frozenset({"fixed", *(["arm"] if arm else []), *(["hand"] if fingers else [])})


def _rolls(body: Body) -> bool:
    """Whether a robot stands on the link of a body, and it is a driven wheel."""
    link = body.link
    wheel = link.end_type is not None and issubclass(link.end_type, WheelPart)
    driven = link.joint is not None and link.joint.actuator is not None
    return wheel and driven and bool(link.sites)


def machine(design: Design) -> str:
    """Kind of machine of a design.

    A fixed base with driven joints on one chain is that of an arm, with several branches that of a
    hand.

        >>> machine(draft.load("quadruped").resolve())
        'robot on 4 legs'
    """
    if design.floating:
        legs, rolls = count(design), "wheels" in kinds(design.spec)
        if legs:
            return f"robot on {counted(legs, 'leg')}{' with wheels' if rolls else ''}"
        if rolls:
            return "robot on wheels"
        return "robot on feet without knees" if design.feet else "floating robot without legs"
    arm, fingers = branches(design.spec)
    hand = f"hand of {len(fingers)} fingers"
    if arm:
        return f"fixed arm with a {hand}" if fingers else "fixed arm"
    return f"{hand} on a fixed base" if fingers else "fixed base without driven joints"
