"""The walking robot of the studio, without a browser."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.model.model import preview
from draft.spec.payload import with_payload
from draft.studio import fields, live_cards, trend_cards
from draft.studio.library import Library
from draft.studio.session import Point, Session
from draft.studio.skins import hit, skins
from draft.studio.walker import BUDGET, LONGEST, SIDEWAYS, Walker


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(Library(draft.load("quadruped"), tmp_path))


def walking(session: Session, seconds: float = 0.0) -> Walker:
    walker = Walker(clock=lambda: 0.0)  # a machine that is quick enough
    walker.start(session.shown)
    run(walker, seconds)
    return walker


def run(walker: Walker, seconds: float) -> None:
    for _ in range(round(seconds / 0.04)):
        walker.advance(0.04)


def test_the_switch_lets_the_robot_walk_and_stops_it(session: Session) -> None:
    walker = walking(session, 4.0)
    assert walker.walk is not None
    assert walker.speed == pytest.approx(walker.command[0], abs=0.25)
    assert walker.place()[0] > 1.0
    assert walker.walk.falls == 0
    walker.stop()
    assert not walker.on
    assert walker.walk is None
    walker.advance(1.0)


def test_time_is_real_and_a_slow_machine_shows_slow_motion(session: Session) -> None:
    walker = walking(session)
    assert walker.walk is not None
    for _ in range(100):
        walker.advance(0.0173)
    assert walker.walk.data.time == pytest.approx(1.73, abs=0.01)
    before = walker.walk.data.time
    walker.advance(60.0)  # It does not pile up.
    assert walker.walk.data.time - before <= LONGEST + 0.01
    ticks = itertools.count()
    walker = Walker(clock=lambda: next(ticks) * 0.3 * BUDGET)
    walker.start(session.shown)
    assert walker.walk is not None
    walker.advance(0.1)
    # Three steps fit into the time that a call may take.
    assert walker.walk.data.time == pytest.approx(3 * walker.walk.model.opt.timestep)


def test_a_moved_slider_changes_the_body_of_the_robot_that_walks(session: Session) -> None:
    walker = walking(session, 1.0)
    walk = walker.walk
    assert walk is not None
    time, mass = walk.data.time, walk.model.body_mass.sum()
    assert session.set("thigh_length", 0.29)
    walker.follow(session.shown)
    assert walker.walk is walk
    assert walk.data.time == time
    assert walk.model.body_mass.sum() == pytest.approx(float(session.design.mass))
    assert walk.model.body_mass.sum() > mass
    run(walker, 2.0)
    assert walk.falls == 0
    assert "Policy of the family of quadrupeds" in live_cards.region(walker)
    assert session.set("thigh_length", 0.5)
    walker.follow(session.shown)
    assert "Not trained for this body" in live_cards.region(walker)
    assert "leg length 0.73 m" in live_cards.region(walker)
    session.undo()
    session.undo()
    walker.follow(session.shown)
    assert "Not trained" not in live_cards.region(walker)
    assert "Policy of quadruped:cheetah" in live_cards.region(walker)


def test_a_motor_that_is_too_weak_is_named_as_what_limits(session: Session) -> None:
    walker = walking(session, 1.5)
    assert "No limit reached" in walker.verdict()
    assert session.set("actuators.leg.peak_torque", 14.0)
    walker.follow(session.shown)
    run(walker, 0.6)
    text = walker.verdict()
    assert "peak torque" in text or "fallen" in text
    assert max(load.share for load in walker.loads()) == pytest.approx(1.0)


def test_the_dot_of_each_joint_lies_below_the_line_of_its_motor(session: Session) -> None:
    assert session.set("actuators.leg.no_load_speed", 4.0)  # shanks swing faster than that
    walker = walking(session, 1.5)
    loads = walker.loads()
    assert {load.joint for load in loads} == set(session.design.joints)
    for load in loads:
        assert 0.0 < load.share <= 1.0
        motor = session.design.actuators[load.actuator]
        assert load.torque <= motor.available(load.speed) * (1 + 1e-9)
    assert max(load.share for load in loads) == 1.0
    card = trend_cards.torque_speed(session, loads)
    assert card.count("<circle") == len(loads)
    assert max(loads, key=lambda load: load.share).joint in card


def test_a_robot_that_no_policy_drives_stands_and_it_is_said_why(tmp_path: Path) -> None:
    session = Session(Library(draft.load("hopper"), tmp_path))
    walker = walking(session, 0.2)
    assert walker.on
    assert walker.walk is None
    assert "use a robot with left and right legs" in live_cards.walking(walker)
    assert walker.loads() == []


def test_a_payload_that_is_asked_for_has_a_slider_and_its_mass(tmp_path: Path) -> None:
    spec = with_payload(draft.load("quadruped"), ["payload"])
    session = Session(Library(spec, tmp_path), Point("", {"payload": 5.0}))
    assert "payload" in fields.names(spec)
    bare = float(draft.load("quadruped").resolve().mass)
    assert float(session.design.mass) == pytest.approx(bare + 5.0)


def test_commands_stay_within_those_of_the_training(session: Session) -> None:
    walker = walking(session)
    slow = walker.most[0]
    walker.steer((9.0, -9.0, 0.0))
    assert walker.command == (slow, -SIDEWAYS, 0.0)
    walker.nudge(forward=-1, left=1, turn=1)
    assert walker.command == pytest.approx((slow - 0.1, 0.1 - SIDEWAYS, 0.2))
    assert walker.walk is not None
    assert walker.walk.command == walker.command
    # Also those of another policy, which takes over.
    assert session.set("thigh_length", 0.29)
    walker.follow(session.shown)
    walker.steer((3.0, 0.0, 0.0))
    assert walker.command[0] == 3.0 > slow
    session.undo()
    walker.follow(session.shown)
    assert walker.command == walker.walk.command == (slow, 0.0, 0.0)


def test_a_push_moves_the_robot_sideways(session: Session) -> None:
    walker = walking(session, 1.0)
    assert walker.walk is not None
    before = walker.walk.data.qvel[:2].copy()
    walker.push(1.0, left=False)
    assert np.linalg.norm(walker.walk.data.qvel[:2] - before) == pytest.approx(1.0)
    run(walker, 2.0)
    assert walker.walk.falls == 0


def test_a_ray_finds_the_link_that_it_meets_first(session: Session) -> None:
    import mujoco

    model = session.shown.mujoco
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    found = list(skins(session.shown).values())
    placed = [skin.placed(data).astype(float) for skin in found]
    random = np.random.default_rng(0)
    agreed = 0
    for _ in range(100):
        origin = random.normal(size=3)
        origin *= 3.0 / np.linalg.norm(origin)
        # Towards a geom of MuJoCo, which finds the body on its own.
        aim = data.geom_xpos[random.integers(model.ngeom)] - origin
        geom = np.array([-1], np.int32)
        mujoco.mj_ray(model, data, origin, aim, None, True, -1, geom)
        body = hit(found, placed, origin, aim)
        agreed += body == model.geom_bodyid[geom[0]]
    # Polyhedra and the round solids that they stand for differ at edges.
    assert agreed >= 95
    assert hit(found, placed, np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, 1.0])) is None


def test_each_link_shows_its_mass_drive_and_findings(session: Session) -> None:
    names = [body.name for body in session.design.bodies]
    card = live_cards.link(session.design, names.index("RL_lower_leg"))
    mass = float(session.design.body_masses()["RL_lower_leg"])
    assert f"{mass:.3f} kg" in card
    assert "RL_knee" in card
    assert "72 N m, 40 rad/s" in card
    assert "no findings" in card
    assert session.load("bear")
    # The filter names one of the four legs.
    card = live_cards.link(session.design, names.index("RR_lower_leg"))
    assert "outside data" in card
    for name in draft.shipped():
        design = preview(draft.load(name).resolve()).design
        for number, of in enumerate(design.bodies):
            assert of.name in live_cards.link(design, number)
