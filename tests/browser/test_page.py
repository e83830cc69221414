"""A page is steered, pushed and reshaped, asks for nothing, and says what it cannot do."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import browser as chromium
from draft.browser import engine, grid
from draft.browser.page import page
from draft.browser.robots import compiled, driven, robot
from draft.design.references import open_design
from draft.errors import DraftError
from draft.model.model import preview

pytest.importorskip("mjswan", reason="needs the extra page")

Opened = Callable[[Path, str], Any]
RANGES = ("thigh_length=0.22:0.3", "actuators.leg.peak_torque=60:100")
# What a browser's model has of a body: masses, inertia tensors, places and sizes.
BODY = """() => {
  const { model, tensors } = draftPage.robots[0];
  const list = (name) => [...model[name]];
  return { mass: list("body_mass"), tensor: [...tensors], body: list("body_pos"),
    geom: list("geom_pos"), size: list("geom_size"), armature: list("dof_armature") };
}"""


def tensors(model: Any) -> np.ndarray:
    """Inertia tensors in the frames of the bodies, by MuJoCo's own rotations."""
    import mujoco

    found = []
    for moments, turn in zip(model.body_inertia, model.body_iquat, strict=True):
        flat = np.empty(9)
        mujoco.mju_quat2Mat(flat, turn)
        r = flat.reshape(3, 3)
        t = r @ np.diag(moments) @ r.T
        found.append([t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]])
    return np.array(found)


@pytest.mark.slow
def test_a_slider_moves_all_robots_by_factors_of_their_own_numbers(
    tmp_path: Path, opened: Opened
) -> None:
    page(["cheetah", "giraffe"], tmp_path / "page", vary=["thigh_length=*0.9:*1.1"])
    tab = opened(tmp_path / "page", "#slow=0")
    tab.evaluate(
        "() => { draftPage.shaped[0].value = draftPage.shaped[0].max; draftPage.reshape(); }"
    )
    for i, name in enumerate(("cheetah", "giraffe")):
        tab.evaluate(f"draftPage.choose({i})")
        design = open_design(name)
        own = design.spec.resolve(dict(design.values), {"thigh_length": "*1.1"})
        shown = tab.inner_text("#sliders output")
        assert shown == f"{own.parameters['thigh_length']:.3g} m"
        masses = tab.evaluate(f"[...draftPage.robots[{i}].model.body_mass].reduce((a, b) => a + b)")
        assert masses == pytest.approx(own.mass, rel=grid.BARS["mass"])
    assert tab.faults == []


@pytest.mark.slow
def test_bodies_of_the_sliders_are_those_that_draft_compiles(
    tmp_path: Path, opened: Opened
) -> None:
    page(["cheetah"], tmp_path / "page", vary=RANGES)
    tab = opened(tmp_path / "page", "#slow=0")
    spec = open_design("cheetah")
    for thigh, torque in ((0.22, 60.0), (0.2571, 77.7), (0.2999, 61.3), (0.263, 99.0)):
        tab.evaluate(
            """(values) => { draftPage.shaped.forEach((slider, i) => { slider.value = values[i]; });
              draftPage.reshape(); }""",
            [thigh, torque],
        )
        found = tab.evaluate(BODY)
        values = {"thigh_length": thigh, "actuators.leg.peak_torque": torque}
        own = preview(spec.spec.resolve(dict(spec.values), values)).mujoco
        mass = np.array(found["mass"])[1:]
        assert np.abs(mass / own.body_mass[1:] - 1).max() < grid.BARS["mass"]
        true, seen = tensors(own), np.array(found["tensor"]).reshape(-1, 6)
        largest = true[1:, :3].max(axis=1, keepdims=True)
        assert (np.abs(seen[1:] - true[1:]) / largest).max() < grid.BARS["inertia"]
        armature = np.array(found["armature"])[6:]
        assert np.abs(armature / own.dof_armature[6:] - 1).max() < grid.BARS["inertia"]
        solid = own.geom_type != 7  # The trunk's frame differs on purpose.
        for name, true_ in (("geom", own.geom_pos), ("size", own.geom_size)):
            seen = np.array(found[name]).reshape(-1, 3)[1:]
            assert np.abs(seen - true_)[solid].max() < grid.BARS["length"]
        seen = np.array(found["body"]).reshape(-1, 3)
        assert np.abs(seen - own.body_pos).max() < grid.BARS["length"]
    assert tab.faults == []


@pytest.mark.slow
def test_a_robot_is_steered_pushed_and_reshaped(tmp_path: Path, opened: Opened) -> None:
    page(["cheetah"], tmp_path / "page", vary=RANGES)
    tab = opened(tmp_path / "page", "#forward=0&thigh_length=0.25")
    for _ in range(6):
        tab.keyboard.press("w")
    assert tab.evaluate("draftPage.robots[0].command[0]") > 0.5
    tab.wait_for_function("draftPage.robots[0].qpos[0] > 0.1")
    before = tab.evaluate("draftPage.robots[0].qvel[1]")
    tab.evaluate("draftPage.push(1)")
    assert tab.evaluate("draftPage.robots[0].qvel[1]") > before + 0.1
    light = tab.inner_text("#mass")
    tab.locator("[id=thigh_length]").focus()
    tab.keyboard.press("End")
    tab.wait_for_function(f"document.getElementById('mass').textContent !== '{light}'")
    assert float(tab.inner_text("#mass").split()[0]) > float(light.split()[0])
    assert "thigh_length=0.3" in tab.url
    tab.click("#stand")
    assert tab.evaluate("draftPage.robots[0].command") == [0, 0, 0]
    assert tab.faults == []
    host = re.match(r"http://[^/]+/", tab.url)
    assert host is not None
    assert all(url.startswith((host[0], "data:")) for url in tab.asked)


@pytest.mark.slow
def test_values_of_a_link_out_of_range_are_clamped_and_said(tmp_path: Path, opened: Opened) -> None:
    page(["cheetah"], tmp_path / "page", vary=RANGES)
    tab = opened(tmp_path / "page", "#forward=9&thigh_length=0.9&left=x&foo=1")
    said = tab.inner_text("#note")
    assert "thigh_length is 0.3, not 0.9" in said
    assert "there is no foo" in said
    assert "not 9" in said
    assert "not x" in said
    assert tab.evaluate("draftPage.robots[0].command[0]") <= 1.0


@pytest.mark.slow
def test_one_file_opens_from_the_disk_and_asks_for_nothing(tmp_path: Path, browser: Any) -> None:
    (file,) = page(["cheetah"], tmp_path / "page.html", single=True)
    tab = chromium.tab(browser, viewport={"width": 390, "height": 844})
    asked: list[str] = []
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(f"file://{file}")
    tab.wait_for_function("window.draftPage?.count.simulated > 0.5")
    assert [url for url in asked if not url.startswith(("data:", "file:"))] == []
    assert tab.evaluate("document.documentElement.scrollWidth") <= 390
    tab.context.close()


@pytest.mark.slow
def test_a_robot_without_a_policy_stands_and_the_page_says_why(
    tmp_path: Path, opened: Opened
) -> None:
    page(["arm", "cheetah"], tmp_path / "page")
    tab = opened(tmp_path / "page", "")
    assert "no policy drives the joints of arm" in tab.inner_text("#why")
    tab.wait_for_function("draftPage.robots[1].qpos[0] > 0.05")
    assert tab.faults == []


def test_texts_of_users_cannot_leave_their_place(tmp_path: Path) -> None:
    page(["cheetah"], tmp_path / "page")
    model = compiled(open_design("cheetah"))
    made = robot(
        model, "</script><img src=x onerror=alert(1)>", "#000000", driven([model], "walk", ())
    )
    from draft.browser.page import _contents

    text = _contents([made], [], single=False)["index.html"]
    assert isinstance(text, str)
    assert "<img" not in text
    assert "\\u003cimg" in text


@pytest.mark.parametrize(
    ("designs", "options", "cause"),
    [
        ([], {}, "a page shows 1 to 6 designs, not 0"),
        (["cheetah"] * 7, {}, "a page shows 1 to 6 designs, not 7"),
        (["cheetah"], {"skill": "climb"}, "a page shows no skill 'climb'"),
        (["cheetah"], {"vary": ["thigh=*0.8:*1.2"]}, "'thigh' is not a stated number of quadruped"),
        (["cheetah"], {"vary": ["thigh_length=*.:*1"]}, "'*.' is not a number"),
        (["cheetah"], {"vary": ["thigh_length=0.2,0.3"]}, "lists values, and a slider has a range"),
        (["cheetah"], {"vary": ["thigh=0.2:0.3"]}, "'thigh' is not a parameter"),
    ],
)
def test_refusals_say_what_a_page_can_show(
    designs: list[str], options: dict[str, Any], cause: str, tmp_path: Path
) -> None:
    with pytest.raises(DraftError, match=re.escape(cause)):
        page(designs, tmp_path / "page", **options)
    assert not (tmp_path / "page").exists()


def test_a_folder_that_is_no_page_is_kept(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("years of work")
    with pytest.raises(DraftError, match="is not a page that Draft wrote"):
        page(["cheetah"], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_page_replaces_the_page_before(tmp_path: Path) -> None:
    page(["cheetah"], tmp_path / "page")
    page(["bear"], tmp_path / "page")
    assert len([*(tmp_path / "page").glob("policy-*.gz")]) == 1


def test_another_mujoco_than_that_of_pages_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    engine.engine.cache_clear()
    monkeypatch.setattr("mujoco.__version__", "3.99.0")
    with pytest.raises(DraftError, match=r"MuJoCo is 3\.99\.0, and that of pages is"):
        engine.engine()
    engine.engine.cache_clear()


def test_what_a_first_robot_needs_is_below_four_megabytes(tmp_path: Path) -> None:
    import gzip

    page(["cheetah"], tmp_path / "page")
    sent = 0
    for path in (tmp_path / "page").iterdir():
        content = path.read_bytes()
        sent += len(content) if path.suffix == ".gz" else len(gzip.compress(content))
    assert sent < 4e6
