"""What docs/structure-trends.md tells of the published designs and of what is left out is so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import draft
from draft.fitting.structure.robots import robots
from draft.laws.structure import population
from draft.values import scalar

TEXT = " ".join(
    (Path(__file__).resolve().parents[2] / "docs" / "structure-trends.md")
    .read_text(encoding="utf-8")
    .split()
)
QUADRUPED = draft.load("quadruped")
DESIGNS = ("cheetah", "bear", "giraffe")
# Total mass as printed [kg].
PRINTED = {"cheetah": 33, "bear": 110, "giraffe": 91}


def _told(words: str, numbers: list[float]) -> None:
    """Check that the page has a sentence with numbers, rounded as there."""
    assert words.format(*numbers) in TEXT


def test_outside_the_data_the_mass_per_metre_is_held() -> None:
    giraffe = QUADRUPED.resolve("giraffe")
    mass = scalar(giraffe.mass)
    for segment in giraffe.segments:
        law = population("quadruped").segments[segment.trend or ""]
        free = scalar(replace(law, beyond="law")(segment.length))
        mass += segment.copies * (free - scalar(segment.mass))
    _told("would give the giraffe {:.0f} kg instead of {:.0f} kg", [mass, scalar(giraffe.mass)])


def test_the_designs_weigh_two_per_cent_more_than_printed_for_the_reasons_told() -> None:
    own = [QUADRUPED.resolve(name) for name in DESIGNS]
    over = [scalar(d.mass) / PRINTED[n] for n, d in zip(DESIGNS, own, strict=True)]
    assert over == pytest.approx([1.02, 1.02, 1.02], abs=0.006)
    _told("{:.1f}, {:.1f} and {:.1f} kg for 33, 110 and 91", [scalar(d.mass) for d in own])
    law = population("quadruped").segments["thigh"]
    hips = []
    for design in own:
        (thigh,) = [s for s in design.segments if s.trend == "thigh"]
        straight = scalar(law(design.parameters["thigh_length"]))
        hips.append(4 * (scalar(thigh.mass) - straight))
    _told("as in the survey: {:+.1f}, {:+.1f} and {:+.1f} kg", hips)
    paper = replace(QUADRUPED, trends="paper")
    by_law = [paper.resolve(name, {"actuators.leg.like": None}) for name in DESIGNS]
    trunks = [scalar(a.trunk.mass - b.trunk.mass) for a, b in zip(own, by_law, strict=True)]
    _told("that the published laws size: {:+.1f}, {:+.1f} and {:+.1f} kg", trunks)
    parts = [scalar(b.actuator_mass - a.actuator_mass) for a, b in zip(own, by_law, strict=True)]
    _told("weigh {:.1f}, {:.1f} and {:.1f} kg less than by the published laws", parts)
    _told("would weigh {:.1f}, {:.1f} and {:.1f} kg", [scalar(d.mass) for d in by_law])


def test_friction_values_are_taken_over_and_zero_where_none_is_stated() -> None:
    legs = [QUADRUPED.resolve(name).actuators["leg"] for name in DESIGNS]
    _told("({:.3f}, {:.3f}, {:.3f} N m;", [scalar(leg.friction_loss) for leg in legs])
    _told("{:.4f}, {:.4f}, {:.4f} N m s/rad)", [scalar(leg.damping) for leg in legs])
    humanoid = draft.load("humanoid").resolve()
    assert {scalar(a.friction_loss) for a in humanoid.actuators.values()} == {0.294}
    bare = {"actuators.leg.friction_loss": None, "actuators.leg.damping": None}
    hopper = draft.load("hopper").resolve(bare).actuators["leg"]
    assert (hopper.friction_loss, hopper.damping) == (0.0, 0.0)


def test_the_number_of_descriptions_is_told() -> None:
    assert len(robots()) == 66
    assert "66 of the 118 descriptions of the published survey are at hand" in TEXT


def test_a_robot_is_a_tree_and_closed_loops_are_said_to_be_left_out() -> None:
    for name in draft.shipped():
        bodies = draft.load(name).bodies
        assert all(
            body.parent is not None and body.parent < i for i, body in enumerate(bodies) if i
        )
        assert draft.load(name).resolve().build().mujoco.neq == 0
    assert "Closed loops are not modelled" in TEXT


def test_the_labels_and_the_digits_are_told() -> None:
    assert "| `released data` | from the data and code released with it | 36 of 103;" in TEXT
    assert "Actuators weigh 0.065255 tau^0.6662 kg" in TEXT
    assert "would change three of its figures" in TEXT
    assert "`structure: calibrated`, the default, uses both" in TEXT
