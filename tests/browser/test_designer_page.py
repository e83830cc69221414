"""Numbers and files of a design change in its page, in a real browser."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from benchmarks import browser as chromium
from draft.browser import live, pyodide
from draft.browser.page import page
from draft.design.references import open_design
from draft.serving.messages import MessageServer

pytest.importorskip("mjswan", reason="needs the extra page")

Open = Callable[..., Any]


@pytest.fixture
def opened(browser: Any, tmp_path: Path) -> Iterator[Open]:
    """Opens a live page of some designs; its tab has what it asked for as `asked`."""
    servers: list[MessageServer] = []
    tabs: list[Any] = []

    def open_(*designs: str, **options: Any) -> Any:
        servers.append(live.serve(page(designs, tmp_path / "page", live=True, **options)))
        tab = chromium.tab(browser, viewport={"width": 1280, "height": 900})
        tabs.append(tab)
        tab.faults, tab.asked, tab.server = [], [], servers[-1]
        tab.on("pageerror", lambda error: tab.faults.append(str(error)))
        tab.on("request", lambda request: tab.asked.append(request.url))
        tab.goto(f"http://127.0.0.1:{servers[-1].port}/#forward=0.5")
        tab.wait_for_function("window.draftPage")
        tab.click("#design > summary")
        return tab

    yield open_
    for tab in tabs:
        tab.context.close()
    for server in servers:
        server.close()


def put(tab: Any, name: str, text: str) -> None:
    field = tab.locator(f"[data-name='{name}']")
    field.fill(text)
    field.press("Enter")


def settle(tab: Any, problems: bool = False) -> None:
    """Wait for an answer, of a robot or of problems."""
    shown = "document.getElementById('design-problems').children.length > 0"
    tab.wait_for_function(f"!draftPage.designer.busy && {shown} === {json.dumps(problems)}")


def mass(tab: Any) -> float:
    return float(tab.inner_text("#mass").split()[0])


@pytest.mark.slow
def test_any_number_of_any_robot_changes_while_it_walks(opened: Open) -> None:
    tab = opened("cheetah", "arm")
    tab.wait_for_function("draftPage.robots[0].qpos[0] > 0.2")
    light, before = mass(tab), tab.evaluate("draftPage.robots[0].qpos[0]")
    put(tab, "thigh_length", "0.3")
    settle(tab)
    values = {**open_design("cheetah").values, "thigh_length": 0.3}
    assert mass(tab) == pytest.approx(open_design("cheetah").spec.resolve(values).mass, abs=0.005)
    assert mass(tab) > light
    assert tab.evaluate("draftPage.robots[0].qpos[0]") >= before
    assert tab.evaluate("draftPage.robots[0].falls") == 0
    assert tab.inner_text("#design-changed") == "--set thigh_length=0.3"
    put(tab, "thigh_length", "shank_length * 1.1")  # An expression.
    settle(tab)
    assert "shank_length * 1.1" in tab.inner_text("#design-changed")
    tab.click("#robots button:nth-child(2)")
    put(tab, "upper_arm_length", "0.5")
    settle(tab)
    assert "upper_arm_length=0.5" in tab.inner_text("#design-changed")
    assert tab.faults == []
    own = f"http://127.0.0.1:{tab.server.port}/"
    assert all(url.startswith((own, "data:")) for url in tab.asked)


@pytest.mark.slow
def test_a_number_that_gives_no_robot_is_said_and_the_robot_stays(opened: Open) -> None:
    tab = opened("cheetah")
    light = mass(tab)
    put(tab, "thigh_length", "3")
    settle(tab, problems=True)
    said = tab.inner_text("#design-problems")
    assert "thigh_length = 3 m is outside its range [0.1, 0.9]" in said
    assert "parameters.yaml:7:3" in said
    assert mass(tab) == light
    put(tab, "thigh_length", "<img src=x onerror=alert(1)>")
    settle(tab, problems=True)
    assert tab.locator("#design img").count() == 0
    put(tab, "thigh_length", "0.25")
    settle(tab)
    put(tab, "actuators.leg.peak_torque", "1")
    settle(tab)
    assert tab.inner_text("#verdict") == "It could not be built:"
    assert "cannot stand" in tab.inner_text("#findings")
    assert tab.faults == []


@pytest.mark.slow
def test_letters_in_a_field_do_not_steer(opened: Open) -> None:
    tab = opened("cheetah")
    command = tab.evaluate("draftPage.steering.command")
    tab.locator("[data-name=thigh_length]").focus()
    tab.keyboard.type("w a s d q e p")
    assert tab.evaluate("draftPage.steering.command") == command
    assert tab.locator("[data-name=thigh_length]").input_value().endswith("w a s d q e p")


@pytest.mark.slow
def test_files_are_edited_and_a_robot_of_ones_own_is_dropped_in(
    opened: Open, tmp_path: Path
) -> None:
    tab = opened("cheetah")
    tab.click("#design-fields summary")
    tab.select_option("#design-file", "tree.yaml")
    text = tab.input_value("#design-text")
    tab.fill("#design-text", text.replace("type", "typ", 1))
    tab.click("#design-apply")
    settle(tab, problems=True)
    assert re.search(r"tree\.yaml:\d+:\d+ unknown key 'typ'", tab.inner_text("#design-problems"))
    assert tab.locator("#design-problems").is_visible()
    tab.click("#design-back")
    settle(tab)
    folder = open_design("hexapod").spec.folder
    assert folder is not None
    own = [str(folder / f"{name}.yaml") for name in ("parameters", "tree", "root")]
    tab.set_input_files("#design-open", own)
    tab.wait_for_function("draftPage.robots[0].policy?.joints.length === 18")
    settle(tab)
    assert tab.inner_text("#name") == "hexapod"
    tab.wait_for_function("draftPage.robots[0].qpos[0] > 0.05")
    other = tmp_path / "thesis.tex"
    other.write_text("years of work")
    tab.set_input_files("#design-open", str(other))
    settle(tab, problems=True)
    assert "a robot has no such file" in tab.inner_text("#design-problems")
    tab.select_option("#design-file", "root.yaml")
    tab.click("#design-apply")  # Files that were refused are not asked for again.
    settle(tab)
    other.write_bytes(b"\x00\xff")
    tab.set_input_files("#design-open", str(other))
    settle(tab, problems=True)
    assert "it is no text" in tab.inner_text("#design-problems")
    assert tab.faults == []


@pytest.mark.slow
def test_sliders_of_the_page_and_fields_are_of_one_robot(opened: Open) -> None:
    tab = opened("cheetah", vary=("thigh_length=0.22:0.3",))
    put(tab, "shank_length", "0.26")
    settle(tab)
    assert tab.inner_text("#design-changed") == "--set shank_length=0.26"
    tab.locator("[id=thigh_length]").focus()
    tab.keyboard.press("End")
    settle(tab)
    values = {**open_design("cheetah").values, "thigh_length": 0.3, "shank_length": 0.26}
    assert mass(tab) == pytest.approx(open_design("cheetah").spec.resolve(values).mass, abs=0.005)
    put(tab, "thigh_length", "0.24")
    settle(tab)
    assert float(tab.input_value("[id=thigh_length]")) == 0.24
    assert tab.faults == []


def slide_to_the_end(tab: Any) -> None:
    tab.locator("[id=thigh_length]").focus()
    tab.keyboard.press("End")


@pytest.mark.slow
def test_a_slider_that_moves_before_the_answer_counts(opened: Open) -> None:
    tab = opened("cheetah", vary=("thigh_length=0.22:0.3",))
    tab.evaluate(
        """() => {
          const { designer } = draftPage, ask = designer.ask;
          designer.ask = async (text) => {
            await new Promise((take) => { window.go = take; });
            designer.ask = ask;
            return ask(text);
          };
        }"""
    )
    put(tab, "shank_length", "0.26")
    slide_to_the_end(tab)
    tab.evaluate("go()")
    settle(tab)
    values = {**open_design("cheetah").values, "thigh_length": 0.3, "shank_length": 0.26}
    assert mass(tab) == pytest.approx(open_design("cheetah").spec.resolve(values).mass, abs=0.005)
    assert float(tab.input_value("[id=thigh_length]")) == 0.3
    assert tab.evaluate("draftPage.networks.size") == 1
    assert tab.faults == []


@pytest.mark.slow
def test_sliders_of_the_page_leave_a_robot_of_other_files(opened: Open) -> None:
    tab = opened("cheetah", vary=("thigh_length=0.22:0.3",))
    folder = open_design("biped").spec.folder
    assert folder is not None
    tab.click("#design-fields summary")
    own = [str(folder / f"{name}.yaml") for name in ("parameters", "tree", "root")]
    tab.set_input_files("#design-open", own)
    tab.wait_for_function("draftPage.designer.changed[0]")
    settle(tab)
    slide_to_the_end(tab)
    settle(tab)
    assert tab.inner_text("#sliders output") == "–"
    assert tab.inner_text("#design-changed") == ""
    assert tab.inner_text("#name") == "biped"
    tab.click("#design-back")
    settle(tab)
    assert tab.inner_text("#name") == "cheetah"
    assert tab.inner_text("#sliders output") == "0.250 m"
    slide_to_the_end(tab)
    settle(tab)
    assert tab.inner_text("#sliders output") == "0.300 m"
    assert tab.inner_text("#design-changed") == "--set thigh_length=0.3"
    assert tab.faults == []


@pytest.mark.slow
def test_a_field_of_the_first_robot_moves_the_sliders_and_the_others_with_them(
    opened: Open,
) -> None:
    tab = opened("cheetah", "bear", vary=("thigh_length=*0.8:*1.2",))
    tab.click("#robots button:nth-child(2)")
    before = mass(tab)
    assert tab.inner_text("#design-changed") == ""
    tab.click("#robots button:nth-child(1)")
    length = open_design("cheetah").parameters["thigh_length"]
    put(tab, "thigh_length", str(1.2 * float(length)))
    settle(tab)
    tab.click("#robots button:nth-child(2)")
    assert mass(tab) > before
    assert "thigh_length=" in tab.inner_text("#design-changed")
    assert tab.evaluate("draftPage.designer.changed") == [True, False]
    assert tab.faults == []


@pytest.mark.slow
def test_problems_and_texts_stay_with_their_robot(opened: Open) -> None:
    tab = opened("cheetah", "arm")
    put(tab, "thigh_length", "3")
    settle(tab, problems=True)
    tab.click("#robots button:nth-child(2)")
    assert tab.locator("#design-problems li").count() == 0
    put(tab, "upper_arm_length", "0.5")
    settle(tab)
    tab.click("#design-fields summary")
    tab.fill("#design-text", "# not applied")
    put(tab, "upper_arm_length", "0.51 * 1")
    settle(tab)
    assert tab.input_value("#design-text") == "# not applied"
    assert tab.inner_text("#design-changed") == "--set 'upper_arm_length=0.51 * 1'"
    tab.click("#robots button:nth-child(1)")
    assert "outside its range" in tab.inner_text("#design-problems")
    assert tab.input_value("[data-name=thigh_length]") == "3"
    tab.evaluate("draftPage.designer.take({'parameters.yaml': '#'.repeat(5e6)})")
    tab.wait_for_function("document.getElementById('design-problems').innerText.includes('bytes')")
    assert "4000000 at most" in tab.inner_text("#design-problems")
    assert tab.faults == []


@pytest.mark.slow
def test_a_page_whose_process_has_ended_says_so(opened: Open) -> None:
    tab = opened("cheetah")
    tab.server.close()
    put(tab, "thigh_length", "0.3")
    settle(tab, problems=True)
    assert "The process of this page has ended" in tab.inner_text("#design-problems")


@pytest.mark.slow
def test_python_is_asked_for_by_its_button_alone_and_a_page_without_it_stays(
    browser: Any, tmp_path: Path
) -> None:
    written = page(["cheetah"], tmp_path / "page", python=True)
    files = {path.name: path.read_bytes() for path in written}
    server = MessageServer(files, "/none", lambda text: "")
    tab = chromium.tab(browser)
    outside: list[str] = []

    def answer_outside(route: Any) -> None:
        outside.append(route.request.url)
        # Another file than that of the hash, as of a host that has been broken into.
        route.fulfill(body="postMessage(1)", headers={"Access-Control-Allow-Origin": "*"})

    tab.context.route(lambda url: not url.startswith("http://127.0.0.1"), answer_outside)
    tab.goto(f"http://127.0.0.1:{server.port}/")
    tab.wait_for_function("window.draftPage?.count.simulated > 0.2")
    tab.click("#design > summary")
    assert tab.locator("[data-name=thigh_length]").is_disabled()
    assert outside == []
    tab.click("#design-start")
    settle(tab, problems=True)
    assert "is not the file that this page was written for" in tab.inner_text("#design-problems")
    assert {url.rpartition("/")[0] + "/" for url in outside} == {pyodide.OWN}
    assert tab.locator("#design-start").is_enabled()
    before = tab.evaluate("draftPage.count.simulated")
    tab.wait_for_function(f"draftPage.count.simulated > {before}")
    tab.context.close()
    server.close()


def test_a_page_without_a_designer_holds_no_files(tmp_path: Path) -> None:
    page(["cheetah"], tmp_path / "page")
    text = (tmp_path / "page" / "index.html").read_text("utf-8")
    assert '"source"' not in text
    assert '<details id="design" hidden>' in text
