"""A payload in an evaluation is the payload of the design, on a robot trained without it."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from draft.errors import DraftError
from draft.learn.bodies.designs import open_bodies
from draft.learn.bodies.family_fields import family_fields
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.payload import model_spec, with_payload
from draft.learn.bodies.slots import servo_torque, slots_of
from draft.learn.measuring import evaluation
from draft.learn.measuring.evaluation_options import Options
from draft.learn.measuring.levels import skill_tests
from draft.learn.measuring.results import Request, make_request, result_folder
from draft.learn.training.run import create
from draft.model.texts import Text
from tests.learn.small import member, plan


@pytest.mark.parametrize("label", ["cheetah", "bear", "giraffe"])
def test_the_block_is_that_of_the_design_with_a_payload(label: str) -> None:
    design = draft.load("quadruped").resolve(label, {"payload": 10})
    expected = design.build().mujoco
    (robot,) = with_payload([member(label)], 10)
    model = model_spec(robot).compile()
    assert robot.mass == pytest.approx(float(design.mass))
    names = [expected.body(i).name for i in range(expected.nbody)]
    assert [model.body(i).name for i in range(model.nbody)] == names
    for field in ("body_mass", "body_inertia", "body_ipos", "body_parentid", "geom_size"):
        ours, theirs = getattr(model, field), getattr(expected, field)
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-12, err_msg=field)


def test_nothing_else_changes_and_a_second_payload_has_a_name_of_its_own() -> None:
    (robot,) = with_payload([member()], 10)
    assert replace(robot, block=(), mass=member().mass) == member()
    trained = legged_robot(draft.load("quadruped").resolve("cheetah", {"payload": 3}))
    model = model_spec(with_payload([trained], 4)[0]).compile()
    assert model.body("payload").mass[0] == pytest.approx(3)
    assert model.body("payload_").mass[0] == pytest.approx(4)


def test_gains_are_those_of_the_robot_without_the_block() -> None:
    (robot,) = with_payload([member()], 10)
    assert robot.own_mass == pytest.approx(member().mass, rel=1e-6)
    slots = slots_of(member())
    assert servo_torque(robot, slots, 1.2) == pytest.approx(servo_torque(member(), slots, 1.2))
    assert servo_torque(member(), slots, 1.2).tolist() != list(member().peak_torque)


def test_each_body_of_a_family_carries_its_own_block() -> None:
    pytest.importorskip("scipy")  # Bodies are drawn by it.
    drawn = open_bodies(["cheetah"], ["trunk_height=0.15:0.25"], 3, seed=1).members
    first, fields = family_fields(with_payload(drawn, 10))
    assert {"geom_pos", "body_ipos"} <= fields.keys()
    for row, robot in enumerate(with_payload(drawn, 10)):
        alone = model_spec(robot).compile()
        for name in ("body_mass", "body_inertia", "body_ipos"):
            ours = fields[name][row] if name in fields else getattr(first, name)
            np.testing.assert_array_equal(ours, getattr(alone, name), err_msg=name)


@pytest.mark.parametrize("xml", ["<mujoco> </mujoco>", '<mujoco model="x"/>'])
def test_a_model_that_draft_did_not_write_is_refused(xml: str) -> None:
    odd = replace(member(), text=Text(xml))
    assert with_payload([odd], 0) == (odd,)
    with pytest.raises(DraftError, match="is not as this version of Draft writes it"):
        with_payload([odd], 10)


def test_a_result_with_a_payload_is_beside_that_without(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), {})
    (run.folder / "model_1.pt").write_bytes(b"weights")
    walk = skill_tests(("walk",))

    def asked(**more: Any) -> Request:
        return make_request(run, walk, Options(replicas=2, seconds=1.0, **more))

    bare = asked()
    assert not {"payload", "regeneration"} & bare.as_dict().keys()
    assert result_folder(run, bare) == run.folder / "evaluation/nominal-walking"
    loaded = asked(payload=10.0, regeneration=0.5)
    assert loaded.as_dict()["payload"] == 10.0
    folder = result_folder(run, loaded)
    assert folder == run.folder / "evaluation-payload-10kg-regeneration-0.5/nominal-walking"
    assert result_folder(run, asked(payload=2.5), tmp_path) == (
        tmp_path / "run-payload-2.5kg/nominal-walking"
    )


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"payload": -1.0}, "`payload` -1 is not a number from 0 to 10000 kg"),
        ({"payload": float("nan")}, "`payload` nan is not a number from 0"),
        ({"regeneration": 1.5}, "`regeneration` 1.5 is not a number from 0 to 1"),
    ],
)
def test_bad_numbers_are_refused(numbers: dict[str, float], said: str) -> None:
    with pytest.raises(DraftError, match=said):
        Options.of(numbers)


def test_the_trial_runs_the_loaded_robot(tmp_path: Path) -> None:
    pytest.importorskip("mjlab")
    from draft.learn.measuring.rollout.trial import trial

    run = create(tmp_path / "run", plan(), {})
    (run.folder / "model_1.pt").write_bytes(b"weights")
    prepared = evaluation.prepare(run, Options(test=["walk"], replicas=2, payload=10.0))
    robots: tuple[LeggedRobot, ...] = trial(run, prepared.tests, prepared.request).task.members
    assert [robot.mass for robot in robots] == [pytest.approx(member().mass + 10)]
