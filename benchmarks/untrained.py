"""Kinds of bodies that the generator does not train: specs made from the text of its own."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from draft.learn.bodies.generated import KINDS, Kind
from draft.values import Array

# A yaw above the hip roll, and an ankle: the foot stays below the hip.
_FIVE = """\
  {which}_leg:
    - name: yaw_housing # no joint: bolted to the trunk
      motor: {{actuator: leg, axis: z}} # drives the hip yaw
    - name: hip_housing
      joint: {{name: hip_yaw, axis: z, range: [-0.5, 0.5], actuator: leg}}
      link: {{axis: -z, length: yaw_to_roll, segment: hip_link, radius: 0.5 * leg.radius}}
      motor: {{actuator: leg, axis: x, shift: [leg.length / 2, 0, 0]}} # drives the hip roll
    - name: abduction
      joint: {{name: hip_roll, axis: x, range: [-0.8, 0.8], actuator: leg}}
      link: {{axis: x, length: abduction_length, segment: hip_link, radius: 0.6 * leg.radius}}
      motor: {{actuator: leg, axis: y}} # drives the hip pitch
    - name: lateral_thigh
      joint: {{name: hip_pitch, axis: y, range: [-2.5, 2.5], actuator: leg, home: {hip}}}
      link: {{axis: y, length: hip_offset, segment: thigh, radius: 0.8 * leg.radius}}
      motor: {{actuator: knee, axis: y}} # drives the knee through a belt
    - name: upper_leg # no joint: bolted to the lateral thigh, beside its motor
      at: [0, hip_offset - leg.length / 2, 0]
      link: {{axis: -z, length: thigh_length, segment: thigh, radius: thigh_radius}}
    - name: lower_leg
      joint: {{name: knee, axis: y, range: [-2.8, 2.8], actuator: knee, home: {knee}}}
      link: {{axis: -z, length: 0.6 * shank_length, segment: shank, radius: shank_radius}}
      motor: {{actuator: ankle, axis: y}} # drives the ankle
    - name: metatarsus
      type: sphere
      joint: {{name: ankle, axis: y, range: [-2, 2], actuator: ankle, home: {ankle}}}
      link: {{axis: -z, length: 0.4 * shank_length, segment: shank, radius: 0.8 * shank_radius}}
      sphere: {{radius: foot_radius, site: foot}}
"""
_ANKLE = """
  ankle: {doc: Drives the ankles., peak_torque: 0.5 * torque, no_load_speed: 1.4 * speed}
"""
_YAW = "  yaw_to_roll: {value: leg.length / 2 + 1.2 * leg.radius, unit: m, doc: Yaw to roll.}\n"
_PLACES = (0.42, 0.14, -0.14, -0.42)  # Of the legs of a side, per length of the body.
_TURNS = (0.36, 0.46, 0.54, 0.64)  # Where they point, in half turns from ahead.
_LONGER = 1.5  # A body for eight legs over one for six.


def kinds(folder: Path) -> Mapping[str, Kind]:
    """Kinds that were never trained, after those that are; specs are written below a folder."""
    quadruped, hexapod = KINDS["quadruped"], KINDS["hexapod"]
    return {
        **KINDS,
        "knees O": replace(quadruped, draw=_knees_apart),
        "five joints a leg": replace(quadruped, spec=_five_joints(folder, quadruped)),
        "eight legs": replace(hexapod, spec=_eight_legs(folder, hexapod), draw=_longer),
    }


def _knees_apart(random: Any) -> dict[str, Array]:
    """Front knees forward and rear ones back, which no quadruped of the training has."""
    drawn = KINDS["quadruped"].draw(random)
    one = np.ones_like(drawn["crouch"])
    return drawn | {"front_bend": -one, "rear_bend": one}


def _longer(random: Any) -> dict[str, Array]:
    drawn = KINDS["hexapod"].draw(random)
    return drawn | {"body_length": _LONGER * drawn["body_length"]}


def _five_joints(folder: Path, kind: Kind) -> Path:
    tree = _text(kind, "tree")
    chains = "\n".join(
        _FIVE.format(
            which=which,
            hip=f"0.375 * crouch * {which}_bend",
            knee=f"-crouch * {which}_bend",
            ankle=f"0.625 * crouch * {which}_bend",
        )
        for which in ("front", "rear")
    )
    own = f"chains:\n{chains}\n{tree[tree.index('tree:') :]}"
    numbers = _text(kind, "parameters").replace("  # derived\n", f"  # derived\n{_YAW}")
    return _written(folder / "quadruped_of_five", kind, own, numbers.rstrip() + _ANKLE)


def _eight_legs(folder: Path, kind: Kind) -> Path:
    tree = _text(kind, "tree")
    lines = [
        f"    - {{chain: leg, prefix: {side}{k}_, at: [{place} * body_length, "
        f"{sign}body_width / 2, 0], rpy: [0, 0, {sign}{turn} * pi]}}"
        for side, sign in (("L", ""), ("R", "-"))
        for k, (place, turn) in enumerate(zip(_PLACES, _TURNS, strict=True))
    ]
    own = tree[: tree.index("    - {chain")] + "\n".join(lines) + "\n"
    return _written(folder / "octopod", kind, own, _text(kind, "parameters"))


def _text(kind: Kind, name: str) -> str:
    return (kind.spec / f"{name}.yaml").read_text(encoding="utf-8")


def _written(folder: Path, kind: Kind, tree: str, parameters: str) -> Path:
    """Write a spec whose root is that of a kind."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {"root": _text(kind, "root"), "tree": tree, "parameters": parameters}
    for name, text in texts.items():
        (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return folder
