"""Designs side by side: the parts of a difference sum to it, and are those of closed forms."""

from __future__ import annotations

import math
import re
from itertools import permutations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.explore import comparison
from draft.explore.comparison import compare
from draft.explore.comparison_tables import section
from draft.metrics import of_design
from draft.spec import Spec
from draft.values import signed
from tests.commands import Command

QUADRUPED = draft.load("quadruped")
CHEETAH, BEAR = (QUADRUPED.resolve(name) for name in ("cheetah", "bear"))
OF = ("mass", "jump_height", "top_speed")


def test_the_shares_of_a_difference_sum_to_it() -> None:
    found = compare([CHEETAH, BEAR])
    part = found.parts[0]
    assert part is not None
    assert not part.exact
    known = np.isfinite(found.values).all(axis=0)
    total = np.where(known, found.values[1], 0.0) - np.where(known, found.values[0], 0.0)
    np.testing.assert_allclose(part.shares.sum(axis=0)[known], total[known], rtol=1e-9, atol=1e-12)
    at = part.names.index("actuators.leg.like")
    assert (part.before[at], part.after[at]) == ("MIT U12", "RMD-X15-P20-450-E")


@settings(max_examples=10)
@given(st.floats(0.2, 0.4), st.floats(60, 140), st.floats(15, 45))
def test_few_numbers_have_their_shapley_values(length: float, torque: float, speed: float) -> None:
    changes = {
        "thigh_length": length,
        "actuators.leg.peak_torque": torque,
        "actuators.leg.no_load_speed": speed,
    }
    other = QUADRUPED.resolve("cheetah", changes)
    part = compare([CHEETAH, other], OF).parts[0]
    assert part is not None
    assert part.exact
    wanted = {name: np.zeros(len(OF)) for name in changes}
    for order in permutations(changes):  # All orders, each design resolved on its own.
        for k, name in enumerate(order):
            ends = [
                of_design(QUADRUPED.resolve("cheetah", {n: changes[n] for n in some}), OF)
                for some in (order[:k], order[: k + 1])
            ]
            wanted[name] += [float(ends[1][m]) - float(ends[0][m]) for m in OF]
    for name, share in zip(part.names, part.shares, strict=True):
        np.testing.assert_allclose(share, wanted[name] / 6, rtol=1e-7, atol=1e-12)


def test_the_errors_of_laws_cancel_in_what_is_certain() -> None:
    longer = QUADRUPED.resolve("cheetah", {"thigh_length": 0.3})
    found = compare([CHEETAH, longer], ["mass", "leg_length", "top_speed"])
    part = found.parts[0]
    assert part is not None
    # The masses of both are known to a factor of two, and the longer one is heavier all the same.
    assert part.better[0] < 0.01
    assert math.isnan(part.better[1])  # Neither direction is better.


def test_a_design_is_as_good_as_itself() -> None:
    part = compare([BEAR, BEAR], ["mass"]).parts[0]
    assert part is not None
    assert part.names == ()
    assert part.better[0] == 0.5


def test_a_stated_number_that_a_law_gives_in_the_other_design_counts() -> None:
    heavy = QUADRUPED.resolve("cheetah", {"actuators.leg.mass": 2.0})
    part = compare([CHEETAH, heavy], ["mass"]).parts[0]
    assert part is not None
    assert part.names == ("actuators.leg.mass",)
    assert part.before == ("as in the robot",)
    assert part.shares[0, 0] == pytest.approx(12 * (2.0 - 1.1))


def test_a_payload_is_a_number_as_others() -> None:
    loaded = QUADRUPED.resolve("cheetah", {"payload": 5.0})
    for pair, sign in (((CHEETAH, loaded), 1), ((loaded, CHEETAH), -1)):
        part = compare(pair, ["mass"]).parts[0]
        assert part is not None
        assert part.names == ("payload",)
        assert part.shares[0, 0] == pytest.approx(sign * 5.0)


def test_other_robots_are_compared_by_metrics_alone(command: Command) -> None:
    found = compare([CHEETAH, draft.load("hopper").resolve()], ["mass"])
    assert found.parts == (None,)
    assert found.values.shape == (2, 1)
    said = command("compare cheetah hopper --of mass").out
    assert "another robot, so no number of one is one of the other" in said


def test_many_numbers_are_divided_by_samples_of_their_orders(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    changes = {"thigh_length": 0.35, "shank_length": 0.3, "actuators.leg.peak_torque": 90.0}
    other = QUADRUPED.resolve("cheetah", changes)
    exact = compare([CHEETAH, other], OF).parts[0]
    monkeypatch.setattr(comparison, "EXACT", 2)
    sampled = compare([CHEETAH, other], OF).parts[0]
    assert exact is not None
    assert sampled is not None
    assert (exact.exact, sampled.exact) == (True, False)
    size = abs(exact.shares).max(axis=0)
    assert (abs(sampled.shares - exact.shares) <= 0.1 * size).all()


def test_one_design_and_several_in_one_are_refused(command: Command) -> None:
    with pytest.raises(DraftError, match="there is nothing to compare"):
        draft.compare([CHEETAH])
    many = QUADRUPED.resolve({"thigh_length": np.array([0.2, 0.3])})
    with pytest.raises(DraftError, match="comparisons are of single designs"):
        draft.compare([CHEETAH, many])
    assert "two designs or more are compared" in command.refuses("compare cheetah")


def test_what_limits_each_is_told_with_its_margin(command: Command) -> None:
    record = command.json("compare cheetah bear --of payload_rated mass")["limits"]
    own = record["quadruped:bear"]["payload_rated"]
    assert (own["quantity"], own["actuator"]) == ("rated torque", "leg")
    assert own["joints"] == ["FL_knee", "FR_knee", "RL_knee", "RR_knee"]
    assert own["value"] == of_design(BEAR, ["payload_rated"])["payload_rated"]
    assert own["margin"] == pytest.approx(own["next"]["value"] - own["value"])
    assert "mass" not in record["quadruped:bear"]
    said = command("compare cheetah hopper --of payload_rated").out
    assert "what limits each" in said
    assert re.search(r"payload_rated +hopper +12.7 kg +knee: rated torque", said)


def test_designs_of_one_name_have_names_of_their_own() -> None:
    low, high = (QUADRUPED.resolve({"thigh_length": x}) for x in (0.2, 0.3))
    assert compare([low, high], ["mass"]).names == ("quadruped", "quadruped 2")
    assert [*compare([low, high], ["mass"], names=("a", "b")).record()["designs"]] == ["a", "b"]


def test_a_finding_that_both_have_with_other_numbers_is_none_of_one_alone() -> None:
    strong, stronger = (
        QUADRUPED.resolve("cheetah", {"actuators.leg.peak_torque": x}) for x in (5000.0, 5500.0)
    )
    assert compare([strong, stronger], ["mass"]).findings == ((), ())
    alone = compare([CHEETAH, strong], ["mass"]).findings
    assert alone[0] == ()
    assert alone[1][0].startswith("error torque: ")


def test_a_table_names_the_largest_shares() -> None:
    longer = {"thigh_length": 0.3, "actuators.leg.peak_torque": 90.0, "trunk_height": 0.19}
    found = compare([CHEETAH, QUADRUPED.resolve("cheetah", longer)], ["mass", "leg_length"])
    mass, length = section(found, found.metrics).summary.rows
    part = found.parts[0]
    assert part is not None
    share = dict(zip(part.names, part.shares[:, 0], strict=True))
    two = sorted(share, key=lambda name: -abs(share[name]))[:2]
    named = (f"{name.removeprefix('actuators.')} {signed(share[name])}" for name in two)
    assert mass[-1] == ", ".join(named)
    assert length[-2:] == ("", "thigh_length +0.05")


def test_what_changes_by_rounding_alone_has_no_share() -> None:
    humanoid = draft.load("humanoid")
    longer = humanoid.resolve({"thigh_length": 0.21})
    found = compare([humanoid.resolve(), longer], ["top_speed", "mass"])
    part = found.parts[0]
    assert part is not None
    assert part.shares[0, 0] == 0.0
    assert section(found, found.metrics).summary.rows[0][-1] == ""


def test_where_no_robot_is_between_two_designs_there_is_no_share(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole, longer = Spec.resolve, QUADRUPED.resolve("cheetah", {"thigh_length": 0.3})

    def resolve(self: Spec, *given: Any, **options: Any) -> draft.Design:
        if isinstance(given[0], dict) and np.ndim(given[0].get("thigh_length", 0)):
            raise draft.ResolveError("no robot", "choose another")
        return whole(self, *given, **options)

    monkeypatch.setattr(Spec, "resolve", resolve)
    part = compare([CHEETAH, longer], ["mass"]).parts[0]
    assert part is not None
    assert np.isnan(part.shares).all()
    assert part.better[0] < 0.01


def test_json_has_all_metrics_and_no_infinity(command: Command) -> None:
    record = command.json("compare cheetah bear giraffe")
    assert [one["design"] for one in record["against_first"]] == [
        "quadruped:bear",
        "quadruped:giraffe",
    ]
    assert record["designs"]["quadruped:cheetah"]["hold_time"] is None
    assert "actuators.leg.like" in record["against_first"][0]["shares"]
