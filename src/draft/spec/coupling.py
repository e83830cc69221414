"""Coupled joints: which joint each of them follows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from draft.errors import Problem, suggest
from draft.spec.links import Coupling
from draft.spec.tree import Body


def leaders(bodies: Sequence[Body]) -> dict[int, int]:
    """Body of the joint that each coupled joint follows, by the body of the coupled joint.

    Those that follow none of the robot are omitted. Each comes after the one that it follows, if
    that is coupled itself; of a cycle, all are omitted.
    """
    names = _names(bodies)
    direct = {i: k for i, one in _coupled(bodies) if (k := _leader(bodies[i], one, names)) >= 0}
    found: dict[int, int] = {}
    waiting = dict(direct)
    while ready := {i: k for i, k in waiting.items() if k not in waiting}:
        found |= ready
        waiting = {i: k for i, k in waiting.items() if i not in ready}
    return found


def coupling_problems(bodies: Sequence[Body]) -> Iterator[Problem]:
    """Coupled joints that follow no joint, a wheel, or each other."""
    names, found = _names(bodies), leaders(bodies)
    for i, coupling in _coupled(bodies):
        body = bodies[i]
        own = f"joint '{_full(body)}'"
        leader = _leader(body, coupling, names)
        if leader < 0:
            cause = f"{own} follows '{coupling.joint}', which does not exist"
            near = [name.removeprefix(body.prefix) for name in names if name != _full(body)]
            remedy = suggest(coupling.joint, near, "joints")
            yield Problem(cause, coupling.where, remedy)
        elif (joint := bodies[leader].link.joint) is not None and joint.rolls:
            cause = f"{own} follows '{_full(bodies[leader])}', the joint of a wheel"
            yield Problem(cause, coupling.where, "a wheel turns without end: follow another joint")
        elif i not in found:
            loop = [i, leader]
            while loop[-1] != i and loop.count(loop[-1]) == 1:
                other = bodies[loop[-1]]
                follows = other.link.joint and other.link.joint.follows
                loop.append(_leader(other, follows, names) if follows else i)
            way = " -> ".join(_full(bodies[k]) for k in loop)
            cause = f"{own} follows itself: {way}"
            yield Problem(cause, coupling.where, "let one of them be free, with 'range: [a, b]'")


def _coupled(bodies: Sequence[Body]) -> Iterator[tuple[int, Coupling]]:
    for i, body in enumerate(bodies):
        if body.link.joint is not None and body.link.joint.follows is not None:
            yield i, body.link.joint.follows


def _names(bodies: Sequence[Body]) -> dict[str, int]:
    """Bodies by the full name of their joint."""
    return {_full(body): i for i, body in enumerate(bodies) if body.link.joint is not None}


def _full(body: Body) -> str:
    return body.prefix + (body.link.joint.name if body.link.joint is not None else "")


def _leader(body: Body, coupling: Coupling, names: dict[str, int]) -> int:
    """Body of the joint that a coupled one follows: of its chain, else of that full name; or -1."""
    return names.get(body.prefix + coupling.joint, names.get(coupling.joint, -1))
