"""The table of metrics, what it gives for the shipped robots, and N designs at once."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pytest_regressions.file_regression import FileRegressionFixture

import draft
from draft.metrics import LEARNED, METRICS, find, metric, of_design, of_model
from draft.metrics.speed import top_speed
from draft.metrics.statics import joint_margins
from tests.changed_package import ChangedPackage
from tests.helpers import leg, parameter, robot

SHIPPED = (
    ("quadruped", "cheetah"),
    ("quadruped", "bear"),
    ("quadruped", "giraffe"),
    ("humanoid", None),
    ("hopper", None),
)
CLOSED = [metric.name for metric in METRICS.values() if metric.needs == "design"]
# Metrics that a robot without legs still has.
LEGLESS = {"mass", "mass_low", "mass_high", "structure_mass", "actuator_share", "accepted"}


def shipped(name: str, design: str | None) -> draft.Design:
    spec = draft.load(name)
    return spec.resolve(design) if design else spec.resolve()


# --- the table -----------------------------------------------------------------------------


@pytest.mark.parametrize("metric", METRICS.values(), ids=lambda metric: metric.name)
def test_a_metric_says_what_it_is(metric: Any) -> None:
    assert metric.name.isidentifier()
    assert metric.doc[0].isupper()
    assert metric.doc.endswith(".")
    assert "[" not in metric.doc
    assert metric.formula
    assert metric.source
    assert metric.better in ("less", "more", "")
    assert METRICS[metric.name] is metric
    first = (inspect.getdoc(metric.function) or "").partition("\n")[0]
    assert metric.unit == "bool" or first.endswith(f" [{metric.unit}].")


def test_metrics_of_one_file_are_shown_together_and_models_last() -> None:
    homes = [metric.function.__module__.rpartition(".")[2] for metric in METRICS.values()]
    assert [*dict.fromkeys(homes)] == [home for home, _ in groupby(homes)]
    needs = [metric.needs for metric in METRICS.values()]
    assert needs == sorted(needs)


NEW = '''"""Ballast."""

from draft.metrics.registry import metric


@metric(unit="kg", formula="m / 10", source="a test", better="less")
def ballast(design):
    """Mass of the ballast [kg].

    More is said here.
    """
    return design.mass / 10
'''


@pytest.fixture(scope="module")
def with_ballast(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    """The recipe of CONTRIBUTING: a copy of the package gains one file, and nothing else."""
    added = {"metrics/ballast.py": {"": NEW}}
    changed = ChangedPackage(tmp_path_factory.mktemp("copy"), added)
    return lambda *words: changed.run("-m", "draft", *words, "--json")


@pytest.mark.slow
def test_a_metric_is_added_by_one_file(with_ballast: Callable[..., Any]) -> None:
    words = with_ballast("metrics")
    assert [row["name"] for row in words] == [*METRICS, "ballast", *LEARNED]
    assert words[len(METRICS)]["doc"] == "Mass of the ballast."
    metrics = with_ballast("metrics", "hopper")["metrics"]
    assert metrics["ballast"] == pytest.approx(metrics["mass"] / 10)


@pytest.mark.slow
def test_an_added_metric_is_a_column_and_a_condition(
    with_ballast: Callable[..., Any], tmp_path: Path
) -> None:
    pytest.importorskip("pyarrow")
    out = str(tmp_path / "out.parquet")
    vary = ["--vary", "thigh_length=0.2:0.3", "--n", "4", "--where", "ballast > 1e-9"]
    said = with_ballast("screen", "hopper", *vary, "--metrics", "ballast", "--out", out)
    assert said["rows"] == 4


def test_two_metrics_of_one_name_are_refused() -> None:
    def mass(design: draft.Design) -> float:
        """Another mass [kg]."""
        return 0.0

    cause = "the metric 'mass' of tests.metrics.test_registry exists already in draft.metrics.sizes"
    with pytest.raises(draft.DraftError, match=cause):
        metric(unit="kg", formula="0", source="a test")(mass)
    assert METRICS["mass"].formula.startswith("sum of trunk")


def test_an_unknown_metric_names_the_nearest() -> None:
    with pytest.raises(draft.DraftError, match="there is no metric 'jump_hight'") as caught:
        find("jump_hight")
    assert "did you mean 'jump_height'?" in str(caught.value)
    design = draft.load("hopper").resolve()
    with pytest.raises(draft.DraftError, match="there is no metric 'speed'"):
        of_design(design, ["speed"])
    with pytest.raises(draft.DraftError, match="there is no metric 'speed'"):
        of_model(design.build(), ["speed"])


def test_a_metric_of_a_model_is_not_one_of_a_design() -> None:
    with pytest.raises(draft.DraftError, match="'foot_inertia' needs a compiled model"):
        of_design(draft.load("hopper").resolve(), ["mass", "foot_inertia"])


# --- shipped robots ------------------------------------------------------------------------


def test_what_the_shipped_robots_can_do(file_regression: FileRegressionFixture) -> None:
    lines = []
    for name, label in SHIPPED:
        design = shipped(name, label)
        lines.append(f"{name} {label or 'default'}")
        lines += [f"  {key} {x:.4g}" for key, x in of_model(design.build()).items()]
        lines += [f"  margin of {key} {x:.4g}" for key, x in joint_margins(design).items()]
    file_regression.check("\n".join(lines) + "\n")


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_the_band_is_nearly_the_drawn_one(name: str, label: str | None) -> None:
    design = shipped(name, label)
    found = of_design(design, ["mass_low", "mass_high"])
    nearness = 0.05 if name == "humanoid" else 0.02
    for value, drawn in zip(found.values(), design.mass_band(), strict=True):
        assert value == pytest.approx(drawn, rel=nearness)


def test_the_published_speed_estimates() -> None:
    speeds = [top_speed(shipped(*SHIPPED[k])) for k in range(3)]
    # arXiv 2609.38405, released code.
    assert speeds == pytest.approx([2.452, 3.013, 1.774], abs=5e-4)


# --- robots that lack something ------------------------------------------------------------


@pytest.mark.parametrize("length", [0.3, np.array([0.2, 0.3, 0.4])], ids=["one", "many"])
def test_robots_without_legs_have_no_leg_metrics(length: Any) -> None:
    chain = leg(
        thigh={"link": {"axis": "-z", "length": "x", "segment": "thigh"}},
        shank={"type": "basic", "sphere": None},
    )
    design = robot(chain, parameters={"x": parameter(0.3)}).resolve({"x": length})
    found = of_design(design)
    assert {name for name, x in found.items() if not np.isnan(x).all()} == LEGLESS
    assert all(np.shape(value) == np.shape(length) for value in found.values())
    assert joint_margins(design) == {}


def test_a_knee_that_slides_is_none() -> None:
    slide = {"name": "knee", "type": "slide", "axis": "z", "range": [-0.1, 0.1]}
    chain = leg(thigh={"motor": None}, shank={"joint": slide})
    found = of_design(robot(chain).resolve())
    assert np.isnan(found["torque_margin"])
    assert np.isnan(found["reach"])


def test_a_knee_across_the_vertical_gives_no_number_and_no_error() -> None:
    chain = leg(shank={"joint": {"name": "k", "axis": "z", "range": [-1, 1], "actuator": "leg"}})
    found = of_design(robot(chain).resolve())
    assert set(found) == {name for name in CLOSED if METRICS[name].base != "wheels"}


# --- N designs -----------------------------------------------------------------------------


def check_same(spec: draft.Spec, rows: list[dict[str, float]], varied: set[str]) -> None:
    table: dict[str, Any] = dict(rows[0])
    table |= {name: np.array([row[name] for row in rows]) for name in varied}
    many = spec.resolve(table)
    found, margins = of_design(many), joint_margins(many)
    for i, row in enumerate(rows):
        own = {name: row[name] if name in varied else rows[0][name] for name in row}
        one = spec.resolve(own)
        for name, value in of_design(one).items():
            assert np.shape(found[name]) == (len(rows),)
            got = found[name][i]  # type: ignore[index]
            # Below this a height is rounding: a knee that only straightens jumps by nothing.
            assert got == pytest.approx(value, rel=1e-9, abs=1e-12, nan_ok=True), name
        for name, value in joint_margins(one).items():
            got = np.broadcast_to(margins[name], len(rows))[i]
            assert got == pytest.approx(value, rel=1e-6), name


QUADRUPED = draft.load("quadruped")
NUMBERS = {
    "thigh_length": (0.2, 0.7),
    "shank_length": (0.2, 0.7),
    "hip_offset": (0.1, 0.2),
    "trunk_length": (0.5, 0.9),
    "actuators.leg.peak_torque": (40.0, 400.0),
    "actuators.leg.no_load_speed": (4.0, 40.0),
}
quadrupeds = st.fixed_dictionaries({k: st.floats(*v) for k, v in NUMBERS.items()})


@given(
    st.lists(quadrupeds, min_size=1, max_size=4), st.sets(st.sampled_from([*NUMBERS]), min_size=1)
)
def test_many_are_each(rows: list[dict[str, float]], varied: set[str]) -> None:
    check_same(QUADRUPED, rows, varied)


HUMANOID = draft.load("humanoid")


@given(
    st.lists(
        st.fixed_dictionaries(
            {
                "thigh_length": st.floats(0.15, 0.3),
                "shank_length": st.floats(0.15, 0.3),
                "actuators.large.peak_torque": st.floats(60, 200),
            }
        ),
        min_size=1,
        max_size=3,
    )
)
def test_many_humanoids_are_each(rows: list[dict[str, float]]) -> None:
    check_same(HUMANOID, rows, set(rows[0]))


# Its hip is parallel to its knee, or not, design by design.
CANTED = robot(
    leg(
        thigh={"joint": {"name": "hip", "axis": ["x", 1, "x"], "range": [-1, 1], "actuator": "leg"}}
    ),
    parameters={"x": parameter(0.0)},
)


@given(st.lists(st.fixed_dictionaries({"x": st.floats(-0.9, 0.9)}), min_size=1, max_size=6))
def test_which_joint_is_the_hip_may_differ(rows: list[dict[str, float]]) -> None:
    check_same(CANTED, [*rows, {"x": 0.1}, {"x": 0.6}], {"x"})


def test_a_design_forgotten_is_forgotten_with_its_numbers() -> None:
    spec = draft.load("hopper")
    # The same place in memory may be used again.
    found = [of_design(spec.resolve({"thigh_length": x})) for x in (0.2, 0.25, 0.3, 0.2)]
    payloads = [float(row["payload_peak"]) for row in found]
    assert payloads[3] == payloads[0]
    assert len(set(payloads)) == 3
