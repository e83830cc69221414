"""The design filter speaks of the design that deserves it, and is silent on its neighbour."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.design.checks import ERRORS, KINDS
from draft.design.filter_actuators import highest
from draft.design.findings import Finding, grouped, note
from draft.laws.actuators import laws
from draft.laws.catalogue import aspect_range, catalogue
from draft.laws.structure import population
from tests.helpers import DRIVE, ids, leg, parameter, robot

QUADRUPED = draft.load("quadruped")
LEGGED = robot()
PEOPLE = population("quadruped")
OVER, UNDER = 1.001, 0.999
ratios = st.floats(1, 300)


def _most(quantity: str, ratio: float) -> float:
    """The most of any family, faded outside its range of reductions."""
    parts = catalogue().values()
    families: dict[str, list[float]] = {}
    for part in parts:
        if part.gear_ratio is not None:
            families.setdefault(part.family, []).append(part.gear_ratio)
    limits = []
    for name, own in families.items():
        most = max(getattr(p, quantity) for p in parts if p.family == name)
        below, beyond = min(1.0, ratio / min(own)), min(1.0, max(own) / ratio)
        below **= 1 if name == "QDD" else 8
        beyond **= 1 if name == "HighGR" else 8
        if name == "QDD" and quantity == "power_density":
            below = 1.0
        limits.append(most * below * (1.0 if quantity == "peak_torque" else beyond))
    return max(limits)


def _with(**quantities: float) -> set[str]:
    """Findings about the test robot's actuator class with these quantities stated."""
    design = LEGGED.resolve({f"actuators.leg.{name}": x for name, x in quantities.items()})
    return {finding.id for finding in design.findings if finding.where == "leg"}


@given(ratios)
def test_torque_beyond_every_module_of_such_a_reduction_is_refused(ratio: float) -> None:
    most = _most("peak_torque", ratio)
    assert "torque" in _with(peak_torque=most * OVER, gear_ratio=ratio)
    assert "torque" not in _with(peak_torque=most, gear_ratio=ratio)


@given(ratios, st.floats(5, 300))
def test_torque_per_mass_beyond_every_module_is_refused(ratio: float, torque: float) -> None:
    lightest = torque / _most("torque_density", ratio)
    stated = {"peak_torque": torque, "gear_ratio": ratio}
    assert "torque_density" in _with(**stated, mass=lightest * UNDER)
    assert "torque_density" not in _with(**stated, mass=lightest)


@given(ratios, st.floats(5, 300))
def test_power_per_mass_beyond_every_module_is_refused(ratio: float, speed: float) -> None:
    most = _most("power_density", ratio)
    stated = {"peak_torque": 60.0, "mass": 2.0, "gear_ratio": ratio}
    fastest = most * 4 * 2.0 / 60.0
    assert "power_density" in _with(**stated, no_load_speed=fastest * OVER)
    assert "power_density" not in _with(**stated, no_load_speed=fastest)


@pytest.mark.parametrize("kind", ["torque", "torque_density", "power_density"])
@given(st.floats(0.5, 400))
def test_limits_change_continuously_with_the_reduction(kind: str, ratio: float) -> None:
    below, _ = highest(kind, ratio)
    above, _ = highest(kind, ratio * (1 + 1e-6))
    assert above == pytest.approx(below, rel=1e-5)


def test_no_reduction_just_outside_the_catalogue_opens_a_hole() -> None:
    for ratio in (5.9, 6.0, 6.1):
        assert "torque" in _with(peak_torque=400.0, gear_ratio=ratio)


@pytest.mark.parametrize("name", sorted(catalogue()))
def test_no_module_of_the_catalogue_is_refused_as_it_is(name: str) -> None:
    design = LEGGED.resolve(
        {"actuators.leg.like": name}
        | {f"actuators.leg.{q}": None for q in ("peak_torque", "no_load_speed", "gear_ratio")}
    )
    found = {f.id for f in design.findings if f.where == "leg"}
    assert not found & (ERRORS | {"aspect_ratio"})


def test_a_shape_outside_the_catalogues_is_remarked_on() -> None:
    low, high = aspect_range()
    assert "aspect_ratio" in _with(aspect_ratio=low * UNDER)
    assert "aspect_ratio" in _with(aspect_ratio=high * OVER)
    assert "aspect_ratio" not in _with(aspect_ratio=low) | _with(aspect_ratio=high)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_reduction_far_from_what_its_speed_has_is_remarked_on(sign: int) -> None:
    law = laws().trends["gear_ratio"]
    edge = float(law(20.0)) * law.band(0.9) ** sign
    outer, inner = (OVER, UNDER) if sign > 0 else (UNDER, OVER)
    assert "gear_ratio" in _with(gear_ratio=edge * outer, no_load_speed=20.0)
    assert "gear_ratio" not in _with(gear_ratio=edge * inner, no_load_speed=20.0)


@pytest.mark.parametrize(
    ("quantity", "other"),
    [
        ("peak_torque", {"gear_ratio": 15.0}),
        ("gear_ratio", {"peak_torque": 60.0}),
    ],
)
def test_a_trend_used_outside_its_modules_is_remarked_on(
    quantity: str, other: dict[str, float]
) -> None:
    low, high = laws().trends["volume"].ranges[quantity]
    free = LEGGED.resolve
    for value, outside in ((low * UNDER, True), (low, False), (high, False), (high * OVER, True)):
        stated = {f"actuators.leg.{k}": v for k, v in {**other, quantity: value}.items()}
        design = free({"actuators.leg.no_load_speed": None, **stated})
        found = [f for f in design.findings if (f.id, f.where) == ("outside_data", "leg")]
        assert any(f"{quantity} " in f.message for f in found) == outside


@pytest.mark.parametrize("name", ["thigh", "shank"])
def test_a_segment_outside_its_surveyed_lengths_is_remarked_on(name: str) -> None:
    low, high = PEOPLE.segments[name].range
    for length, outside in (
        (low - 0.001, True),
        (low, False),
        (high, False),
        (high + 0.001, True),
    ):
        link = {"axis": "-z", "length": length, "segment": name}
        design = robot(leg(**{name: {"link": link}})).resolve()
        assert any((f.id, f.where) == ("outside_data", name) for f in design.findings) == outside


@pytest.mark.parametrize(("factor", "heavy"), [(2 * OVER, True), (2 * UNDER, False)])
def test_a_stated_mass_above_twice_the_classs_is_remarked_on(factor: float, heavy: bool) -> None:
    mass = factor * float(PEOPLE.segments["thigh"](0.3))
    link = {"axis": "-z", "length": 0.3, "segment": "thigh", "mass": mass}
    design = robot(leg(thigh={"link": link})).resolve()
    assert [f.where for f in design.findings if f.id == "heavy_link"] == ["thigh"] * heavy


def _hung(legs: int) -> list[dict[str, Any]]:
    return [
        {"chain": "leg", "prefix": f"l{k}_", "at": [0.4 * (k - legs / 2), 0, -0.2]}
        for k in range(legs)
    ]


def _of_mass(mass: float, legs: int = 4, motor: float = 1.0) -> draft.Design:
    """The test robot on some legs, with actuators [kg] and a trunk that brings it to a mass."""
    spec = robot(
        children=_hung(legs),
        root={"density": "rho"},
        parameters={"rho": parameter(1.0)},
        actuators={"leg": {**DRIVE, "mass": motor}},
    )
    bare, volume = spec.resolve({"rho": 0.001}), 0.4 * 0.2 * 0.1
    return spec.resolve({"rho": 0.001 + (mass - float(bare.mass)) / volume})


def test_actuators_outside_the_populations_share_of_mass_are_remarked_on() -> None:
    low, _, high = PEOPLE.share
    for share, outside in (
        (low * UNDER, True),
        (low * OVER, False),
        (high * UNDER, False),
        (high * OVER, True),
    ):
        design = _of_mass(2 * 4 * 4 / share, motor=4)
        assert design.actuator_mass / design.mass == pytest.approx(share)
        assert ("actuator_share" in ids(design)) == outside


def test_a_mass_outside_the_allometrys_95_percent_band_is_remarked_on() -> None:
    a = PEOPLE.allometry
    usual = a.coefficient * (0.3 + 0.25) ** a.exponent
    fold = 2.718281828459045 ** (1.96 * a.sigma)
    for mass, outside in (
        (usual / fold * UNDER, True),
        (usual / fold * OVER, False),
        (usual * fold * UNDER, False),
        (usual * fold * OVER, True),
    ):
        assert ("total_mass" in ids(_of_mass(mass))) == outside


@pytest.mark.parametrize("legs", [3, 4, 5, 6, 8])
def test_a_robot_is_weighed_by_its_own_number_of_legs(legs: int) -> None:
    a = PEOPLE.allometry
    usual = legs / 4 * a.coefficient * (0.3 + 0.25) ** a.exponent
    fold = 2.718281828459045 ** (1.96 * a.sigma)
    assert "total_mass" not in ids(_of_mass(usual * fold * UNDER, legs))
    (found,) = (f for f in _of_mass(usual * fold * OVER, legs).findings if f.id == "total_mass")
    assert found.limit == pytest.approx(usual)
    assert (f"for {legs} legs instead of 4" in found.message) == (legs != 4)


@pytest.mark.parametrize("legs", [1, 2])
@pytest.mark.parametrize("mass", [15, 500])
def test_a_hopper_is_not_weighed_against_quadrupeds(legs: int, mass: float) -> None:
    assert not {"total_mass", "actuator_share"} & ids(_of_mass(mass, legs))


def test_limbs_in_the_same_place_are_remarked_on_and_limbs_apart_are_not() -> None:
    radius = float(LEGGED.resolve().actuators["leg"].radius)
    for spacing, near in ((0.9 * radius, True), (1.1 * radius, False)):
        children = [
            {"chain": "leg", "prefix": "L_", "at": [0, spacing, -0.2]},
            {"chain": "leg", "prefix": "R_", "at": [0, spacing, -0.2], "mirror": "y"},
        ]
        chain = leg(thigh={"motor": {"actuator": "leg", "axis": "z"}})
        found = ids(robot(chain, children).resolve())
        assert ("limb_overlap" in found) == near


SMALL = {"leg": {**DRIVE, "radius": 0.03, "length": 0.06}}


def _hinged(reach: float, shift: list[float], limits: list[float], axis: str = "y") -> draft.Design:
    """A hip motor `shift` away from a hip about x, whose thigh carries the knee motor."""
    first, thigh, shank = leg(
        housing={"motor": {"actuator": "leg", "axis": axis, "shift": shift}},
        thigh={"link": {"axis": "-z", "length": reach, "segment": "thigh"}},
    )
    home = (limits[0] + limits[1]) / 2
    thigh["joint"] |= {"range": limits, "home": home}
    return robot([first, thigh, shank], actuators=SMALL).resolve()


@pytest.mark.parametrize(
    ("reach", "shift", "limits", "refused"),
    [
        # On the joint's own axis, turning changes nothing: only the distance does.
        pytest.param(0.04, [0, 0, 0], [-1, 1], True, id="near the joint"),
        pytest.param(0.08, [0, 0, 0], [-1, 1], False, id="far from the joint"),
        # Off the axis, the thigh swings its motor away from the hip's, if the joint lets it.
        pytest.param(0.1, [0, 0, -0.1], [-0.1, 0.1], True, id="a joint too stiff to part them"),
        pytest.param(0.1, [0, 0, -0.1], [-0.1, 1.5], False, id="a joint that parts them upwards"),
        pytest.param(0.1, [0, 0, -0.1], [-1.5, 0.1], False, id="a joint that parts them downwards"),
        pytest.param(0.1, [0, 0, -0.1], [-6.2, 6.2], False, id="a joint that turns all the way"),
        # At zero they are apart, but zero is out of reach.
        pytest.param(0.1, [0, 0.1, 0], [1.5, 1.6], True, id="together wherever the joint reaches"),
        pytest.param(0.1, [0, 0.1, 0], [-1.6, -1.5], False, id="apart wherever the joint reaches"),
        pytest.param(0.1, [0, 0.1, 0], [0.2, 1.6], False, id="apart where the joint begins"),
    ],
)
def test_actuators_that_no_angle_parts_are_refused(
    reach: float, shift: list[float], limits: list[float], refused: bool
) -> None:
    axis = "x" if shift == [0, 0, 0] else "y"
    design = _hinged(reach, shift, limits, axis)
    found = [f.where for f in design.findings if f.id == "actuator_overlap"]
    assert found == ["housing/thigh"] * refused
    assert design.accepted != refused


@pytest.mark.parametrize(("distance", "refused"), [(0.055, True), (0.061, False)])
def test_actuators_bolted_together_are_refused_where_they_meet(
    distance: float, refused: bool
) -> None:
    first, thigh, shank = leg(thigh={"joint": None, "motor": {"actuator": "leg", "axis": "x"}})
    thigh["link"] = {"axis": "-z", "length": distance, "segment": "thigh"}
    ankle = {
        "name": "toe",
        "joint": {"name": "ankle", "axis": "y", "range": [-1, 1], "actuator": "leg"},
        "link": {"axis": "-z", "length": 0.1, "segment": "shank"},
    }
    design = robot([first, thigh, shank, ankle], actuators=SMALL).resolve()
    assert ("actuator_overlap" in ids(design)) == refused


@pytest.mark.parametrize("name", [None, *QUADRUPED.designs])
def test_ten_times_the_torque_is_refused_by_the_classs_name(name: str | None) -> None:
    torque = QUADRUPED.resolve(name).actuators["leg"].peak_torque
    design = QUADRUPED.resolve(name, {"actuators.leg.peak_torque": 10 * torque})
    assert not design.accepted
    errors = [f for f in design.findings if f.severity == "error" and f.where == "leg"]
    assert errors
    assert all("'leg'" in f.message for f in errors)
    with pytest.raises(draft.RefusedError, match="'leg'"):
        design.build()


def _torque(*allow: str) -> tuple[draft.Design, Finding]:
    """The test robot with too much torque, and the finding about it."""
    heavy = {"leg": {**SMALL["leg"], "peak_torque": 5000, "mass": 90}}
    design = robot(actuators=heavy, allow=list(allow)).resolve()
    return design, next(f for f in design.findings if f.id == "torque")


@pytest.mark.parametrize("item", ["torque", "torque:leg"])
def test_an_allowed_error_stays_as_a_warning_and_names_what_allows_it(item: str) -> None:
    design, finding = _torque(item)
    assert (finding.severity, finding.allowed, finding.remedy) == ("warning", item, "")
    assert design.accepted
    assert design.build().mujoco.nbody == 5


@pytest.mark.parametrize("allow", [[], ["torque:thigh"], ["power_density"]], ids=str)
def test_an_error_that_is_not_the_allowed_one_refuses(allow: list[str]) -> None:
    design, finding = _torque(*allow)
    assert finding.severity == "error"
    assert "add 'torque:leg' to 'allow'" in finding.remedy
    with pytest.raises(draft.RefusedError):
        design.build()


def test_only_errors_have_a_remedy_and_every_kind_is_explained() -> None:
    assert set(KINDS) >= ERRORS
    _, finding = _torque()
    record = finding.record()
    assert record["limit"] == _most("peak_torque", 15.0)
    assert record["value"] == 5000
    assert " N m of 'leg'" in record["message"]


# --- places --------------------------------------------------------------------------------


def test_a_part_below_the_feet_is_remarked_on() -> None:
    low = {"name": "low", "type": "box", "at": [0, 0, 0.0]}
    for depth, found in ((-0.9, True), (-0.3, False)):
        box = {"size": [0.05, 0.05, 0.05], "mass": 0.1, "shift": [0.4, 0, depth]}
        children = [{"chain": "leg", "at": [0, 0, -0.2]}, {**low, "box": box}]
        design = robot(children=children).resolve()
        places = [f.where for f in design.findings if f.id == "below_floor"]
        assert places == (["low"] if found else [])


def test_a_section_far_off_its_own_width_is_remarked_on() -> None:
    def sections(offset: float) -> dict[str, object]:
        return {
            "sections": [
                {"at": at, "rectangle": [0.2, 0.1], "offset": [y, 0.0]}
                for at, y in ((-0.2, 0.0), (0.0, offset), (0.2, 0.0))
            ]
        }

    near, far = (robot(root=sections(offset)).resolve() for offset in (0.15, 0.25))
    assert "trunk_section" not in {f.id for f in near.findings}
    found = [f for f in far.findings if f.id == "trunk_section"]
    assert "section 2 of the trunk is 1.25 of its own widths" in found[0].message


def test_an_actuator_class_that_no_joint_uses_is_remarked_on() -> None:
    spec = robot(actuators={"leg": DRIVE, "spare": DRIVE})
    (found,) = [f for f in spec.resolve().findings if f.id == "unused_class"]
    assert (found.where, found.severity) == ("spare", "warning")


@pytest.mark.parametrize(("at", "remark"), [(None, False), (-0.3, False), (-0.2, True)])
def test_a_link_drawn_beyond_the_next_joint_is_remarked_on(at: float | None, remark: bool) -> None:
    shank = {} if at is None else {"shank": {"at": [0, 0, at]}}
    design = robot(leg(**shank)).resolve()
    found = [f.message for f in design.findings if f.id == "off_tip"]
    assert len(found) == remark
    if remark:
        (message,) = found
        assert "'thigh' are drawn 0.3 m long and count as 0.2 m" in message
        assert "'at' of 'shank' is not at the tip" in message
    length = next(s.length for s in design.segments if s.label == "thigh")
    assert length == pytest.approx(0.2 if remark else 0.3)


def test_people_read_warnings_once_for_a_class_of_parts_and_each_error() -> None:
    floor = [
        one
        for i in range(5)
        for one in note(
            *("below_floor", f"finger_{i}", True, f"'finger_{i}' is {{value}} below the feet"),
            *("home pose", 0.01 * (1 + i % 3), None, "m"),
        )
    ]
    errors = [one for k in "ab" for one in note("torque", k, True, f"'{k}' is beyond", "catalogue")]
    shown = grouped([*floor, *errors])
    assert shown[:2] == errors
    (told,) = shown[2:]
    places = "'finger_0', 'finger_1', 'finger_3' and 1 more"
    assert told.message == f"'finger_2' is 0.03 m below the feet; 4 more like it: {places}"
    assert grouped([floor[0]]) == [floor[0]]


def test_classes_with_limits_of_their_own_stay_apart() -> None:
    design = draft.load("quadruped").resolve({"thigh_length": 0.45, "shank_length": 0.5})
    lengths = [one for one in design.findings if one.id == "outside_data"]
    classes = {one.text.partition("outside ")[2] for one in lengths}
    assert len(classes) > 1
    shown = [one for one in grouped(design.findings) if one.id == "outside_data"]
    assert len(shown) == len(classes)
