"""Equality constraints of an MJCF model: closed loops, and joints that follow others."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from draft.description.description import Joint, Link, Loop
from draft.description.xmlfile import Element


def loops(root: Element, links: Mapping[str, Link]) -> tuple[Loop, ...]:
    """Loops that <connect> and <weld> close between two links of the robot."""
    sites = _site_bodies(root)
    found: list[Loop] = []
    for section in root.all("equality"):
        for element in section.all("connect", "weld"):
            given = element.attributes
            if given.get("active") == "false":
                continue
            first, second = (
                given.get(f"body{i}") or sites.get(given.get(f"site{i}", ""), "") for i in (1, 2)
            )
            if first in links and second in links:
                found.append(Loop(given.get("name", ""), (first, second), element.where))
    return tuple(found)


def followed(root: Element, joints: Mapping[str, Joint]) -> dict[str, Joint]:
    """Joints, with `mimics` set for those that an equality couples to another.

    Of two coupled joints the one without an actuator follows; joint1 if both or neither have one.
    """
    coupled = dict(joints)
    for section in root.all("equality"):
        for element in section.all("joint"):
            pair = element.attributes.get("joint1", ""), element.attributes.get("joint2", "")
            if element.attributes.get("active") == "false" or not set(pair) <= set(coupled):
                continue
            first, second = coupled[pair[0]], coupled[pair[1]]
            if first.driven and not second.driven:
                first, second = second, first
            if not second.mimics:
                coupled[first.name] = replace(first, mimics=second.name)
    return coupled


def _site_bodies(root: Element) -> dict[str, str]:
    """Names of the bodies of sites, by site."""
    bodies: dict[str, str] = {}
    waiting = [(world, "") for world in root.all("worldbody")]
    while waiting:
        element, body = waiting.pop()
        for child in element.all("site", "frame", "body"):
            if child.tag == "site":
                bodies[child.attributes.get("name", "")] = body
            else:
                name = child.attributes.get("name", "") if child.tag == "body" else body
                waiting.append((child, name))
    return bodies
