"""Skill tests in mjlab with scripted controllers whose scores are known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from draft.errors import DraftError  # noqa: E402
from draft.learn.measuring.levels import SKILL_TESTS, SkillTest, skill_tests  # noqa: E402
from draft.learn.measuring.rollout import evaluate as lab  # noqa: E402
from draft.learn.measuring.rollout.evaluate import evaluate, roll_out  # noqa: E402
from draft.learn.measuring.rollout.measure import Measures  # noqa: E402
from draft.learn.measuring.rollout.trial import Trial, layout  # noqa: E402
from draft.learn.measuring.rollout.trial_env import build, env_cfg  # noqa: E402
from draft.learn.measuring.scalars import Worlds, curves, scalars  # noqa: E402
from draft.learn.task.config import Config  # noqa: E402
from draft.learn.task.world.access import GROUND  # noqa: E402
from draft.learn.task.world.task import Task  # noqa: E402
from tests.learn.runs import QUICK  # noqa: E402
from tests.learn.small import SMALL  # noqa: E402

CONFIG = Config().with_values(SMALL)


def levels(name: str, *values: float) -> SkillTest:
    return replace(SKILL_TESTS[name], levels=values)


def still(env: Any) -> Any:
    """The PD law holds the home pose."""
    return lambda seen: torch.zeros(env.num_envs, 12)


def thrashing(env: Any) -> Any:
    return lambda seen: 100.0 * torch.randn(env.num_envs, 12)


def trial(members: Any, *asked: SkillTest, **more: Any) -> Trial:
    usual: dict[str, Any] = {"replicas": 4, "seconds": 1.0, "settle": 0.2}
    return Trial(Task(members, "velocity", CONFIG), asked, **usual | more)


@pytest.fixture(scope="module")
def family(members: Any) -> Trial:
    """Two designs that stand, walk and are kicked in one simulation."""
    asked = levels("walk", 0.0), levels("speed", 3.0), levels("push", 2.0)
    return trial(members[:2], *asked)


@pytest.fixture(scope="module")
def flat(family: Trial) -> Any:
    return build(family, family.tests, "cpu")


@pytest.fixture(scope="module")
def stairs(members: Any) -> Any:
    asked = tuple(replace(test, levels=(0.05, 0.2, 0.5)) for test in skill_tests(["stairs"]))
    of = trial(members[:1], *asked, replicas=1)
    return build(of, asked, "cpu"), layout(of, asked)


def test_every_world_has_its_test_level_replica_and_member(family: Trial, flat: Any) -> None:
    rows = layout(family, family.tests)
    assert len(rows.level) == flat.num_envs == 3 * 2 * 2
    assert rows.test.tolist() == ["walk"] * 4 + ["speed"] * 4 + ["push"] * 4
    assert rows.command.tolist() == [0.0] * 4 + [3.0] * 4 + [0.4] * 4
    assert rows.kick.tolist() == [0.0] * 8 + [2.0] * 4
    assert rows.replica.tolist() == [0, 0, 1, 1] * 3
    names = np.array([member.name for member in family.task.members])
    assert names[flat.scene["robot"].member.numpy()].tolist() == rows.member.tolist()


def test_members_may_be_asked_for_speeds_of_their_own(family: Trial) -> None:
    own = replace(family, paces=(1.0, 1.5))
    rows = layout(own, own.tests)
    assert rows.command.tolist() == [0.0] * 4 + [3.0, 4.5] * 2 + [0.4] * 4
    assert rows.level[rows.test == "speed"].tolist() == [3.0, 4.5] * 2
    usual = layout(family, family.tests)
    assert rows.level[rows.test == "push"].tolist() == usual.level[usual.test == "push"].tolist()


def test_replicas_are_shared_out_among_members(members: Any) -> None:
    of = trial(members, levels("walk", 0.4), replicas=4)
    assert of.each == 2
    assert len(layout(of, of.tests).level) == 6


def test_a_robot_that_is_held_stands_and_keeps_its_command(family: Trial, flat: Any) -> None:
    rows, seen_commands = layout(family, family.tests), []

    def policy(seen: Any) -> Any:
        seen_commands.append(seen["actor"][:, 45:48].clone())
        return torch.zeros(flat.num_envs, 12)

    # Commands are drawn anew after three seconds at the earliest, unless they are held.
    flat.command_manager.get_term("twist").time_left[:] = 0.1
    measures = roll_out(flat, policy, family, lambda *_: None)
    wanted = torch.zeros(flat.num_envs, 3)
    wanted[:, 0] = torch.from_numpy(rows.command)
    assert len(seen_commands) == 50
    assert all(torch.equal(values, wanted) for values in seen_commands)
    columns = measures.fetch()
    assert not columns["fell"][:8].any()
    assert np.abs(columns["speed"][:8]).max() < 0.05
    # 40 actions of four physics steps after settling, four legs.
    counts, plane = measures.samples(1, 1)
    assert (counts[:8].sum(-1) == 640).all()
    assert (plane[:8].sum((-1, -2)) == 640).all()


def test_a_robot_that_thrashes_falls_and_scores_nothing(members: Any) -> None:
    of = trial(members[:1], levels("speed", 1.0), levels("push", 1.0), replicas=2)
    worlds, counted = evaluate(of, thrashing, "cpu", engine=QUICK)
    assert worlds.fell.all()
    made = scalars(curves(worlds), 0.48)
    assert set(made.values.values()) == {None}
    assert set(made.reasons.values()) == {"all fell at every level"}
    assert counted.counts.sum() == counted.plane.sum() == 0


def test_equal_seeds_agree_and_others_do_not(members: Any) -> None:
    def run(seed: int) -> tuple[Worlds, Any]:
        asked = trial(members[:1], levels("push", 2.0), replicas=3, seed=seed, seconds=0.6)
        return evaluate(asked, still, "cpu", engine=QUICK)

    (one, counted), (same, counted_too), (other, _) = run(5), run(5), run(6)
    assert all(np.array_equal(getattr(one, n), getattr(same, n)) for n in vars(one))
    assert np.array_equal(counted.counts, counted_too.counts)
    assert np.array_equal(counted.plane, counted_too.plane)
    assert not np.array_equal(one.speed, other.speed)


def test_kicks_come_at_three_six_and_nine_seconds(members: Any) -> None:
    of = Trial(Task(members[:1], "push", CONFIG), (levels("push", 1.0, 12.0),), 1, 12.0, 2.0)
    params = env_cfg(of, of.tests, layout(of, of.tests)).events["kick"].params
    assert params == {"most": (1.0, 12.0), "steps": (150, 300, 450)}
    for seconds in (0.5, 1.3, 8.1, 12.1):
        short = replace(of, seconds=seconds)
        steps = env_cfg(short, of.tests, layout(of, of.tests)).events["kick"].params
        assert len(steps["steps"]) == 3


def test_kicks_are_drawn_from_the_worlds_square(flat: Any) -> None:
    flat.reset(seed=0)
    term = flat.event_manager.get_term_cfg("kick")
    robot = flat.scene["robot"]
    assert term.params["steps"] == (12, 25, 38)
    drawn = []
    for step in (11, 12, 13, 25, 50):
        for _ in range(40):
            before = robot.data.data.qvel[:].clone()
            flat.common_step_counter = step
            term.func(flat, None, **term.params)
            change = robot.data.data.qvel[:] - before
            if step in (12, 25):
                drawn.append(change)
            else:
                assert not change.any()
    kicks = torch.stack(drawn)
    assert not kicks[:, :8].any()
    assert not kicks[:, :, 2:].any()
    pushed = kicks[:, 8:, :2].abs()
    assert 1.8 < pushed.max() <= 2.0 + 1e-4
    assert pushed.mean() == pytest.approx(1.0, abs=0.1)


def test_there_are_no_pushes_time_outs_rewards_or_curriculum(members: Any) -> None:
    of = trial(members[:1], levels("speed", 1.0))
    made = env_cfg(of, of.tests, layout(of, of.tests))
    assert set(made.terminations) == {"tilted", "low", "broken"}
    assert not made.rewards
    assert not made.curriculum
    kept = {"foot_friction", "encoder_bias", "shift_centre"}
    assert set(made.events) == {"reset_base", "reset_joints"} | kept
    assert made.observations["actor"].enable_corruption


def test_extra_events_follow_the_designs_and_come_before_the_rest(members: Any) -> None:
    extra: Any = {"more": object()}
    of = trial(members[:2], levels("speed", 1.0), extra=extra)
    events = env_cfg(of, of.tests, layout(of, of.tests)).events
    assert list(events)[:2] == ["designs", "more"]


def test_the_published_protocol_lets_a_tenth_stand(members: Any) -> None:
    of = trial(members[:1], levels("speed", 0.2, 2.0), replicas=4000, published=True)
    rows = layout(of, of.tests)
    assert np.mean(~rows.kept) == pytest.approx(0.1, abs=0.01)
    assert not rows.command[~rows.kept].any()
    slow, fast = rows.kept & (rows.level == 0.2), rows.kept & (rows.level == 2.0)
    assert np.mean(rows.command[slow] == 0.3) == pytest.approx(0.2, abs=0.03)
    assert set(rows.command[slow]) == {0.2, 0.3}
    assert set(rows.command[fast]) == {2.0}
    walking = layout(replace(of, published=False), of.tests)
    assert walking.kept.all()


def test_stairs_have_the_requested_heights(stairs: Any) -> None:
    env, rows = stairs
    origins, ground = env.scene.env_origins, env.scene[GROUND]
    out = torch.arange(0.05, 3.9, 0.1)
    assert rows.test.tolist() == ["ascent"] * 3 + ["descent"] * 3
    for world, (test, height) in enumerate(zip(rows.test, rows.level, strict=True)):
        for way in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
            xy = origins[world, :2] + out[:, None] * torch.tensor(way)
            heights = ground.ground(xy)
            steps = torch.diff(heights)
            risers = steps[steps.abs() > 1e-4]
            sign = 1.0 if test == "ascent" else -1.0
            assert risers.numpy() == pytest.approx(np.full(6, sign * height), abs=1e-4)
            assert heights[-1] == pytest.approx(0.0, abs=1e-5)
            assert heights[0] == pytest.approx(float(origins[world, 2]), abs=1e-4)


def test_robots_start_on_their_patch(stairs: Any) -> None:
    env, _ = stairs
    env.reset(seed=0)
    position = env.scene["robot"].data.root_link_pos_w
    assert (position[:, :2] - env.scene.env_origins[:, :2]).abs().max() <= 0.5 + 1e-4
    above = position[:, 2] - env.scene["ground"].ground(position[:, :2])
    assert above.numpy() == pytest.approx(np.full(6, env.scene["robot"].height[0] + 0.03), abs=0.03)


def recorded(worlds: int = 2) -> Any:
    """A robot whose state is what a test says."""
    zeros = torch.zeros(worlds, 12)
    data = SimpleNamespace(
        root_link_pos_w=torch.zeros(worlds, 3),
        root_link_lin_vel_b=torch.zeros(worlds, 3),
        qfrc_actuator=zeros,
        joint_vel=zeros.clone(),
    )
    limits = {
        "peak_torque": zeros + 70.0,
        "stall_torque": zeros + 140.0,
        "copper_loss": zeros + 0.1,
        "no_load_speed": zeros + 20.0,
    }
    return SimpleNamespace(data=data, **limits)


def test_power_of_a_sinusoid_is_that_of_the_closed_form() -> None:
    robot, steps = recorded(1), 400
    torque, speed = 35.0, 8.0

    def state(i: float, size: float) -> Any:
        values = torch.zeros(1, 12)
        values[0, 4] = size * np.sin(2 * np.pi * (i + 0.5) / steps)
        return values

    robot.data.joint_vel = state(0, speed)
    measures = Measures(robot, (0, 1, 2) * 4, 0)
    for i in range(steps):
        # A physics step: the torque of the state that it began with, and the speed it ends with.
        robot.data.qfrc_actuator, robot.data.joint_vel = state(i, torque), state(i + 1, speed)
        measures.sample()
    columns, (counts, _) = measures.fetch(), measures.samples(1, 1)
    work, heat = torque * speed / 2, torque**2 / 2 * 20.0 / 140.0
    assert columns["mechanical"][0] == pytest.approx(work, rel=1e-4)
    assert columns["heat"][0] == pytest.approx(heat, rel=1e-4)
    assert columns["copper"][0] == pytest.approx(torque**2 / 2 * 0.1, rel=1e-4)
    assert columns["driving"][0] == pytest.approx(work, rel=1e-4)
    # |sin| is above 0.8 for 1 - 2 asin(0.8) / pi of the time: so often is the share above 0.4.
    share = counts[0, 1, 0, 80:].sum() / steps
    assert share == pytest.approx(1 - 2 * np.arcsin(0.8) / np.pi, abs=0.01)
    assert counts[0, 1].sum(-1).tolist() == [4 * steps] * 3
    assert counts[0, 0, :, 0].tolist() == [4 * steps] * 3


def test_every_physics_step_is_measured_with_the_speed_that_its_torque_acted_at(
    flat: Any, family: Any
) -> None:
    robot, seen = flat.scene["robot"], []
    step = flat.sim.step

    def watched() -> None:
        speed = robot.data.joint_vel.clone()
        step()
        seen.append((robot.data.qfrc_actuator * speed).abs().sum(1))

    flat.sim.step = watched
    try:
        measures = roll_out(flat, still(flat), replace(family, seconds=0.4), lambda *_: None)
    finally:
        del flat.sim.step
    assert len(seen) == 80
    expected = torch.stack(seen[40:]).mean(0)[:8]
    assert expected.min() > 0
    assert measures.fetch()["mechanical"][:8] == pytest.approx(expected.numpy(), rel=1e-4)


def test_only_a_lack_of_memory_is_reported_as_such(members: Any, monkeypatch: Any) -> None:
    def fail(*_: Any, **__: Any) -> Any:
        raise RuntimeError(words)

    monkeypatch.setattr(lab, "build", fail)
    asked = trial(members[:1], levels("push", 2.0))
    words = "CUDA out of memory. Tried to allocate 2 GiB"
    with pytest.raises(DraftError, match="do not fit into the memory of cpu"):
        evaluate(asked, still, "cpu")
    words = "CUDA error: an illegal memory access was encountered"
    with pytest.raises(RuntimeError, match="illegal memory access"):
        evaluate(asked, still, "cpu")


def test_a_replayed_climb_is_traversed_and_a_fall_is_not() -> None:
    robot = recorded(3)
    measures = Measures(robot, (0, 1, 2) * 4, 2)
    for z in (0.9, 0.4, 0.45, 0.55, 0.61):  # 0.21 above where it had settled
        robot.data.root_link_pos_w = torch.tensor([[0, 0, z], [0, 0, 0.4], [0, 0, z]])
        measures.add(torch.tensor([False, False, z == 0.55]))
    columns = measures.fetch()
    assert columns["rise"][:2] == pytest.approx([0.21, 0.0])
    assert columns["fell"].tolist() == [False, False, True]
    rows = {"member": ["a"] * 3, "replica": [0, 1, 2], "kept": [True] * 3}
    plain = {name: np.array(values) for name, values in rows.items()}
    for step, share in ((0.2, 1 / 3), (0.21001, 0.0)):
        level = {"test": np.array(["ascent"] * 3), "level": np.full(3, step)}
        (curve,) = curves(Worlds(**level, **plain, **columns)).values()
        assert curve.get("traversed") == [pytest.approx(share)]


def test_nothing_counts_before_settling_or_after_a_fall() -> None:
    robot = recorded(2)
    measures = Measures(robot, (0, 1, 2) * 4, 2)
    for i, fallen in enumerate((False, False, False, True, False)):
        robot.data.root_link_lin_vel_b = torch.full((2, 3), 100.0 if i < 2 else 1.0 + i)
        for _ in range(4):
            measures.sample()
        measures.add(torch.tensor([False, fallen]))
    columns, (counts, plane) = measures.fetch(), measures.samples(1, 1)
    assert columns["speed"][0] == pytest.approx((3 + 4 + 5) / 3)
    assert columns["fell"].tolist() == [False, True]
    assert counts[0].sum() == 3 * 4 * 12 * 3
    assert plane[0].sum() == 3 * 4 * 12
    assert counts[1].sum() == plane[1].sum() == 0


def test_torque_and_speed_are_counted_together_by_level_and_member() -> None:
    robot = recorded(4)  # two replicas of two members, or two levels of two
    for world, (torque, speed) in enumerate(((35.0, 0.0), (70.0, 10.0), (35.0, 0.0), (0.0, 50.0))):
        robot.data.qfrc_actuator[world, 8] = -torque
        robot.data.joint_vel[world, 8] = speed
    measures = Measures(robot, (0, 1, 2) * 4, 0)
    measures.sample()
    _, plane = measures.samples(2, 2)
    knee = plane[:, 2]
    # Three knees of four rest; half the peak torque is the 13th cell of 0.04, all of it the 25th.
    assert {tuple(at): knee[0][tuple(at)] for at in np.argwhere(knee[0]).tolist()} == {
        (0, 0): 6,
        (12, 0): 2,
    }
    assert knee[1][24, 12] == knee[1][0, 40] == 1
    assert measures.samples(1, 2)[1].shape == (4, 3, 41, 41)


def test_pytorch_has_its_threads_again_after_an_evaluation() -> None:
    before = torch.get_num_threads()
    with lab._one_thread("cpu"):
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before
