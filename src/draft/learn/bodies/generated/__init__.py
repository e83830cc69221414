"""Bodies of many topologies to train one policy of all legs on: sizes and motors drawn together.

A body is a spec with values of its parameters, so that it can be saved and opened as any design.
Its torque rises with its size as that of real robots does, times a factor of its own. What the
filter refuses, or what its motors cannot hold up, is drawn again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.learn.bodies.designs import Bodies, draw_bodies
from draft.spec import load
from draft.spec.load import ROBOTS
from draft.values import Array

BODIES = 2000  # Usual number of bodies.
FOLDER = Path(__file__).parent
STRENGTH = 0.8  # Half width of the logarithm of the factor on the torque.
_POWER = 3.3  # Power of the leg length that the torque rises with.
_LEAN = 0.06  # Largest angle of a humanoid's legs from where its sole is under its waist [rad].
_MARGIN = 1.6  # Least ratio of peak torque to standing torque.
Draw = Callable[["_Random"], dict[str, Array]]


class _Random:
    """Random arrays of one length."""

    def __init__(self, rng: np.random.Generator, count: int) -> None:
        self._rng, self._count = rng, count

    def between(self, low: float, high: float) -> Array:
        return self._rng.uniform(low, high, self._count)

    def spread(self, low: float, high: float) -> Array:
        """Even in the logarithm."""
        return np.exp(self.between(math.log(low), math.log(high)))

    def one_of(self, values: Array) -> Array:
        """Rows of values, shape (count, ...)."""
        return values[self._rng.integers(len(values), size=self._count)]

    def strength(self) -> Array:
        return np.exp(self.between(-STRENGTH, STRENGTH))


@dataclass(frozen=True)
class Kind:
    """Bodies of one topology.

    Attributes:
        spec: folder of the robot.
        share: share of all bodies.
        draw: draws values of its parameters and actuators.
    """

    spec: Path
    share: float
    draw: Draw


def _quadruped(random: _Random) -> dict[str, Array]:
    thigh = random.spread(0.1, 0.55)
    shank = thigh * random.between(0.75, 1.3)
    size = (thigh + shank) / 0.48
    # Knees back, forward, and toward each other; away from each other is kept for tests.
    front, rear = random.one_of(np.array([(1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])).T
    return {
        "thigh_length": thigh,
        "shank_length": shank,
        "trunk_length": 0.52 * size * random.between(0.35, 1.2),
        "trunk_width": 0.2 * size * random.between(0.7, 1.3),
        "trunk_height": 0.18 * size * random.between(0.7, 1.2),
        "hip_spacing": 0.16 * size * random.between(0.6, 1.6),
        "hip_offset": 0.1 * size * random.between(0.6, 1.6),
        "crouch": random.between(0.6, 1.7),
        "front_bend": front,
        "rear_bend": rear,
        "torque": 72 * size**_POWER * random.strength(),
        "speed": 40 / np.sqrt(size) * random.spread(0.2, 1.5),
        "reduction": random.between(0.8, 2.0),
    }


def _hexapod(random: _Random) -> dict[str, Array]:
    femur = random.spread(0.09, 0.32)
    tibia = femur * random.between(1.0, 1.7)
    size = (femur + tibia) / 0.38
    return {
        "femur_length": femur,
        "tibia_length": tibia,
        "body_length": 0.44 * size * random.between(0.7, 1.5),
        "body_width": 0.2 * size * random.between(0.7, 1.6),
        "body_height": 0.08 * size * random.between(0.8, 1.3),
        "lift": random.between(0.2, 0.9),
        "foot_radius": np.clip(0.018 * size, 0.006, 0.045),
        "actuators.leg.peak_torque": 14 * size**_POWER * random.strength(),
        "actuators.leg.no_load_speed": 12 / np.sqrt(size) * random.spread(0.6, 2.4),
    }


def _biped(random: _Random) -> dict[str, Array]:
    size, drawn = _two_legs(random)
    ankle = 55 * size**_POWER * random.spread(0.35, 1.5)
    return drawn | {
        "foot_offset": drawn["foot_length"] * random.between(0.0, 0.25),
        "spread": random.between(0.95, 1.5),
        "hip_forward": 0.3 * size * random.between(-0.15, 0.15),
        "actuators.yaw.peak_torque": 110 * size**_POWER * random.spread(0.25, 1.2),
        "actuators.yaw.no_load_speed": 14 / np.sqrt(size) * random.spread(0.6, 2.0),
        "actuators.ankle.peak_torque": ankle,
        "actuators.roll.peak_torque": ankle * random.spread(0.3, 1.0),
        "actuators.roll.no_load_speed": 14 / np.sqrt(size) * random.spread(0.4, 3.0),
    }


def _biped_slanting(random: _Random) -> dict[str, Array]:
    return _biped(random) | {"slant": random.between(0.0, 0.78)}


def _biped_of_four(random: _Random) -> dict[str, Array]:
    size, drawn = _two_legs(random)
    return drawn | {"actuators.ankle.peak_torque": 55 * size**_POWER * random.spread(0.35, 1.5)}


def _two_legs(random: _Random) -> tuple[Array, dict[str, Array]]:
    """Size over that of legs of 0.6 m, and what bipeds have in common."""
    thigh = random.spread(0.13, 0.5)
    shank = thigh * random.between(0.8, 1.25)
    size = (thigh + shank) / 0.6
    return size, {
        "thigh_length": thigh,
        "shank_length": shank,
        "pelvis_height": 0.16 * size * random.between(0.5, 3.0),
        "pelvis_depth": 0.2 * size * random.between(0.7, 1.2),
        "foot_length": np.clip(0.2 * size * random.between(0.7, 1.3), 0.06, 0.4),
        "foot_width": np.clip(0.09 * size * random.between(0.7, 1.3), 0.03, 0.2),
        "knee_bend": random.between(0.2, 1.2),
        "actuators.hip.peak_torque": 110 * size**_POWER * random.strength(),
        "actuators.hip.no_load_speed": 14 / np.sqrt(size) * random.spread(0.5, 2.5),
        "actuators.ankle.no_load_speed": 14 / np.sqrt(size) * random.spread(0.4, 3.0),
    }


def _humanoid(random: _Random) -> dict[str, Array]:
    size, longer = random.spread(0.6, 1.4), random.between(0.9, 2.0)
    torque = size**_POWER
    lengths = {
        "torso_length": 0.5,
        "shoulder_width": 0.2,
        "shoulder_depth": 0.15,
        "upper_shoulder_length": 0.086,
        "lower_shoulder_length": 0.12,
        "upper_arm_length": 0.1,
        "forearm_length": 0.106,
        "thigh_length": 0.2,
        "shank_length": 0.2,
        "foot_length": 0.2,
        "foot_width": 0.085,
        "foot_height": 0.06,
    }
    drawn = {name: value * size * random.between(0.8, 1.2) for name, value in lengths.items()}
    # Less of the thigh above its yaw motor: more of its mass lies where that of others does.
    drawn["lower_hip_length"] = 0.15 * size * random.between(0.7, 1.1)
    # Long legs under a short torso, so that the centre of mass lies lower than in the shipped one.
    for name in ("thigh_length", "shank_length"):
        drawn[name] *= longer
    for name in ("foot_length", "foot_width"):
        drawn[name] *= np.sqrt(longer)
    drawn["torso_length"] *= random.between(0.6, 1.0)
    drawn["foot_offset"] = drawn["foot_length"] * random.between(0.0, 0.25)
    # The hips are not above the middle of the feet in all: others carry more in front or behind.
    bend, leg = random.between(0.15, 1.0), drawn["lower_hip_length"] + drawn["thigh_length"]
    under = (drawn["shank_length"] * bend - drawn["foot_offset"]) / (leg + drawn["shank_length"])
    drawn |= {"knee_bend": bend, "hip_bend": under + random.between(-_LEAN, _LEAN)}
    speeds = {"large": 5.9, "medium": 10.3, "small": 11.5}
    torques = {"large": 120.0 * longer, "medium": 72.0 * np.sqrt(longer), "small": 24.0}
    least = {"large": 0.4, "medium": 0.4, "small": 0.3}
    for name, peak in torques.items():
        drawn[f"actuators.{name}.peak_torque"] = peak * torque * random.spread(least[name], 1.6)
        speed = speeds[name] / np.sqrt(size) * random.spread(0.6, 4.0)
        drawn[f"actuators.{name}.no_load_speed"] = speed
        drawn[f"actuators.{name}.gear_ratio"] = 292.1 / speed
    return drawn


KINDS: Mapping[str, Kind] = {
    "quadruped": Kind(FOLDER / "quadruped", 0.38, _quadruped),
    "hexapod": Kind(ROBOTS / "hexapod", 0.10, _hexapod),
    "biped": Kind(FOLDER / "biped", 0.13, _biped),
    "biped_of_four": Kind(FOLDER / "biped_of_four", 0.08, _biped_of_four),
    "humanoid": Kind(ROBOTS / "humanoid", 0.20, _humanoid),
    "biped_slanting": Kind(FOLDER / "biped_slanting", 0.11, _biped_slanting),
}


def generate(count: int, seed: int = 0) -> list[Bodies]:
    """Draw bodies of all kinds.

    Args:
        count: number of bodies, divided by the kinds' shares; at least one of each.
        seed: seed of the draws.

    Returns:
        Bodies of each kind, in the order of `KINDS`.

    Raises:
        DraftError: too few draws of a kind pass.
    """
    return [
        generate_kind(name, max(1, round(count * kind.share)), seed) for name, kind in KINDS.items()
    ]


def together(kinds: Sequence[Bodies]) -> Bodies:
    """Bodies of all kinds as those of one training."""
    return Bodies(
        kinds[0].spec,
        tuple(member for bodies in kinds for member in bodies.members),
        tuple(text for bodies in kinds for text in bodies.texts),
        "; ".join(bodies.note for bodies in kinds if bodies.note),
    )


def generate_kind(name: str, count: int, seed: int = 0, of: Mapping[str, Kind] = KINDS) -> Bodies:
    """Draw bodies of one kind, by its name; other kinds than `KINDS` can be drawn for tests.

    Raises:
        DraftError: too few draws pass.
    """
    kind = of[name]
    base = load(kind.spec).resolve()
    rng = np.random.default_rng([list(of).index(name), seed])

    def draw(start: int, size: int) -> dict[str, Array]:
        drawn = kind.draw(_Random(rng, size))
        for key, values in drawn.items():
            bounds = getattr(base.spec.parameters.get(key), "bounds", None)
            drawn[key] = np.clip(values, *bounds) if bounds is not None else values
        return drawn

    return draw_bodies(base, draw, count, _stands)


def _stands(block: Design) -> NDArray[np.bool_]:
    """Whether the motors of designs hold them up in the home pose with a margin."""
    from draft.metrics import of_design

    return np.asarray(of_design(block, ["torque_margin"])["torque_margin"]) > _MARGIN
