"""Counted samples of torque and speed: pooled, summed up and drawn."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from matplotlib import pyplot as plt
from pyarrow import parquet

from draft.design.actuators import size
from draft.learn.measuring.utilisation import CELL, CELLS
from draft.study.report import figures, plane
from draft.study.report.folder import read
from draft.study.report.occupancy import Utilisation, percentile
from draft.study.report.table import Table
from draft.study.report.tables import utilisation
from tests.study.report.pages import to_html

SHARES = np.linspace(0, 1, 21)


def speed_of(used: Utilisation) -> Any:
    """How the cheetah uses its motors in the test of speed."""
    found = used.of("quadruped:cheetah", "speed")
    assert found is not None
    return found


def test_utilisation_pools_the_samples_of_all_seeds(source: Path) -> None:
    study = read(source)
    use = speed_of(Utilisation(study))
    assert use.samples.bins["knee"]["speed"].sum() == use.samples.plane["knee"].sum() == 3 * 20_000
    assert use.limiting[:4] == ("knee", "speed", 3, 3)
    assert use.shares["knee", "speed"] == percentile(use.samples.bins["knee"]["speed"])
    assert use.limiting.value == pytest.approx(0.83)


def test_a_table_may_say_that_no_actuator_limits(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = read(source)
    used = Utilisation(study)

    def shown() -> Table:
        made = utilisation(study, used)
        assert made is not None
        return made

    table = shown()
    assert "at 0.9 of its limit or above; below that, nothing does" in table.caption
    assert table.rows[0][-1] == "none; nearest knee, speed 0.83 (3 of 3)"
    assert "<b>" not in to_html(table)
    assert table.notes == ["No design is limited by its actuators in any test."]
    use = speed_of(used)
    near = replace(use, limiting=use.limiting._replace(value=0.9))
    monkeypatch.setitem(used._found, ("quadruped:cheetah", "speed"), near)
    table = shown()
    assert table.rows[0][-1] == "knee, speed (3 of 3)"
    assert str(table.rows[1][-1]).startswith("none")
    assert to_html(table).count("<b>") == 1
    assert table.notes == []


def test_a_percentile_is_linear_within_a_bin_and_ends_at_the_open_one() -> None:
    counts = np.zeros(321)
    counts[100] = 100
    assert percentile(counts) == pytest.approx(0.005 * 100.95)
    counts[320] = 100
    assert percentile(counts) == pytest.approx(1.6)


def test_counts_that_cannot_be_read_leave_the_summaries_own_percentiles(one: Path) -> None:
    place = one / "runs/cheetah-velocity-0/evaluation/nominal-walking"
    for name in ("utilisation.parquet", "occupancy.parquet"):
        (place / name).write_bytes(b"PAR1")
    study = read(one)
    used = Utilisation(study)
    use = speed_of(used)
    told = json.loads((place / "summary.json").read_text())["utilisation"]["speed"]
    assert use.shares["knee", "torque"] == told["knee"]["torque"]
    assert "utilisation.parquet cannot be read" in study.warnings[0]
    assert "occupancy.parquet cannot be read" in study.warnings[1]
    drawn = {figure.section for figure in figures.single(study, used)}
    assert drawn == {"", "curves", "training"}


def test_samples_are_drawn_where_their_torque_and_speed_are(one: Path) -> None:
    study = read(one)
    used = Utilisation(study)
    use = speed_of(used)
    use.samples.plane["knee"] = np.zeros((CELLS, CELLS))
    use.samples.plane["knee"][24, 5] = 10  # peak torque at a fifth of the no-load speed
    makers = {made.name: made.make for made in figures.single(study, used)}
    figure = makers["occupancy_speed_cheetah"]()
    knee = figure.axes[2]
    (image,) = knee.get_images()
    shares: Any = image.get_array()
    drawn = np.argwhere(shares.filled(0))
    assert drawn.tolist() == [[24, 5]]
    left, right, low, high = image.get_extent()
    assert (left, low) == (0, 0)
    assert right == high == pytest.approx(CELL * CELLS)
    assert image.origin == "lower"
    assert [text.get_text() for text in knee.texts][-1] == "knee"
    plt.close(figure)


def test_a_corner_is_drawn_where_the_motor_has_it(one: Path) -> None:
    study = read(one)
    (robot,) = study.members.values()
    knees = [k for k, place in enumerate(robot.joint_classes) if robot.classes[place] == "knee"]
    speeds = [0.5 * speed if k in knees else 0.0 for k, speed in enumerate(robot.no_load_speed)]
    cornered = replace(robot, corner_speed=tuple(speeds))
    runs = [run.model_copy(update={"members": (cornered,)}) for run in study.runs]
    study = replace(study, runs=tuple(runs))
    found = plane.shown(study, Utilisation(read(one)), "speed")
    figure = plane.figure(study, "speed", found, 7.0)
    stated = {"peak_torque": 60.0, "no_load_speed": 20.0}
    straight, motor = size("leg", stated, None), size("leg", stated | {"corner_speed": 10.0}, None)
    for ax, law in zip(figure.axes, (straight, straight, motor), strict=True):
        line = next(line for line in ax.get_lines() if line.get_color() == "0.2")
        drawn = np.interp(SHARES, *np.transpose(line.get_xydata()))
        assert list(drawn) == pytest.approx([law.available(20.0 * x) / 60.0 for x in SHARES])
    plt.close(figure)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("torque", "x", "cannot be read"),
        ("count", None, "count has missing values"),
        ("speed", -5, ""),
    ],
)
def test_counts_that_make_no_sense_are_omitted_or_kept_at_the_end(
    one: Path, column: str, value: Any, words: str
) -> None:
    path = one / "runs/cheetah-velocity-0/evaluation/nominal-walking/occupancy.parquet"
    table = parquet.read_table(path)
    at = table.schema.get_field_index(column)
    parquet.write_table(table.set_column(at, column, [[value] * table.num_rows]), path)
    study = read(one)
    use = speed_of(Utilisation(study))
    assert [words in warning for warning in study.warnings] == [True] * bool(words)
    assert bool(use.samples.plane) == (not words)
