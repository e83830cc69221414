"""Warnings of an import: those that differ only in names and numbers become one with a count."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from draft.errors import Location, Problem, listed, quoted
from draft.imports.anatomy import ROLLING
from draft.imports.reduce import Reduced
from draft.imports.trunk import NO_MESHES, Trunk

REVIEW = "look at it, and take it out of 'allow' in parameters.yaml once it is mended"
_NAME = re.compile(r"'([^'\n]*)'")
_NUMBER = re.compile(r"(?<![\w])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")


def merged(notes: Iterable[Problem]) -> list[Problem]:
    """Merge warnings of one file that are alike: the first, with the names of the others.

    Its numbers are those of the first. Warnings with a remedy precede those without.
    """
    groups: dict[tuple[str, str, str], list[Problem]] = {}
    for note in notes:
        own = groups.setdefault(_kind(note), [])
        if note not in own:
            own.append(note)
    # What a user can do something about comes first.
    return sorted(map(_one, groups.values()), key=lambda note: not note.remedy)


def _kind(note: Problem) -> tuple[str, str, str]:
    """File, cause and remedy without names and numbers."""
    names = [name for name in _NAME.findall(note.cause) if name]
    if not names:
        return str(note), "", ""
    own = re.compile("|".join(rf"(?<!\w){re.escape(name)}(?!\w)" for name in names))
    cause, remedy = (
        _NUMBER.sub("0", own.sub("''", _NAME.sub("''", text))) for text in (note.cause, note.remedy)
    )
    return note.where.file if note.where else "", cause, remedy


def _one(group: list[Problem]) -> Problem:
    first, *others = group
    if not others:
        return first
    names = list(dict.fromkeys(_NAME.findall(note.cause)[0] for note in others))
    return replace(first, cause=f"{first.cause}; {len(others)} more like it: {quoted(names)}")


def of_shapes(unread: Sequence[Problem], trunk: Trunk | None, where: Location) -> list[Problem]:
    """Warnings of meshes that were not read, and of what stands in for those of the trunk.

    Args:
        unread: those of single meshes.
        trunk: the trunk; None for a fixed base.
        where: place of its link.
    """
    found = merged(unread)
    if trunk is None or not trunk.fault:
        return found
    if found:  # One cause, one warning.
        cause = f"{found[0].cause}; for the trunk, {trunk.instead}"
        return [replace(found[0], cause=cause), *found[1:]]
    # A trunk that its maker describes by primitives needs none; the summary names its source.
    described = trunk.fault == NO_MESHES and trunk.source.endswith("primitives")
    return [] if described else [Problem(f"{trunk.fault}: {trunk.instead}", where)]


def of_wheels(reduced: Reduced) -> list[Problem]:
    """Ranges of wheels that the file states and a spec has no place for."""
    return [
        Problem(f"wheel '{body.name}' has a range: it is imported as one without end", joint.where)
        for body in reduced.root.all()
        if body.role in ROLLING and (joint := body.joint) is not None and joint.limits is not None
    ]


def of_allowed(allowed: Mapping[str, str], where: Location) -> Problem:
    """Warning of all rules that an import lets its robot break, each with why."""
    (key, why), *others = allowed.items()
    cause = f"allows {key}: {why}"
    if others:
        keys = listed(key for key, _ in others)
        cause += f"; also {keys}, each with its reason in parameters.yaml"
    return Problem(cause, where, REVIEW)
