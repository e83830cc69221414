"""Equality constraints of an MJCF model: closed loops, and joints that follow others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

from draft.description.description import Joint, Link, Loop, Point
from draft.description.xmlfile import Element


def loops(
    root: Element, links: Mapping[str, Link], sites: Mapping[str, tuple[str, Point]]
) -> tuple[Loop, ...]:
    """Loops that <connect> and <weld> close between two links of the robot.

    Args:
        root: the model.
        links: the robot's links.
        sites: link and position [m] of each site.
    """
    found: list[Loop] = []
    for section in root.all("equality"):
        for element in section.all("connect", "weld"):
            given = element.attributes
            if given.get("active") == "false":
                continue
            at = sites.get(given.get("site1", ""))
            other = sites.get(given.get("site2", ""))
            anchor = at[1] if at else cast(Point, element.numbers("anchor", 3, (0.0, 0.0, 0.0)))
            first = given.get("body1") or (at[0] if at else "")
            second = given.get("body2") or (other[0] if other else "")
            rigid = element.tag == "weld"
            if rigid and not at:  # A weld's anchor is a point of its second body.
                first, second = second, first
            if first in links and second in links:
                name = given.get("name", "")
                found.append(Loop(name, (first, second), element.where, anchor, rigid))
    return tuple(found)


def followed(root: Element, joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """Joints, with `mimics` set for those that an equality couples to another.

    Of two coupled joints the one without an actuator follows; joint1 if both or neither have one.
    A polynomial that is no line, or between joints that do not rest at zero, has a ratio of 0.
    """
    coupled = dict(joints)
    for section in root.all("equality"):
        for element in section.all("joint"):
            pair = element.attributes.get("joint1", ""), element.attributes.get("joint2", "")
            if element.attributes.get("active") == "false" or not set(pair) <= set(coupled):
                continue
            first, second = coupled[pair[0]], coupled[pair[1]]
            offset, ratio, *curved = element.some_numbers("polycoef") or (0.0, 1.0)
            if any(curved) or first.rest or second.rest:
                ratio = 0.0
            if first.driven and not second.driven:
                first, second = second, first
                ratio, offset = (1.0 / ratio, -offset / ratio) if ratio else (0.0, 0.0)
            if not second.mimics:
                coupled[first.name] = replace(first, mimics=second.name, ratio=ratio, offset=offset)
    return coupled
