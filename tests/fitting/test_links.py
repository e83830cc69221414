"""Laws of the links of arms and hands are what the code gives, and say what they rest on."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import draft
from draft.design.report import report
from draft.fitting.structure.links import link_trends
from draft.laws.structure import LINKS, link_laws, population
from tests import fixed
from tests.fitting.test_limits import SHARED

DOCS = Path(__file__).parents[2] / "docs" / "structure-trends.md"


def test_the_file_is_what_the_fit_gives() -> None:
    assert json.loads(LINKS.read_text(encoding="utf-8")) == json.loads(json.dumps(link_trends()))


def test_fingers_are_fitted_to_twelve_links_of_five_hands() -> None:
    law = link_laws()["finger"]
    assert (law.formula, law.n) == ("m = 6.05 L^1.97", 12)
    assert law.fold == pytest.approx(1.452, abs=5e-4)
    assert law.held_out["maker"] == pytest.approx(1.667, abs=5e-4)


def test_the_links_of_arms_lie_in_the_middle_of_their_span() -> None:
    cobot, light = link_laws()["cobot_link"], link_laws()["light_link"]
    assert cobot(1.0) == pytest.approx((6 * 14) ** 0.5)
    assert light(1.0) == pytest.approx(0.75)
    assert cobot.band(0.9) == pytest.approx(1.63, abs=0.01)


def test_the_page_states_every_law() -> None:
    text = " ".join(DOCS.read_text(encoding="utf-8").split())
    for name, law in link_laws().items():
        held = f"{law.held_out['maker']:.2f}" if law.held_out else "-"
        assert f"| `{name}` | {law.formula} | {law.n} | {held} | {law.band(0.9):.2f} |" in text


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the gathered data")
def test_the_shipped_fingers_are_the_gathered_ones() -> None:
    def of(path: Path) -> list[dict[str, str]]:
        with path.open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    shipped = of(Path(draft.__file__).parent / "fitting/data/phalanges.csv")
    gathered = of(SHARED / "phalanges.csv")
    assert [(r["hand"], r["link"]) for r in shipped] == [(r["hand"], r["link"]) for r in gathered]
    for ours, theirs in zip(shipped, gathered, strict=True):
        assert float(ours["mass_kg"]) == pytest.approx(float(theirs["mass_g"]) / 1000)
        assert float(ours["length_m"]) == pytest.approx(float(theirs["length_mm"]) / 1000)


@pytest.mark.parametrize("name", ["humanoid", "quadruped"])
def test_every_population_knows_the_links_of_arms_and_hands(name: str) -> None:
    laws = population(name)
    assert list(laws.segments)[-4:] == ["finger", "cobot_link", "light_link", "other"]
    assert laws.origin("finger") == "finger"
    assert laws.origin("thigh") == f"{name} thigh"


def arm(segment: str) -> draft.Design:
    tree = fixed.ARM_TREE.replace(
        "length: forearm_length, mass: 1.2", f"length: forearm_length, segment: {segment}"
    )
    return draft.Spec.parse({**fixed.ARM, "tree.yaml": tree}).resolve()


def test_the_link_of_a_cobot_weighs_by_its_length_and_has_a_band() -> None:
    design = arm("cobot_link")
    (segment,) = [one for one in design.segments if one.trend is not None]
    assert segment.mass == pytest.approx(link_laws()["cobot_link"](0.35))
    (row,) = [row for row in report(design)["segments"] if row["origin"] == "trend"]
    assert row["source"] == "draft/fitting/data/arms.csv; docs/structure-trends.md"
    assert "whole_robot_held_out_error" not in row  # That of robots with legs.
    assert not [one for one in design.findings if one.where == design.name]


def test_an_arm_weighed_as_robots_with_legs_is_told_so_and_what_to_use() -> None:
    (finding,) = [one for one in arm("forearm").findings if one.where == "tester_arm"]
    assert "surveyed humanoids, robots with legs" in finding.message
    assert "finger or cobot_link or light_link" in finding.message
