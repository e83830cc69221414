"""The numbers of the learning tasks, and changing them."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.learn.task.config import STAGES, Config, from_dict
from draft.learn.task.constants import Scaled, scaled
from draft.learn.task.recipes import ANY, LAPTOP, RECIPES, Recipe

INFO = {
    f"{group}.{one.name}": one
    for group in Config().groups()
    for one in fields(getattr(Config(), group))
}
SCALARS = [
    name
    for name in INFO
    if type(getattr(getattr(Config(), name.split(".")[0]), name.split(".")[1])) is float
]


def value(config: Config, name: str) -> Any:
    group, key = name.split(".")
    return getattr(getattr(config, group), key)


@pytest.mark.parametrize("name", INFO)
def test_every_number_has_a_unit_a_meaning_and_a_source(name: str) -> None:
    told = INFO[name].metadata
    assert told["unit"] in {"1", "s", "m", "rad", "m/s", "rad/s", "1/s", "1/rad", "s/rad"}
    assert len(told["doc"]) > 4
    assert re.fullmatch(r"paper|choice: (released code|mjlab|rsl-rl|Draft)", told["source"])
    assert told["power"] in (-1.5, -1.0, -0.5, 0.0, 0.5, 1.0)


def test_what_the_paper_states_is_marked_so() -> None:
    marked = {name for name, one in INFO.items() if one.metadata["source"] == "paper"}
    assert marked == {
        *("physics.decimation", "actuation.stiffness", "actuation.damping"),
        *(f"rewards.{n}_weight" for n in ("linear", "angular", "upright", "air_time", "height")),
        *(f"rewards.{n}_weight" for n in ("clearance", "vertical", "limits", "upper_leg")),
        *("rewards.action_rate_weight", "rewards.linear_sigma", "rewards.angular_sigma"),
        *("rewards.upright_sigma", "rewards.air_time_most", "rewards.height"),
        *("rewards.height_sigma", "rewards.clearance_scale", "rewards.clearance"),
        "rewards.vertical_scale",
    }


def test_a_changed_number_is_the_only_change() -> None:
    changed = Config().with_values({"rewards.upright_weight": "2", "ground.step": [0.1, 0.2]})
    assert changed.rewards.upright_weight == 2.0
    assert changed.ground.step == (0.1, 0.2)
    others = [name for name in INFO if name not in ("rewards.upright_weight", "ground.step")]
    assert all(value(changed, name) == value(Config(), name) for name in others)
    assert Config().rewards.upright_weight == 1.0


@pytest.mark.parametrize(
    ("name", "given_", "kept"),
    [
        ("ground.rows", "12", 12),
        ("ground.rows", 12.0, 12),
        ("learning.mirror", "TRUE", True),
        ("learning.mirror", False, False),
        ("learning.hidden", "[64, 32]", (64, 32)),
        ("learning.hidden", [8], (8,)),
        ("episodes.drop", "0.1,0.2", (0.1, 0.2)),
        ("velocity.ramp", [[0, 0.5], [10, 1.0]], ((0, 0.5), (10, 1.0))),
        ("velocity.ramp", "[[0, 0.5], [10, 1]]", ((0, 0.5), (10, 1.0))),
        ("episodes.push_linear", "(1, 2, 3)", (1.0, 2.0, 3.0)),
        ("commands.forward", 1, 1.0),
        # Weights have any sign.
        ("rewards.limits_weight", 0.5, 0.5),
        ("rewards.upright_weight", -1, -1.0),
    ],
)
def test_values_are_taken_as_their_kind(name: str, given_: Any, kept: Any) -> None:
    found = value(Config().with_values({name: given_}), name)
    assert found == kept
    assert type(found) is type(kept)


KINDS: dict[str, tuple[Any, ...]] = {
    "ground.rows": (1.5, "many"),
    "rewards.height": ("nan", "inf", None, [1.0], 10**400),
    "learning.mirror": ("perhaps",),
    "ground.step": ([0.1], "0.1,0.2,0.3", 0.1),
    "velocity.ramp": (3, "0,1", [[5, 1.0]], [[0, 1.0], [0, 2.0]], [[0, 1.0, 2.0]]),
    "learning.hidden": ([], "[" * 100_000),
}
RULES: dict[str, tuple[str, Any]] = {
    "velocity.pushed": ("a share, 0 to 1", 3),
    "commands.standing": ("a share, 0 to 1", -0.1),
    "physics.timestep": ("above 0", 0),
    "learning.environments": ("above 0", -512),
    "learning.hidden": ("above 0", [256, 0]),
    "episodes.spawn": ("0 or more", -1),
    "push.ramp": ("0 or more", [[0, 1.0], [100, -2.0]]),
    "commands.interval": ("a range from 0 or more, the smaller number first", [8.0, 3.0]),
}


@pytest.mark.parametrize(
    ("name", "wrong", "words"),
    [
        *((n, wrong, f"is not a value of {n}") for n, each in KINDS.items() for wrong in each),
        *((n, wrong, f"{n} must be {rule}, and is ") for n, (rule, wrong) in RULES.items()),
    ],
    ids=lambda value: str(value)[:40],
)
def test_values_of_another_kind_and_out_of_range_are_refused_with_the_rule(
    name: str, wrong: Any, words: str
) -> None:
    with pytest.raises(DraftError, match=rf"{words}[^\n]*\n  such as"):
        Config().with_values({name: wrong})


@pytest.mark.parametrize("stage", ["ground", "terrain"])
def test_a_stage_without_any_ground_is_refused(stage: str) -> None:
    none = {f"{stage}.{kind}": 0 for kind in ("flat", "stairs", "slopes", "rough", "waves")}
    with pytest.raises(DraftError) as caught:
        Config().with_values(none)
    assert f"no ground is left: {stage}.flat, " in str(caught.value)
    assert f"{stage}.flat=1" in str(caught.value)
    assert Config().with_values(none | {f"{stage}.waves": 0.1})


@pytest.mark.parametrize(
    "name", ["rewards.uprigth_weight", "upright_weight", "rewards", "", ".", "a.b.c"]
)
def test_unknown_numbers_are_refused_with_what_there_is(name: str) -> None:
    with pytest.raises(DraftError, match="there is no number") as caught:
        Config().with_values({name: 1})
    assert "numbers: " in str(caught.value)
    if name == "rewards.uprigth_weight":
        assert "did you mean 'rewards.upright_weight'?" in str(caught.value)


@given(st.sampled_from(SCALARS), st.floats(-10, 10))
def test_any_number_in_range_that_changes_is_read_back(name: str, number: float) -> None:
    assume(INFO[name].metadata["within"].holds([number]))
    changed = Config().with_values({name: number})
    assert (changed == Config()) == (number == value(Config(), name))
    assert from_dict(json.loads(json.dumps(changed.as_dict()))) == changed


def test_what_was_written_is_read_back() -> None:
    for recipe in RECIPES.values():
        assert from_dict(recipe.config.as_dict()) == recipe.config
    values = {"learning.hidden": [64, 64, 64, 64], "push.ramp": [[0, 2.0]], "learning.mirror": True}
    config = Config().with_values(values)
    assert from_dict(config.as_dict()) == config
    assert from_dict({}) == Config()
    assert from_dict(Config().as_dict()) == Config()
    with pytest.raises(DraftError):
        from_dict({"rewards": {"unknown": 1}})


def test_every_stage_has_its_iterations() -> None:
    assert [Config().iterations(stage) for stage in STAGES] == [1200, 1800, 2000, 1500, 4000]


def test_a_number_grows_with_its_power_of_the_scale() -> None:
    assert Scaled(0.5, 0.5).at(4.0) == 1.0
    assert Scaled(0.5, -0.5).at(4.0) == 0.25
    assert Scaled(0.5).at(4.0) == 0.5
    assert scaled(Config().rewards, "height") == Scaled(0.43, 1.0)
    with pytest.raises(KeyError):
        scaled(Config().rewards, "nothing")


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=lambda one: one.name)
def test_iterations_follow_the_number_of_joints(recipe: Recipe) -> None:
    for joints in (1, 8, 12):
        assert recipe.for_joints(joints) is recipe
    last = recipe
    for joints in (13, 18, 29, 60):
        more = recipe.for_joints(joints)
        assert (more.name, more.plane) == (recipe.name, recipe.plane)
        for stage in ("base", "velocity", "terrain", "push"):
            usual, count = (one.config.iterations(stage) for one in (recipe, more))
            assert count == pytest.approx(usual * (joints / 12) ** 1.5, abs=0.5)
            assert count > last.config.iterations(stage)
            assert (
                f"{usual} x ({joints} joints / 12)"
                in more.changes[f"learning.iterations_{stage}"].why
            )
        assert more.config.iterations("any") == recipe.config.iterations("any")
        last = more
    assert LAPTOP.for_joints(29).config.iterations("base") == 939
    assert ANY.for_joints(10**6).config.iterations("base") == 10**7
