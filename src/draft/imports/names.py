"""Names for a spec from a vendor's: valid, unique, cut into prefix and rest for copies."""

from __future__ import annotations

import re
from collections.abc import Sequence

from draft.spec.expressions import RESERVED

LONGEST = 48


def valid(text: str, fallback: str = "part") -> str:
    """A name that a spec may have, as near to the vendor's as can be."""
    name = re.sub(r"[^A-Za-z0-9_]+", "_", text).strip("_")[:LONGEST].rstrip("_")
    if not name:
        return fallback
    return name if not name[0].isdigit() else f"n{name}"


class Unique:
    """Gives each name once; a name that is taken gets a number."""

    def __init__(self, taken: Sequence[str] = ()) -> None:
        self.taken = set(taken) | RESERVED

    def __call__(self, name: str) -> str:
        """Return the name, or the name with the first free number."""
        found, k = name, 2
        while found in self.taken:
            found, k = f"{name}_{k}", k + 1
        self.taken.add(found)
        return found


def side(signs: tuple[float, float, float], at: Sequence[float], four: bool) -> str:
    """Prefix by place: `FL_` and the like for four limbs, else `left_` and `right_`."""
    left = at[1] >= 0
    if four:
        return f"{'F' if at[0] >= 0 else 'R'}{'L' if left else 'R'}_"
    return "left_" if left else "right_"


def factor(groups: Sequence[Sequence[str]]) -> tuple[list[str], list[str]] | None:
    """Cut names into one prefix per group and rests that all groups share.

    Args:
        groups: the names of each limb, in one order.

    Returns:
        Prefixes and rests, so that prefix + rest is the vendor's name; None where there are none.
    """
    common = [_start(group) for group in groups]
    for length in range(len(common[0]), 0, -1):
        rests = [name[length:] for name in groups[0]]
        if not all(re.match(r"[A-Za-z_][A-Za-z0-9_]*$", rest) for rest in rests):
            continue
        prefixes = [common[0][:length]]
        for group, start in zip(groups[1:], common[1:], strict=True):
            cut = len(group[0]) - len(rests[0])
            if not 0 < cut <= len(start):
                break
            if [name[cut:] for name in group] != rests:
                break
            prefixes.append(group[0][:cut])
        good = len(prefixes) == len(groups) == len(set(prefixes))
        good = good and max(map(len, (*prefixes, *rests))) <= LONGEST
        if good and all(re.match(r"[A-Za-z_][A-Za-z0-9_]*$", prefix) for prefix in prefixes):
            return prefixes, rests
    return None


def _start(group: Sequence[str]) -> str:
    """Characters that all names of a group begin with."""
    first, last = min(group), max(group)
    pairs = enumerate(zip(first, last, strict=False))
    return first[: next((i for i, (a, b) in pairs if a != b), min(len(first), len(last)))]


def shared(groups: Sequence[Sequence[str]]) -> list[str]:
    """Rests of names that no prefix can be cut off: what all groups' names have in common."""
    rests: list[str] = []
    for names in zip(*groups, strict=True):
        words = [re.split(r"[_\-. ]+", name) for name in names]
        if len({len(own) for own in words}) == 1:
            kept = [own[0] for own in zip(*words, strict=True) if len(set(own)) == 1]
        else:
            kept = words[0]
        rests.append(valid("_".join(kept), "joint"))
    if len(set(rests)) < len(rests):
        rests = [valid(name) for name in groups[0]]
    if len(set(rests)) < len(rests):
        # Long names may differ only in what was cut off.
        rests = [
            rest if rest not in rests[:i] else f"{rest}_{i + 1}" for i, rest in enumerate(rests)
        ]
    return rests
