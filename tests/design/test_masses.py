"""Where a design's mass comes from and how it is shared out: nothing is lost, nothing twice."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.bands import mass_spreads
from draft.design.report import mass_parts, report
from draft.laws.structure import population
from tests.helpers import BOX, leg, parameter, robot

QUADRUPED = draft.load("quadruped")
TRENDS = population("quadruped").segments
END_DENSITY = population("quadruped").end_density
lengths = st.floats(0.05, 1.2)
quadrupeds = st.fixed_dictionaries(
    {
        "thigh_length": st.floats(0.1, 0.9),
        "shank_length": st.floats(0.1, 0.9),
        "hip_offset": st.floats(0.03, 0.4),
        "trunk_length": st.floats(0.2, 1.5),
        "trunk_width": st.floats(0.05, 1.0),
        "actuators.leg.peak_torque": st.floats(10, 400),
    }
)


def _of(design: draft.Design, name: str) -> Any:
    return next(body for body in design.bodies if body.name == name)


@given(quadrupeds)
def test_total_mass_is_that_of_the_bodies_and_of_trunk_segments_and_actuators(
    values: dict[str, float],
) -> None:
    design = QUADRUPED.resolve(values)
    segments = sum(s.mass * s.copies for s in design.segments)
    actuators = 12 * design.actuators["leg"].mass
    assert design.mass == pytest.approx(sum(design.body_masses().values()), rel=1e-12)
    assert design.mass == pytest.approx(design.trunk.mass + segments + actuators, rel=1e-12)
    assert design.mass == pytest.approx(design.structure_mass + design.actuator_mass, rel=1e-15)


@given(quadrupeds)
def test_every_copy_of_a_leg_weighs_the_same(values: dict[str, float]) -> None:
    masses = QUADRUPED.resolve(values).body_masses()
    for name, mass in masses.items():
        if name.startswith("FL_"):
            copies = [masses[prefix + name[3:]] for prefix in ("FR_", "RL_", "RR_")]
            assert copies == [mass] * 3


@given(quadrupeds)
def test_members_of_a_segment_share_its_mass_by_length(values: dict[str, float]) -> None:
    design = QUADRUPED.resolve(values)
    thigh = next(s for s in design.segments if s.trend == "thigh")
    lateral, upper = (_of(design, f"FL_{name}") for name in ("lateral_thigh", "upper_leg"))
    assert lateral.member_mass + upper.member_mass == pytest.approx(thigh.mass)
    assert lateral.member_mass / upper.member_mass == pytest.approx(
        values["hip_offset"] / values["thigh_length"]
    )


@given(quadrupeds)
def test_a_thigh_is_as_long_as_from_hip_pitch_axis_to_knee_axis(values: dict[str, float]) -> None:
    design = QUADRUPED.resolve(values)
    thigh = next(s for s in design.segments if s.trend == "thigh")
    # The upper leg hangs beside the knee motor, half a motor inside the end of the hip offset.
    across = values["hip_offset"] - design.actuators["leg"].length / 2
    assert thigh.length == pytest.approx(math.hypot(values["thigh_length"], across))
    assert thigh.mass == pytest.approx(TRENDS["thigh"](thigh.length))


@given(lengths, st.floats(0.005, 0.1), st.sampled_from(["sphere", "plate"]))
def test_an_end_effector_is_paid_first_and_takes_at_most_half(
    length: float, size: float, kind: str
) -> None:
    plate = {"length": 2 * size, "width": size, "thickness": size, "site": "sole"}
    shank = {"link": {"axis": "-z", "length": length, "segment": "shank"}}
    if kind == "plate":
        shank |= {"type": "foot", "plate": plate, "sphere": None}
        volume = 2 * size**3
    else:
        shank |= {"sphere": {"radius": size}}
        volume = 4 / 3 * math.pi * size**3
    body = _of(robot(leg(shank=shank)).resolve(), "shank")
    whole = TRENDS["shank"](length)
    assert body.member_mass + body.end_mass == pytest.approx(whole)
    assert body.end_mass == pytest.approx(min(END_DENSITY * volume, whole / 2))


def test_a_stated_end_effector_keeps_its_mass_and_the_member_gets_what_is_left() -> None:
    whole = TRENDS["shank"](0.25)
    for share in (0.9, 2.0):
        chain = leg(shank={"sphere": {"radius": 0.02, "mass": share * whole}})
        body = _of(robot(chain).resolve(), "shank")
        assert body.end_mass == pytest.approx(share * whole)
        assert body.member_mass == pytest.approx(max(1 - share, 0) * whole)


def test_a_mirrored_member_bolted_to_a_link_is_as_long_and_as_heavy_as_its_image() -> None:
    def thigh(mirror: str) -> tuple[float, float]:
        bar = {"name": "bar", "link": {"axis": [0, 1, 0], "length": 0.2, "segment": "thigh"}}
        use = {"chain": "bar", "at": [0, 0.1, 0]} | ({"mirror": mirror} if mirror else {})
        chain = leg(thigh={"children": [use]})[:2]
        chain[1].pop("motor", None)
        design = robot(chain, chains={"bar": [bar]}).resolve()
        found = next(s for s in design.segments if s.label == "thigh")
        return float(found.length), float(found.mass)

    assert thigh("y") == pytest.approx(thigh(""))


@given(st.floats(0.001, 0.2), st.floats(0.001, 0.2))
def test_a_drawn_radius_never_changes_a_mass(first: float, second: float) -> None:
    spec = robot(
        leg(thigh={"link": {"axis": "-z", "length": 0.3, "segment": "thigh", "radius": "width"}}),
        parameters={"width": parameter(0.03)},
    )
    thin, wide = spec.resolve({"width": first}), spec.resolve({"width": second})
    assert thin.body_masses() == wide.body_masses()
    assert _of(thin, "thigh").member_radius == first


@given(st.floats(0.0, 30.0))
def test_a_stated_mass_wins_over_the_trend(mass: float) -> None:
    link = {"axis": "-z", "length": 0.3, "segment": "thigh", "mass": mass}
    design = robot(leg(thigh={"link": link})).resolve()
    assert _of(design, "thigh").member_mass == pytest.approx(mass)
    segment = next(s for s in design.segments if "thigh" in s.bodies)
    assert segment.mass == pytest.approx(mass)
    assert segment.trend is None
    trend = robot().resolve()
    rest = trend.mass - TRENDS["thigh"](0.3)
    assert design.mass == pytest.approx(rest + mass)


angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)


def _bent(rpy: tuple[float, ...], at: list[float]) -> draft.Spec:
    """A leg whose thigh carries a second, rotated, member before the knee."""
    first, thigh, shank = leg(thigh={"motor": None})
    bolted = {
        "name": "bracket",
        "rpy": list(rpy),
        "at": at,
        "link": {"axis": "-z", "length": 0.2, "segment": "thigh"},
        "motor": {"actuator": "leg", "axis": "y"},
    }
    return robot([first, thigh, bolted, shank])


@given(angles)
def test_a_bolted_and_rotated_member_counts_from_joint_to_joint(rpy: tuple[float, ...]) -> None:
    at = [0.05, -0.02, -0.25]
    design = _bent(rpy, at).resolve()
    roll, pitch, yaw = rpy
    # Down the bracket's own z, turned by roll, then pitch, then yaw about fixed axes.
    c, s = math.cos, math.sin
    z = np.array(
        [
            c(yaw) * s(pitch) * c(roll) + s(yaw) * s(roll),
            s(yaw) * s(pitch) * c(roll) - c(yaw) * s(roll),
            c(pitch) * c(roll),
        ]
    )
    knee = np.array(at) - 0.2 * z
    segment = next(s for s in design.segments if s.trend == "thigh")
    assert segment.length == pytest.approx(float(np.linalg.norm(knee)))
    assert segment.bodies == ("thigh", "bracket")
    shares = [_of(design, name).member_mass for name in segment.bodies]
    assert shares[0] / shares[1] == pytest.approx(0.3 / 0.2)
    hip, end = (np.array(design.frames()[i][0], dtype=float) for i in (2, 4))
    assert end - hip == pytest.approx(knee, abs=1e-12)


@given(st.floats(1, 3000))
def test_a_stated_trunk_density_weighs_the_trunk(density: float) -> None:
    trunk = robot(root={"density": density}).resolve().trunk
    assert trunk.mass == pytest.approx(density * 0.4 * 0.2 * 0.1)
    assert trunk.density_stated


@pytest.mark.parametrize("people", ["humanoid", "quadruped"])
def test_a_trunk_has_the_populations_density_where_none_is_stated(people: Any) -> None:
    trunk = robot(root={"density": "population"}, population=people).resolve().trunk
    assert trunk.mass == pytest.approx(population(people).trunk_density * 0.4 * 0.2 * 0.1)
    assert not trunk.density_stated


@given(st.floats(0.5, 2.0))
def test_trunk_mass_grows_with_the_cube_of_its_size(scale: float) -> None:
    spec = robot(
        root={
            "sections": [
                {"at": "-0.2 * s", "rectangle": ["0.2 * s", "0.1 * s"], "chamfer": 0.2},
                {"at": "0.2 * s", "rectangle": ["0.1 * s", "0.1 * s"], "chamfer": 0.3},
            ]
        },
        parameters={"s": parameter(1.0)},
    )
    grown, plain = spec.resolve({"s": scale}).trunk, spec.resolve().trunk
    assert grown.mass == pytest.approx(scale**3 * plain.mass)
    assert spec.root is not None
    assert BOX["axis"] == spec.root.axis


@pytest.mark.parametrize("people", ["humanoid", "quadruped"])
def test_a_link_of_no_class_is_priced_by_its_length_and_says_so(people: str) -> None:
    other = population(people).segments["other"]
    member = {"axis": "-z", "length": 0.25, "segment": "other"}
    design = robot(leg(shank={"link": member}), population=people).resolve()
    assert _of(design, "shank").mass == pytest.approx(other.coefficient * 0.25)
    record = next(s for s in report(design)["segments"] if s["segment"] == "other")
    assert (record["origin"], record["n"]) == ("trend", other.n)
    assert record["in_sample_error"] == other.fold
    _, spreads = mass_spreads(design)
    own = next(s for s in spreads if s.mass == pytest.approx(other.coefficient * 0.25))
    assert own.sigma == math.sqrt(math.pi / 2) * math.log(other.fold or math.nan)


def _two_sided(left: float, right: float, moved: float = 0.0) -> draft.Design:
    """A robot whose left and right legs have chains of their own."""
    sides = {"l": left, "r": right}
    chains = {
        side: leg(thigh={"link": {"axis": "-z", "length": length, "segment": "thigh"}})
        for side, length in sides.items()
    }
    chains["r"][2]["joint"] = {**chains["r"][2]["joint"], "range": [-2 + moved, 2]}
    hung = [
        {"chain": side, "prefix": f"{side}_", "at": [0, 0.2 * (1 if side == "l" else -1), -0.2]}
        for side in sides
    ]
    return robot(children=hung, chains=chains).resolve()


def test_legs_that_weigh_the_same_are_one_row_of_the_masses() -> None:
    design = _two_sided(0.3, 0.3, moved=0.1)
    assert len(design.segments) > 2  # each side of its own
    rows = dict(mass_parts(design))
    assert {"2 × thigh", "2 × shank"} < set(rows)
    assert sum(rows.values()) == pytest.approx(float(design.mass))


def test_legs_that_differ_are_told_apart_by_their_names() -> None:
    design = _two_sided(0.3, 0.25)
    rows = mass_parts(design)
    assert {"1 × l_thigh", "1 × r_thigh", "2 × shank"} < {label for label, _ in rows}
    assert len(dict(rows)) == len(rows)
    assert sum(mass for _, mass in rows) == pytest.approx(float(design.mass))
