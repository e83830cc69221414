"""The nearest design that meets conditions, against plain searches and closed forms."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
import draft.explore.solve as module
from draft.errors import DraftError
from draft.explore.nearest import Solution
from draft.explore.solve import solve
from draft.metrics import of_design
from tests.commands import Command

QUADRUPED = draft.load("quadruped")
CHEETAH, BEAR = (QUADRUPED.resolve(name) for name in ("cheetah", "bear"))
HUMANOID = draft.load("humanoid").resolve()
VARY = {
    "thigh_length": (0.2, 0.4),
    "shank_length": (0.2, 0.4),
    "trunk_length": (0.4, 0.7),
    "actuators.leg.peak_torque": (50.0, 150.0),
    "actuators.leg.no_load_speed": (15.0, 50.0),
}


def measured(found: Solution, *names: str) -> dict[str, float]:
    return {name: float(x) for name, x in of_design(found.design, names).items()}


@settings(max_examples=8)
@given(
    mass=st.floats(0.85, 1.1),
    payload=st.floats(0.8, 1.4),
    jump=st.floats(0.7, 1.2),
    seed=st.integers(0, 5),
)
def test_a_solution_meets_all_and_no_plain_search_finds_a_nearer_one(
    mass: float, payload: float, jump: float, seed: int
) -> None:
    own = of_design(CHEETAH, ["mass", "payload_rated", "jump_height"])
    limits = [float(own[name]) * by for name, by in zip(own, (mass, payload, jump), strict=True)]
    conditions = [
        f"mass <= {limits[0]!r}",
        f"payload_rated >= {limits[1]!r}",
        f"jump_height >= {limits[2]!r}",
    ]
    found = solve(CHEETAH, conditions, VARY, seed=seed)
    # A search of its own: uniform over the ranges, and over boxes around the start.
    rng, count = np.random.default_rng(1), 60_000
    start = np.array([0.25, 0.23, 0.52, 72.0, 40.0])
    low, high = np.array(list(VARY.values())).T
    share = rng.uniform(-1, 1, (count, 5)) * rng.random((count, 1))
    drawn = np.clip(start + share * (high - low), low, high)
    many = QUADRUPED.resolve("cheetah", {name: drawn[:, i] for i, name in enumerate(VARY)})
    table = of_design(many, own)
    met = np.asarray(many.accepted) & (table["mass"] <= limits[0])
    met &= table["payload_rated"] >= limits[1]
    met &= table["jump_height"] >= limits[2]
    change = np.sqrt((((drawn - start) / (high - low)) ** 2).mean(axis=1))
    if found.conflict is not None:
        assert not met.any()
        return
    reached = measured(found, *own)
    assert reached["mass"] <= limits[0]
    assert reached["payload_rated"] >= limits[1]
    assert reached["jump_height"] >= limits[2]
    assert found.design.accepted
    if met.any():
        assert found.change <= 1.02 * change[met].min()


def test_one_number_alone_is_moved_to_where_the_condition_begins() -> None:
    found = solve(CHEETAH, ["leg_length >= 0.5"], {"thigh_length": (0.2, 0.4)})
    (moved,) = found.moved
    assert (moved.name, moved.before) == ("thigh_length", 0.25)
    assert moved.after == pytest.approx(0.27, abs=2e-4)
    assert moved.why == ("leg_length >= 0.5, and it is 0.48",)


def test_numbers_that_need_not_change_do_not() -> None:
    found = solve(BEAR, ["mass <= 100"])
    names = {one.name for one in found.moved}
    assert "crouch" not in names
    assert "actuators.leg.no_load_speed" not in names
    assert all(one.why for one in found.moved)


def test_a_number_that_is_kept_stays() -> None:
    found = solve(BEAR, ["mass <= 100"], keep=["trunk_length", "trunk_height"])
    assert not {"trunk_length", "trunk_height"} & {one.name for one in found.moved}
    assert found.design.parameters["trunk_length"] == BEAR.parameters["trunk_length"]
    assert found.change > solve(BEAR, ["mass <= 100"]).change


def test_conditions_that_are_met_change_nothing() -> None:
    found = solve(BEAR, ["mass <= 200"])
    assert found.design is BEAR
    assert (found.change, found.moved, found.conflict) == (0.0, (), None)


def test_a_refused_design_moves_to_the_nearest_accepted_one() -> None:
    start = QUADRUPED.resolve("cheetah", {"actuators.leg.peak_torque": 140.0})
    assert not start.accepted
    found = solve(start, ["mass <= 60"])
    assert found.design.accepted
    assert found.moved[0].why[0].startswith("the filter refuses it: ")


def test_what_excludes_each_other_is_the_smallest_set() -> None:
    conditions = ["top_speed >= 2", "mass <= 15", "payload_rated >= 200"]
    found = solve(CHEETAH, conditions)
    assert found.conflict is not None
    assert found.conflict.conditions == ("mass <= 15", "payload_rated >= 200")
    for left in range(2):
        some = [one for k, one in enumerate(conditions) if k != left + 1]
        assert solve(CHEETAH, some).conflict is None
    assert found.conflict.misses
    for miss in found.conflict.misses:
        assert re.fullmatch(r"(mass <= 15|payload_rated >= 200|top_speed >= 2), and it is .*", miss)


@pytest.mark.parametrize("condition", ["payload_hour >= 0.001", "payload_hour >= 0"])
def test_the_design_that_misses_least_is_better_than_the_first(condition: str) -> None:
    found = solve(HUMANOID, [condition], {"thigh_length": (0.18, 0.22)})
    assert found.conflict is not None
    first = float(of_design(HUMANOID)["payload_hour"])
    assert first < float(found.conflict.misses[0].rpartition(" ")[2]) - 1 < 0


def test_equal_seeds_give_equal_solutions() -> None:
    first, again, other = (solve(BEAR, ["mass <= 100"], seed=seed) for seed in (0, 0, 1))
    assert first.moved == again.moved
    assert first.change == pytest.approx(other.change, rel=0.02)


@pytest.mark.parametrize(
    ("conditions", "more", "message"),
    [
        ([], {}, "there is no condition"),
        (["mass < 3 and mass > 4"], {}, "`mass < 3` and `mass > 4` exclude each other"),
        (["mass < 3", "mass >= 3"], {}, "`mass < 3` and `mass >= 3` exclude each other"),
        (["mas < 3"], {}, "unknown name 'mas'"),
        (["impact_mitigation > 0"], {}, "`impact_mitigation > 0` needs a compiled model"),
        (["mass < 30"], {"keep": ["thigh"]}, "'thigh' cannot be kept"),
        (
            ["mass < 30"],
            {"vary": {"thigh_length": (0.2, 0.4)}, "keep": ["thigh_length"]},
            "'thigh_length' is both kept and varied",
        ),
        (["mass < 30"], {"vary": {"foot_radius": (0.01, 0.02)}}, "does not state 'foot_radius'"),
    ],
)
def test_what_makes_no_sense_is_refused(
    conditions: list[str], more: dict[str, object], message: str
) -> None:
    with pytest.raises(DraftError, match=re.escape(message)):
        draft.solve(CHEETAH, conditions, **more)  # pyright: ignore[reportArgumentType]


def test_a_metric_that_a_design_lacks_is_no_condition(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "of_design", lambda *_: {"jump_height": float("nan")})
    with pytest.raises(DraftError, match="quadruped:cheetah has no jump_height"):
        solve(CHEETAH, ["jump_height > 1"])


def test_the_command_saves_a_design_with_the_reasons(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "light.yaml"
    said = command('solve bear "mass <= 100" "payload_rated >= 200" --out', file).out
    assert "designs computed" in said
    text = file.read_text(encoding="utf-8")
    assert "# trunk_length: 0.62 -> " in text
    assert "; else mass <= 100, and it is " in text
    again = QUADRUPED.resolve(file)
    assert again.accepted
    assert float(again.mass) <= 100
    assert (
        "nothing was changed" in command('solve bear "mass <= 200" --out', tmp_path / "no.yaml").out
    )
    assert not (tmp_path / "no.yaml").exists()


def test_the_command_replaces_only_what_it_wrote(command: Command, tmp_path: Path) -> None:
    file, line = tmp_path / "mine.yaml", 'solve bear "mass <= 100" --out'
    file.write_text("values: {thigh_length: 0.3}\n", encoding="utf-8")
    assert "was not written by this command; it is kept" in command.refuses(line, file)
    assert file.read_text(encoding="utf-8") == "values: {thigh_length: 0.3}\n"
    for _ in range(2):
        command(line, tmp_path / "other.yaml")
    assert "does not end in .yaml" in command.refuses(line, tmp_path / "other.txt")


def test_the_command_names_what_excludes_each_other(command: Command, tmp_path: Path) -> None:
    line = 'solve cheetah "mass <= 15" "payload_rated >= 200" --out'
    said = command(line, tmp_path / "no.yaml", code=1).out
    assert "no design of these ranges: exclude each other" in said
    assert "the design that misses least misses" in said
    assert not (tmp_path / "no.yaml").exists()
