"""Where structure balances: actuators are taken out at their places, robots are held out."""

from __future__ import annotations

import math
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.description.segments import segments
from draft.fitting.structure import centres, feet, fits
from draft.fitting.structure import survey_refit as refit
from draft.fitting.structure.attribution import Machine, Piece, machine, machines
from draft.fitting.structure.parse import parse
from draft.fitting.structure.robots import robots
from draft.laws import survey as rows
from draft.laws.structure import population

SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared"))
MANIFEST = SHARED / "robots" / "manifest.csv"
shares = st.floats(0.01, 0.99)


@pytest.fixture(scope="module")
def surveyed() -> dict[str, list[Machine]]:
    found = machines(rows.read())
    return {
        name: [robot for robot in found if robot.population == name] for name in centres.CLASSES
    }


def _row(
    robot: str, population: str, kind: str, parent: str, centre: float, mass: float
) -> rows.Row:
    role = {"base": ()}.get(kind, ({"thigh": "hip", "shank": "knee"}.get(kind, "ankle"),))
    return rows.Row(
        robot, population, kind, parent, kind, role, role, (50.0,) * len(role),
        (math.nan,) * len(role), mass, 0.3, (0.3, 0.1, 0.1), (), (), centre,
    )  # fmt: skip


def test_a_humanoids_thigh_carries_half_a_drive_at_either_end() -> None:
    people = [("base", "", 9.0), ("thigh", "base", 4.0), ("shank", "thigh", 3.0)]
    made = machine([_row("x", "humanoid", kind, up, 0.6, mass) for kind, up, mass in people])
    thigh = made.pieces[1]
    drive = thigh.actuators
    assert thigh.far == pytest.approx(drive / 2)
    balance = thigh.structure * thigh.centre + drive / 2 * 1.0
    assert balance == pytest.approx(4.0 * 0.6)
    # The last segment has nothing at its far end.
    assert made.pieces[2].far == 0.0


def test_a_quadrupeds_drives_sit_at_the_first_joint(surveyed: dict[str, list[Machine]]) -> None:
    for robot in surveyed["quadruped"]:
        assert {piece.far for piece in robot.pieces} == {0.0}
    go2 = next(robot for robot in surveyed["quadruped"] if robot.key == "unitree_go2")
    thigh = next(piece for piece in go2.pieces if piece.kind == "thigh")
    assert thigh.centre == pytest.approx(thigh.row.mass * thigh.row.centre / thigh.structure)
    assert thigh.centre > thigh.row.centre


@given(st.dictionaries(st.sampled_from("abcdef"), st.lists(shares, min_size=1, max_size=4)))
def test_the_centre_of_a_class_is_the_median_over_robots_and_not_over_copies(
    drawn: dict[str, list[float]],
) -> None:
    made = [
        Machine(
            key,
            "humanoid",
            tuple(Piece(_row(key, "humanoid", "thigh", "base", c, 2.0), 0.0, 0.0) for c in values),
            1.0,
            0.0,
        )
        for key, values in drawn.items()
    ]
    found = centres.shares(made, "thigh")
    assert found == pytest.approx({key: np.median(values) for key, values in drawn.items()})
    measured = centres.centres(made, {key: key for key in drawn}) if made else {}
    assert set(measured) == ({"thigh"} if len(drawn) >= fits.FEWEST else set())
    if measured:
        assert measured["thigh"].value == pytest.approx(np.median(list(found.values())))
        assert measured["thigh"].n == len(drawn)


def test_structure_that_would_balance_outside_its_segment_is_left_out() -> None:
    made = [
        Machine(
            "x",
            "humanoid",
            tuple(
                Piece(_row("x", "humanoid", "thigh", "base", c, 2.0), 0.0, 0.0)
                for c in (-0.1, 0.0, 0.3, 1.0, math.nan)
            ),
            1.0,
            0.0,
        )
    ]
    assert centres.shares(made, "thigh") == {"x": 0.3}


def test_a_robot_or_a_maker_held_out_is_never_seen() -> None:
    by_robot = {"a": 0.2, "b": 0.2, "c": 0.8}
    found = centres.fit(by_robot, {"a": "one", "b": "one", "c": "other"})
    # Others' medians: 0.5, 0.5 and 0.2; by maker: 0.8, 0.8 and 0.2.
    assert found.held_out == pytest.approx((0.3 + 0.3 + 0.6) / 3)
    assert found.held_out_maker == pytest.approx(0.6)
    assert found.held_out_middle == pytest.approx(0.3)
    alone = centres.fit(by_robot, dict.fromkeys(by_robot, "one"))
    assert alone.held_out_maker == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("people", "kind", "n", "value", "errors"),
    [
        ("quadruped", "thigh", 15, 0.425, (0.169, 0.207, 0.182)),
        ("quadruped", "shank", 15, 0.594, (0.095, 0.096, 0.115)),
        ("humanoid", "thigh", 19, 0.230, (0.176, 0.178, 0.254)),
        ("humanoid", "shank", 22, 0.282, (0.211, 0.237, 0.226)),
        ("humanoid", "upper_arm", 8, 0.793, (0.215, 0.220, 0.270)),
        ("humanoid", "forearm", 9, 0.418, (0.384, 0.422, 0.311)),
    ],
)
def test_the_documented_centres_are_measured_and_those_of_thighs_ship(
    surveyed: dict[str, list[Machine]],
    people: str,
    kind: str,
    n: int,
    value: float,
    errors: tuple[float, float, float],
) -> None:
    found = refit.measured_centres(surveyed[people])[kind]
    assert (found.n, round(found.value, 3)) == (n, value)
    ours = (found.held_out, found.held_out_maker, found.held_out_middle)
    assert ours == pytest.approx(errors, abs=5e-4)
    shipped = population(people).centres.get(kind)
    assert (shipped is not None) == (kind == "thigh")
    if shipped is not None:
        assert shipped.value == pytest.approx(found.value)


def test_no_other_class_has_a_centre() -> None:
    for people, kinds in centres.CLASSES.items():
        assert set(population(people).centres) <= set(kinds)


def test_ends_have_the_median_density_of_the_surveyed_feet() -> None:
    used = [foot.density for foot in feet.feet() if foot.used]
    for people in centres.CLASSES:
        assert population(people).end_density == pytest.approx(np.median(used))
        assert population(people).end.n == len(used) == 8


def test_a_foot_that_does_not_count_has_its_reason() -> None:
    assert [foot.key for foot in feet.feet() if foot.used == bool(foot.reason)] == []
    assert {foot.key for foot in feet.feet()} <= set(robots())


@pytest.mark.skipif(not MANIFEST.exists(), reason="the descriptions are not here")
def test_the_table_of_feet_is_what_the_descriptions_say() -> None:
    table = {foot.key: foot for foot in feet.feet()}
    found: dict[str, tuple[str, float, float]] = {}
    for one in parse(MANIFEST).used:
        if one.robot.population != "quadruped":
            continue
        shanks = {row.segment for row in one.rows if row.kind == "shank"}
        for segment in segments(one.description):
            for name in segment.links[1:] if segment.name in shanks else ():
                link = one.description.links[name]
                spheres = [
                    shape.size[0]
                    for shape in link.geometries
                    if (shape.use, shape.kind) == ("collision", "sphere")
                ]
                if spheres and link.inertial is not None and link.inertial.mass > 0:
                    value = (name, link.inertial.mass, max(spheres))
                    kept = table.get(one.robot.key)
                    if kept is None or kept.link == name:
                        found[one.robot.key] = value
    assert found == {foot.key: (foot.link, foot.mass, foot.radius) for foot in table.values()}
