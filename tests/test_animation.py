"""The first picture of README and site shows the numbers of real designs, and stays small."""

from __future__ import annotations

import pytest
from PIL import Image

import draft

pytest.importorskip("matplotlib")
from docs import animation


@pytest.fixture(scope="module")
def frames() -> list[animation.Frame]:
    return animation.frames()


def test_the_numbers_of_each_frame_are_those_of_its_design(frames: list[animation.Frame]) -> None:
    spec = draft.load("quadruped")
    for frame in frames[::7]:
        design = spec.resolve(frame.values)
        assert frame.mass == pytest.approx(float(design.mass), rel=1e-12)
        assert frame.accepted == design.accepted
        assert (frame.finding != "") == bool(design.findings)


def test_the_thighs_grow_and_the_verdict_changes_and_comes_back(
    frames: list[animation.Frame],
) -> None:
    lengths = [frame.values["thigh_length"] for frame in frames]
    masses = [frame.mass for frame in frames]
    assert max(lengths) > 1.5 * min(lengths)
    assert masses[lengths.index(max(lengths))] > masses[0] + 3.0
    assert {frame.severity for frame in frames} == {"", "warning", "error"}
    assert [frame.accepted for frame in frames if frame.severity == "error"].count(True) == 0
    assert frames[0] == frames[-1]
    assert frames[0].values == {"thigh_length": 0.25, "actuators.leg.peak_torque": 72}


@pytest.mark.slow
def test_the_robot_walks_on_through_all_bodies(frames: list[animation.Frame]) -> None:
    places = []
    for walking in animation.walk(frames):
        places.append(float(walking.data.qpos[0]))
        assert walking.falls == 0
    assert places[-1] - places[0] > 0.4 * animation.SPEED * animation.SECONDS


def test_the_picture_is_an_animation_of_at_most_two_megabytes() -> None:
    assert animation.PICTURE.stat().st_size <= 2_000_000
    with Image.open(animation.PICTURE) as picture:
        assert picture.format == "WEBP"
        assert picture.size == animation.SIZE
        assert picture.info["loop"] == 0
        assert 50 <= getattr(picture, "n_frames", 1) <= animation.SECONDS * animation.RATE
        picture.seek(1)
        picture.load()
        assert picture.info["duration"] >= 80


def test_the_site_shows_it_before_its_list_of_pages() -> None:
    text = (animation.PICTURE.parents[1] / "index.md").read_text(encoding="utf-8")
    assert f"](images/{animation.PICTURE.name})" in text[: text.index("\n- ")]
