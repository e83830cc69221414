"""Classes of segments, named by the joint at the proximal end.

Source: arXiv 2609.38405, structure survey.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

BASE = "base"
AFTER = {
    "hip": "thigh",
    "knee": "shank",
    "ankle": "foot",
    "shoulder": "upper_arm",
    "elbow": "forearm",
    "wrist": "hand",
    "waist": "torso",
    "neck": "head",
}
QUADRUPED = {"abduction": "hip_link", "flexion": "thigh", "knee": "shank"}


def humanoid(roles: Sequence[str], children: Collection[str]) -> str:
    """Class of a humanoid's segment; "" for fingers and the like.

    Args:
        roles: roles of the joints merged into it, the first at its proximal end.
        children: role of the first joint of each child segment. If one is the segment's own role,
            the segment is the short link inside that joint: hip -> hip_link.
    """
    first = roles[0] if roles else ""
    if first not in AFTER:
        return ""
    return f"{first}_link" if first in children else AFTER[first]


def quadruped(roles: Sequence[str]) -> str:
    """Class of a quadruped's segment; one with the flexion joint of the hip is a thigh.

    Args:
        roles: roles of the joints merged into it, the first at its proximal end.
    """
    if "flexion" in roles:
        return "thigh"
    return QUADRUPED.get(roles[0], "") if roles else ""
