"""The calibrated law of the trunk: seen by whole designs, continuous, and never with a jump."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.design.bands import mass_spreads
from draft.design.report import report
from draft.errors import DraftError
from draft.laws.structure import FILE, population, read_population
from draft.spec import schema
from draft.spec.expressions import parse
from draft.spec.primitives.root import WrittenRoot
from draft.values import scalar
from tests.helpers import leg, robot

PAPER = draft.load("quadruped")
CALIBRATED = replace(PAPER, structure="calibrated")
LAWS = {name: population(name, "calibrated").calibrated for name in ("humanoid", "quadruped")}
people = st.sampled_from(sorted(LAWS))
volumes, legs = st.floats(1e-4, 1.0), st.floats(0.05, 3.0)
steps = st.floats(1e-9, 1e-2)


def test_the_published_designs_state_the_published_law() -> None:
    assert PAPER.structure == draft.load("humanoid").structure == "paper"
    masses = [PAPER.resolve(name).mass for name in ("cheetah", "bear", "giraffe")]
    assert masses == pytest.approx([33.61, 112.74, 93.04], rel=2e-4)


def test_a_robot_that_says_nothing_has_the_calibrated_law() -> None:
    assert robot().structure == schema.ParametersFile.model_fields["structure"].default
    assert robot().structure == "calibrated"
    assert population("quadruped").uses == population("humanoid").uses == "calibrated"


def _on_legs(people: str, legs: int) -> draft.Design:
    """A robot on the small leg, so many times."""
    hung = [{"chain": "leg", "prefix": f"leg{k}_", "at": [0.1 * k, 0, -0.2]} for k in range(legs)]
    return robot(children=hung, population=people).resolve()


@pytest.mark.parametrize("people", sorted(LAWS))
@pytest.mark.parametrize("legs", [1, 2, 3, 4, 6])
def test_the_law_holds_for_as_many_legs_as_the_surveyed_robots_have(people: str, legs: int) -> None:
    design = _on_legs(people, legs)
    published = population(people).trunk_density
    assert (design.trunk.density == published) == (legs != {"humanoid": 2, "quadruped": 4}[people])
    told = report(design)["trunk"]["density_kg_m3"]["fit"]
    assert told.startswith("median") == (design.trunk.density == published)


def test_a_hopper_keeps_the_published_density() -> None:
    hopper = draft.load("hopper")
    assert hopper.structure == "calibrated"
    assert hopper.resolve().trunk.density == population("quadruped").trunk_density


def test_a_trunk_weighs_by_its_volume_and_the_leg_length() -> None:
    design = CALIBRATED.resolve("cheetah")
    assert design.leg_length is not None
    density = 306.7367 * design.trunk.loft.volume**-0.5 * design.leg_length**1.931889
    assert design.trunk.density == pytest.approx(density, rel=1e-6)
    assert design.trunk.mass == pytest.approx(density * design.trunk.loft.volume, rel=1e-6)


@given(people, volumes, legs)
def test_outside_the_survey_the_density_is_that_at_the_edge(
    name: str, volume: float, length: float
) -> None:
    law = LAWS[name]
    inside = [
        min(max(x, law.ranges[key][0]), law.ranges[key][1])
        for key, x in (("volume", volume), ("leg_length", length))
    ]
    factor, (of_volume, of_leg) = law.terms[0].factor, law.terms[0].exponents
    assert law(volume, length) == pytest.approx(
        factor * inside[0] ** of_volume * inside[1] ** of_leg
    )


@given(people, volumes, legs, steps, steps)
def test_a_trunk_never_jumps(name: str, volume: float, length: float, a: float, b: float) -> None:
    law = LAWS[name]
    before = volume * law(volume, length)
    after = volume * (1 + a) * law(volume * (1 + a), length * (1 + b))
    assert before < after * (1 + 1e-12)
    assert math.log(after / before) <= 1.0 * a + 2.0 * b + 1e-9


@given(st.floats(0.1, 0.9), st.floats(0.1, 0.9), st.floats(0.2, 1.5), st.floats(1e-9, 1e-3))
def test_the_total_mass_of_a_design_never_jumps(
    thigh: float, shank: float, trunk: float, step: float
) -> None:
    def mass(by: float) -> float:
        design = CALIBRATED.resolve(
            {
                "thigh_length": min(thigh * by, 0.9),
                "shank_length": min(shank * by, 0.9),
                "trunk_length": min(trunk * by, 1.5),
            }
        )
        return scalar(design.mass)

    # Of the laws of all parts, a thigh's is the steepest: m = c L^2.69.
    assert abs(math.log(mass(1 + step) / mass(1.0))) <= 3.0 * step


@pytest.mark.parametrize("people", sorted(LAWS))
@pytest.mark.parametrize("end", [0, 1])
def test_the_total_does_not_jump_where_the_surveyed_legs_end(people: str, end: int) -> None:
    """Legs a hair inside and a hair outside the surveyed range: masses a hair apart."""
    spec = replace(draft.load(people), structure="calibrated")
    edge = LAWS[people].ranges["leg_length"][end]

    def resolved(shank: float) -> draft.Design:
        return spec.resolve({"thigh_length": edge / 2, "shank_length": shank})

    whole = resolved(edge / 2).leg_length
    assert whole is not None
    at_edge = edge / 2 + edge - scalar(whole)  # the shank counts as it is, the thigh to its joint
    hair = 1e-7
    shorter, longer = resolved(at_edge * (1 - hair)), resolved(at_edge * (1 + hair))
    assert scalar(shorter.leg_length or 0) < edge < scalar(longer.leg_length or 0)
    assert 0 < math.log(scalar(longer.mass) / scalar(shorter.mass)) < 10 * hair


def test_no_giraffe_of_269_kg() -> None:
    giraffe = CALIBRATED.resolve("giraffe")
    record = report(giraffe)
    assert record["mass_by_leg_length"]["mass_kg"] > 250
    assert giraffe.mass < 125
    (volume, length) = (f for f in giraffe.findings if "trunk is that at the edge" in f.text)
    assert (volume.id, volume.unit, length.unit) == ("outside_data", "m3", "m")
    assert length.value == giraffe.leg_length
    assert not any("trunk is that" in f.text for f in CALIBRATED.resolve("cheetah").findings)


def test_a_report_names_the_law_and_its_error() -> None:
    paper, ours = (report(spec.resolve("cheetah")) for spec in (PAPER, CALIBRATED))
    assert paper["trunk"]["density_kg_m3"]["fit"] == "median structural mass / volume of the trunk"
    assert ours["trunk"]["density_kg_m3"]["fit"].startswith("calibrated: density = 306.7 V^-0.5")
    errors = [r["segments"][0]["whole_robot_held_out_error"] for r in (paper, ours)]
    assert errors == pytest.approx([1.1796, 1.1438], abs=1e-4)


def test_a_band_is_that_of_the_law() -> None:
    design = CALIBRATED.resolve("cheetah")
    (trunk,) = [s for s in mass_spreads(design)[1] if s.mass == design.trunk.mass]
    assert trunk.sigma == LAWS["quadruped"].sigma
    low, high = design.mass_band()
    published = PAPER.resolve("cheetah").mass_band()
    assert high / low < published.high / published.low


def test_a_robot_without_thigh_and_shank_keeps_the_published_density() -> None:
    arm = robot(leg(thigh={"link": {"axis": "-z", "length": 0.3, "mass": 1.0}}))
    assert arm.resolve().leg_length is None
    ours = replace(arm, structure="calibrated").resolve()
    assert ours.trunk.density == population("quadruped").trunk_density


def test_a_stated_density_stays() -> None:
    stated = replace(robot(root={"density": 500.0}), structure="calibrated").resolve()
    assert stated.trunk.density == 500.0


def test_a_file_of_structure_trends_says_which_law_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["survey", "fit", "--out", "mine.json", "--structure", "calibrated"]) == 0
    assert read_population("quadruped", tmp_path / "mine.json").uses == "calibrated"
    # A file that was written before there were two laws has the published one.
    assert read_population("quadruped", FILE).uses == "paper"
    record = json.loads(Path("mine.json").read_text()) | {"structure": "guessed"}
    Path("mine.json").write_text(json.dumps(record))
    with pytest.raises(DraftError, match="holds no structure trends"):
        read_population("quadruped", tmp_path / "mine.json")


def test_a_trunk_of_a_stated_leg_length_keeps_its_mass_when_only_legs_change() -> None:
    own = CALIBRATED.resolve()
    held = replace(CALIBRATED, root=_held(PAPER, scalar(own.leg_length or 0)))
    for lengths in (0.25, 0.5, np.array([0.25, 0.3, 0.5])):
        longer = held.resolve({"thigh_length": lengths})
        assert longer.trunk.mass == pytest.approx(own.trunk.mass, rel=1e-12)
    # Without it, the trunk follows the legs.
    assert CALIBRATED.resolve({"thigh_length": 0.3}).trunk.mass > 1.15 * own.trunk.mass


def test_its_mass_changes_with_the_trunk_as_the_law_says_and_keeps_its_band() -> None:
    held = replace(PAPER, structure="calibrated", root=_held(PAPER, 0.5))
    before, after = held.resolve(), held.resolve({"trunk_length": 0.8})
    volumes = after.trunk.loft.volume / before.trunk.loft.volume
    assert after.trunk.mass / before.trunk.mass == pytest.approx(volumes**0.5)
    (trunk,) = [s for s in mass_spreads(after)[1] if s.mass == after.trunk.mass]
    assert trunk.sigma == LAWS["quadruped"].sigma


def test_a_report_says_which_leg_length_the_trunk_has() -> None:
    held = replace(PAPER, structure="calibrated", root=_held(PAPER, 0.5)).resolve()
    own = CALIBRATED.resolve()
    stated, design = (report(one)["trunk"]["density_kg_m3"] for one in (held, own))
    assert (stated["inputs"]["leg_length"], stated["leg_length_origin"]) == (0.5, "stated")
    assert stated["fit"].endswith(
        "L = thigh + shank = 0.5 m, stated in root.yaml: the legs do not change the trunk"
    )
    assert (design["inputs"]["leg_length"], design["leg_length_origin"]) == (
        own.leg_length,
        "design",
    )
    assert design["fit"].endswith("m, of this design: longer legs make the trunk denser")
    assert "inputs" not in report(PAPER.resolve())["trunk"]["density_kg_m3"]


def _held(spec: draft.Spec, leg: float) -> WrittenRoot:
    """Trunk of a spec with a stated leg length [m] for its law."""
    assert spec.root is not None
    return replace(spec.root, leg_length=parse(leg, spec.root.where))
