"""What a person does in the studio, without a browser."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import DraftError
from draft.spec.load import ROBOTS
from draft.studio import cards, fields, plots, trend_cards
from draft.studio.drop import HEIGHT, Drop
from draft.studio.library import Library, Writes
from draft.studio.report_page import report_page
from draft.studio.session import GESTURE, Point, Session
from draft.studio.skins import skins
from draft.values import scalar
from tests import fixed
from tests.studio.robots import with_motor_of_its_own


class Clock:
    """Time that stands still unless it is moved."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@lru_cache(maxsize=1)
def quadruped() -> draft.Spec:
    return draft.load("quadruped")


def session(folder: Path, clock: Clock | None = None, base: str = "") -> Session:
    return Session(Library(quadruped(), folder), Point(base), clock or Clock())


@pytest.fixture
def s(tmp_path: Path) -> Session:
    """A tab with the quadruped, whose designs are saved to a folder of its own."""
    return session(tmp_path / "designs")


ACTIONS = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.sampled_from(["thigh_length", "crouch"]), st.floats(-1, 3)),
        st.tuples(st.just("set"), st.just("actuators.leg.peak_torque"), st.floats(10, 200)),
        st.tuples(st.just("text"), st.sampled_from(["foot_radius", "nonsense"]), st.text()),
        st.tuples(st.just("reset"), st.sampled_from(["thigh_length", "crouch"])),
        st.tuples(st.just("load"), st.sampled_from(["", "bear", "cheetah", "nobody"])),
        st.tuples(st.just("wait")),
        st.tuples(st.just("undo")),
        st.tuples(st.just("redo")),
    ),
    max_size=12,
)


def act(s: Session, clock: Clock, action: tuple) -> None:
    kind, *rest = action
    calls = {"set": s.set, "text": s.set_text, "reset": s.reset, "load": s.load}
    if kind == "wait":
        clock.now += 2 * GESTURE
    else:
        {**calls, "undo": s.undo, "redo": s.redo}[kind](*rest)


@pytest.mark.slow
@given(ACTIONS)
def test_undo_after_anything_leads_back_and_redo_forth(
    tmp_path_factory: pytest.TempPathFactory, actions: list[tuple]
) -> None:
    clock = Clock()
    s = session(tmp_path_factory.getbasetemp() / "none", clock)
    start, mass = s.point, s.design.mass
    for action in actions:
        act(s, clock, action)
    end, end_mass = s.point, s.design.mass
    steps = 0
    while s.undo():
        steps += 1
    assert (s.point, s.design.mass) == (start, mass)
    for _ in range(steps):
        assert s.redo()
    assert (s.point, s.design.mass) == (end, end_mass)


@pytest.mark.slow
@given(st.floats(0.15, 0.8), st.floats(40, 120))
def test_a_saved_design_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, length: float, torque: float
) -> None:
    folder = tmp_path_factory.mktemp("designs")
    s = session(folder, base="bear")
    assert s.set("thigh_length", length)
    assert s.set("actuators.leg.peak_torque", torque)
    mass = s.design.mass
    path = s.save("longer")
    assert path == folder / "longer.yaml"
    assert (s.title, s.changed(), s.design.mass) == ("longer", {}, mass)
    other = session(folder)
    assert "longer" in other.library.names()
    assert other.load("longer")
    assert other.design.mass == mass
    assert quadruped().resolve(folder / "longer.yaml").mass == mass


def test_a_bad_value_says_why_and_keeps_the_last_good_robot(s: Session) -> None:
    assert s.set("thigh_length", 0.3)
    good = s.shown
    assert not s.set("thigh_length", 50.0)
    assert "thigh_length" in s.message
    assert s.shown is good
    assert not s.set_text("foot_radius", "__import__('os').system('true')")
    assert s.message
    assert s.shown is good
    assert s.set("thigh_length", 0.31)
    assert not s.message


def test_a_drag_is_one_step_of_undo(tmp_path: Path) -> None:
    clock = Clock()
    s = session(tmp_path, clock)
    for value in (0.26, 0.27, 0.28):
        clock.now += 0.1
        s.set("thigh_length", value)
    clock.now += 2 * GESTURE
    s.set("thigh_length", 0.4)
    assert s.undo()
    assert s.value("thigh_length") == 0.28
    assert s.undo()
    assert s.value("thigh_length") == 0.25
    assert not s.undo()


def test_the_loaded_designs_own_value_is_no_change(s: Session) -> None:
    s.set("thigh_length", 0.3)
    assert s.changed() == {"thigh_length": 0.25}
    s.set("thigh_length", 0.25)
    assert s.changed() == {}
    s.set("actuators.leg.like", None)
    assert s.changed() == {"actuators.leg.like": "MIT U12"}
    assert s.reset("actuators.leg.like")
    assert s.changed() == {}
    s.set_text("foot_radius", "2 * shank_radius")
    assert s.set_text("foot_radius", "")
    assert s.changed() == {}


def test_a_refused_design_is_shown_but_not_exported(s: Session, tmp_path: Path) -> None:
    s.set("actuators.leg.peak_torque", 290.0)
    assert not s.design.accepted
    assert "refused" in cards.head(s)
    assert "To allow it" in cards.findings(s.design)
    assert s.export("strong", tmp_path) is None
    assert "torque" in s.message
    assert s.undo()
    assert s.export("calm", tmp_path) == tmp_path / "calm"
    assert (tmp_path / "calm" / "robot.xml").is_file()


def test_an_export_replaces_only_what_the_same_tab_exported(s: Session, tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / "mine").mkdir(parents=True)
    (out / "mine" / "robot.xml").write_text("of somebody else")
    assert s.export("mine", out) is None
    assert "mine' exists already; it is kept" in s.message
    assert s.export("other", out)
    s.set("thigh_length", 0.3)
    assert s.export("other", out) is None
    assert "tick 'Replace'" in s.message
    assert s.export("other", out, replace=True) == out / "other"
    assert s.export("mine", out, replace=True) is None
    assert (out / "mine" / "robot.xml").read_text() == "of somebody else"
    assert session(tmp_path / "designs").export("other", out) is None


@pytest.mark.parametrize("name", ["", "../x", "a/b", "a b", "x" * 65, "/tmp/x", "a\n"])
def test_only_names_are_names(tmp_path: Path, name: str) -> None:
    s = session(tmp_path / "designs")
    assert s.save(name) is None
    assert s.export(name, tmp_path / "out") is None
    assert not s.load(name) or name == ""
    assert not list(tmp_path.iterdir())


def test_a_design_is_not_written_over_unless_that_is_asked_for(s: Session) -> None:
    assert s.save("mine")
    for loaded in ("", "mine"):
        s.load(loaded)
        s.set("thigh_length", 0.4)
        assert s.save("mine") is None
        assert "'mine' exists already; it is kept" in s.message
        assert "tick 'Replace'" in s.message
    assert s.save("mine", replace=True)
    assert s.value("thigh_length") == 0.4


def test_replacing_a_design_leaves_other_tabs_and_undo_as_they_were(tmp_path: Path) -> None:
    library = Library(quadruped(), tmp_path)
    one, other = Session(library), Session(library)
    one.set("thigh_length", 0.3)
    assert one.save("mine")
    assert other.load("mine")
    mass = other.design.mass
    one.set("thigh_length", 0.4)
    assert one.save("mine", replace=True)
    assert one.title == other.title == "mine"
    assert other.set("crouch", 0.7)
    assert other.value("thigh_length") == 0.3
    assert other.reset_all()
    assert other.design.mass == mass
    assert one.undo()  # the save
    assert one.value("thigh_length") == 0.4
    assert one.undo()  # the change
    assert (one.title, one.value("thigh_length"), one.changed()) == ("mine", 0.3, {})
    assert one.redo()
    assert one.redo()
    assert (one.value("thigh_length"), one.changed()) == (0.4, {})
    (tmp_path / "mine.yaml").unlink()
    assert other.set("crouch", 0.6)
    assert not other.load("mine")
    assert "mine" in other.message
    assert one.save("new")
    assert other.load("new")
    assert other.value("thigh_length") == 0.4


def test_default_is_the_name_of_the_values_in_parameters_yaml_and_of_no_design(
    s: Session, tmp_path: Path
) -> None:
    for replace in (False, True):
        assert s.save("default", replace) is None
        assert "'default' stands for the values in parameters.yaml" in s.message
        assert "choose another name" in s.message
    assert not list(tmp_path.iterdir())
    # One of an older studio is not listed.
    for name in ("default", "mine"):
        (tmp_path / f"{name}.yaml").write_text("doc: A design.\nvalues: {}\n")
    assert Library(quadruped(), tmp_path).names() == [*quadruped().designs, "mine"]
    own = tmp_path / "quadruped"
    shutil.copytree(ROBOTS / "quadruped", own)
    shutil.copy(tmp_path / "default.yaml", own / "designs")
    spec = draft.load(own)
    assert "default" in spec.designs
    assert "default" not in Library(spec).names()
    # A robot of one's own keeps its designs.
    assert Session(Library(spec)).save("mine") == own / "designs" / "mine.yaml"
    assert "mine" in draft.load(own).designs


def test_all_tabs_together_write_no_more_than_the_limit_in_a_minute(tmp_path: Path) -> None:
    now = [0.0]
    library = Library(quadruped(), tmp_path / "designs")
    library.writes = Writes(3, clock=lambda: now[0])
    one, other = Session(library), Session(library)
    assert one.save("a")
    assert other.export("b", tmp_path / "out")
    assert other.save("c")
    assert one.save("d") is None
    assert "3 files were written in the last minute" in one.message
    assert one.export("e", tmp_path / "out") is None
    assert not (tmp_path / "out" / "e").exists()
    now[0] = 59.9
    assert one.save("d") is None
    now[0] = 60.0
    assert one.save("d")


def test_every_number_is_a_field(tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    spec = quadruped()
    shown = {p.name for of in fields.groups(spec).values() for p in of}
    assert shown | {text.name for text in fields.derived(spec)} == set(spec.parameters)
    design = session(tmp_path).design
    names = {slider.label for slider in fields.stated(design, "leg")}
    assert names == {"peak_torque", "no_load_speed", "gear_ratio"}
    for name in spec.parameters:
        assert name in report_page(session(tmp_path))


def test_modules_of_ones_own_can_be_chosen_and_have_numbers(tmp_path: Path) -> None:
    s = Session(Library(with_motor_of_its_own(tmp_path / "jumper"), tmp_path / "designs"))
    assert s.value("actuators.leg.like") == "S-40"
    options = fields.parts(s.library.spec)
    assert options[0] == fields.NO_PART
    assert {"S-40", "S-80", "MIT U12"} < set(options)
    assert s.set("actuators.leg.like", "S-80")
    assert scalar(s.design.actuators["leg"].mass) == 1.25
    for card in (cards.head(s), cards.actuators(s.design), trend_cards.trends(s)):
        assert card


@pytest.mark.parametrize("robot", ["hopper", "quadruped", "humanoid"])
def test_all_robots_can_be_drawn_told_and_dropped(tmp_path: Path, robot: str) -> None:
    s = Session(Library(draft.load(robot), tmp_path))
    s.pin()
    for text in (cards.masses(s), trend_cards.trends(s), trend_cards.torque_speed(s)):
        assert "<svg" in text
        assert "nan" not in text
    for skin in skins(s.shown).values():
        assert skin.faces.max() < len(skin.vertices) == len(skin.bodies)
    base = float(s.design.lowest())
    drop = Drop(s.shown, s.shown.mujoco.qpos0[7:], base, held=False)
    drop.advance(0.2)
    assert drop.data.qpos[2] < base + HEIGHT


def test_text_cannot_become_markup(s: Session) -> None:
    s.set_text("foot_radius", "<img src=x onerror=alert(1)>")
    assert "<img" not in cards.head(s)
    with pytest.raises(DraftError):
        s.library.read("<b>")


def test_a_session_begins_with_changes_that_can_be_reset(tmp_path: Path) -> None:
    library = Library(quadruped(), tmp_path)
    s = Session(library, Point("cheetah", {"thigh_length": 0.3}))
    assert (s.value("thigh_length"), s.changed()) == (0.3, {"thigh_length": 0.25})
    assert s.reset_all()
    assert s.value("thigh_length") == 0.25
    with pytest.raises(DraftError, match="thigh_length"):
        Session(library, Point("", {"thigh_length": -1.0}))


def test_rated_torque_is_on_the_card_of_actuators() -> None:
    design = quadruped().resolve("cheetah")
    (row,) = [row for row in cards.actuators(design).split("<tr") if "rated torque" in row]
    assert plots.short(scalar(design.actuators["leg"].rated_torque)) in row
    low, high = design.actuator_bands()["leg"]["rated_torque"]
    assert f"{scalar(low):.1f}–{scalar(high):.1f}" in row


@pytest.mark.parametrize("spec", [fixed.arm, fixed.hand])
def test_a_robot_on_a_fixed_base_is_drawn_where_it_is_bolted_and_droops(
    tmp_path: Path, spec: Callable[[], draft.Spec]
) -> None:
    s = Session(Library(spec(), tmp_path))
    s.pin()
    for text in (
        cards.head(s),
        cards.masses(s),
        trend_cards.trends(s),
        trend_cards.torque_speed(s),
    ):
        assert text
        assert "nan" not in text
    joints = np.array([scalar(joint.home) for joint in s.design.joints.values()])
    drop = Drop(s.shown, joints, 0.0, held=False)
    drop.advance(0.2)
    assert drop.data.xpos[1] == pytest.approx(s.shown.mujoco.body_pos[1])
    assert np.abs(drop.data.qpos - joints).max() > 0.02
    held = Drop(s.shown, joints, 0.0, held=True)
    held.advance(0.2)
    assert held.data.qpos == pytest.approx(joints, abs=0.01)
