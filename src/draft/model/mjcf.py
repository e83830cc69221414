"""MJCF of the robot alone, `robot.xml`.

Geoms have densities, so that MuJoCo computes masses and inertias from the drawn shapes; for the
mesh of the trunk it computes the exact inertia. The size and the mass of a part are separate
numbers, and its density is mass over drawn volume.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft import geometry as g
from draft.design.actuators import Actuator
from draft.design.brackets import bracket
from draft.design.cached import once
from draft.design.design import Body, Design
from draft.design.plan import plan
from draft.errors import DraftError
from draft.geometry import Vector
from draft.model.texts import Text, of_template
from draft.model.xml import Element
from draft.spec.primitives.base import COLORS, HIDDEN, HIDDEN_COLOR, Color, Geom
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.mesh import Mesh
from draft.spec.primitives.root import TrunkPart
from draft.values import Array, Value, both, either, is_array, scalar, sqrt, where

if TYPE_CHECKING:
    import mujoco

    from draft.spec import Spec

# Coordinates of the trunk's mesh below it are zero [m].
_SMALLEST_VERTEX = 1e-30
# Largest gap between the trunk and a part on it that needs no bracket, and gap from which on MuJoCo
# does not measure [m].
_TOUCHING, _FAR = 0.002, 100.0
# Solver of joints that follow others: with MuJoCo's own, fingers give by hundredths of a radian
# under their weight. Time constant [s] and damping ratio; least and greatest impedance, and width.
_STIFF, _HARD = (0.005, 1), (0.95, 0.99, 0.001)
FLOATING = "floating_base"  # Joint of a floating base.
# Default forms of the geoms of a kind.
FORMS = {"trunk": "mesh", "structure": "cylinder", "actuator": "cylinder", "drawn": "cylinder"}


def colors(design: Design) -> dict[str, Color]:
    """Colours by kind of geom of a robot; the kinds of all robots come first."""
    ends = [body.link.end for body in design.bodies if body.link.end is not None]
    parts = any(body.shapes for body in design.bodies)
    kinds = COLORS | ({HIDDEN: HIDDEN_COLOR} if parts else {})
    return kinds | {kind: color for end in ends for kind, color in end.colors.items()}


def robot_xml(design: Design) -> str:
    """MJCF text of one robot: bodies, joints, geoms, sites and sensors, without actuators."""
    return robot_element(design).text()


def robot_texts(design: Design, rows: NDArray[np.intp]) -> list[Text]:
    """MJCF texts of some of N designs, with one template.

    They are those of `robot_xml`, except that a frame that has no turn in one design but has in
    others is written out, and a trunk that may not be convex has no triangles.
    """
    return of_template(*robot_element(design).template(rows))


def robot_element(design: Design) -> Element:
    """MJCF of the robot alone as elements.

    For N designs, every number that differs is an array of shape (N,) among its attribute's
    numbers, as are the coordinates of the trunk's vertices.
    """
    reuse = plan(design.spec).reuse(design.count)
    root, trunk = design.spec.root, design.lofted
    # A trunk of one's own has whatever holds its parts.
    if root is None or trunk is None or trunk.shape is not None:
        return _robot(design, ())
    held = [
        reuse.result(("bracket", i), _bracket, design.bodies[i], suffix, trunk.loft, root.axis)
        for i, suffix in _hanging(design.spec).items()
    ]
    return _robot(design, held)


def _bracket(body: Body, suffix: str, loft: Loft, axis: str) -> Element:
    """Geom of the bracket that holds a solid of a body on the trunk."""
    (held,) = (solid for solid in body.solids() if solid.suffix == suffix)
    return _geom(body.name, bracket(loft, axis, body, held))


@once
def _hanging(spec: Spec) -> dict[int, str]:
    """Bodies on the trunk that do not touch it, each with the suffix of its nearest solid.

    They are those of the spec's own values, so that all its designs have one topology. A spec
    that has no model with its own values has none.
    """
    import mujoco  # Only a robot with a trunk needs it.

    try:
        design = spec.resolve()
        model = mujoco.MjModel.from_xml_string(_robot(design, ()).text())
    except (DraftError, ValueError):
        return {}
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    trunk = model.geom(design.bodies[0].name + TrunkPart.suffix).id
    found: dict[int, str] = {}
    for i, body in enumerate(design.bodies):
        gaps = {
            solid.suffix: _gap(model, data, trunk, model.geom(body.name + solid.suffix).id)
            for solid in (body.solids() if body.parent == 0 else ())
        }
        if gaps and min(gaps.values()) > _TOUCHING:
            found[i] = min(gaps, key=lambda suffix: gaps[suffix])
    return found


def _gap(model: mujoco.MjModel, data: mujoco.MjData, first: int, second: int) -> float:
    """Distance of two geoms [m], up to `_FAR`."""
    import mujoco

    return mujoco.mj_geomDistance(model, data, first, second, _FAR, None)


def _robot(design: Design, brackets: Sequence[Element]) -> Element:
    """Elements of the robot with brackets on its trunk."""
    reuse, trunk = plan(design.spec).reuse(design.count), design.lofted
    name = design.bodies[0].name
    root = Element("mujoco", model=design.name)
    root.add("compiler", angle="radian", autolimits="true")
    root.children.append(reuse.result("defaults", lambda: _defaults(design)))
    meshes = [*_part_meshes(design)]
    if trunk is not None or meshes:
        asset = root.add("asset")
        if trunk is not None:
            asset.children.append(reuse.result("mesh", _trunk_mesh, name, trunk.loft))
        asset.children += meshes
    world = root.add("worldbody")
    elements: list[Element] = []
    # Names are unique: a geom is named after its body, with a suffix that is unique to its kind.
    for i, body in enumerate(design.bodies):
        if body.parent is None:
            element = _base(body, trunk, design.lowest())
            element.children += [*brackets, *_parts(body)]
            world.children.append(element)
        else:
            actuator = None if body.joint is None else design.drive(body.joint)
            made = reuse.result(("element", i), _body, body, actuator)
            element = made.alone()
            element.children += made.children
            elements[body.parent].children.append(element)
        elements.append(element)
    if plan(design.spec).leaders:
        root.children.append(_couplings(design))
    if trunk is not None:
        root.children.append(reuse.result("sensors", lambda: _sensors(name, trunk.site)))
    return root


def _base(body: Body, trunk: TrunkPart | None, height: Value) -> Element:
    """Element of the base: a trunk that floats, or a body without a joint, fixed to the world."""
    if trunk is None:
        return _placed(body)
    element = Element("body", name=body.name, pos=(0, 0, height))
    element.add("freejoint", name=FLOATING)
    if trunk.shape is None:
        element.add(
            "geom",
            name=body.name + trunk.suffix,
            class_="trunk",
            mesh=body.name,
            density=trunk.density,
        )
    else:
        element.children += [_geom(body.name, geom) for geom in trunk.geoms()]
    element.add("site", name=trunk.site)
    return element


def _couplings(design: Design) -> Element:
    """Equalities of the joints that follow others."""
    equality = Element("equality")
    for name, joint in design.joints.items():
        if (follows := joint.follows) is not None:
            polynomial = (follows.offset, follows.ratio, 0, 0, 0)
            equality.add(
                "joint",
                name=name,
                joint1=name,
                joint2=follows.joint,
                polycoef=polynomial,
                solref=_STIFF,
                solimp=_HARD,
            )
    return equality


def _sensors(trunk: str, site: str) -> Element:
    sensor = Element("sensor")
    sensor.add("gyro", name="imu_ang_vel", site=site)
    sensor.add("velocimeter", name="imu_lin_vel", site=site)
    sensor.add("accelerometer", name="imu_lin_acc", site=site)
    sensor.add("subtreeangmom", name="root_angmom", body=trunk)
    return sensor


def _defaults(design: Design) -> Element:
    """Geom classes. Geoms of the robot touch the floor and objects, not each other."""
    default = Element("default")
    for name, color in colors(design).items():
        kind = default.add("default", class_=name)
        touches = 0 if name == "drawn" else 1
        kind.add(
            "geom",
            type=FORMS.get(name),
            group=3 if name == HIDDEN else 2,
            contype=0,
            conaffinity=touches,
            rgba=color,
            mass=0 if name == "drawn" else None,
        )
    default.add("site", size=(0.005,), group=4)
    return default


def _trunk_mesh(name: str, loft: Loft) -> Element:
    # MuJoCo reads single precision, and refuses what that has no digits for.
    points = np.where(np.abs(loft.vertices) < _SMALLEST_VERTEX, 0.0, loft.vertices)
    if points.ndim == 2:
        vertices, faces = points.ravel().tolist(), loft.faces().ravel().tolist()
    else:
        vertices = tuple(points.reshape(-1, points.shape[2]))
        faces = loft.faces().ravel().tolist() if loft.convex else ()
    return Element("mesh", name=name, inertia="exact", vertex=vertices, face=faces)


def _part_meshes(design: Design) -> Iterator[Element]:
    """Elements of the meshes of parts, each once. They weigh nothing: boxes have their inertia."""
    parts = {part.mesh.name: part.mesh for body in design.bodies for _, part in body.shapes}
    for name, mesh in parts.items():
        vertices, faces = mesh.vertex_text, mesh.face_text
        yield Element("mesh", name=name, inertia="shell", vertex=vertices, face=faces)


def _body(body: Body, actuator: Actuator | None) -> Element:
    """Element of a body below the trunk with its joint, that an actuator drives, and its parts."""
    element = _placed(body)
    joint, a = body.joint, actuator
    if joint is not None:
        element.add(
            "joint",
            name=body.prefix + joint.name,
            type="slide" if joint.slide else None,
            axis=body.joint_axis,
            range=None if joint.rolls else joint.range,
            limited="false" if joint.continuous else None,
            armature=a.armature if a else None,
            damping=a.damping if a else None,
            frictionloss=a.friction_loss if a else None,
            actuatorfrcrange=(-a.peak_torque, a.peak_torque) if a else None,
        )
    element.children += _parts(body)
    return element


def _placed(body: Body) -> Element:
    """Element of a body at its place, without its contents."""
    rotation = None if body.rotation is None else g.quaternion(body.rotation)
    return Element("body", name=body.name, pos=body.position, quat=rotation)


def _parts(body: Body) -> Iterator[Element]:
    """Geoms and sites of a body."""
    for geom in body.geoms():
        yield _geom(body.name, geom)
    end = body.link.end
    if end is not None and end.site is not None:
        for suffix, place in zip(end.sites, end.site_places(body.link.tip), strict=True):
            yield Element("site", name=body.prefix + end.site + suffix, pos=place)


def _geom(body: str, geom: Geom) -> Element:
    """Geom with the density that gives its mass; a geom without mass has none."""
    form, size, quat, mesh = geom.form, geom.size, None, geom.mesh
    if form == "cylinder":
        size, quat = (size[0], size[1] / 2), _toward(geom.axis)
    elif form == "box":
        size = tuple(side / 2 for side in size)
    if geom.rotation is not None:
        quat = g.quaternion(geom.rotation)
    return Element(
        "geom",
        name=body + geom.suffix,
        class_=geom.kind,
        type=None if FORMS.get(geom.kind) == form else form,
        mesh=None if mesh is None else mesh.name if isinstance(mesh, Mesh) else body,
        pos=geom.center,
        quat=quat,
        size=size or None,
        density=None if geom.mass is None else geom.mass / geom.volume,
        mass=0 if geom.mass is None and geom.kind != "drawn" else None,
        conaffinity=None if geom.collides or geom.kind == "drawn" else 0,
    )


_AXIS_QUATERNIONS: dict[Vector, tuple[float, ...] | None] = {
    (0.0, 0.0, 1.0): None,
    (0.0, 0.0, -1.0): None,
    (1.0, 0.0, 0.0): (1, 0, 1, 0),
    (-1.0, 0.0, 0.0): (1, 0, 1, 0),
    (0.0, 1.0, 0.0): (1, 1, 0, 0),
    (0.0, -1.0, 0.0): (1, 1, 0, 0),
}


def _toward(axis: Vector) -> tuple[Value, ...] | None:
    """Quaternion (w, x, y, z) that turns the z axis onto the line of a unit vector.

    A cylinder is symmetric, so a vector and its opposite give the same line.
    """
    if any(is_array(c) for c in axis):
        return _toward_each(axis)
    if axis in _AXIS_QUATERNIONS:
        return _AXIS_QUATERNIONS[axis]
    x, y, z = (scalar(c) for c in axis)
    if z < 0:
        x, y, z = -x, -y, -z
    w = math.sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def _toward_each(axis: Vector) -> tuple[Value, ...]:
    """Return `_toward` for N designs: the general rotation, except along x and y."""
    x, y, z = axis
    flip = where(either(z < 0, both(z == 0, either(x == -1, y == 1))), -1.0, 1.0)
    x, y, z = flip * x, flip * y, flip * z
    w = sqrt((1 + z) / 2)
    return (w, -y / (2 * w), x / (2 * w), 0.0)


def body_masses(design: Design) -> Array:
    """Masses of the bodies [kg], in MuJoCo's order without the world, shape (bodies,)."""
    return np.array([scalar(mass) for mass in design.body_masses().values()])
