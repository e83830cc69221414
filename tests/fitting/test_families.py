"""Robots of one maker do not tell what longer legs alone do to a trunk, and the docs say so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from draft.fitting.structure import families
from draft.fitting.structure.attribution import Machine, Piece

DOCS = Path(__file__).parents[2] / "docs" / "structure-trends.md"
# Population -> exponent and standard error over all makers, and within a maker; robots of each.
EXPONENTS = {
    "quadruped": ((1.297, 0.495, 20), (2.382, 0.763, 15)),
    "humanoid": ((0.854, 0.270, 29), (0.136, 0.424, 23)),
}


@pytest.mark.parametrize("name", EXPONENTS)
def test_the_exponents_of_the_leg_length_are_those_of_the_docs(name: str) -> None:
    robots = families.surveyed(name)
    text = DOCS.read_text(encoding="utf-8")
    for within, known in zip((False, True), EXPONENTS[name], strict=True):
        found = families.exponent(robots, within)
        assert (found.value, found.error, found.n) == pytest.approx(known, abs=1e-3)
        low, high = found.value - 2 * found.error, found.value + 2 * found.error
        assert f"{found.value:.2f} ({low:.2f} to {high:.2f})" in text


def test_few_pairs_differ_in_their_legs_alone_and_they_disagree() -> None:
    found = [pair for name in EXPONENTS for pair in families.pairs(families.surveyed(name))]
    assert len(found) == 46
    alike = {pair.names: round(pair.exponent, 1) for pair in found if pair.alike}
    assert alike == {
        ("anymal_b", "anymal_c"): 9.8,
        ("anymal_b", "anymal_d"): 3.2,
        ("anymal_c", "anymal_d"): -0.1,
        ("limx_oli_d04", "limx_oli_d03"): -0.4,
        ("limx_oli_d04_hand", "limx_oli_d03"): -0.4,
    }


@pytest.mark.parametrize("true", [0.0, 2.0])
def test_an_exponent_that_all_trunks_follow_is_found(true: float) -> None:
    robots = families.surveyed("quadruped")
    made = [_with_trunk(robot, true, 50.0 + i) for i, robot in enumerate(robots)]
    same = [_with_trunk(robot, true, 50.0) for robot in robots]
    assert families.exponent(same, within=True).value == pytest.approx(true)
    assert families.exponent(same, within=False).error == pytest.approx(0.0, abs=1e-9)
    assert families.exponent(made, within=False).error > 1e-3


def _with_trunk(robot: Machine, exponent: float, factor: float) -> Machine:
    """The robot with a trunk of structural mass factor V^(1/2) L^exponent."""
    mass = factor * families.trunk_volume(robot) ** 0.5 * families.leg_length(robot) ** exponent
    whole = families.trunk_mass(robot)

    def weighed(piece: Piece) -> Piece:
        if piece.kind not in families.TRUNKS:
            return piece
        own = piece.actuators + piece.structure / whole * mass
        return replace(piece, row=replace(piece.row, mass=own))

    return replace(robot, pieces=tuple(map(weighed, robot.pieces)))
