"""Policies drive robots of other names, orders and signs of the joints, and refuse other legs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.references import open_design
from draft.errors import DraftError
from draft.learn.gait import record
from draft.learn.legged import legged_robot
from draft.learn.matching import Match, Structure, match, structure_of
from draft.learn.policy import FAMILY, open_policy
from draft.learn.region import check_drives, fit
from draft.learn.walk import Walk
from draft.model import Model
from draft.model.model import preview
from draft.studio.walker import Walker

GO2 = Path(__file__).parents[2] / "examples/descriptions/unitree_go2/go2.urdf"
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
        {{axis: y, length: hip_offset, segment: thigh, radius: "min(thigh_radius, 0.8 * leg.radius)"}}
      motor: {{actuator: leg, axis: y}}
    - name: upper_leg
      at: [0, hip_offset - leg.length / 2, 0]
      link: {{axis: -z, length: thigh_length, segment: thigh, radius: thigh_radius}}
      pulley:
        {{axis: y, radius: "max(0.5 * leg.radius, 1.15 * thigh_radius)", length: 2.1 * thigh_radius}}
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


PLAIN = {leg: (1, 1, 1) for leg in LEGS}


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


@settings(max_examples=12, deadline=None)
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
