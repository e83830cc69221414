"""The studio as a person sees it, in a real browser of 1280 x 720.

With DRAFT_PICTURES=1, pictures of each state are kept in `build/studio/`, for a look.
"""

from __future__ import annotations

import io
import os
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from benchmarks import browser as chromium

viser = pytest.importorskip("viser", reason="needs the extra 'view'")

from PIL import Image  # noqa: E402

from draft.explore.comparison_tables import section  # noqa: E402
from draft.studio import panel  # noqa: E402
from draft.studio.drop import HEIGHT, Drop  # noqa: E402
from draft.studio.library import Library  # noqa: E402
from draft.studio.server import Studio  # noqa: E402
from tests import fixed, gamepad  # noqa: E402
from tests.studio.robots import with_motor_of_its_own  # noqa: E402
from tests.waiting import until  # noqa: E402

PICTURES = Path(__file__).resolve().parents[2] / "build" / "studio"
TOKEN = "a-token-of-20-chars_"
pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "designs"


@pytest.fixture
def studio(tmp_path: Path, folder: Path) -> Iterator[Studio]:
    made = Studio(Library(draft.load("quadruped"), folder), port=0, out=tmp_path / "out")
    yield made
    made.close()


@pytest.fixture
def address(studio: Studio) -> str:
    return f"http://127.0.0.1:{studio.port}/"


@pytest.fixture
def tab(browser: Any, address: str) -> Iterator[Any]:
    made = visit(browser, address)
    yield made
    made.context.close()


def visit(browser: Any, address: str) -> Any:
    """A tab whose fields are there to be used."""
    made = chromium.page(browser, address)
    made.wait_for_selector("label:has-text('trunk_height')")
    return made


def mass(tab: Any) -> float:
    return float(tab.inner_text("#ds-mass").split()[0])


def enter(tab: Any, studio: Studio, label: str, text: str) -> None:
    """Fill a field, and wait until the server has it, which the page sends a little later."""
    (shown, _), *_ = studio._panels.values()
    chromium.field(tab, label).fill(text)
    handles = shown._client.gui._gui_input_handle_from_uuid
    until(lambda: (label, text) in [(one.label, one.value) for one in list(handles.values())])


def picture(tab: Any, name: str) -> None:
    if "DRAFT_PICTURES" not in os.environ:
        return
    PICTURES.mkdir(parents=True, exist_ok=True)
    close = tab.get_by_text("Software WebGL rendering detected")
    if close.count():
        tab.evaluate(
            "document.querySelectorAll('[role=alert] button').forEach(button => button.click())"
        )
    time.sleep(1.5)
    tab.screenshot(path=PICTURES / f"{name}.png")


def press(tab: Any, name: str) -> None:
    tab.get_by_role("button", name=name, exact=True).click()


def turn_to(tab: Any, name: str) -> None:
    tab.get_by_role("tab", name=name, exact=True).click()


def push(tab: Any, label: str, times: int = 1) -> None:
    thumb = chromium.slider(tab, label)
    for _ in range(times):
        thumb.press("ArrowRight")


def load(tab: Any, name: str) -> None:
    chromium.field(tab, "design").click()
    tab.get_by_role("option", name=name).click()


def test_a_slider_moves_the_mass_and_undo_brings_it_back(tab: Any) -> None:
    before = mass(tab)
    picture(tab, "start")
    push(tab, "thigh_length", 5)
    until(lambda: mass(tab) > before)
    until(lambda: "1 changed" in tab.inner_text("body"))
    until(lambda: tab.locator("label:has-text('● thigh_length')").count() == 1)
    picture(tab, "changed")
    press(tab, "Undo")
    until(lambda: mass(tab) == before)
    assert tab.locator("label:has-text('●')").count() == 0
    press(tab, "Redo")
    until(lambda: mass(tab) > before)
    press(tab, "reset to 0.25 m")
    until(lambda: mass(tab) == before)


def test_a_finding_is_told_with_its_limit_and_the_way_to_allow_it(tab: Any) -> None:
    turn_to(tab, "Parameters")
    chromium.field(tab, "peak_torque").fill("280")
    until(lambda: tab.inner_text("#ds-verdict") == "refused")
    text = tab.inner_text("body")
    assert "error: torque" in text
    assert "torque:leg" in text
    assert "parameters.yaml" in text
    picture(tab, "refused")
    turn_to(tab, "Trends")
    picture(tab, "trends")
    turn_to(tab, "Actuators")
    picture(tab, "actuators")


def test_a_bad_value_is_explained_and_the_last_good_robot_stays(tab: Any, studio: Studio) -> None:
    before = mass(tab)
    turn_to(tab, "Expression")
    enter(tab, studio, "value", "1 / (thigh_length - thigh_length)")
    press(tab, "Apply")
    until(lambda: tab.locator("#ds-message").count() == 1)
    assert "last valid robot" in tab.inner_text("#ds-message")
    assert mass(tab) == before
    picture(tab, "bad_value")
    enter(tab, studio, "value", "1.5 * shank_length")
    press(tab, "Apply")
    until(lambda: tab.locator("#ds-message").count() == 0)
    until(lambda: mass(tab) > before)


def test_a_design_is_saved_loaded_exported_and_reported(
    tab: Any, browser: Any, studio: Studio, address: str, folder: Path
) -> None:
    push(tab, "thigh_length", 9)
    until(lambda: "1 changed" in tab.inner_text("body"))
    turn_to(tab, "Save")
    enter(tab, studio, "name", "mine")
    press(tab, "Save as named design")
    until((folder / "mine.yaml").is_file)
    until(lambda: "changed" not in tab.inner_text("body"))
    saved = mass(tab)
    press(tab, "Export MuJoCo model")
    until((folder.parent / "out" / "mine" / "robot.xml").is_file)
    picture(tab, "saved")
    with tab.context.expect_page() as found:
        tab.get_by_text("Open the report").click()
    report = found.value
    report.wait_for_load_state()
    assert f"{saved:.1f}" in report.inner_text("body")
    picture(report, "report")
    other = visit(browser, address)
    assert mass(other) != saved
    load(other, "mine")
    until(lambda: mass(other) == saved)
    other.context.close()


def test_a_motor_of_ones_own_is_shown_and_another_is_chosen(browser: Any, tmp_path: Path) -> None:
    spec = with_motor_of_its_own(tmp_path / "jumper")
    studio = Studio(Library(spec), port=0, out=tmp_path / "out")
    tab = chromium.page(browser, f"http://127.0.0.1:{studio.port}/")
    try:
        tab.wait_for_selector("label:has-text('body_height')")
        before = mass(tab)
        turn_to(tab, "Parameters")
        assert chromium.field(tab, "like").input_value() == "S-40"
        chromium.field(tab, "like").click()
        tab.get_by_role("option", name="S-80").click()
        until(lambda: mass(tab) > before)
    finally:
        tab.context.close()
        studio.close()


def test_two_tabs_do_not_disturb_each_other(tab: Any, browser: Any, address: str) -> None:
    other = visit(browser, address)
    before = mass(tab)
    push(other, "trunk_length", 10)
    until(lambda: mass(other) > before)
    push(tab, "thigh_length", 3)
    until(lambda: mass(tab) != before)
    assert "1 changed" in tab.inner_text("body")
    assert tab.locator("label:has-text('● trunk_length')").count() == 0
    until(lambda: other.locator("label:has-text('● trunk_length')").count() == 1)
    assert other.locator("label:has-text('● thigh_length')").count() == 0
    other.context.close()
    push(tab, "thigh_length", 3)
    until(lambda: "1 changed" in tab.inner_text("body"))


def test_a_pinned_design_stays_as_a_ghost_and_a_limp_robot_falls(
    tab: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    drops: list[Drop] = []

    def noted(*arguments: Any) -> Drop:
        drops.append(Drop(*arguments))
        return drops[-1]

    monkeypatch.setattr(panel, "Drop", noted)
    press(tab, "Pin")
    load(tab, "bear")
    until(lambda: tab.locator("#ds-pinned").count() == 1)
    until(lambda: "kg now" in tab.inner_text("#ds-pinned"))
    picture(tab, "pinned")
    turn_to(tab, "Pose")
    press(tab, "Limp")
    until(lambda: drops)
    start = drops[0].data.qpos[2]
    until(lambda: drops[0].data.qpos[2] < start - HEIGHT)
    picture(tab, "dropped")
    press(tab, "Stop")
    turn_to(tab, "Parameters")
    before = mass(tab)
    push(tab, "thigh_length", 2)
    until(lambda: mass(tab) != before)


def test_a_pinned_design_has_a_tab_that_says_why_the_design_differs(
    tab: Any, studio: Studio
) -> None:
    (shown, _), *_ = studio._panels.values()
    press(tab, "Pin")
    tab.get_by_role("tab", name="Pinned", exact=True).wait_for()
    turn_to(tab, "Pinned")
    tab.wait_for_selector("#ds-same")
    push(tab, "thigh_length", 10)
    tab.wait_for_selector("#ds-compared")
    session = shown._session
    until(lambda: session.design.parameters["thigh_length"] == pytest.approx(0.26))
    assert session.pinned is not None
    designs = (session.pinned.design, session.design)
    found = draft.compare(designs, ["mass", "jump_height"], names=("pinned", "now"))
    for row in section(found, found.metrics).summary.rows:
        for cell in row[2:]:
            until(lambda cell=cell: cell in tab.inner_text("body"))
    assert "knee: rated torque (leg)" in tab.inner_text("body")
    picture(tab, "pinned_why")
    press(tab, "Unpin")
    until(lambda: tab.get_by_role("tab", name="Pinned", exact=True).count() == 0)


# Sliders of which a person sees the thumb: nothing covers it, and it is inside the window.
SEEN = """() => [...document.querySelectorAll('[role=slider]')].filter((thumb) => {
  const box = thumb.getBoundingClientRect();
  const top = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2);
  return top !== null && (top === thumb || top.closest('.mantine-Slider-root')?.contains(thumb));
}).length"""


@pytest.mark.parametrize("robot", ["quadruped", "humanoid"])
def test_ten_sliders_are_seen_without_scrolling(robot: str, browser: Any, tmp_path: Path) -> None:
    studio = Studio(Library(draft.load(robot), tmp_path / "designs"), port=0)
    tab = chromium.tab(browser, viewport={"width": 1280, "height": 800})
    try:
        tab.goto(f"http://127.0.0.1:{studio.port}/")
        tab.wait_for_selector("label:has-text('thigh_length')")
        until(lambda: tab.evaluate(SEEN) >= 10)
        assert chromium.slider(tab, "thigh_length").is_visible()
        assert tab.locator("canvas").first.bounding_box()["width"] >= 0.69 * 1280
        picture(tab, f"sliders_{robot}")
    finally:
        tab.context.close()
        studio.close()


def test_the_robot_has_a_shadow_on_the_floor_that_follows_it(tab: Any, studio: Studio) -> None:
    canvas = tab.locator("canvas").first.bounding_box()

    def seen() -> np.ndarray:
        shot = tab.screenshot(clip=canvas)
        return np.asarray(Image.open(io.BytesIO(shot)).convert("L"), int)

    (shown, _), *_ = studio._panels.values()
    until(lambda: shown._robot._shadow is not None)
    standing: Any = shown._robot._shadow
    until(lambda: np.array_equal(seen(), seen()))  # the camera has moved to the robot
    with_shadow = seen()
    standing.visible = False
    until(lambda: not np.array_equal(seen(), with_shadow))
    gained = seen() - with_shadow
    assert (gained > 30).sum() > 2000
    assert (gained < -30).sum() < 100
    standing.visible = True
    before = standing.vertices.copy()
    walk(tab)
    until(lambda: not np.array_equal(standing.vertices, before))


def test_without_the_token_a_browser_gets_nothing(browser: Any, folder: Path) -> None:
    studio = Studio(Library(draft.load("hopper"), folder), host="0.0.0.0", port=0, token=TOKEN)
    address = f"http://127.0.0.1:{studio.port}/"
    page = chromium.tab(browser)
    try:
        for query in ("", "?token=wrong-token-of-20-ch"):
            assert page.goto(address + query).status == 401
            assert "requires its token" in page.inner_text("body")
        tried = page.evaluate(
            """([address, protocol]) => new Promise((done) => {
              const socket = new WebSocket(address, protocol);
              socket.onmessage = () => done('message');
              socket.onopen = () => done('open');
              socket.onerror = () => done('refused');
            })""",
            [address.replace("http", "ws"), f"viser-v{viser.__version__}"],
        )
        assert tried == "refused"
        known = chromium.page(browser, f"{address}?token={TOKEN}")
        assert re.fullmatch(r"\d+\.\d+ kg", known.inner_text("#ds-mass"))
        assert TOKEN not in known.url
        assert page.goto(address).status == 401
        known.context.close()
    finally:
        page.context.close()
        studio.close()


def walker(studio: Studio) -> Any:
    (shown, _), *_ = studio._panels.values()
    return shown._walker


def walk(tab: Any) -> None:
    turn_to(tab, "Walk")
    tab.get_by_label("Walk", exact=True).last.click()


def test_the_robot_walks_on_while_a_slider_changes_its_legs(tab: Any, studio: Studio) -> None:
    said: list[str] = []
    tab.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    tab.on("pageerror", lambda error: said.append(str(error)))
    walk(tab)
    until(lambda: walker(studio).walk is not None and walker(studio).walk.data.time > 0.5)
    until(lambda: tab.locator(".ds-dot").count() == 1)
    picture(tab, "walking")
    before, walking = mass(tab), walker(studio).walk
    push(tab, "thigh_length")  # one step: several are several steps of undo on a slow machine
    until(lambda: mass(tab) > before)
    until(lambda: tab.get_by_text("Policy of the family of quadrupeds.").count() == 1)
    assert walker(studio).walk is walking
    picture(tab, "walking_longer")
    tab.keyboard.press("k")
    until(lambda: walker(studio).command[0] == pytest.approx(0.7))
    until(lambda: chromium.field(tab, "forward").input_value() == "0.7")
    press(tab, "From the left")
    tab.keyboard.press("Control+z")
    until(lambda: mass(tab) == before)
    until(lambda: tab.get_by_text("Policy of quadruped:cheetah.").count() == 1)
    turn_to(tab, "Pose")
    press(tab, "Home")
    until(lambda: not walker(studio).on)
    until(lambda: not tab.get_by_label("Walk", exact=True).last.is_checked())
    assert said == []


def test_a_gamepad_steers_and_pushes_the_robot(browser: Any, address: str, studio: Studio) -> None:
    shown = chromium.tab(browser, viewport={"width": 1280, "height": 720})
    shown.add_init_script(gamepad.FAKE)
    shown.goto(address)
    shown.wait_for_selector("#ds-mass")
    said: list[str] = []
    shown.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
    walk(shown)
    until(lambda: walker(studio).walk is not None)
    robot = walker(studio)
    gamepad.hold(shown, [0, -1, 0.575, 0])
    until(lambda: robot.command == pytest.approx((robot.most[0], 0.0, -0.5), abs=0.01))
    until(lambda: chromium.field(shown, "forward").input_value() == f"{robot.most[0]:g}")
    frame = shown.frame_locator("iframe[title=gamepad]")
    until(lambda: frame.locator("#state").inner_text() == "Test pad")
    shown.locator("iframe[title=gamepad]").scroll_into_view_if_needed()
    picture(shown, "gamepad")
    pushed: list[float] = []
    robot.push = lambda size, left=True: pushed.append(size if left else -size)
    gamepad.hold(shown, [0, 0, 0, 0], gamepad.RIGHT_SHOULDER)
    until(lambda: pushed == [1.5])
    gamepad.hold(shown, [0, 0, 0, 0], gamepad.LEFT_SHOULDER)
    until(lambda: len(pushed) == 2)
    assert robot.command == (0.0, 0.0, 0.0)
    assert pushed == [1.5, -1.5]
    assert said == []
    shown.context.close()


def test_a_walk_ends_with_its_tab_and_others_go_on(
    tab: Any, browser: Any, studio: Studio, address: str
) -> None:
    walk(tab)
    until(lambda: walker(studio).walk is not None)
    (shown, _), *_ = studio._panels.values()
    other = visit(browser, address)
    until(lambda: len(studio._panels) == 2)
    second = next(one for one, _ in studio._panels.values() if one is not shown)
    assert not second._walker.on
    walk(other)
    until(lambda: second._walker.walk is not None)
    first_walk, second_walk = shown._walker.walk, second._walker.walk
    assert first_walk is not None
    assert second_walk is not None
    other.context.close()
    until(lambda: not second._tasks._thread.is_alive())
    stopped, now = second_walk.data.time, first_walk.data.time
    until(lambda: first_walk.data.time > now + 0.3)
    assert second_walk.data.time == stopped


def test_most_of_the_window_shows_the_robot_and_a_click_tells_of_a_link(
    tab: Any, studio: Studio
) -> None:
    canvas = tab.locator("canvas").first.bounding_box()
    assert canvas["width"] >= 0.6 * 1280
    (shown, _), *_ = studio._panels.values()
    until(lambda: shown._robot.model is not None)
    picture(tab, "before_click")

    def clicked() -> bool:
        # The camera moves to the robot a little after the page is there.
        tab.mouse.click(canvas["x"] + canvas["width"] / 2, canvas["y"] + 0.44 * canvas["height"])
        time.sleep(0.5)
        return tab.locator("#ds-link").count() == 1

    until(clicked)
    assert "Link" in tab.inner_text("#ds-link")
    assert "kg" in tab.inner_text("body")
    picture(tab, "link")


def choose(tab: Any, label: str, name: str) -> None:
    chromium.field(tab, label).click()
    tab.get_by_role("option", name=name, exact=True).click()


def test_sliders_show_their_effect_a_held_metric_stays_and_a_target_is_reached(
    tab: Any, studio: Studio
) -> None:
    before = mass(tab)
    turn_to(tab, "Levers")
    choose(tab, "effect on", "jump_height")
    turn_to(tab, "Parameters")
    until(lambda: tab.locator("label:has-text('no_load_speed [rad/s] ▲')").count() == 1)
    turn_to(tab, "Levers")
    choose(tab, "hold", "mass")
    choose(tab, "by", "trunk_length")
    until(lambda: tab.locator("#ds-levers").count() == 0)
    turn_to(tab, "Parameters")
    push(tab, "thigh_length", 5)
    until(lambda: "holds mass" in tab.inner_text("#ds-levers"))
    assert mass(tab) == before
    picture(tab, "held")
    turn_to(tab, "Levers")
    enter(tab, studio, "target", "0.4")
    press(tab, "Reach")
    until(lambda: "reached by" in tab.inner_text("#ds-levers"))
    picture(tab, "levers")
    turn_to(tab, "Parameters")
    until(lambda: tab.locator("label:has-text('● no_load_speed')").count() == 1)
    picture(tab, "reached")
    press(tab, "Undo")
    until(lambda: tab.locator("label:has-text('● no_load_speed')").count() == 0)
    assert tab.locator("label:has-text('● thigh_length')").count() == 1


def test_an_arm_on_a_fixed_base_is_shown_on_the_floor_and_does_not_walk(
    tmp_path: Path, browser: Any
) -> None:
    studio = Studio(Library(fixed.arm(), tmp_path / "designs"), port=0, out=tmp_path / "out")
    try:
        made = chromium.page(browser, f"http://127.0.0.1:{studio.port}/")
        made.wait_for_selector("label:has-text('forearm_length')")
        (shown, _), *_ = studio._panels.values()
        assert shown._robot.base == 0.0
        before = mass(made)
        push(made, "pedestal_mass", 5)
        until(lambda: mass(made) > before)
        picture(made, "arm")
        turn_to(made, "Pose")
        press(made, "Limp")
        until(lambda: shown._drop is not None)
        press(made, "Stop")
        made.context.close()
    finally:
        studio.close()
