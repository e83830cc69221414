"""A vendor's robot and its twin in one picture, at true relative size."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.description.description import Geometry
from draft.imports.reduce import Pose
from draft.imports.shapes import Shapes
from draft.model.picture import Exhibit, Pixels, corners, draw, exhibit, stage
from draft.twins.compare import Comparison
from draft.twins.vendor import BASE, FLOATING, body_name, vendor_spec
from draft.values import Array, scalar

DRAWN: dict[str, Any] = {
    "rgba": (0.62, 0.63, 0.66, 1.0),
    "contype": 0,
    "conaffinity": 0,
    "group": 2,
}
KINDS = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
}
TURN = 0.80  # away from the camera [rad]
GAP = 0.15  # between the robots [m]
VIEW = (180, -12)  # azimuth and elevation [deg]
SIZE = (1200, 686)
MANY = 400_000  # triangles of a mesh that are drawn
CELL = 0.002  # [m]


def side_by_side(found: Comparison, size: tuple[int, int] = SIZE) -> Pixels:
    """Render the vendor's robot on the left and the twin on the right, both in the home pose.

    A vendor's body without shapes is drawn as the box that has its inertia.

    Returns:
        Pixels, shape (height, width, 3).

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    edge = 0.0
    exhibits: list[Exhibit] = []
    for one in (_vendor(found), exhibit(found.model)):
        # Without its height and turn, which move the corners alike: one compile does for both.
        points = corners(*stage([Exhibit(one.robot, one.base, 0.0, one.home)]))
        y = points[:, :2] @ (np.sin(TURN), np.cos(TURN))
        place = (0.0, edge - float(y.min()))
        height = -float(points[:, 2].min()) if one.base == FLOATING else one.height
        exhibits.append(Exhibit(one.robot, one.base, height, one.home, place, TURN))
        edge += float(np.ptp(y)) + GAP
    return draw(exhibits, VIEW, size)


def _vendor(found: Comparison) -> Exhibit:
    """The vendor's robot with its meshes and primitives, its base at the height of the floor."""
    shapes = found.files.shapes
    spec, root, poses = vendor_spec(found.files.reduced.description, found.joints)
    for body in root.all():
        own = spec.body(BASE if body.parent is None else body_name(body.name))
        drawn = 0
        for name in body.links:
            drawn += _draw_link(spec, own, shapes, name, poses[name], body.anchor)
        if not drawn:
            _draw_box(own, found, body.joint.name if body.joint else "")
    design = found.design
    home = {a: scalar(design.joints[b].home) for a, b in found.joints.items()}
    return Exhibit(spec, FLOATING, 0.0, home)


def _draw_link(spec: Any, body: Any, shapes: Shapes, name: str, pose: Pose, anchor: Array) -> int:
    """Add a link's meshes, else its visible or colliding primitives; returns how many."""
    triangles = shapes.triangles([name])
    if 4 <= len(triangles) <= MANY:
        at, turn = shapes.reduced.base
        # From the trunk's frame to that of the vendor's base.
        points, faces = _coarse((triangles.reshape(-1, 3) - at) @ turn - anchor)
        if len(faces) < 4:
            return 0
        mesh = spec.add_mesh(name=f"mesh {len(spec.meshes)}")
        mesh.uservert = points.ravel()
        mesh.userface = faces.ravel()
        # Vendors' meshes are often open: only the shell has an inertia then.
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name, **DRAWN)
        return 1
    link = shapes.reduced.description.links[name]
    for use in ("visual", "collision"):
        own = [shape for shape in link.geometries if shape.use == use]
        drawn = sum(_draw_primitive(body, shape, pose, anchor) for shape in own)
        if drawn:
            return drawn
    return 0


def _coarse(points: Array) -> tuple[Array, NDArray[np.int64]]:
    """Vertices [m] and faces of triangles whose corners are drawn to the nearest 2 mm.

    Args:
        points: corners, three for each triangle, shape (3 n, 3).
    """
    cells = np.round(points / CELL).astype(np.int64)
    # One number for each cell: NumPy sorts numbers far faster than rows.
    low = cells.min(axis=0)
    span = np.ptp(cells, axis=0) + 1
    keys = ((cells - low) @ np.array([span[1] * span[2], span[2], 1])).astype(np.int64)
    _, first, where = np.unique(keys, return_index=True, return_inverse=True)
    faces = where.reshape(-1, 3)
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (a != c)]
    return points[first], faces


def _draw_primitive(body: Any, shape: Geometry, pose: Pose, anchor: Array) -> int:
    position, rotation = pose
    if shape.kind not in KINDS or not shape.size:
        return 0
    half = np.zeros(3)
    half[: len(shape.size)] = shape.size
    if shape.kind == "box":
        half = half / 2
    elif shape.kind != "sphere":
        half[1] /= 2
    quat = np.empty(4)
    mujoco.mju_mat2Quat(quat, (rotation @ np.array(shape.rotation, float)).ravel())
    place = rotation @ np.array(shape.position, float) + position - anchor
    body.add_geom(type=KINDS[shape.kind], size=half, pos=place, quat=quat, **DRAWN)
    return 1


def _draw_box(body: Any, found: Comparison, joint: str) -> None:
    """Add the box that has a body's inertia."""
    model: Any = found.vendor
    i = model.jnt_bodyid[model.joint(joint or FLOATING).id]
    mass, moments = float(model.body_mass[i]), model.body_inertia[i]
    if mass <= 0:
        return
    squares = 6.0 * (moments.sum() - 2.0 * moments) / mass
    half = np.maximum(np.sqrt(np.maximum(squares, 0.0)) / 2, 0.003)
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=half,
        pos=model.body_ipos[i],
        quat=model.body_iquat[i],
        **DRAWN,
    )
