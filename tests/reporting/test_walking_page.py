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
from draft.reporting import scene3d
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects

pytest.importorskip("plotly")

DESIGNS = ["quadruped:cheetah", "quadruped:bear", "hopper"]
MOST = 1_000_000  # Bytes that a gait may add to the page.
KINDS = {"f4": "<f4", "i2": "<i2", "i1": "<i1", "u1": "<u1"}


@pytest.fixture(scope="module")
def walking() -> list[Subject]:
    return subjects(open_designs(DESIGNS), walk=True)


@pytest.fixture(scope="module")
def text(walking: list[Subject]) -> str:
    return page(walking)


def unpacked(data: dict[str, str]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(data["bdata"]), KINDS[data["dtype"]])


def scene(text: str) -> dict[str, Any]:
    found = re.search(r'id="draft-figures">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    return json.loads(unescape(found[1]))["robots"]


def test_each_design_walks_or_the_page_says_why_not_and_what_to_do(text: str) -> None:
    words = " ".join(re.sub(r"<[^>]*>", " ", text[: text.index("<script")]).split())
    assert re.search(r"cheetah walks at 0\.4\d m/s; asked for 0\.50 m/s", words)
    assert re.search(r"bear walks at 0\.\d\d m/s", words)
    assert "hopper stands: no policy drives the joints of hopper" in words
    assert "draft train" not in words
    assert len(scene(text)["walk"]) == 2


def test_a_gait_adds_at_most_a_megabyte_to_the_page(text: str) -> None:
    still = page(subjects(open_designs(DESIGNS)))
    assert len(text) - len(still) < MOST
    assert 'id="walk-play"' not in still


def test_the_vertices_of_a_frame_are_those_of_the_recorded_bodies(
    walking: list[Subject], text: str
) -> None:
    figure = scene(text)
    for robot, subject in zip(figure["walk"], walking, strict=False):
        gait = subject.gait
        assert gait is not None
        shape = (robot["frames"], robot["bodies"], 3)
        positions = robot["quantum"] * unpacked(robot["positions"]).reshape(shape)
        c, s = np.cos(scene3d.YAW), np.sin(scene3d.YAW)
        turned = gait.positions @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
        away = positions - turned
        np.testing.assert_allclose(away, away[:1, :1] + 0 * away, atol=1e-4)
        quaternions = unpacked(robot["quaternions"]).reshape((*shape[:2], 4)) / 32767
        np.testing.assert_allclose(np.linalg.norm(quaternions, axis=2), 1.0, atol=1e-3)
        counts = [len(unpacked(figure["data"][m["trace"]]["x"])) for m in robot["meshes"]]
        assert counts == [len(unpacked(m["bodies"])) for m in robot["meshes"]]
        assert [len(unpacked(m["points"])) for m in robot["meshes"]] == [3 * n for n in counts]


def test_the_scene_has_room_for_the_whole_gait(walking: list[Subject], text: str) -> None:
    ranges = scene(text)["layout"]["scene"]
    assert ranges["zaxis"]["range"][0] <= 0.0
    for subject in walking:
        assert subject.model is not None
        high = corners(subject.model.mujoco, scene3d.home(subject.model))[:, 2].max()
        assert ranges["zaxis"]["range"][1] >= high - 1e-6


def test_a_report_in_which_all_stand_has_no_controls() -> None:
    text = page(subjects(open_designs(["hopper"]), walk=True))
    assert "stands: no policy drives the joints of hopper" in text
    assert 'id="walk-play"' not in text
    assert "walk" not in scene(text)
