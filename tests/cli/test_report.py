"""`draft report` and `draft build --report`."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from draft.cli import main
from draft.extras import remedy
from draft.reporting import figures
from tests.written import files_below

pytest.importorskip("plotly")


def test_a_page_is_written_and_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "robot", "robot:long", "--out", "deep/page.html"]) == 0
    assert files_below(Path("deep")) == {"page.html"}
    out = capsys.readouterr().out.splitlines()
    assert out[0] == "deep/page.html"
    assert out[1].startswith("2 designs in ")


def test_robots_walk_on_request() -> None:
    assert main(["report", "cheetah", "humanoid", "--walk"]) == 0
    text = Path("report.html").read_text(encoding="utf-8")
    assert 'id="walk-play"' in text
    assert "draft train humanoid" in text


def test_json_is_the_reports(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "robot", "robot:long", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert list(table["designs"]) == ["default", "long"]
    assert table["designs"]["long"]["parameters"]["thigh_length"]["value"] == 0.45
    assert table["out"] == ["report.html"]


@pytest.mark.slow
def test_figures_are_png_and_pdf(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(figures, "picture", lambda _: None)
    assert main(["report", "robot", "robot:long", "--figures", "figures"]) == 0
    names = ("masses", "actuators", "torque_speed", "metrics", "parameters")
    assert files_below(Path("figures")) == {f"{n}.{kind}" for n in names for kind in ("png", "pdf")}


def test_a_build_may_have_a_report() -> None:
    assert main(["build", "robot", "--out", "model", "--report"]) == 0
    assert "report.html" in files_below(Path("model"))
    assert main(["build", "robot", "--out", "model"]) == 0
    assert "report.html" not in files_below(Path("model"))


def test_nothing_to_report_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report"]) == 2
    assert "1 to 12 designs" in capsys.readouterr().err
    assert main(["report", "nobody"]) == 2
    assert not Path("report.html").exists()


@pytest.mark.parametrize("command", [["report", "robot"], ["build", "robot", "--report"]])
def test_without_the_extra_nothing_is_written(
    command: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "plotly", None)
    assert main(command) == 2
    assert remedy("report") in capsys.readouterr().err
    assert {path.name for path in Path().iterdir()} == {"robot"}
