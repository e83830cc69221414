"""Geometry of an imported robot against MuJoCo's own compile of the maker's file.

MuJoCo reads the joints of the file by itself: its bodies, frames, defaults and angles, without
shapes and masses, so that missing meshes do not matter. Nothing else is read from the disk.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.description.description import Description, Joint
from draft.description.xmlfile import DescriptionError, Element
from draft.errors import Problem
from draft.imports.anatomy import ROLLING
from draft.imports.reduce import Body, Reduced
from draft.values import Array

POSES = 20
SEED = 0
# Largest differences: of an anchor [m], and of an axis or a limit [rad].
DISTANCE, ANGLE = 1e-4, np.radians(0.01)
LISTED = 3
# Range that a joint without limits is moved in [rad].
FREE = np.pi
# Elements of an MJCF file that place joints, and attributes that name files.
PLACING = ("compiler", "default", "worldbody", "body", "frame", "joint", "freejoint")
FILES = ("assetdir", "meshdir", "texturedir")


@dataclass(frozen=True, slots=True)
class GeometryCheck:
    """Result of the check.

    Attributes:
        joints: number of joints compared.
        poses: number of poses.
        distance: largest distance between two anchors [m].
        angle: largest angle between two axes [rad].
        skipped: why nothing was compared; "" where it was.
    """

    joints: int = 0
    poses: int = 0
    distance: float = 0.0
    angle: float = 0.0
    skipped: str = ""


@dataclass(frozen=True, slots=True)
class _Pair:
    """One joint in both models: its ids, and the sense of the import's axis."""

    body: Body
    joint: Joint
    theirs: int
    ours: int
    sense: float


def check_geometry(
    root: Element, reduced: Reduced, names: Mapping[str, str], model: mujoco.MjModel
) -> GeometryCheck:
    """Compare anchors, axes and limits of joints at random poses.

    Args:
        root: root element of the maker's file, its includes expanded.
        reduced: the robot as imported.
        names: the import's joints by the maker's names.
        model: the imported robot, compiled.

    Raises:
        DescriptionError: a joint differs by more than 0.1 mm or 0.01 degrees; the message names
            it and its line.
    """
    description = reduced.description
    try:
        maker = maker_model(root, description)
    except ValueError as error:
        reason = " ".join(str(error).split())[:200]
        return GeometryCheck(skipped=f"MuJoCo does not compile its joints: {reason}")
    trunk = _id(maker, mujoco.mjtObj.mjOBJ_BODY, reduced.root.name)
    pairs = _pairs(reduced, names, maker, model)
    if trunk < 0 or not pairs:
        return GeometryCheck(skipped="MuJoCo's compile of the file lacks the trunk or its joints")
    theirs, ours = mujoco.MjData(maker), mujoco.MjData(model)
    _hold(description, names, maker, theirs)
    mujoco.mj_kinematics(maker, theirs)
    # Of a URDF only the links of the import are compiled, so that its root is upright in MuJoCo.
    base = description.upright if description.format == "urdf" else description.turned
    upright = np.array(base) @ theirs.xmat[trunk].reshape(3, 3)
    distances = np.zeros((POSES + 1, len(pairs)))
    angles = np.zeros_like(distances)
    rng = np.random.default_rng(SEED)
    for k in range(POSES + 1):
        if k:  # The first pose is that of all zeros.
            _move(pairs, maker, theirs, model, ours, rng)
        mujoco.mj_kinematics(maker, theirs)
        mujoco.mj_kinematics(model, ours)
        distances[k], angles[k] = _differences(pairs, theirs, ours, trunk, upright)
    limits = [_limit_difference(pair, maker, model) for pair in pairs]
    _refuse(pairs, distances.max(axis=0), angles.max(axis=0), limits)
    return GeometryCheck(len(pairs), POSES, float(distances.max()), float(angles.max()))


def maker_model(root: Element, description: Description) -> mujoco.MjModel:
    """MuJoCo's compile of the joints of a maker's file, every body of unit mass.

    Raises:
        ValueError: MuJoCo refuses it.
    """
    text = (_mjcf if root.tag == "mujoco" else _urdf)(root, description)
    try:
        spec = mujoco.MjSpec.from_string(text)
    except RuntimeError as error:
        # Its reader has a limit of about a thousand links in series, which it does not name.
        raise ValueError(f"{len(description.links)} links: {error}") from error
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False
    for body in spec.bodies[1:]:
        body.explicitinertial = True
        body.mass, body.inertia = 1.0, np.ones(3)
    return spec.compile()


def _mjcf(root: Element, description: Description) -> str:
    """Text of an MJCF model with what places its joints, each of them and each body with a name."""
    lines = Counter(str(link.where) for link in description.links.values())
    names = {("body", str(link.where)): link.name for link in description.links.values()}
    for joint in description.joints.values():
        lines[f"joint {joint.where}"] += 1
        names["joint", str(joint.where)] = joint.name
    robot = Element("mujoco", {}, root.where, root.children)

    def text(element: Element) -> str:
        given = dict(element.attributes)
        if element.tag == "compiler":
            given = {key: value for key, value in given.items() if key not in FILES}
        if element.tag in ("body", "joint") and not given.get("name"):
            name = names.get((element.tag, str(element.where)))
            key = str(element.where) if element.tag == "body" else f"joint {element.where}"
            if name is not None and lines[key] == 1:
                given["name"] = name
        inner = (child for child in element.children if child.tag in PLACING)
        return _element(element.tag, given, "".join(map(text, inner)))

    return text(robot)


def _urdf(root: Element, description: Description) -> str:
    """Text of a URDF with its links and the joints of its tree, without shapes and masses."""
    parts = [_element("link", {"name": name}) for name in description.links]
    for joint in root.all("joint"):
        if joint.attributes.get("name", "").strip() in description.joints:
            inner = joint.all("origin", "parent", "child", "axis", "limit")
            given = dict(joint.attributes)
            if given.get("type") == "floating":  # MuJoCo has these on the world only.
                given["type"] = "fixed"
            parts.append(
                _element(
                    "joint",
                    given,
                    "".join(_element(one.tag, one.attributes) for one in inner),
                )
            )
    compiler = _element("compiler", {"fusestatic": "false", "balanceinertia": "true"})
    return _element("robot", {"name": "maker"}, f"<mujoco>{compiler}</mujoco>" + "".join(parts))


def _element(tag: str, attributes: Mapping[str, str], inner: str = "") -> str:
    given = "".join(f" {key}={quoteattr(value)}" for key, value in attributes.items())
    return f"<{tag}{given}>{inner}</{tag}>"


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    return mujoco.mj_name2id(model, kind, name)


def _pairs(
    reduced: Reduced, names: Mapping[str, str], maker: mujoco.MjModel, model: mujoco.MjModel
) -> list[_Pair]:
    """Joints that both models have, parents first."""
    found: list[_Pair] = []
    for body in reduced.root.all()[1:]:
        joint = body.joint
        if joint is None or joint.name not in names:
            continue
        theirs = _id(maker, mujoco.mjtObj.mjOBJ_JOINT, joint.name)
        ours = _id(model, mujoco.mjtObj.mjOBJ_JOINT, names[joint.name])
        if theirs >= 0 and ours >= 0:
            # A joint between the maker's base and the trunk is seen from its other side.
            sense = 1.0 if joint.child in body.links else -1.0
            found.append(_Pair(body, joint, theirs, ours, sense))
    return found


def _hold(
    description: Description,
    names: Mapping[str, str],
    maker: mujoco.MjModel,
    data: mujoco.MjData,
) -> None:
    """Put joints that the import has at zero, and those that it holds where it holds them."""
    for joint in description.moving:
        i = _id(maker, mujoco.mjtObj.mjOBJ_JOINT, joint.name)
        if i >= 0 and joint.type in ("revolute", "continuous", "prismatic"):
            data.qpos[maker.jnt_qposadr[i]] = 0.0 if joint.name in names else joint.held_at


def _move(
    pairs: list[_Pair],
    maker: mujoco.MjModel,
    theirs: mujoco.MjData,
    model: mujoco.MjModel,
    ours: mujoco.MjData,
    rng: np.random.Generator,
) -> None:
    """Put the joints of both models at the same random positions in their ranges."""
    for pair in pairs:
        low, high = pair.joint.limits or (-FREE, FREE)
        if not low < high or max(abs(low), abs(high)) > 4 * FREE:
            low, high = -FREE, FREE
        position = rng.uniform(low, high)
        theirs.qpos[maker.jnt_qposadr[pair.theirs]] = position
        ours.qpos[model.jnt_qposadr[pair.ours]] = position


def _differences(
    pairs: list[_Pair],
    theirs: mujoco.MjData,
    ours: mujoco.MjData,
    trunk: int,
    upright: Array,
) -> tuple[list[float], list[float]]:
    """Distances of anchors [m] and angles of axes [rad], seen from the trunk."""
    turn = upright @ theirs.xmat[trunk].reshape(3, 3).T
    back = ours.xmat[1].reshape(3, 3).T
    distances: list[float] = []
    angles: list[float] = []
    for pair in pairs:
        gap = turn @ (theirs.xanchor[pair.theirs] - theirs.xpos[trunk])
        gap -= back @ (ours.xanchor[pair.ours] - ours.xpos[1])
        # A slide moves alike wherever its anchor is.
        distances.append(0.0 if pair.body.slides else float(np.linalg.norm(gap)))
        a = pair.sense * turn @ theirs.xaxis[pair.theirs]
        b = back @ ours.xaxis[pair.ours]
        angles.append(float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))
    return distances, angles


def _limit_difference(pair: _Pair, maker: mujoco.MjModel, model: mujoco.MjModel) -> float:
    """Largest difference of a limit [rad or m]; 0 where the file's is not taken.

    That is of a wheel, of a joint that follows another, and of one changed with a warning.
    """
    if pair.body.role in ROLLING or pair.body.coupled:
        return 0.0
    if not maker.jnt_limited[pair.theirs] or pair.joint.limits != pair.body.limits:
        return 0.0
    gap = np.abs(maker.jnt_range[pair.theirs] - model.jnt_range[pair.ours])
    return float(gap.max())


def _refuse(pairs: list[_Pair], distances: Array, angles: Array, limits: list[float]) -> None:
    """Refuse an import of which a joint is elsewhere than in MuJoCo's compile."""
    found: list[Problem] = []
    for pair, distance, angle, limit in zip(pairs, distances, angles, limits, strict=True):
        faults: list[str] = []
        if distance > DISTANCE:
            faults.append(f"anchor off by {1000 * distance:.3g} mm")
        if angle > ANGLE:
            faults.append(f"axis off by {np.degrees(angle):.3g} degrees")
        if limit > (DISTANCE if pair.body.slides else ANGLE):
            unit = "m" if pair.body.slides else "rad"
            faults.append(f"limit off by {limit:.3g} {unit}")
        if faults:
            cause = f"joint '{pair.joint.name}' is not where MuJoCo's compile of this file has it: "
            remedy = "this is a defect of the import: report it with the file"
            found.append(Problem(cause + ", ".join(faults), pair.joint.where, remedy))
    if len(found) > LISTED:
        cause = f"{len(found) - LISTED} more joints are elsewhere, some as they hang on these"
        found = [*found[:LISTED], Problem(cause, found[LISTED].where)]
    if found:
        raise DescriptionError(found)
