"""Designs of a study, read once when it starts."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from functools import partial

from draft.errors import DraftError, Problem, counted
from draft.learn.bodies.designs import Bodies, open_bodies
from draft.learn.bodies.legged import LeggedRobot
from draft.study.file import Family, Study, at_place
from draft.study.jobs import Group


def read_groups(study: Study) -> list[Group]:
    """Read the designs of a study, and draw those of its families.

    Raises:
        DraftError: a design cannot be read or trained, or is listed twice; with its place in the
            study's file.
    """
    groups: list[Group] = []
    for number, design in enumerate(study.designs):
        where = study.place("designs", number)
        group = at_place(partial(_group, design), where)
        if len(group.members) > study.environments:
            cause = (
                f"{counted(study.environments, 'world')} cannot hold {len(group.members)} designs"
            )
            remedy = f"set 'environments: {len(group.members)}' or more"
            raise DraftError(Problem(cause, where, remedy))
        groups.append(group)
    count = Counter(group.name for group in groups)
    # Designs of one name belong to different robots, unless they are the same.
    groups = [
        replace(group, name=_safe(group.members[0].name)) if count[group.name] > 1 else group
        for group in groups
    ]
    for number, group in enumerate(groups):
        if group.name in [other.name for other in groups[:number]]:
            cause = f"'{group.name}' is listed twice"
            remedy = "list each design once, or give the family a name"
            raise DraftError(Problem(cause, study.place("designs", number), remedy))
    return groups


def _group(design: str | Family) -> Group:
    if isinstance(design, Family):
        return _family(design)
    bodies = open_bodies([design])
    name = _safe(bodies.members[0].name.rpartition(":")[2])
    return Group(name, bodies.members, _design_files(bodies, bodies.members))


def _family(family: Family) -> Group:
    """Bodies of a family, drawn once for all seeds and stages."""
    bodies = open_bodies([family.design], family.vary, family.bodies, None, family.seed)
    spec, count = bodies.spec.name, len(bodies.members)
    members = tuple(
        replace(member, name=f"{spec}:body_{number:0{len(str(count))}d}")
        for number, member in enumerate(bodies.members, start=1)
    )
    default = f"{_safe(family.design.rpartition('/')[2])}-{count}-bodies"
    return Group(
        name=family.name or default,
        members=members,
        designs=_design_files(bodies, members),
        family=True,
        see_design=family.see_design,
        note=bodies.note,
    )


def _design_files(bodies: Bodies, members: tuple[LeggedRobot, ...]) -> dict[str, str]:
    """Design file of each member as YAML, by the member's name."""
    pairs = zip(members, bodies.texts, strict=True)
    return {member.name: text for member, text in pairs}


def _safe(name: str) -> str:
    """Return a name with only the characters that file names allow everywhere."""
    return re.sub(r"[^\w.]+", "-", name).strip("-") or "design"
