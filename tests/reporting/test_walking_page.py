"""Recorded gaits in the page: what walks, what stands and why, and how large they are."""

from __future__ import annotations

import base64
import json
import re
from html import unescape
from typing import Any

import numpy as np
import pytest

from draft.design.references import open_designs
from draft.model.picture import corners
from draft.model.scene import home
from draft.reporting import scene3d
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects

pytest.importorskip("plotly")

DESIGNS = ["quadruped:cheetah", "quadruped:bear", "hopper"]
MOST = 1_000_000  # Bytes that a gait may add to the page.
KINDS = {"f4": "<f4", "i2": "<i2"}


@pytest.fixture(scope="module")
def walking() -> list[Subject]:
    """Recorded gaits, as without the extra of live pages."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("draft.reporting.subjects.available", lambda: False)
        return subjects(open_designs(DESIGNS), walk=True)


@pytest.fixture(scope="module")
def text(walking: list[Subject]) -> str:
    return page(walking)


def unpacked(data: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(data["bdata"]), KINDS[data["dtype"]])


def scene(text: str) -> dict[str, Any]:
    found = re.search(r'id="draft-robots">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    return json.loads(unescape(found[1]))


def test_each_design_walks_or_the_page_says_why_not_and_what_to_do(text: str) -> None:
    words = " ".join(
        re.sub(
            r"<[^>]*>", " ", text[text.index("<body>") : text.index('id="draft-report"')]
        ).split()
    )
    assert re.search(r"cheetah walks at 0\.4\d m/s; asked for 0\.50 m/s", words)
    assert re.search(r"bear walks at 0\.\d\d m/s", words)
    assert "hopper stands: no policy drives the joints of hopper" in words
    assert "draft train" not in words
    assert ["travel" in robot for robot in scene(text)["robots"]] == [True, True, False]


def test_a_gait_adds_at_most_a_megabyte_to_the_page(text: str) -> None:
    still = page(subjects(open_designs(DESIGNS)))
    assert len(text) - len(still) < MOST
    assert 'id="walk-play"' not in still


def test_the_poses_of_a_frame_are_those_of_the_recorded_bodies(
    walking: list[Subject], text: str
) -> None:
    for robot, subject in zip(scene(text)["robots"], walking, strict=True):
        gait, model = subject.gait, subject.model
        assert gait is not None
        assert model is not None
        data = home(model.design, model.mujoco)
        own = gait.positions if gait.walks else data.xpos[None, 1:]
        shape = (robot["frames"], robot["bodies"], 3)
        assert own.shape == shape
        positions = robot["quantum"] * unpacked(robot["positions"]).reshape(shape)
        c, s = np.cos(scene3d.YAW), np.sin(scene3d.YAW)
        away = positions - own @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        np.testing.assert_allclose(away, away[:1, :1] + 0 * away, atol=1e-4)
        quaternions = unpacked(robot["quaternions"]).reshape((*shape[:2], 4)) / 32767
        np.testing.assert_allclose(np.linalg.norm(quaternions, axis=2), 1.0, atol=1e-3)


def test_the_scene_has_room_for_the_whole_gait(walking: list[Subject], text: str) -> None:
    low, high = scene(text)["box"]
    assert low[2] <= 0.0
    for robot, subject in zip(scene(text)["robots"], walking, strict=True):
        assert subject.model is not None
        model = subject.model.mujoco
        data = home(subject.design, model)
        places = robot["quantum"] * unpacked(robot["positions"]).reshape(-1, 3)
        assert (places >= low).all()
        assert (places <= high).all()
        if not scene3d.walks(subject):
            assert high[2] >= corners(model, data)[:, 2].max() - 1e-6


def test_a_report_in_which_all_stand_has_no_controls(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("draft.reporting.subjects.available", lambda: False)
    text = page(subjects(open_designs(["hopper"]), walk=True))
    assert "stands: no policy drives the joints of hopper" in text
    assert 'id="walk-play"' not in text
    assert "travel" not in scene(text)["robots"][0]
