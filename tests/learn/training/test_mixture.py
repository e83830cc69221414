"""One policy learns from robots of several topologies, and becomes a small one for each of them."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from mjlab.envs import ManagerBasedRlEnv  # noqa: E402
from tensordict import TensorDict  # noqa: E402

import draft  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.generated import generate, generate_kind  # noqa: E402
from draft.learn.bodies.legged import LeggedRobot, by_topology, kind_of, legged_robot  # noqa: E402
from draft.learn.bodies.slots import SLOTS, describe, slots_of  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.engine.worlds.simulate import make  # noqa: E402
from draft.learn.engine.worlds.turns import alike, cells  # noqa: E402
from draft.learn.measuring.rollout import review  # noqa: E402
from draft.learn.measuring.rollout.by_slots import by_slots  # noqa: E402
from draft.learn.policy import video  # noqa: E402
from draft.learn.policy.playback import Outcome, Playback  # noqa: E402
from draft.learn.policy.reduced import LegsPolicy, open_legs_policy  # noqa: E402
from draft.learn.task.mdp.environment import environment  # noqa: E402
from draft.learn.task.recipes import ANY  # noqa: E402
from draft.learn.task.world.access import robot_of  # noqa: E402
from draft.learn.task.world.robot import RobotCfg  # noqa: E402
from draft.learn.task.world.task import Task  # noqa: E402
from draft.learn.training.ppo.legs_onnx import export_legs  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.ppo.worlds import Worlds, by_bodies  # noqa: E402
from draft.learn.training.run import Run, open_run  # noqa: E402
from draft.learn.watching.side_by_side import SideBySide  # noqa: E402
from tests.commands import Command  # noqa: E402
from tests.learn.legs import mixed_plan  # noqa: E402
from tests.learn.runs import begin, train, weights  # noqa: E402
from tests.learn.small import SMALL  # noqa: E402
from tests.learn.task.states import place, value  # noqa: E402

if obstacle() is not None:
    pytest.skip("needs mjbatch", allow_module_level=True)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    found = begin(tmp_path_factory.mktemp("mixture") / "run", mixed_plan())
    train(found, 2, engine="native")
    return found


@pytest.fixture(scope="module")
def legs(run: Run) -> LegsPolicy:
    export_legs(run, run.folder / "legs.onnx")
    return open_legs_policy(run.folder / "legs.onnx")


def test_a_run_keeps_robots_of_several_topologies(run: Run) -> None:
    opened = open_run(run.folder).plan
    assert opened == run.plan
    assert opened.mixed
    assert len(by_topology(opened.members)) == 6
    row = (run.folder / "progress.csv").read_text(encoding="utf-8").splitlines()[0]
    for members in by_topology(opened.members):
        assert f"{kind_of(members)}/tracking_error" in row


def test_a_resumed_training_is_the_same_bit_by_bit(tmp_path: Path) -> None:
    whole, parts = (begin(tmp_path / name, mixed_plan()) for name in ("whole", "parts"))
    first, second = train(whole, 4, engine="native"), train(parts, 1, 4, engine="native")
    for name, values in weights(first).items():
        assert torch.equal(values, weights(second)[name]), name


def test_worlds_are_divided_by_the_numbers_of_bodies() -> None:
    bodies = [800, 300, 400, 200, 300]
    for processes in (1, 2):
        counts = by_bodies(256, bodies, processes)
        assert sum(counts) == 256
        shares = np.array(counts) / 256 * sum(bodies) / np.array(bodies)
        assert shares == pytest.approx(1.0, abs=0.1)
    assert by_bodies(10, [4, 2, 2, 1, 2], 2) == [2] * 5
    assert by_bodies(7, [3], 2) == [7]


def test_robots_of_all_legs_are_to_keep_the_height_of_their_home_pose(run: Run) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        worlds = Worlds(run.plan, "cpu", "native", 0, 1)
    for env in worlds.envs:
        robot = robot_of(env)
        at = torch.zeros(env.num_envs, 3)
        at[:, 2] = robot.height
        place(env, at)
        assert value(env, "height").tolist() == pytest.approx([1.0] * env.num_envs, abs=1e-3)
    worlds.close()


def test_cells_of_bodies_of_any_legs_part_them_by_torque_width_speed_and_size() -> None:
    members = generate_kind("quadruped", 64, 3).members
    by_slots: Any = SimpleNamespace(scene={"robot": SimpleNamespace(cfg=RobotCfg(by_slots=True))})
    numbers = np.array(alike(by_slots, members))
    found = cells(numbers, 16)
    within = [numbers[found == cell].std(axis=0) for cell in range(16)]
    assert (np.mean(within, axis=0) < 0.7 * numbers.std(axis=0)).all()


def test_actions_of_absent_joints_are_not_learnt(run: Run) -> None:
    trainer = Trainer(open_run(run.folder), "cpu", engine="native")
    present = trainer.runner.alg._present  # pyright: ignore[reportAttributeAccessIssue]
    absent = present.sum(0) == 0
    assert 0 < int(absent.sum()) < SLOTS
    last: Any = trainer.runner.alg.get_policy().mlp[-1]
    first = Trainer(begin(run.folder.with_name("first"), mixed_plan()), "cpu", engine="native")
    before: Any = first.runner.alg.get_policy().mlp[-1]
    assert torch.equal(last.weight[absent], before.weight[absent])
    assert not torch.equal(last.weight[~absent], before.weight[~absent])


def test_the_small_network_of_each_robot_gives_the_same_actions(run: Run, legs: LegsPolicy) -> None:
    with contextlib.redirect_stdout(io.StringIO()):
        worlds = Worlds(run.plan, "cpu", "native", 0, 1)
    padded = worlds.wrapped.get_observations()["actor"]
    start = 0
    for env in worlds.envs:
        robot = robot_of(env)
        for world in range(env.num_envs):
            member = robot.cfg.members[robot.host_member[world]]
            small, slots = legs.of_robot(member), slots_of(member)
            entries = padded[start + world].numpy()
            own = _own(member, entries, slots)
            wide = legs.network(entries)
            wanted = [
                sign * wide[slot] if slot >= 0 else 0.0
                for slot, sign in zip(slots.joints, slots.signs, strict=True)
            ]
            assert small(own) == pytest.approx(np.array(wanted), abs=1e-5)
        start += env.num_envs
    worlds.close()


def test_the_policy_is_the_same_for_many_robots_at_once(run: Run, legs: LegsPolicy) -> None:
    for members in by_topology(run.plan.members):
        env = quiet_env(members)
        robot = robot_of(env)
        seen = TensorDict(dict(env.get_observations()), batch_size=[env.num_envs])
        entries = seen["actor"] + 0.1 * torch.randn_like(seen["actor"])
        actions = by_slots(legs, "cpu")(env)(TensorDict({"actor": entries}, batch_size=[len(seen)]))
        for world in range(env.num_envs):
            small = legs.of_robot(robot.cfg.members[robot.host_member[world]])
            terms = [name for name, _ in small.terms]
            assert terms == env.observation_manager.active_terms["actor"]
            wanted = small(entries[world].numpy())
            assert actions[world].numpy() == pytest.approx(wanted, abs=1e-4)
        env.close()


def quiet_env(members: tuple[LeggedRobot, ...]) -> ManagerBasedRlEnv:
    """Environment of a measurement: the robots do not observe their design."""
    task = Task(
        members, "any", config=ANY.config.with_values(SMALL), ground="flat", see_ground=False
    )
    with contextlib.redirect_stdout(io.StringIO()):
        return make(environment(task, 2 * len(members)), "cpu", "native")


def _own(member, entries, slots):
    """A robot's own observation for padded entries, by a calculation of its own."""
    length = member.leg_length
    speed, time = np.sqrt(9.81 * length), np.sqrt(length / 9.81)
    lin, ang, gravity, command = (entries[i : i + 3] for i in (0, 3, 6, 9))
    joints = entries[12 : 12 + 3 * SLOTS].reshape(3, SLOTS)
    rows = np.zeros((3, len(member.joints)))
    for joint, (slot, sign) in enumerate(zip(slots.joints, slots.signs, strict=True)):
        if slot >= 0:
            rows[:, joint] = sign * joints[:, slot] / np.array([1.0, time, 1.0])
    commanded = command * [speed, speed, 1 / time]
    return np.concatenate([lin * speed, ang / time, gravity, *rows, commanded])


def test_the_mirror_image_of_an_observation_gives_mirrored_actions(legs: LegsPolicy) -> None:
    member = legged_robot(draft.load("humanoid").resolve())
    policy = legs.of_robot(member)
    rng = np.random.default_rng(0)
    count = len(member.joints)
    seen = rng.normal(size=9 + 3 * count + 3)
    mirror, sign = np.array(member.mirror), np.array(member.mirror_sign)

    def image(values: np.ndarray) -> np.ndarray:
        return values[mirror] * sign

    lin, ang, gravity = (seen[i : i + 3] for i in (0, 3, 6))
    rows = seen[9 : 9 + 3 * count].reshape(3, count)
    other = np.concatenate(
        [
            lin * [1, -1, 1],
            ang * [-1, 1, -1],
            gravity * [1, -1, 1],
            *(image(row) for row in rows),
            seen[-3:] * [1, -1, -1],
        ]
    )
    assert policy(other) == pytest.approx(image(policy(seen)), abs=1e-5)


def test_a_robot_outside_the_training_counts_as_the_nearest_inside(legs: LegsPolicy) -> None:
    member = legged_robot(draft.load("quadruped").resolve())
    strong = replace(member, peak_torque=tuple(100 * x for x in member.peak_torque))
    slots, own = describe(strong)
    first = legs.departures(strong, own)[0]
    assert first.name.startswith("peak torque of the ")
    _, high = legs.ends(4)
    joints = SLOTS + np.array(slots.joints)
    assert legs.nearest(own, 4)[joints] == pytest.approx(high[joints])
    assert legs.nearest(own, 4)[:SLOTS] == pytest.approx(own[:SLOTS])
    without = own.copy()
    without[slots.joints[0]] = 0.0  # All quadrupeds of the training have this joint.
    assert legs.nearest(without, 4)[slots.joints[0]] == 0.0
    assert legs.distances(without, 4)[slots.joints[0]] == 10.0
    seen = np.zeros(9 + 3 * 12 + 3)
    assert np.isfinite(legs.of_robot(strong)(seen)).all()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data[: len(data) // 2], "truncated"),
        (lambda data: data.replace(b"layout", b"layuot"), "metadata of .* invalid: joint_names"),
        (lambda data: data.replace(b"\x030.6", b"\x03-.6"), r"its support is -\.6, and a share"),
        (lambda _: b"", "not a policy"),
    ],
)
def test_a_file_that_is_no_such_policy_is_refused(
    legs: LegsPolicy, tmp_path: Path, change: Callable[[bytes], bytes], words: str
) -> None:
    file = tmp_path / "broken.onnx"
    file.write_bytes(change(legs.file.read_bytes()))
    with pytest.raises(DraftError, match=words):
        open_legs_policy(file)


def test_the_command_trains_any_legs_and_refuses_what_is_of_one_robot(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(review, "SECONDS", 0.2)
    monkeypatch.setattr(review, "SETTLE", 0.1)
    small = "--bodies 10 --envs 10 --iterations 1 --replicas 1 --set learning.steps=4"
    said = command(f"train any {small} --out", tmp_path / "run").out
    opened = open_run(tmp_path / "run").plan
    assert opened.mixed
    for members in by_topology(opened.members):  # Of each, bodies at four speeds.
        bodies = min(review.BODIES, len(members))
        row = rf"{kind_of(members)} +{bodies}(?: +-?\d\.\d\d){{3}} +\d+ of {4 * bodies}\n"
        assert re.search(row, said), kind_of(members)
    for words, message in (
        ("--vary thigh_length=0.2:0.3", "its bodies are drawn already"),
        ("--stage push", "has a stage of its own"),
        ("--bodies 0", "bodies"),
    ):
        assert message in command.refuses(f"train any {words}")


def test_a_run_of_one_topology_is_exported_otherwise(tmp_path: Path) -> None:
    members = generate(10)[0].members
    single = begin(
        tmp_path / "run", replace(mixed_plan(), members=members, stage="base", see_design=False)
    )
    with pytest.raises(DraftError, match="a run of one topology"):
        export_legs(single, tmp_path / "legs.onnx")


def test_robots_of_all_topologies_are_shown_side_by_side(run: Run) -> None:
    shown = SideBySide(run)
    assert shown.iteration == 2
    assert [robot.member for robot in shown.robots] == [
        members[0] for members in by_topology(run.plan.members)
    ]
    bodies = [shown.model.body(f"{i}/{one.member.trunk}").id for i, one in enumerate(shown.robots)]

    def places() -> np.ndarray:
        return shown.data.xpos[bodies].copy()

    start = places()
    assert (np.diff(start[:, 1]) < -0.3).all()  # From left to right.
    assert start[:, 2] == pytest.approx([one.member.height for one in shown.robots], abs=1e-6)
    shown.command = (9.0, 0.0, 0.5)
    assert [one.command[0] for one in shown.robots] == [one.policy.forward for one in shown.robots]
    for _ in range(20):
        shown.step()
    heights = [one.data.qpos[2] for one in shown.robots]
    assert places()[:, 2] == pytest.approx(heights, abs=1e-6)
    assert (places() != start).any()
    first = shown.robots[0]
    first.data.qpos[:7] = (0.3, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0)  # Upside down, it restarts there.
    shown.step()
    assert first.falls == 1
    assert places()[0, 0] == pytest.approx(0.3, abs=0.05)
    shown.load(2)
    shown.reset()
    assert places() == pytest.approx(start, abs=1e-6)


def test_a_run_of_several_topologies_is_played(
    command: Command, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = command("play", run.folder, "--onnx", tmp_path / "legs.onnx").out
    assert f"{tmp_path / 'legs.onnx'}: the policy of all legs after 2 iterations" in said
    assert open_legs_policy(tmp_path / "legs.onnx").of_robot(run.plan.members[0])
    filmed = []

    def film(player: Playback, *_: object) -> Outcome:
        filmed.append(player)
        return player.play(0.1)

    monkeypatch.setattr(video, "film", film)
    name = run.plan.members[-1].name
    said = command("play", run.folder, "--member", name, "--out", tmp_path / "a.mp4").out
    assert f"{name}, 2 iterations" in said
    assert filmed[0].member.name == name
    for words in ("--robots 2", "--ground uneven"):
        assert "this one has several" in command.refuses("play", run.folder, *words.split())
