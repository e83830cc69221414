"""Simulation of the home pose: what the servos of `scene.xml` make of a robot on a floor."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.design.actuators import Actuator
from draft.design.design import Design
from draft.design.findings import Finding, note
from draft.design.parts import Joint
from draft.errors import counted
from draft.model.pose import base_coordinates
from draft.model.scene import foot_points
from draft.values import Array, brief

DURATION = 2.0
# Penetrations of the start pose that are reported, of the floor and of other parts [m].
IN_FLOOR, IN_PARTS = 1e-3, 2e-3
# A robot has fallen when its trunk tilts by more [rad], or sinks below this share of its height.
TILT, SUNK = math.radians(60.0), 0.5
# Deviation from the home pose from which on a servo is weak, by type of joint [rad, m].
YIELDS = {"hinge": 0.1, "slide": 0.02}
# A joint swings if it turns back this often, by this share of the deviation above, in a second.
TURNS, SWING = 4, 0.2
# Speed of a joint that no servo gives: the simulation diverges [rad/s or m/s].
_RUNAWAY = 1e3
# Acceleration at which MuJoCo gives up, 1e10, with a margin [rad/s2 or m/s2].
_LARGEST = 1e9
_SOURCE = "simulation of the home pose with the servos of scene.xml"


@dataclass(frozen=True)
class Course:
    """Course of a simulation, until a robot falls or diverges.

    Attributes:
        time: simulated time [s].
        joints: position of every joint at every step [rad or m], shape (steps, joints).
        speeds: speed of every joint at every step [rad/s or m/s], shape (steps, joints).
        at_limit: share of the steps at which each servo gives its peak torque, shape (servos,).
        tilt: tilt of the trunk at the end [rad].
        height: height of the trunk at the end as a share of that at the start.
        fell: whether it fell; a base that is bolted to the world does not.
        diverged: whether a speed or position is not finite or beyond all servos.
        supports: number of points of feet on the floor in the start pose.
    """

    time: float
    joints: Array
    speeds: Array
    at_limit: Array
    tilt: float
    height: float
    fell: bool
    diverged: bool
    supports: int


def simulate(design: Design, scene: mujoco.MjModel) -> tuple[Finding, ...]:
    """Simulate the home pose for two seconds.

    Args:
        design: one design.
        scene: its compiled scene.

    Returns:
        Findings: penetrations of the start pose, a fall, servos that swing or give way.
    """
    course = run(scene)
    return (
        *_in_floor(scene),
        *_in_parts(scene),
        *_servos(design, scene, course),
        *_fall(design, course),
    )


def run(scene: mujoco.MjModel, duration: float = DURATION) -> Course:
    """Let servos hold the home pose of a scene on its floor.

    Args:
        scene: compiled scene with the keyframe `home`.
        duration: simulated time [s].
    """
    data = _start(scene)
    places, dofs = base_coordinates(scene)
    height, supports, time = float(data.xpos[1][2]), len(foot_points(scene, data)), 0.0
    joints, speeds = [], []
    at_limit = np.zeros(scene.nu)
    tilt, fell, diverged = 0.0, False, False
    while time < duration and not fell and not diverged:
        diverged = _step(scene, data)
        if diverged:
            break
        time = float(data.time)
        joints.append(data.qpos[places:].copy())
        speeds.append(data.qvel[dofs:].copy())
        at_limit += np.abs(data.actuator_force) > 0.999 * scene.actuator_forcerange[:, 1]
        if places:
            tilt = math.acos(min(max(float(data.xmat[1][8]), -1.0), 1.0))
            fell = tilt > TILT or (supports > 0 and data.qpos[2] < SUNK * height)
    steps = max(len(joints), 1)
    return Course(
        time,
        np.array(joints).reshape(-1, scene.nq - places),
        np.array(speeds).reshape(-1, scene.nv - dofs),
        at_limit / steps,
        tilt,
        float(data.qpos[2]) / height if places and height > 0 else 1.0,
        fell,
        diverged,
        supports,
    )


def _step(scene: mujoco.MjModel, data: mujoco.MjData) -> bool:
    """Do a step; return whether the simulation diverges.

    `mj_step` would start again from the beginning then, and write MUJOCO_LOG.TXT into the current
    folder.
    """
    mujoco.mj_forward(scene, data)
    if not np.all(np.abs(data.qacc) < _LARGEST):
        return True
    mujoco.mj_implicit(scene, data)
    return not np.all(np.abs(data.qvel) < _RUNAWAY)


def _start(scene: mujoco.MjModel) -> mujoco.MjData:
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, scene.key("home").id)
    mujoco.mj_forward(scene, data)
    return data


# --- findings ----------------------------------------------------------------------------------


def _in_floor(scene: mujoco.MjModel) -> Iterator[Finding]:
    """Compare the contacts of the start pose with the floor."""
    floor = scene.geom("floor").id
    for pair, depth in _depths(scene, _start(scene)).items():
        if floor in pair and depth > IN_FLOOR:
            part = scene.geom(pair[0] if pair[1] == floor else pair[1]).name
            yield from note(
                "start_penetration",
                _body(scene, part),
                True,
                f"'{part}' is {{value}} deep in the floor in the start pose: the floor throws "
                "the robot up",
                _SOURCE,
                1e3 * depth,
                None,
                "mm",
            )


def _in_parts(scene: mujoco.MjModel) -> Iterator[Finding]:
    """Compare limbs of the robot, which the scene lets pass through each other."""
    # The scene belongs to the caller: let the parts of a copy collide.
    touching = copy.copy(scene)
    touching.geom_contype[:] = touching.geom_conaffinity
    touching.body_contype[:] = touching.body_conaffinity
    depths = _depths(touching, _start(touching))
    for (first, second), depth in depths.items():
        bodies = [int(body) for body in scene.geom_bodyid[[first, second]]]
        # Links of one limb are joined, and overlap where they are.
        if depth <= IN_PARTS or bodies[0] in _above(scene, bodies[1]):
            continue
        names = [scene.geom(one).name for one in (first, second)]
        yield from note(
            "start_penetration",
            "/".join(scene.body(body).name for body in bodies),
            True,
            f"'{names[0]}' and '{names[1]}' overlap by {{value}} in the start pose",
            _SOURCE,
            1e3 * depth,
            None,
            "mm",
        )


def _above(scene: mujoco.MjModel, body: int) -> set[int]:
    """Return a body and those above it in the tree, up to the world."""
    found = {body}
    while body:
        body = int(scene.body_parentid[body])
        found.add(body)
    return found


def _depths(scene: mujoco.MjModel, data: mujoco.MjData) -> dict[tuple[int, int], float]:
    """Greatest penetration of each pair of geoms [m], the deepest first, a pair of bodies once."""
    deepest: dict[tuple[int, int], tuple[float, tuple[int, int]]] = {}
    for contact in data.contact:
        first, second = sorted((int(contact.geom1), int(contact.geom2)))
        bodies = (int(scene.geom_bodyid[first]), int(scene.geom_bodyid[second]))
        found = (-float(contact.dist), (first, second))
        deepest[bodies] = max(found, deepest.get(bodies, found))
    return {pair: depth for depth, pair in sorted(deepest.values(), reverse=True)}


def _body(scene: mujoco.MjModel, geom: str) -> str:
    return scene.body(int(scene.geom(geom).bodyid[0])).name


@dataclass(frozen=True)
class _Servo:
    """A driven joint in a simulation.

    Attributes:
        name: name of the joint in the model.
        body: name of the body that it moves.
        joint: the joint.
        actuator: its actuator.
        moved: deviation from the home pose at every step [rad or m], shape (steps,).
        speed: greatest speed at the end [rad/s or m/s].
        at_limit: share of the time at the peak torque.
    """

    name: str
    body: str
    joint: Joint
    actuator: Actuator
    moved: Array
    speed: float
    at_limit: float

    @property
    def unit(self) -> str:
        return "m" if self.joint.slide else "rad"

    @property
    def limit(self) -> float:
        """Deviation from which on it is weak [rad or m]."""
        return YIELDS["slide" if self.joint.slide else "hinge"]

    @property
    def most(self) -> float:
        """Greatest deviation from the home pose [rad or m]."""
        return float(np.max(np.abs(self.moved), initial=0.0))


def _driven(design: Design, scene: mujoco.MjModel, course: Course) -> Iterator[_Servo]:
    home = scene.key("home").qpos[base_coordinates(scene)[0] :]
    index = servo = -1
    for body in design.bodies:
        if (joint := body.joint) is None:
            continue
        index += 1
        if (actuator := design.drive(joint)) is None:
            continue
        servo += 1
        yield _Servo(
            body.prefix + joint.name,
            body.name,
            joint,
            actuator,
            course.joints[:, index] - home[index],
            float(np.max(np.abs(course.speeds[-1:, index]), initial=0.0)),
            float(course.at_limit[servo]),
        )


def _servos(design: Design, scene: mujoco.MjModel, course: Course) -> Iterator[Finding]:
    """Compare the positions of driven joints with the home pose."""
    servos = [*_driven(design, scene, course)]
    if course.diverged:
        yield from _divergence(design, servos, scene.opt.timestep, course)
        return
    second = round(1.0 / scene.opt.timestep)
    weak: dict[tuple[str, str], list[_Servo]] = {}
    for servo in servos:
        last = servo.moved[-second:]
        if _turns(last, SWING * servo.limit) >= TURNS:
            yield from note(
                "unstable_servo",
                servo.body,
                True,
                f"the servo of '{servo.name}' does not come to rest: it swings by {{value}}",
                _SOURCE,
                float(np.ptp(last)),
                None,
                servo.unit,
            )
        elif servo.most > servo.limit and not servo.joint.rolls:  # A wheel holds its speed.
            weak.setdefault((servo.joint.name, servo.actuator.name), []).append(servo)
    for alike in weak.values():
        yield from _weak(alike)


def _divergence(
    design: Design, servos: Sequence[_Servo], step: float, course: Course
) -> Iterator[Finding]:
    """Name the fastest joint of a simulation that diverged."""
    first = max(servos, key=lambda servo: servo.speed, default=None)
    at = f", first at '{first.name}'" if first else ""
    yield from note(
        "unstable_servo",
        first.body if first else design.name,
        True,
        f"the simulation diverges within {{value}}{at}: the inertia is too small, or the torque "
        f"too large, for steps of {1e3 * step:g} ms",
        _SOURCE,
        course.time,
        None,
        "s",
    )


def _weak(alike: Sequence[_Servo]) -> Iterator[Finding]:
    """Report the weakest of the servos of one joint in all limbs."""
    worst = max(alike, key=lambda servo: servo.most)
    others = len(alike) - 1
    like = f" and {counted(others, 'joint')} like it" if others else ""
    peak = f"the peak torque of '{worst.actuator.name}', {brief(worst.actuator.peak_torque)} N m"
    why = f"too soft for the load, below {peak}"
    if worst.at_limit > 0.01:
        why = f"at {peak}, for {worst.at_limit:.0%} of the time"
    yield from note(
        "weak_servo",
        worst.body,
        True,
        f"'{worst.name}'{like} leave{'s' * (not others)} the home pose, by {{value}}: the servo "
        f"is {why}",
        _SOURCE,
        worst.most,
        worst.limit,
        worst.unit,
    )


def _turns(course: Array, least: float) -> int:
    """Number of times that a course turns back by more than some distance."""
    turns, direction, extreme = 0, 0, float(course[0]) if len(course) else 0.0
    for value in course.tolist():
        if direction == 0:
            if abs(value - extreme) > least:
                direction, extreme = (1 if value > extreme else -1), value
        elif (value - extreme) * direction > 0:
            extreme = value
        elif (extreme - value) * direction > least:
            turns, direction, extreme = turns + 1, -direction, value
    return turns


def _fall(design: Design, course: Course) -> Iterator[Finding]:
    if not course.fell:
        return
    how = f"the trunk sinks to {course.height:.0%} of its height"
    if course.tilt > TILT:
        how = f"the trunk tilts by more than {math.degrees(TILT):.0f} deg"
    if 0 < course.supports < 3:
        points = ("one point", "two points")[course.supports - 1]
        how += f"; to stand on {points} takes a controller that balances"
    yield from note(
        "falls",
        design.name,
        True,
        f"the robot falls within {{value}} while its servos hold the home pose: {how}",
        _SOURCE,
        course.time,
        None,
        "s",
    )
