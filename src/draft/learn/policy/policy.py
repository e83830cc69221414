"""Trained policies as functions from observations to actions, with NumPy only.

Policies of the shipped designs are part of the package, in `robots/quadruped/policies`; export
others from a run of `draft train` with `draft play`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from draft.errors import DraftError, suggest
from draft.learn.policy.matching import Structure, rolls_of_texts
from draft.learn.policy.onnx_file import Network, read
from draft.learn.policy.trim import NONE, Trim
from draft.learn.task.constants import CONTACT_TIME, VELOCITY_NOISE
from draft.learn.task.scan import scan_points

# Skills that studies compare, and the stages of training that teach them.
STUDIED = {"walk": "base", "run": "velocity", "climb": "terrain", "push": "push"}
# Policies for machines walk, run and survive kicks without the trunk's velocity.
SKILLS = {**STUDIED, "machine": "velocity"}
ROBOT = "quadruped"
DESIGN = "design"  # Term of the observation that holds the features of the design.
FOLDER = Path(__file__).parents[2] / "robots" / ROBOT / "policies"
# Policies of all quadrupeds of a range: one that is blind, one that sees the ground, and one for
# machines.
FAMILY, CLIMBING_FAMILY = FOLDER / "family.onnx", FOLDER / "family_climb.onnx"
MACHINE_FAMILY = FOLDER / "family_machine.onnx"
FAMILIES = {
    "walk": FAMILY,
    "run": FAMILY,
    "climb": CLIMBING_FAMILY,
    "push": FAMILY,
    "machine": MACHINE_FAMILY,
}
# The policy of all legs; see `draft.learn.policy.reduced`.
ANY = FOLDER.parents[1] / "policies" / "any.onnx"
_HISTORY = "observation_terms_history_length"
Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Policy:
    """A policy and the numbers that a controller needs; joints in the order of the actions.

    Attributes:
        file: file that it was read from.
        network: network of the file.
        design: name of the robot and design that it was trained with.
        stage: stage of training: base, velocity, terrain or push.
        iterations: iterations of that stage.
        seed: seed of the training.
        joints: names of the joints.
        structure: their places and axes in training; None for a file that does not state them.
        sign: for each joint, -1 if it turns the other way than in training, so that its angle,
            speed and action change signs, shape (joints,).
        rolls: for each joint, whether it drives a wheel: its target is a speed, not an angle,
            shape (joints,).
        home: joint angles to which actions are added [rad], shape (joints,).
        action_scale: joint offset [rad], or speed of a wheel [rad/s], per unit of action, shape
            (joints,).
        stiffness: gain kp [N m/rad], 0 for wheels, shape (joints,).
        damping: gain kd [N m s/rad], shape (joints,).
        servo_torque: torque that the gains are for [N m], shape (joints,); the peak torque where
            the training gave no hip and knee more (`draft.learn.bodies.slots.servo_torque`).
        support: least torque of hip pitch and knee there, over m g L; 0 for none.
        peak_torque: peak torque [N m], shape (joints,).
        stall_torque: torque at standstill without the current limit [N m], shape (joints,).
        no_load_speed: no-load speed [rad/s], shape (joints,).
        control_period: time between two actions [s].
        timestep: physics step of the training [s].
        contact_time: least and greatest time constant of the feet's contacts in training [s].
        delay: least and greatest delay of the joint targets in training [s].
        velocity_noise: largest error of the observed velocity in training [m/s].
        terms: names and lengths of the terms of an observation, in order.
        history: for each term, the number of its last values that are observed, the oldest first
            and the present one last.
        scan_points: points of the height scan in the trunk's heading frame, forwards and to the
            left [m], shape (points, 2); none if the policy does not observe the ground.
        scan_range: range of the scan, and divisor of its heights [m].
        commands: largest |vx|, |vy| [m/s] and |wz| [rad/s] that were commanded in training; of a
            family, the means over its bodies.
        features: features of the design, for a policy that observes them (`features`),
            shape (features,); () for others.
        known: lower and upper end of each feature of the bodies that the policy was trained with,
            shape (2, features); without features where the file has none.
        leg_length: thigh plus shank of the design [m].
        action_std: standard deviation of the actions at the end of the training, shape (joints,);
            (0,) for a file that does not state it.
        trim: integrators of the errors of the velocity; of one kind of robot there are none.
    """

    file: Path
    network: Network
    design: str
    stage: str
    iterations: int
    seed: int
    joints: tuple[str, ...]
    structure: Structure | None
    sign: Array
    rolls: NDArray[np.bool_]
    home: Array
    action_scale: Array
    stiffness: Array
    damping: Array
    servo_torque: Array
    support: float
    peak_torque: Array
    stall_torque: Array
    no_load_speed: Array
    control_period: float
    timestep: float
    contact_time: tuple[float, float]
    delay: tuple[float, float]
    velocity_noise: float
    terms: tuple[tuple[str, int], ...]
    history: tuple[int, ...]
    scan_points: Array
    scan_range: float
    commands: tuple[float, float, float]
    features: Array
    known: Array
    leg_length: float
    action_std: Array
    trim: Trim = NONE

    def __repr__(self) -> str:
        sizes = f"{self.network.size} observations, {len(self.joints)} actions"
        return f"Policy('{self.design}', stage {self.stage}, {sizes})"

    @property
    def forward(self) -> float:
        """Largest |vx| that was commanded in training [m/s]."""
        return self.commands[0]

    def __call__(self, observations: ArrayLike) -> NDArray[np.float32]:
        """Return the mean actions.

        Args:
            observations: shape (..., n), with n the sum of the lengths in `terms`.

        Returns:
            Actions, shape (..., joints): offsets from `home`, or speeds of wheels, in units of
            `action_scale`.

        Raises:
            DraftError: the observations have another length.
        """
        values = np.asarray(observations, np.float32)
        if values.shape[-1:] != (self.network.size,):
            parts = ", ".join(f"{name} {length}" for name, length in self.terms)
            cause = f"an observation of {self.design} has {self.network.size} numbers, not "
            cause += f"{values.shape[-1] if values.ndim else 'one'}"
            raise DraftError(cause, f"concatenate, in order: {parts}")
        return self.network(values)

    def torque(self, action: ArrayLike, angle: ArrayLike, speed: ArrayLike) -> Array:
        """Joint torques of the PD law, limited by the torque-speed line of a DC motor [N m].

        That of a wheel is proportional to the difference of its speed and its target.

        Args:
            action: action of the policy, shape (..., joints).
            angle: joint angles [rad], shape (..., joints).
            speed: joint velocities [rad/s], shape (..., joints).
        """
        action, angle, speed = (np.asarray(one, float) for one in (action, angle, speed))
        offset = self.sign * self.action_scale * action
        speeds = np.where(self.rolls, offset, 0.0)  # Wheels have no stiffness.
        wanted = self.stiffness * (self.home + offset - angle) + self.damping * (speeds - speed)
        return np.clip(wanted, *self.torque_bounds(speed))

    def torque_bounds(self, speed: ArrayLike) -> tuple[Array, Array]:
        """Least and largest torques of the motors at joint speeds [N m], shapes (..., joints).

        Beyond the no-load speed, both oppose the motion.

        Args:
            speed: joint velocities [rad/s], shape (..., joints).
        """
        peak, stall = self.peak_torque, self.stall_torque
        # As mjlab's motor: the speed counts up to where the line meets the opposite peak torque.
        ends = 1.0 + peak / stall
        share = np.clip(np.asarray(speed, float) / self.no_load_speed, -ends, ends)
        most = np.minimum(peak, stall * (1.0 - share))
        least = np.maximum(-peak, stall * (-1.0 - share))
        return least, most


def policy(design: str, skill: str = "walk") -> Policy:
    """Load the policy of a shipped design.

    Args:
        design: name of the design, such as "cheetah".
        skill: one of `SKILLS`.

    Raises:
        DraftError: there is no such design or skill, or it has no policy of its own for it.
    """
    check_skill(skill)
    name, shipped = short(design), designs()
    if name not in shipped:
        remedy = suggest(name, shipped, "designs with policies")
        remedy += "; train others with `draft.train`"
        raise DraftError(f"no policy of '{design}' is shipped", remedy)
    if not has(name, skill):
        known = [skill for skill in SKILLS if has(name, skill)]
        cause = f"no policy of '{name}' for the skill {skill} is shipped"
        raise DraftError(cause, f"skills of {name}: {', '.join(known)}")
    return open_policy(FOLDER / f"{name}-{skill}.onnx")


def has(design: str, skill: str) -> bool:
    """Return whether a policy of a shipped design alone is shipped for a skill."""
    return (FOLDER / f"{short(design)}-{skill}.onnx").is_file()


def check_skill(skill: str) -> None:
    """Check the name of a skill.

    Raises:
        DraftError: there is no such skill.
    """
    if skill not in SKILLS:
        raise DraftError(f"there is no skill '{skill}'", suggest(skill, SKILLS, "skills"))


def short(design: str) -> str:
    """Short name of a shipped design: "cheetah" for "quadruped:cheetah"."""
    return design.removeprefix(f"{ROBOT}:")


def designs() -> tuple[str, ...]:
    """Names of the designs that have shipped policies."""
    return tuple(sorted({file.stem.rpartition("-")[0] for file in FOLDER.glob("*-*.onnx")}))


def open_policy(path: str | Path) -> Policy:
    """Read a policy that `draft play` wrote.

    Args:
        path: ONNX file.

    Raises:
        DraftError: it cannot be read, or was written by another tool.
    """
    file = Path(path)
    return with_network(file, read(file))


def with_network(file: Path, network: Network) -> Policy:
    """Return the policy of a network that `draft play` wrote.

    Args:
        file: file of the network.
        network: the network, with its metadata.

    Raises:
        DraftError: the metadata are not those of a policy.
    """
    try:
        return _policy(file, network)
    except (KeyError, ValueError) as error:
        text = str(error).strip("'\"")
        cause = f"the metadata of {file} is missing or invalid: {text}"
        raise DraftError(cause, "write it with 'draft play'") from None


def velocity_noise(texts: Mapping[str, str]) -> float:
    """Largest error of the observed velocity in training [m/s]: the usual one if none is stated.

    Args:
        texts: metadata of a file.

    Raises:
        ValueError: it is no number that is 0 or more.
    """
    found = float(texts.get("velocity_noise", VELOCITY_NOISE))
    if not 0.0 <= found < math.inf:
        raise ValueError(f"velocity_noise is {found}, and no number that is 0 or more")
    return found


def _policy(file: Path, network: Network) -> Policy:
    texts = network.metadata

    def numbers(key: str) -> Array:
        return np.array(texts[key].split(","), float)

    def ends(key: str, usual: float) -> tuple[float, float]:
        low, high = numbers(key) if key in texts else (usual, usual)
        return float(low), float(high)

    joints = tuple(texts["joint_names"].split(","))
    names = texts["observation_names"].split(",")
    lengths = [int(n) for n in texts["observation_terms_dim"].split(",")]
    scan = "height_scan" in names
    ranges = [part.split(";") for part in texts["command_ranges"].split(",")]
    return Policy(
        file=file,
        network=network,
        design=texts["design"],
        stage=texts["stage"],
        iterations=int(texts["iteration"]),
        seed=int(texts["seed"]),
        joints=joints,
        structure=Structure.of_texts(texts),
        sign=np.ones(len(joints)),
        rolls=np.array(rolls_of_texts(texts) or (False,) * len(joints)),
        home=numbers("default_joint_pos"),
        action_scale=numbers("action_scale"),
        stiffness=numbers("joint_stiffness"),
        damping=numbers("joint_damping"),
        # Gains are for the motors' torques where no other is stated.
        servo_torque=numbers(
            "joint_servo_torque" if "joint_servo_torque" in texts else "joint_peak_torque"
        ),
        support=float(texts.get("support", "0")),
        peak_torque=numbers("joint_peak_torque"),
        # A motor with a straight line has no stall torque of its own.
        stall_torque=numbers(
            "joint_stall_torque" if "joint_stall_torque" in texts else "joint_peak_torque"
        ),
        no_load_speed=numbers("joint_no_load_speed"),
        control_period=1.0 / float(texts["control_rate"]),
        timestep=float(texts["physics_timestep"]),
        contact_time=ends("contact_time", CONTACT_TIME),
        delay=ends("delay", 0.0),
        velocity_noise=velocity_noise(texts),
        terms=tuple(zip(names, lengths, strict=True)),
        history=tuple(max(1, int(n)) for n in texts[_HISTORY].split(","))
        if _HISTORY in texts
        else (1,) * len(names),
        scan_points=scan_points([*numbers("height_scan_size")], float(texts["height_scan_pitch"]))
        if scan
        else np.zeros((0, 2)),
        scan_range=float(texts["height_scan_range"]),
        commands=(float(ranges[0][1]), float(ranges[1][1]), float(ranges[2][1])),
        features=numbers("design_features") if DESIGN in names else np.zeros(0),
        known=np.array([numbers("design_features_low"), numbers("design_features_high")])
        if "design_features_low" in texts
        else np.zeros((2, 0)),
        leg_length=float(texts["leg_length"]),
        action_std=numbers("action_std") if "action_std" in texts else np.zeros(0),
        trim=Trim.of([*numbers("trim")]) if "trim" in texts else NONE,
    )
