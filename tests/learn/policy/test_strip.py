"""Film strips."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("PIL")

from draft.learn.policy import strip

WHITE, GREY, RED = (255, 255, 255), (128, 128, 128), (200, 0, 0)


def shot(left: int, top: int, wide: int, tall: int, place: float = 0.0) -> strip.Shot:
    """A red robot on grey."""
    pixels = np.full((120, 200, 3), GREY, np.uint8)
    pixels[top : top + tall, left : left + wide] = RED
    box = (float(left), float(top), float(left + wide), float(top + tall))
    return strip.Shot(pixels, box, 0.0, np.array([place, 0.0]))


def red(pixels: np.ndarray) -> np.ndarray:
    return (pixels == RED).all(axis=2)


def test_pictures_are_the_last_of_the_film_and_a_moment_apart() -> None:
    assert strip.moments(100, 6, 0.04) == [85, 88, 91, 94, 97, 100]
    assert strip.moments(5, 6, 0.04) == [0, 1, 2, 3, 4, 5]
    assert strip.moments(2, 6, 0.04) == [0, 1, 2]


def test_the_robot_fills_its_picture() -> None:
    tall = strip.draw([shot(90 + i, 20, 20, 60) for i in range(3)])
    assert red(tall).sum() == 3 * 20 * 60
    assert red(tall[: -strip.BAND]).mean() > 0.4


def test_all_pictures_have_one_scale_and_one_window() -> None:
    pixels = strip.draw([shot(80, 30, 20, 40), shot(90, 30, 20, 40)])
    columns = np.flatnonzero(red(pixels).any(axis=0))
    starts = columns[np.diff(columns, prepend=-2) > 1]
    period = (pixels.shape[1] + 6) // 2
    # The second robot is ten pixels further in its window.
    assert starts[1] - starts[0] == period + 10


def test_wide_robots_take_two_rows() -> None:
    wide = strip.draw([shot(50, 40, 100, 40) for _ in range(6)])
    tall = strip.draw([shot(90, 20, 20, 60) for _ in range(6)])
    assert np.diff(np.flatnonzero(red(wide).any(axis=1))).max() > strip.BAND
    assert np.diff(np.flatnonzero(red(tall).any(axis=1))).max() == 1


def test_time_and_distance_are_below_each_picture() -> None:
    near = strip.draw([shot(90, 20, 60, 60), shot(90, 20, 60, 60, 0.0)])
    far = strip.draw([shot(90, 20, 60, 60), shot(90, 20, 60, 60, 1.25)])
    differs = (near != far).any(axis=2)
    assert differs[-strip.BAND :].any()
    assert not differs[: -strip.BAND].any()
