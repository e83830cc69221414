"""A member whose structure does not balance in its middle is heavier at one end, and only that."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.report import report
from draft.laws.structure import population
from draft.values import plain
from tests.helpers import leg, parameter, robot

TRENDS = population("quadruped").segments
CENTRES = population("quadruped").centres
lengths = st.floats(0.1, 0.6)
directions = st.tuples(*[st.integers(-9, 9)] * 3).filter(any)


def _body(design: draft.Design, name: str) -> Any:
    return next(body for body in design.bodies if body.name == name)


def _leg(thigh: Any, shank: Any, radius: Any, axis: Any = "-z") -> list[dict[str, Any]]:
    """A leg of two members and a foot; no motor at the thigh's end, so that it is all member."""
    knee = {"name": "knee", "axis": "y", "range": [-2, 2]}
    return leg(
        thigh={"link": {"axis": axis, "length": thigh, "segment": "thigh"}, "motor": None},
        shank={
            "joint": knee,
            "link": {"axis": axis, "length": shank, "segment": "shank"},
            "sphere": {"radius": radius},
        },
    )


def _along(model: mujoco.MjModel, name: str, axis: tuple[int, ...]) -> float:
    """Place of a body's centre of mass along an axis from its origin [m]."""
    unit = np.array(axis) / np.linalg.norm(axis)
    com = model.body(name).ipos
    assert com - (com @ unit) * unit == pytest.approx(np.zeros(3), abs=1e-9)
    return float(com @ unit)


@settings(max_examples=25)
@given(lengths, lengths, st.floats(0.005, 0.06), directions)
def test_mujocos_body_balances_where_the_design_says_and_weighs_the_same(
    thigh: float, shank: float, radius: float, axis: tuple[int, ...]
) -> None:
    design = robot(_leg(thigh, shank, radius, list(axis))).resolve()
    model = design.build().mujoco
    for name, length in (("thigh", thigh), ("shank", shank)):
        body = _body(design, name)
        mass = body.member_mass + body.end_mass
        assert model.body(name).mass[0] == pytest.approx(mass, rel=1e-6)
        balance = body.member_mass * body.member_centre + body.end_mass
        found = _along(model, name, axis)
        assert found == pytest.approx(balance / mass * length, rel=1e-6)
        assert mass == pytest.approx(TRENDS[name](length))


@given(lengths, st.floats(0.005, 0.06))
def test_a_segment_balances_where_its_class_does_unless_its_member_cannot(
    length: float, radius: float
) -> None:
    """A thigh that ends in a foot: one segment of a class with a centre, with an end."""
    chain = leg(
        thigh={
            "type": "sphere",
            "link": {"axis": "-z", "length": length, "segment": "thigh"},
            "sphere": {"radius": radius, "site": "foot"},
            "motor": None,
        }
    )[:2]
    body = _body(robot(chain).resolve(), "thigh")
    trend = CENTRES["thigh"]
    wanted = trend.value * (body.member_mass + body.end_mass)
    found = body.member_mass * body.member_centre + body.end_mass
    if 0.25 < body.member_centre < 0.75:
        assert found == pytest.approx(wanted)
    else:
        # The foot alone is too heavy for the class's centre: the member does what it can.
        assert body.member_centre in (0.25, 0.75)
        assert (found > wanted) == (body.member_centre == 0.25)


def test_a_thigh_without_an_end_balances_where_surveyed_thighs_do() -> None:
    trend = CENTRES["thigh"]
    assert _body(robot().resolve(), "thigh").member_centre == pytest.approx(trend.value)


@given(st.lists(st.tuples(lengths, st.floats(0.005, 0.06)), min_size=1, max_size=5))
def test_centres_of_many_designs_are_those_of_each(rows: list[tuple[float, float]]) -> None:
    parameters = {"length": parameter(0.3), "radius": parameter(0.02)}
    spec = robot(_leg(0.3, "length", "radius"), parameters=parameters)
    table = np.array(rows)
    many = spec.resolve({"length": table[:, 0], "radius": table[:, 1]})
    for i, (length, radius) in enumerate(rows):
        one = spec.resolve({"length": length, "radius": radius})
        for a, b in zip(many.bodies, one.bodies, strict=True):
            assert np.broadcast_to(a.member_centre, len(rows))[i] == pytest.approx(b.member_centre)


@pytest.mark.parametrize(
    ("chain", "people"),
    [
        (leg(thigh={"link": {"axis": "-z", "length": 0.3, "mass": 0.5}}), "quadruped"),
        (leg(thigh={"link": {"axis": "-z", "length": 0.3, "segment": "forearm"}}), "humanoid"),
    ],
    ids=["stated mass", "class without a centre"],
)
def test_without_a_known_centre_a_member_is_one_rod_that_balances_in_its_middle(
    chain: list[dict[str, Any]], people: str
) -> None:
    design = robot(chain, population=people).resolve()
    assert _body(design, "thigh").member_centre == 0.5
    model = design.build().mujoco
    names = [model.geom(i).name for i in range(model.ngeom)]
    assert "thigh_link" in names
    assert "thigh_link_far" not in names


def test_members_that_share_a_segment_balance_in_their_middles() -> None:
    design = draft.load("quadruped").resolve()
    assert {
        _body(design, f"FL_{name}").member_centre for name in ("lateral_thigh", "upper_leg")
    } == {0.5}


def test_a_member_that_is_left_without_mass_still_compiles() -> None:
    whole = TRENDS["shank"](0.25)
    chain = leg(shank={"sphere": {"radius": 0.02, "mass": 2 * whole}})
    design = robot(chain).resolve()
    assert _body(design, "shank").member_mass == 0.0
    assert design.build().mujoco.body("shank").mass[0] == pytest.approx(2 * whole)


def test_the_two_halves_of_a_member_are_the_rod_that_is_drawn() -> None:
    design = robot(_leg(0.3, 0.25, 0.02)).resolve()
    model = design.build().mujoco
    near, far = model.geom("thigh_link"), model.geom("thigh_link_far")
    radius = _body(design, "thigh").member_radius
    for geom, middle in ((near, -0.075), (far, -0.225)):
        assert geom.size[:2] == pytest.approx([radius, 0.075])
        assert geom.pos == pytest.approx([0, 0, middle])


def test_the_report_names_the_centre_and_what_it_rests_on() -> None:
    design = robot().resolve()
    record = plain(report(design))
    thigh = next(s for s in record["segments"] if s["segment"] == "thigh")
    trend = CENTRES["thigh"]
    assert thigh["centre"]["value"] == pytest.approx(trend.value)
    assert thigh["centre"]["n"] == trend.n
    assert thigh["centre"]["held_out_error"] == trend.held_out
    assert thigh["centre"]["held_out_error_of_the_middle"] == trend.held_out_middle
    assert thigh["centre"]["source"]
    member = _body(design, "thigh").member_centre
    assert thigh["centre"]["of_the_member"] == pytest.approx(member)
    assert record["end_density_kg_m3"]["n"] == population("quadruped").end.n
