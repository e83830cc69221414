"""The table of capabilities, and all that reads it."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("pyarrow")

from draft.cli.display.evaluation import show
from draft.learn.measuring.learned_metrics import NUMBERS
from draft.learn.measuring.scalars import curves, scalars
from draft.learn.measuring.summary import Summary
from draft.metrics import LEARNED
from draft.metrics.capabilities import CAPABILITIES, MEASURED, Capability, Derived, of_table
from draft.study.report.table import to_texts
from tests.learn import synthetic
from tests.learn.measuring.columns import stood
from tests.study.report.pages import tables_of

# Metrics of a policy that are no capabilities but properties of its measurement.
OF_MEASUREMENT = {"learned.top_speed_error", "learned.inside"}
NEW = Capability(
    *("1/s", "leg lengths per second", "Top speed over the leg length."),
    tables=("capability_normalised",),
    law=Derived("top_speed", lambda speed, leg_length: speed / leg_length),
)


@pytest.fixture
def added(monkeypatch: pytest.MonkeyPatch) -> None:
    """The recipe of CONTRIBUTING: the table gains one line, with its law."""
    monkeypatch.setitem(CAPABILITIES, "lengths", NEW)


def test_a_capability_is_added_by_its_line_and_its_law(
    added: None, capsys: pytest.CaptureFixture[str]
) -> None:
    found = scalars(curves(stood("speed", {1.0: 10}, speed=3.0)), 0.5)
    assert found.values["top_speed"] == 3.0
    assert found.values["lengths"] == 6.0
    head = {"format": 2, "stage": "velocity", "design": "a", "arm": "nominal", "errors": None}
    record = {**head, "protocol": "walking", "scalars": found.values, "reasons": found.reasons}
    show([Summary.model_validate(record)])
    assert "leg lengths per second [1/s]" in " ".join(capsys.readouterr().out.split())


def test_an_added_capability_without_a_value_has_the_reason_of_its_input(added: None) -> None:
    found = scalars(curves(stood("speed", {1.0: 0})), 0.5)
    assert found.values["lengths"] is None
    assert found.reasons["lengths"] == found.reasons["top_speed"] == "all fell at every level"


@pytest.mark.slow
def test_an_added_capability_is_a_column_of_the_studys_tables(added: None, tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path / "study", ("cheetah",), (0,), ("nominal",), ("velocity",))
    heads, rows = to_texts(tables_of(folder)["capability_normalised"])
    assert "leg lengths per second [1/s]" in heads
    assert all(row[heads.index("leg lengths per second [1/s]")] for row in rows)


@pytest.mark.parametrize("name", CAPABILITIES)
def test_a_capability_says_what_it_is(name: str) -> None:
    one = CAPABILITIES[name]
    assert one.text[0].isupper()
    assert one.text.endswith(".")
    assert one.better in ("less", "more", "")
    assert one.law is None or CAPABILITIES[one.law.of].law is None


def test_metrics_of_a_policy_are_those_with_a_formula() -> None:
    assert {f"learned.{name}" for name in MEASURED} | OF_MEASUREMENT == LEARNED.keys()
    assert {*MEASURED, "top_speed_error"} == {*NUMBERS}
    for name, one in MEASURED.items():
        metric = LEARNED[f"learned.{name}"]
        assert (metric.unit, metric.doc, metric.better) == (one.unit, one.text, one.better)


def test_less_of_what_costs_energy_is_better() -> None:
    less = {name for name, one in CAPABILITIES.items() if one.better == "less"}
    assert less == {"walk_cost_of_transport", "cost_of_transport"}
    assert less < {*of_table("energy")}
