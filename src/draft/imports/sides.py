"""Warnings of an import about limbs that are not each other's mirror images."""

from __future__ import annotations

from collections.abc import Sequence

from draft.errors import Location, Problem, counted, listed
from draft.imports.formatting import LEAST_GAP, SAME, Deviation

LISTED = 4


def notes(deviations: Sequence[Deviation], where: Location) -> list[Problem]:
    """Say which dimensions of counterparts are shared, and which are not."""
    found: list[Problem] = []
    shared = [one for one in deviations if one.shared]
    if shared:
        cause = f"limbs that are alike differ in {_count(shared)}, by up to {_most(shared)}: "
        cause += listed([f"{one.own} = {_millimetres(one.value)}" for one in shared], LISTED)
        remedy = f"within {SAME:.0%} or {1000 * LEAST_GAP:g} mm the sides share one parameter; "
        remedy += "set the offsets to 0 for equal sides"
        found.append(Problem(cause, where, remedy))
    apart = [one for one in deviations if not one.shared]
    if apart:
        cause = f"limbs truly differ in {_count(apart)} by up to {_most(apart)}: "
        cause += listed([f"{one.name} and {one.own}" for one in apart], LISTED)
        remedy = "each side has its own parameter: edit both to keep the sides in step"
        found.append(Problem(cause, where, remedy))
    return found


def _count(found: Sequence[Deviation]) -> str:
    return f"{counted(len(found), 'dimension')}"


def _most(found: Sequence[Deviation]) -> str:
    return _millimetres(max(abs(one.value) for one in found)).lstrip("+")


def _millimetres(value: float) -> str:
    return f"{1000 * value:+.2g} mm" if abs(value) < 0.01 else f"{1000 * value:+.0f} mm"
