"""Warnings that differ only in names and numbers are one warning with a count."""

from __future__ import annotations

from draft.errors import Location, Problem
from draft.imports.notes import merged

FILE = Location("beast.urdf", 3)


def causes(*words: str) -> list[str]:
    """Causes of what warnings with these causes, all at one place, become."""
    return [one.cause for one in merged(Problem(cause, FILE) for cause in words)]


def test_alike_warnings_become_one_that_names_all() -> None:
    found = merged(
        Problem(f"range [0, {i}] of joint '{name}' is empty", Location("beast.urdf", i))
        for i, name in enumerate("abcd", start=1)
    )
    assert [str(one) for one in found] == [
        "beast.urdf:1: range [0, 1] of joint 'a' is empty; 3 more like it: 'b', 'c', 'd'"
    ]


def test_a_remedy_may_repeat_the_name() -> None:
    notes = [Problem(f"joint '{n}' has no drive", FILE, f"--torque {n}=VALUE") for n in ("j", "k")]
    (one,) = merged(notes)
    assert one.remedy == "--torque j=VALUE"


def test_other_warnings_stay_apart() -> None:
    apart = ("joint 'a' has no drive", "joint 'b' has no range", "no meshes", "no masses")
    assert causes(*apart) == [*apart]
    elsewhere = [Problem(apart[0], FILE), Problem(apart[0], Location("other.xml"))]
    assert merged(elsewhere) == elsewhere


def test_the_same_warning_twice_is_one() -> None:
    assert causes("joint 'a' has no drive", "joint 'a' has no drive") == ["joint 'a' has no drive"]


def test_many_names_end_with_a_number() -> None:
    (one,) = causes(*(f"joint 'j{i}' has no drive" for i in range(40)))
    assert one.endswith("'j3' and 36 more")


def test_what_has_a_remedy_is_first() -> None:
    meshes = [Problem(f"mesh 'm{i}.stl' is missing", FILE) for i in range(2)]
    speeds = Problem("no usable speeds are declared", FILE, "state them, --speed 12")
    first, missing = merged([*meshes, speeds])
    assert first == speeds
    assert missing.cause == "mesh 'm0.stl' is missing; 1 more like it: 'm1.stl'"
