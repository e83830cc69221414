"""Warnings that differ only in names and numbers are one warning with a count."""

from __future__ import annotations

from draft.errors import Location, Problem
from draft.imports.notes import merged

FILE = Location("beast.urdf", 3)


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
    assert len(merged(notes)) == 1
    assert merged(notes)[0].remedy == "--torque j=VALUE"


def test_other_warnings_stay_apart() -> None:
    notes = [
        Problem("joint 'a' has no drive", FILE),
        Problem("joint 'b' has no range", FILE),
        Problem("joint 'c' has no drive", Location("other.xml")),
        Problem("it has no meshes", FILE),
        Problem("it has no masses", FILE),
    ]
    assert merged(notes) == notes


def test_the_same_warning_twice_is_one() -> None:
    assert merged([Problem("joint 'a' has no drive", FILE)] * 2) == [
        Problem("joint 'a' has no drive", FILE)
    ]


def test_many_names_end_with_a_number() -> None:
    notes = [Problem(f"joint 'j{i}' has no drive", FILE) for i in range(40)]
    assert merged(notes)[0].cause.endswith("'j3' and 36 more")


def test_meshes_that_are_missing_are_one_warning_after_those_with_a_remedy() -> None:
    meshes = [Problem(f"mesh 'm{i}.stl' is missing", FILE) for i in range(9)]
    speeds = Problem("no usable speeds are declared", FILE, "state them, --speed 12")
    found = merged([*meshes, speeds])
    assert found[0] == speeds
    (missing,) = found[1:]
    assert missing.cause == (
        "mesh 'm0.stl' is missing; 8 more like it: 'm1.stl', 'm2.stl', 'm3.stl' and 5 more"
    )
