"""Policies drive robots of other names, orders and signs of the joints, and refuse other legs."""

from __future__ import annotations

import importlib.util
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.references import open_design
from draft.errors import DraftError
from draft.learn.bodies.legged import legged_robot
from draft.learn.engine.machine import obstacle
from draft.learn.measuring import learned_metrics as learned
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.learn.measuring.policies import open_source
from draft.learn.policy.gait import record
from draft.learn.policy.matching import Match, Structure, match, structure_of
from draft.learn.policy.policy import FAMILY, open_policy
from draft.learn.policy.validity import ANY_NAME, check_drives, fit
from draft.learn.policy.walk import Walk
from draft.metrics import of_policy
from draft.model import Model
from draft.model.model import preview
from draft.studio.walker import Walker
from draft.values import scalar

GO2 = Path(__file__).parents[3] / "examples/descriptions/unitree_go2/go2.urdf"
LEGS = ("FL", "FR", "RL", "RR")
JOINTS = ("hip_roll", "hip_pitch", "knee")
PLACES = {"FL": "", "FR": "mirror: y", "RL": "mirror: x", "RR": "mirror: xy"}
TRUNK = slice(0, 7)
# As tree.yaml of the shipped quadruped, with names, signs and an order of legs to fill in.
CHAIN = """
  {leg}:
    - name: hip_housing
      motor: {{actuator: leg, axis: x, shift: [leg.length / 2, 0, 0]}}
    - name: abduction
      joint: {{name: {roll}, axis: {x}, range: [-0.8, 0.8], actuator: leg}}
      link: {{axis: x, length: abduction_length, segment: hip_link, radius: 0.6 * leg.radius}}
      motor: {{actuator: leg, axis: y}}
    - name: lateral_thigh
      joint: {{name: {pitch}, axis: {y}, range: [-2.5, 2.5], actuator: leg, home: {pitch_home}}}
      link:
        axis: y
        length: hip_offset
        segment: thigh
        radius: min(thigh_radius, 0.8 * leg.radius)
      motor: {{actuator: leg, axis: y}}
    - name: upper_leg
      at: [0, hip_offset - leg.length / 2, 0]
      link: {{axis: -z, length: thigh_length, segment: thigh, radius: thigh_radius}}
      pulley:
        axis: y
        radius: max(0.5 * leg.radius, 1.15 * thigh_radius)
        length: 2.1 * thigh_radius
    - name: lower_leg
      type: sphere
      joint: {{name: {knee}, axis: {z}, range: {range}, actuator: leg, home: {knee_home}}}
      link: {{axis: -z, length: shank_length, segment: shank, radius: shank_radius}}
      sphere: {{radius: foot_radius, site: foot}}
"""


def tree(names: Sequence[str], signs: Mapping[str, Sequence[int]], order: Sequence[str]) -> str:
    """Text of the shipped quadruped's tree with other names, axes and an order of the legs."""
    chains, uses = "chains:", "tree:\n  name: trunk\n  type: root\n  children:\n"
    for leg in order:
        roll, pitch, knee = signs[leg]
        chains += CHAIN.format(
            leg=f"leg_{leg}",
            **dict(zip(("roll", "pitch", "knee"), names, strict=True)),
            x="x" if roll > 0 else "-x",
            y="y" if pitch > 0 else "-y",
            z="y" if knee > 0 else "-y",
            pitch_home="crouch / 2" if pitch > 0 else "-crouch / 2",
            range="[-2.8, 0]" if knee > 0 else "[0, 2.8]",
            knee_home="-crouch" if knee > 0 else "crouch",
        )
        at = "[trunk_length / 2, hip_spacing / 2, 0]"
        mirror = f", {PLACES[leg]}" if PLACES[leg] else ""
        uses += f"    - {{chain: leg_{leg}, prefix: {leg}_, at: {at}{mirror}}}\n"
    return f"{chains}\n{uses}"


@pytest.fixture(scope="module")
def shipped() -> Path:
    return Path(draft.__file__).parent / "robots/quadruped"


def made(folder: Path, shipped: Path, text: str) -> Model:
    """The cheetah's numbers in a tree of this text."""
    folder.mkdir(exist_ok=True)
    for name in ("parameters.yaml", "root.yaml"):
        (folder / name).write_text((shipped / name).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "tree.yaml").write_text(text, encoding="utf-8")
    return preview(draft.load(folder).resolve())


PLAIN: dict[str, tuple[int, int, int]] = dict.fromkeys(LEGS, (1, 1, 1))
SIGNS = {"FL": (-1, 1, -1), "FR": (1, -1, -1), "RL": (-1, -1, 1), "RR": (-1, -1, -1)}


def walked(model: Model, seconds: float = 1.5) -> np.ndarray:
    """Poses of the trunk every 0.1 s, under the family's policy."""
    walk = Walk(model, fit(model, "run", [open_policy(FAMILY)]), (1.0, 0.2, 0.3))
    poses = []
    for _ in range(round(10 * seconds)):
        walk.advance(0.1)
        poses.append(walk.data.qpos[TRUNK].copy())
    assert walk.falls == 0
    return np.array(poses)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory, shipped: Path) -> np.ndarray:
    text = (shipped / "tree.yaml").read_text(encoding="utf-8")
    return walked(made(tmp_path_factory.mktemp("plain") / "robot", shipped, text))


@settings(max_examples=12)
@given(
    names=st.lists(
        st.text("abcdefgh", min_size=2, max_size=6), min_size=3, max_size=3, unique=True
    ),
    signs=st.fixed_dictionaries({leg: st.tuples(*[st.sampled_from((1, -1))] * 3) for leg in LEGS}),
    order=st.permutations(LEGS),
)
def test_names_signs_and_order_of_the_joints_change_nothing(
    tmp_path_factory: pytest.TempPathFactory,
    shipped: Path,
    reference: np.ndarray,
    names: list[str],
    signs: dict[str, tuple[int, int, int]],
    order: list[str],
) -> None:
    model = made(tmp_path_factory.mktemp("other") / "robot", shipped, tree(names, signs, order))
    np.testing.assert_allclose(walked(model), reference, atol=1e-6)


SHIPPED = legged_robot(draft.load("quadruped").resolve())


def quadruped(joints: Sequence[str] = JOINTS, legs: Sequence[str] = LEGS) -> Structure:
    """Legs in pairs from the front, of joints about x, y, y and then z."""
    places = [
        (1 if leg[1] == "L" else -1, legs.index(leg) // 2, j)
        for leg in legs
        for j in range(len(joints))
    ]
    axes = [
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))[p[2]] for p in places
    ]
    return Structure(tuple(places), tuple(axes), tuple(-1.0 if p[2] == 2 else 0.0 for p in places))


def names_of(structure: Structure, joints: Sequence[str] = JOINTS) -> list[str]:
    return [f"{'L' if s > 0 else 'R'}{rank}_{joints[j]}" for s, rank, j in structure.places]


def reason(own: Structure, joints: Sequence[str]) -> str:
    found = match(SHIPPED.joints, structure_of(SHIPPED), joints, own)
    assert isinstance(found, str)
    assert "\n" not in found
    return found


def test_the_structure_of_the_shipped_quadruped_is_legs_about_x_y_y() -> None:
    assert structure_of(SHIPPED) == quadruped()
    assert match(
        SHIPPED.joints, quadruped(), names_of(quadruped()), quadruped()
    ) == Match.of_equals(12)


def test_other_legs_are_named_in_one_line() -> None:
    six = quadruped(legs=(*LEGS, "ML", "MR"))
    assert reason(six, names_of(six)) == "the robot has 6 legs, and the policy drives 4"
    four = quadruped((*JOINTS, "wheel"))
    assert (
        "a leg of the robot has 4 joints (L0_hip_roll, L0_hip_pitch, L0_knee, L0_wheel), and"
        in (reason(four, names_of(four, (*JOINTS, "wheel"))))
    )
    plain = quadruped()
    head = Structure((*plain.places, ()), (*plain.axes, (0.0, 0.0, 1.0)), (*plain.bends, 0.0))
    assert "the robot has head besides its legs" in reason(head, [*names_of(plain), "head"])
    lame = replace(plain, places=tuple((1, i // 3, i % 3) for i in range(12)))
    assert "the robot has 0 legs on the right, and the policy drives 2" in (
        reason(lame, names_of(plain))
    )


def test_an_axis_that_points_elsewhere_is_named() -> None:
    plain = quadruped()
    axes = ((0.0, 0.0, 1.0), *plain.axes[1:])
    assert "L0_hip_roll would turn about another axis" in (
        reason(replace(plain, axes=axes), names_of(plain))
    )


def test_a_knee_that_is_nearly_straight_bends_neither_way() -> None:
    plain = quadruped()
    straight = replace(plain, bends=tuple(-0.01 * one for one in plain.bends))
    assert isinstance(match(SHIPPED.joints, structure_of(SHIPPED), SHIPPED.joints, straight), Match)


def test_a_policy_of_unknown_structure_drives_joints_of_its_names_only() -> None:
    plain = quadruped()
    assert match(["a", "b"], None, ["a", "b"], plain) == Match.of_equals(2)
    assert "the policy drives a, b, c and so on" in str(match([*"abcd"], None, ["a"], plain))


def test_the_structure_is_kept_as_text() -> None:
    found = structure_of(SHIPPED)
    texts = {
        key: ",".join(
            ";".join(map(str, one)) if isinstance(one, list) else str(one) for one in values
        )
        for key, values in found.texts().items()
    }
    assert Structure.of_texts(texts) == found
    assert Structure.of_texts({}) is None


def test_a_policy_of_ones_own_is_matched_by_the_structure_of_its_file(
    tmp_path: Path, shipped: Path, reference: np.ndarray
) -> None:
    """The family's policy as one that was trained with turned axes drives the plain robot."""
    model = made(tmp_path / "own", shipped, tree(("a", "b", "c"), SIGNS, LEGS[::-1]))
    trained = legged_robot(model.design, model)
    turned = np.array([sign for leg in trained.joints[::3] for sign in SIGNS[leg[:2]]])
    known = open_policy(FAMILY)
    order = [
        known.joints.index(f"{name[:2]}_{JOINTS['abc'.index(name[-1])]}") for name in trained.joints
    ]
    entries, factors, at = [], [], 0
    for name, size in known.terms:
        if name in ("joint_pos", "joint_vel", "actions"):
            entries += [at + order.index(j) for j in range(12)]
            factors += [float(turned[order.index(j)]) for j in range(12)]
        else:
            entries += range(at, at + size)
            factors += [1.0] * size
        at += size

    class Turned:
        size = known.network.size

        def __call__(self, values: np.ndarray) -> np.ndarray:
            return turned * known.network((values[entries] * factors).astype(np.float32))[order]

    own = replace(
        known,
        network=Turned(),
        joints=trained.joints,
        structure=structure_of(trained),
    )
    plain = preview(draft.load("quadruped").resolve())
    walk = Walk(plain, fit(plain, "run", [own]), (1.0, 0.2, 0.3))
    assert walk.fit.policy.joints[0].startswith("RR_")
    walk.advance(4.0)
    assert walk.falls == 0
    assert float(np.linalg.norm(walk.data.qpos[:2])) > 2.0


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory, shipped: Path) -> Path:
    """The shipped quadruped with hind knees that point forwards, as ANYmal's."""
    text = tree(JOINTS, PLAIN, LEGS)
    for leg in ("RL", "RR"):
        before, start, rest = text.partition(f"  leg_{leg}:")
        rest = rest.replace("home: crouch / 2", "home: -crouch / 2", 1)
        rest = rest.replace("range: [-2.8, 0]", "range: [0, 2.8]", 1)
        text = before + start + rest.replace("home: -crouch}", "home: crouch}", 1)
    folder = tmp_path_factory.mktemp("turned") / "robot"
    made(folder, shipped, text)
    return folder


def test_knees_that_point_toward_each_other_are_driven_by_the_policy_of_all_legs(
    turned: Path,
) -> None:
    design = open_design(turned)
    assert fit(preview(design)).name == ANY_NAME
    with pytest.raises(DraftError) as found:
        fit(preview(design), "climb")
    line, remedy = str(found.value).splitlines()
    assert line.startswith(f"no policy drives the joints of {design.reference}: in the home pose, ")
    assert "RL_knee and RR_knee would bend the other way than in the policy's training" in line
    assert remedy.strip().startswith("train one: draft train ")
    with pytest.raises(DraftError, match="RL_knee and RR_knee would bend the other way"):
        check_drives([open_policy(FAMILY)], preview(design))


@pytest.fixture(scope="module")
def go2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("import") / "go2"
    draft.import_robot(GO2, out=folder)
    return folder


def test_an_import_walks_at_half_the_froude_speed(go2: Path) -> None:
    model = preview(open_design(go2))
    found = fit(model, "run")
    assert found.policy.joints[:3] == ("FL_hip_joint", "FL_thigh_joint", "FL_calf_joint")
    assert found.warning == ""
    scale = float(np.sqrt(9.81 * legged_robot(model.design, model).leg_length))
    walk = Walk(model, found, (0.5 * scale, 0.0, 0.0))
    walk.advance(3.0)
    start = walk.data.qpos[0]
    walk.advance(5.0)
    assert walk.falls == 0
    assert (walk.data.qpos[0] - start) / 5.0 == pytest.approx(0.42 * scale, rel=0.15)


def test_a_robot_without_a_home_pose_walks_from_the_crouch(tmp_path: Path, shipped: Path) -> None:
    text = (shipped / "tree.yaml").read_text(encoding="utf-8")
    model = made(tmp_path / "homeless", shipped, re.sub(r", home: [^}]+", "", text))
    assert not any(scalar(joint.home) for joint in model.design.joints.values())
    walk = Walk(model, fit(model, "run", [open_policy(FAMILY)]), (1.0, 0.0, 0.0))
    assert walk.data.qpos[9] < -0.8  # The knee starts bent.
    walk.advance(4.0)
    assert walk.falls == 0
    assert walk.velocity[0] > 0.5


def test_the_studio_and_a_report_let_an_import_walk(go2: Path) -> None:
    model = preview(open_design(go2))
    walker = Walker(clock=lambda: 0.0)
    walker.start(model)
    for _ in range(30):
        walker.advance(0.1)
    assert (walker.message, walker.speed > 0.3) == ("", True)
    assert {load.joint for load in walker.loads()} == set(model.design.joints)
    gait = record(model, seconds=3.0)
    assert gait.walks
    assert gait.note == ""


def needs_mjlab(test: Any) -> Any:
    """Skip a test that rolls out in mjlab where that or mjbatch is missing."""
    found = importlib.util.find_spec("mjlab") and obstacle() is None
    marked = pytest.mark.skipif(not found, reason="needs mjlab and mjbatch")(test)
    return pytest.mark.filterwarnings("ignore")(marked)


@needs_mjlab
def test_other_names_signs_and_order_walk_as_fast_in_mjlab(tmp_path: Path, shipped: Path) -> None:
    made(tmp_path / "other", shipped, tree(("swing", "thigh", "calf"), SIGNS, LEGS[::-1]))
    source = open_source()
    (one, _), (two, _) = (
        learned.of_designs(source, design, BodyRollOuts(replicas=4, seconds=4.0), device="cpu")
        for design in (open_design("quadruped"), open_design(tmp_path / "other"))
    )
    assert one.inside.all()
    assert two.inside.all()
    # Their joints start with other random offsets.
    assert two.top_speed == pytest.approx(one.top_speed, rel=0.05)
    assert two.kick == pytest.approx(one.kick, rel=0.25)


@needs_mjlab
def test_an_import_has_learned_metrics_and_says_where_it_is_outside(go2: Path) -> None:
    design = open_design(go2)
    found = of_policy(design, replicas=1, seconds=3.0, outside=True)
    assert found["learned.inside"] == 1
    assert float(found["learned.top_speed"]) > 1.5
    loaded = design.spec.resolve({"payload": 25.0})
    assert of_policy(loaded, replicas=1, seconds=1.0, outside=True)["learned.inside"] == 0
    assert np.isnan(float(of_policy(loaded, replicas=1, seconds=1.0)["learned.top_speed"]))
