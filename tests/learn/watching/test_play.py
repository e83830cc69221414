"""Watching a policy: what is asked for, what is seen, and what is told."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from mjlab.rl import RslRlVecEnvWrapper  # noqa: E402

from draft.errors import DraftError  # noqa: E402
from draft.learn.engine.machine import NATIVE, obstacle  # noqa: E402
from draft.learn.task.world.access import COMMAND  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.run import Run, create, open_run  # noqa: E402
from draft.learn.watching.play import KINDS, Player, member_of, walking  # noqa: E402
from tests.learn.small import member, plan  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:mujoco_warp.*")
STILL, ASKED = (0.0, 0.0, 0.0), (0.4, -0.1, 0.2)
ENGINE = NATIVE if obstacle() is None else "warp"  # The quicker one.


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of a family, with an untrained policy as its checkpoints 0 and 2."""
    folder = tmp_path_factory.mktemp("play") / "run"
    made = create(folder, plan("cheetah", "bear"), {"a": "values: {}\n", "b": "values: {}\n"})
    trainer = Trainer(made, "cpu")
    for trainer.iteration in (0, 2):
        trainer.keep()
    trainer.close()
    return open_run(folder)


@pytest.fixture(scope="module")
def player(run: Run) -> Iterator[Player]:
    made = Player(run, "cpu", ground="uneven", robots=3, command=ASKED, engine=ENGINE)
    yield made
    made.close()


@pytest.fixture(scope="module")
def flat(run: Run) -> Iterator[Player]:
    made = Player(run, "cpu", ground="flat", robots=2, command=ASKED, engine=ENGINE)
    yield made
    made.close()


def hold(player: Player) -> None:
    """Let the policy ask for the home pose."""
    player.policy = lambda seen: torch.zeros(player.env.num_envs, 12)


def test_the_last_checkpoint_of_the_first_design_is_shown_and_acts_by_its_mean(
    player: Player,
) -> None:
    assert player.iteration == 2
    assert player.member.name == "quadruped:cheetah"
    assert isinstance(player.env, RslRlVecEnvWrapper)
    seen = player.env.get_observations()
    with torch.inference_mode():
        assert torch.equal(player.policy(seen), player.policy(seen))


def test_the_command_stays_after_falls_and_in_time(player: Player) -> None:
    hold(player)
    asked = torch.tensor([ASKED]).expand(3, 3)
    term: Any = player.env.unwrapped.command_manager.get_term(COMMAND)
    seen: list[Any] = []
    player.play(0.3, lambda _: seen.append(term.command.clone()))
    assert len(seen) == 16
    assert all(torch.allclose(one, asked) for one in seen)


def test_nothing_is_noisy_and_nothing_pushes(player: Player) -> None:
    env = player.env.unwrapped
    first, second = (env.observation_manager.compute()["actor"] for _ in range(2))
    assert torch.equal(first, second)
    assert "push" not in str(env.event_manager.active_terms)


def test_robots_stand_on_kinds_of_uneven_ground_and_look_ahead(player: Player) -> None:
    env = player.env.unwrapped
    env.reset()
    terrain: Any = env.scene.terrain
    have = list(terrain.cfg.terrain_generator.sub_terrains)
    assert [have[i] for i in terrain.terrain_types.tolist()] == list(KINDS[:3])
    assert env.scene["robot"].data.heading_w.abs().max() < 1e-5
    root = env.scene["robot"].data.root_link_pos_w
    assert torch.allclose(root[:, :2], env.scene.env_origins[:, :2], atol=1e-4)


def test_what_happened_is_measured_after_the_first_second(flat: Player) -> None:
    hold(flat)
    outcome = flat.play(1.2)
    assert outcome.seconds == pytest.approx(1.2)
    assert (outcome.robots, outcome.falls) == (2, 0)
    assert abs(outcome.speed) < 0.1
    # Who stands still misses the whole command.
    assert outcome.error == pytest.approx(math.hypot(0.4, 0.1), abs=0.1)


def test_falls_are_counted_and_a_fallen_robot_restarts(flat: Player) -> None:
    # Legs drawn up as far as they go: the trunk comes down.
    up = torch.zeros(2, 12)
    up[:, 1::3], up[:, 2::3] = 10.0, -10.0
    flat.policy = lambda seen: up
    assert flat.play(1.5).falls >= 2


def test_a_policy_with_missing_numbers_is_reported(flat: Player) -> None:
    flat.policy = lambda seen: torch.full((2, 12), math.nan)
    with pytest.raises(DraftError, match="not finite"):
        flat.play(0.2)


def test_half_of_the_largest_command_is_walked_at_where_none_is_given() -> None:
    cheetah = member("cheetah")
    assert walking(cheetah, plan().config) == pytest.approx((0.5, 0.0, 0.0))
    slow = replace(cheetah, top_speed=0.6)
    assert walking(slow, plan().config) == pytest.approx((0.3, 0.0, 0.0))


def test_a_design_is_named_in_full_or_by_its_last_part(run: Run) -> None:
    assert member_of(run, "bear").name == member_of(run, "quadruped:bear").name == "quadruped:bear"
    with pytest.raises(DraftError, match=r"no design 'bare'\n.*did you mean"):
        member_of(run, "bare")


def test_a_member_is_shown_with_its_own_body(run: Run) -> None:
    player = Player(run, "cpu", member="bear", ground="flat", command=STILL)
    mass = player.env.unwrapped.sim.mj_model.body_mass.sum()
    assert mass == pytest.approx(member("bear").mass, rel=1e-5)
    player.close()


@pytest.mark.parametrize(
    ("values", "share", "words"),
    [
        ({"learning.hidden": [8, 8]}, 1.0, "does not fit the run's design and numbers"),
        ({}, 0.5, r"model_2\.pt cannot be read as a checkpoint"),
    ],
    ids=["of other sizes", "cut short"],
)
def test_a_checkpoint_that_does_not_fit_is_reported(
    run: Run, tmp_path: Path, values: dict[str, Any], share: float, words: str
) -> None:
    other = create(tmp_path / "run", plan(values=values), {})
    data = run.checkpoint()[1].read_bytes()
    (other.folder / "model_2.pt").write_bytes(data[: int(share * len(data))])
    with pytest.raises(DraftError, match=words):
        Player(other, "cpu", ground="flat")


@pytest.fixture(scope="module")
def camera(player: Player) -> Iterator[Any]:
    from draft.learn.policy.video import Film

    try:
        made = Film(player, (160, 90))
    except DraftError as error:
        pytest.skip(f"no pictures here: {error}")
    yield made
    made.close()


def trunk(pixels: Any) -> Any:
    """Where the trunk is: it is blue, and the ground is grey."""
    return pixels[..., 2].astype(int) - pixels[..., 0] > 40


def test_the_robot_is_in_the_middle_of_the_picture_and_stays_there(
    player: Player, camera: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    player.env.reset()
    blue = trunk(camera.frame(0.04))
    assert blue.shape == (90, 160)
    rows, columns = np.nonzero(blue)
    assert blue.sum() > 100
    assert abs(np.median(columns) - 80) < 20
    assert abs(np.median(rows) - 45) < 20
    with monkeypatch.context() as patch:
        patch.setattr(camera, "_draw", lambda: np.zeros(1))  # Only the last frame is looked at.
        for _ in range(75):
            player.env.unwrapped.sim.data.qpos[0, 0] += 5.0 * 0.04
            camera.frame(0.04)
    _, columns = np.nonzero(trunk(camera.frame(0.0)))
    assert abs(np.median(columns) - 80) < 20


def test_a_video_and_a_strip_are_written_whole(
    player: Player, camera: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from imageio_ffmpeg import read_frames
    from PIL import Image

    from draft.learn.policy import strip as strips
    from draft.learn.policy import video

    monkeypatch.setattr(video, "SIZE", (160, 90))
    monkeypatch.setattr(video, "_SUNS", 2)
    hold(player)
    video.film(player, 0.2, tmp_path / "new" / "a.mp4", tmp_path / "a.png", 3)
    meta = next(read_frames(str(tmp_path / "new" / "a.mp4")))
    assert (meta["size"], meta["fps"]) == ((160, 90), 25.0)
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["a.mp4"]
    with Image.open(tmp_path / "a.png") as strip:
        pixels = np.asarray(strip.convert("RGB"))
    # Three windows, cut to the robot with its blue trunk.
    windows = np.split(pixels[: -strips.BAND, : pixels.shape[1] // 3 * 3], 3, axis=1)
    for window in windows:
        blue = trunk(window)
        assert blue.mean() > 0.06
        assert blue.size < 0.35 * 160 * 90


def test_a_video_that_fails_leaves_nothing(tmp_path: Path) -> None:
    from draft.learn.policy.video import video

    def fail() -> None:
        with video(tmp_path / "a.mp4", (16, 16), 25) as sink:
            sink.send(np.zeros((16, 16, 3), np.uint8))
            raise KeyError("the policy")

    with pytest.raises(KeyError):
        fail()
    assert not list(tmp_path.iterdir())


def test_the_page_lists_the_checkpoints_of_the_run(player: Player, run: Run) -> None:
    from draft.learn.watching.web import Page

    page = Page(player, run, "127.0.0.1", 0)
    assert page.port > 0
    assert [name for name, _ in page._available()] == ["0", "2"]
    page.close()
