"""`draft report` and `draft build --report`."""

from __future__ import annotations

from pathlib import Path

import pytest

from draft.__main__ import _choose_rendering
from draft.browser.engine import available
from draft.learn.policy.policy import FAMILY
from draft.reporting import figures
from tests.commands import Command
from tests.written import files_below

pytest.importorskip("plotly")


def test_a_page_is_written_and_named(command: Command) -> None:
    out = command("report robot robot:long --out deep/page.html").out.splitlines()
    assert files_below(Path("deep")) == {"page.html"}
    assert out[0] == "deep/page.html"
    assert out[1].startswith("2 designs in ")
    table = command.json("report robot robot:long")
    assert list(table["designs"]) == ["default", "long"]
    assert table["designs"]["long"]["parameters"]["thigh_length"]["value"] == 0.45
    assert table["out"] == ["report.html"]


@pytest.mark.parametrize("live", [False, True])
def test_robots_walk_on_request(
    live: bool, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    if live:
        pytest.importorskip("mjswan", reason="needs the extra page")
    else:
        monkeypatch.setattr("draft.reporting.subjects.available", lambda: False)
    command("report cheetah hopper --walk")
    text = Path("report.html").read_text(encoding="utf-8")
    assert ('class="live"' if live else 'id="walk-play"') in text
    assert "stands: no policy drives the joints of hopper" in text


@pytest.mark.slow
def test_figures_are_png_and_pdf(monkeypatch: pytest.MonkeyPatch, command: Command) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.setattr(figures, "picture", lambda _: None)
    command("report robot robot:long --figures figures")
    names = ("masses", "actuators", "torque_speed", "metrics", "parameters")
    assert files_below(Path("figures")) == {f"{n}.{kind}" for n in names for kind in ("png", "pdf")}


def test_a_policy_of_another_robot_is_refused(command: Command) -> None:
    said = command.refuses("report humanoid --walk --policy", FAMILY)
    assert "family.onnx drives no robot here: the robot has 2 legs, and the policy drives 4" in said
    if available():
        assert said == command.refuses("page humanoid --policy", FAMILY)
    command("report humanoid cheetah --walk --policy", FAMILY)


def test_a_page_is_an_html_file(command: Command) -> None:
    assert "--out 'robot/tree.yaml' does not end in .html" in command.refuses(
        "report robot --out robot/tree.yaml"
    )


def test_figures_are_drawn_without_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    chosen = []
    monkeypatch.setattr("draft.__main__.prefer_offscreen", lambda: chosen.append("offscreen"))
    monkeypatch.setattr("draft.__main__.disable_drawing", lambda: chosen.append("disabled"))
    for line in ("report bear", "report bear --figures d", "report bear --figures=d"):
        _choose_rendering(line.split())
    assert chosen == ["disabled", "offscreen", "offscreen"]


def test_a_build_may_have_a_report(command: Command) -> None:
    for more in (["--report"], []):
        command("build robot --out model", *more)
        assert ("report.html" in files_below(Path("model"))) == bool(more)


def test_nothing_to_report_is_bad_input(command: Command) -> None:
    assert "1 to 12 designs" in command.refuses("report")
    command.refuses("report nobody")
    assert not Path("report.html").exists()
