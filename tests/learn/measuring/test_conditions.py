"""Physics that an evaluation asks for in the place of that of the training."""

from __future__ import annotations

from typing import Any

import pytest

from draft.errors import DraftError
from draft.learn.measuring.conditions import with_conditions
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.task.config import Config
from tests.learn.small import member


def numbers(**asked: Any) -> dict[str, Any]:
    config = with_conditions(Config(), Extras(**asked))
    physics, episodes = config.physics, config.episodes
    return {
        "timestep": physics.timestep,
        "decimation": physics.decimation,
        "friction": episodes.friction,
        "contact_time": episodes.contact_time,
        "delay": episodes.delay,
    }


@pytest.mark.parametrize(
    ("asked", "changed"),
    [
        ({}, {}),
        ({"timestep": 0.0025}, {"timestep": 0.0025, "decimation": 8}),
        ({"friction": 0.6}, {"friction": (0.6, 0.6)}),
        (
            {"contact_time": 0.004, "timestep": 0.00125},
            {"contact_time": (0.004, 0.004), "timestep": 0.00125, "decimation": 16},
        ),
        ({"contact_time": 0.01}, {"contact_time": (0.01, 0.01)}),
        ({"delay": 0.02}, {"delay": (0.02, 0.02)}),
        ({"delay": 0.0}, {}),
    ],
)
def test_what_is_asked_for_replaces_what_was_trained(
    asked: dict[str, Any], changed: dict[str, Any]
) -> None:
    assert numbers(**asked) == numbers() | changed


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            {"timestep": 0.003},
            "`timestep` 0.003 s is no part of the control period of 0.02 s\n  such as 0.00285714",
        ),
        (
            {"contact_time": 0.004},
            "`contact_time` 0.004 s needs two physics steps, of 0.005 s\n  pass `timestep` 0.002",
        ),
        (
            {"delay": 0.03},
            "`delay` 0.03 s is longer than the control period of 0.02 s\n  give a shorter one",
        ),
    ],
)
def test_physics_that_cannot_be_simulated_is_refused(asked: dict[str, Any], message: str) -> None:
    with pytest.raises(DraftError) as error:
        with_conditions(Config(), Extras(**asked))
    assert str(error.value) == message


def test_the_noise_of_observations_is_scaled() -> None:
    usual, half, none = (
        with_conditions(Config(), Extras(noise=share)).observations for share in (1.0, 0.5, 0.0)
    )
    assert usual == Config().observations
    names = [name for name in vars(usual) if name.endswith("_noise")]
    assert len(names) == 6
    for name in names:
        assert getattr(half, name) == getattr(usual, name) / 2
        assert getattr(none, name) == 0
    assert half.scan_range == usual.scan_range


def test_every_part_that_the_robots_own_model_lets_collide_may_do_so() -> None:
    pytest.importorskip("mjlab")
    from draft.learn.task.world.robot import robot

    def colliding(**asked: Any) -> set[str]:
        config = with_conditions(Config(), Extras(**asked))
        (found,) = robot((member(),), config).collisions
        return set(found.geom_names_expr)

    feet, every = colliding(), colliding(all_collide=True)
    assert feet < every
    assert any("lower_leg" in name for name in every - feet), every - feet
