"""Playback of a policy and its design in plain MuJoCo: on a plane, over steps, or with kicks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ParamSpec, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.design.references import find_design
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.bodies.payload import model_spec
from draft.learn.policy.controller import Controller
from draft.learn.policy.play_options import Command, Course, PlaySettings
from draft.learn.policy.policy import SKILLS, Policy, check_skill, has
from draft.learn.policy.policy import policy as shipped
from draft.learn.policy.reduced import open_any
from draft.learn.policy.scenery import dress
from draft.learn.policy.validity import check_drives, fit
from draft.learn.task.groups import Episodes, Ground
from draft.learn.task.stages import is_like
from draft.model import Model
from draft.settings import by_keyword

P = ParamSpec("P")
SETTLING = 1.0  # Time after the start from rest that measures of walking exclude [s].
STEPS, WIDTH = 4, 6.0  # Number of steps of a flight; their width [m].
_RUN_UP, _LANDING = 1.5, 2.0  # Distance before the steps, and between up and down [m].
KICK_EVERY = 3.0  # Time between two kicks [s].
# Depth of steps and criteria of a fall are those of training.
_TREAD, _EPISODES = Ground().tread, Episodes()
_AS_USUAL = Course()


@dataclass(frozen=True)
class Outcome:
    """Result of playing a policy.

    Attributes:
        seconds: duration [s].
        robots: number of robots.
        command: commanded vx, vy [m/s], wz [rad/s].
        speed: mean forward speed, after the first second [m/s].
        error: mean of |v_xy - command|, after the first second [m/s].
        falls: number of falls; a robot that falls restarts.
    """

    seconds: float
    robots: int
    command: Command
    speed: float
    error: float
    falls: int


@dataclass(frozen=True)
class Scenario:
    """Command, ground and disturbances of a playback.

    Attributes:
        command: commanded vx, vy [m/s], wz [rad/s].
        step: height of the steps ahead [m]; 0 for a plane.
        kick: size of the kicks [m/s]; 0 for none.
    """

    command: Command
    step: float = 0.0
    kick: float = 0.0


class Playback:
    """One robot, driven by a policy.

    Attributes:
        policy: the policy.
        controller: controller that runs the policy.
        member: numbers of the design.
        model: MuJoCo model of robot and ground.
        data: state of the model.
        command: commanded vx, vy [m/s], wz [rad/s]; may be changed at any time.
        kick: size of the kicks [m/s]: each adds a velocity within +-kick along x and along y.
        falls: number of falls so far.
    """

    def __init__(
        self, policy: Policy, robot: Design | LeggedRobot, scenario: Scenario, seed: int = 0
    ) -> None:
        """Put the robot into its scene.

        Args:
            policy: the policy, with the joints of the design; see `validity.fit`.
            robot: the robot: a design, or its numbers for training.
            scenario: command, ground and disturbances.
            seed: seed of kicks and of joint offsets at the start.

        Raises:
            DraftError: the policy does not fit the design.
        """
        self.policy = policy
        self.member = legged_robot(robot) if isinstance(robot, Design) else robot
        self.model = _scene(robot.build() if isinstance(robot, Design) else robot, scenario.step)
        self.data = mujoco.MjData(self.model)
        self.command, self.kick, self.falls = scenario.command, scenario.kick, 0
        self.controller = Controller(policy, self.model)
        self._random = np.random.default_rng(seed)
        self._feet = [self.model.site(name).id for name in self.member.feet]
        self._trunk = self.model.body(self.member.trunk).id
        self.reset()

    @property
    def title(self) -> str:
        """Name of the robot."""
        return self.member.name

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        return self.policy.control_period

    def scene(self) -> tuple[mujoco.MjModel, str]:
        """Return the model and the prefix of the robot's names in it."""
        return self.model, ""

    def poses(self) -> NDArray[np.float64]:
        """Return positions `qpos` of the robot, shape (1, nq)."""
        return self.data.qpos[None].copy()

    def steps(self, seconds: float) -> int:
        """Return the number of actions in a time [s], at least 1."""
        return max(1, round(seconds / self.period))

    def reset(self) -> None:
        """Put the robot back to the start."""
        self.controller.reset(self.data, int(self._random.integers(2**31)))
        if not self.model.nkey:
            self.data.qpos[2] = self.member.height
            mujoco.mj_forward(self.model, self.data)

    def step(self) -> None:
        """Advance by one physics step; a robot that falls restarts.

        Raises:
            DraftError: the simulation or the policy gives values that are not finite.
        """
        before = self.data.time
        self.controller.step(self.data, self.command)
        if self.kick and int(self.data.time / KICK_EVERY) > int(before / KICK_EVERY):
            self.push(self.kick)
        if self._fallen():
            self.falls += 1
            self.reset()

    def push(self, size: float) -> None:
        """Kick the robot.

        Args:
            size: largest velocity that is added along x and along y [m/s].
        """
        self.data.qvel[:2] += self._random.uniform(-size, size, 2)

    def play(self, seconds: float, report: Callable[[int], None] = lambda _: None) -> Outcome:
        """Run the policy from a fresh start.

        Args:
            seconds: duration [s].
            report: called with the number of actions done, from 0 on.

        Raises:
            DraftError: the simulation or the policy gives values that are not finite.
        """
        self.reset()
        self.falls = 0
        substeps, actions = round(self.period / self.policy.timestep), self.steps(seconds)
        skipped = min(round(SETTLING / self.period), actions // 2)
        commanded, velocities = np.array(self.command[:2]), []
        report(0)
        for action in range(1, actions + 1):
            for _ in range(substeps):
                self.step()
            if action > skipped:
                velocities.append(self.controller.velocity(self.data)[:2].copy())
            report(action)
        error = float(np.linalg.norm(np.array(velocities) - commanded, axis=1).mean())
        speed = float(np.mean(velocities, axis=0)[0])
        return Outcome(actions * self.period, 1, self.command, speed, error, self.falls)

    def _fallen(self) -> bool:
        up = self.data.xmat[self._trunk][8]
        feet = self.data.site_xpos[self._feet, 2].mean()
        low = self.data.xpos[self._trunk, 2] - feet < _EPISODES.low * self.member.height
        return bool(low or up < np.cos(_EPISODES.tilt))


def _scene(robot: Model | LeggedRobot, step: float) -> mujoco.MjModel:
    """The robot on a plane, or before a flight of steps up and one down."""
    if isinstance(robot, LeggedRobot):
        spec = model_spec(robot)
    else:
        own = {"robot.xml": robot.xml.encode()}
        spec = mujoco.MjSpec.from_string(robot.scene_xml, include=own)
        spec.delete(spec.geom("floor"))
        spec.delete(spec.texture("sky"))
    ground = spec.worldbody.add_body(name="terrain")
    ground.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 0.05))
    for start, length, height in _flight(step) if step else ():
        ground.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=(start + length / 2, 0, height / 2),
            size=(length / 2, WIDTH / 2, height / 2),
        )
    dress(spec)
    return spec.compile()


def _flight(step: float) -> list[tuple[float, float, float]]:
    """Start, length and height of each block of a flight [m], the longest at the bottom."""
    whole = 2 * STEPS * _TREAD + _LANDING - 2 * _TREAD
    return [(_RUN_UP + i * _TREAD, whole - 2 * i * _TREAD, (i + 1) * step) for i in range(STEPS)]


class _Play(Protocol[P]):
    """Type of `play`, with the settings as keyword arguments."""

    def __call__(
        self,
        design: Design | str,
        skill: str | None = None,
        policy: str | Path | None = None,
        *args: P.args,
        **settings: P.kwargs,
    ) -> Outcome: ...


def _with_settings(
    record: Callable[P, PlaySettings],
) -> Callable[[Callable[..., Outcome]], _Play[P]]:
    return by_keyword(record)


@_with_settings(PlaySettings)
def play(
    design: Design | str,
    skill: str | None = None,
    policy: str | Path | None = None,
    *,
    settings: PlaySettings,
) -> Outcome:
    """Let a robot walk in plain MuJoCo with the policy that fits it best.

        >>> found = draft.play("quadruped", command=(0.8, 0.0, 0.0), seconds=4.0)
        >>> found.falls, round(found.speed, 1)
        (0, 0.8)

    Args:
        design: the robot, or its name.
        skill: "walk", "run", "climb", "push" or "machine"; None for "walk".
        policy: an ONNX file that `draft play` wrote; None for a shipped policy.
        settings: fields of `PlaySettings`, by keyword.

    Returns:
        Mean speed and tracking error after settling, and the number of falls. `playback` gives the
        model and its state at each step instead.

    Raises:
        DraftError: no policy drives the robot, an argument is out of range, or the simulation
            diverges.
    """
    found = find_design(design).resolve() if isinstance(design, str) else design
    own = () if policy is None else (policy,)
    robot, _ = playback(found, skill, own, settings, settings.seed)
    return robot.play(settings.seconds)


def playback(
    design: Design,
    skill: str | None = None,
    own: Sequence[str | Path] = (),
    course: Course = _AS_USUAL,
    seed: int = 0,
) -> tuple[Playback, str]:
    """Put a robot into the scene of a skill, with the policy that fits it best.

    Args:
        design: the robot.
        skill: as of `play`; None for "walk", or what `own` was trained for.
        own: ONNX files to choose from; empty for the shipped policies.
        course: what the robot is asked to do.
        seed: seed of kicks and of joint offsets at the start.

    Returns:
        The robot, and what of it lies outside the policy's region of validity; "" for nothing.

    Raises:
        DraftError: no policy drives the robot, or an argument is out of range.
    """
    if skill is not None:
        check_skill(skill)
    name, warning = design.reference, ""
    if has(name, skill or "walk") and not own:
        chosen = shipped(name, skill or "walk")
    else:
        model, policies = design.build(), [open_any(file) for file in own]
        check_drives(policies, model)
        fitting = fit(model, skill or "walk", policies)
        chosen, warning = fitting.policy, fitting.warning
    usually = usual(chosen, chosen.stage if own and not skill else SKILLS[skill or "walk"])
    scenario = Scenario(
        command=course.command or usually.command,
        step=usually.step if course.step is None else course.step,
        kick=usually.kick if course.kick is None else course.kick,
    )
    return Playback(chosen, design, scenario, seed), warning


def usual(policy: Policy, stage: str) -> Scenario:
    """Return the scenario that shows what a stage teaches.

    Args:
        policy: the policy.
        stage: that of the policy, or of the skill that it is to show.
    """
    # Policies of kicks may stand still at slow commands, which are as near to theirs as to none.
    share = 0.8 if is_like(stage, "velocity") or is_like(stage, "push") else 0.5
    return Scenario(
        command=(share * policy.forward, 0.0, 0.0),
        step=0.1 if is_like(stage, "terrain") else 0.0,
        kick=2.0 if is_like(stage, "push") else 0.0,
    )
