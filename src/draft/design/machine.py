"""What kind of machine a design is taken for, in words."""

from __future__ import annotations

from draft.design.design import Design
from draft.design.legs import count
from draft.errors import counted


def machine(design: Design) -> str:
    """Kind of machine of a design.

    A fixed base with joints on one chain is that of an arm, on several that of a hand.

        >>> machine(draft.load("quadruped").resolve())
        'robot on 4 legs'
    """
    if design.floating:
        legs = count(design)
        if legs:
            return f"robot on {counted(legs, 'leg')}{' with wheels' if design.rolls else ''}"
        if design.rolls:
            return "robot on wheels"
        return "robot on feet without knees" if design.feet else "floating robot without legs"
    chains: set[int] = set()
    top: list[int] = [0]  # body on the base that each body is attached to
    for i, body in enumerate(design.bodies[1:], start=1):
        top.append(top[body.parent] if body.parent else i)
        if body.joint is not None:
            chains.add(top[i])
    if not chains:
        return "fixed base without joints"
    return "fixed arm" if len(chains) == 1 else f"hand of {len(chains)} fingers on a fixed base"
