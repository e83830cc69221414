"""Robots with parts of their own, and the files of such parts, made here without Draft."""

# pyright: reportAttributeAccessIssue=false
# (The kernel's compiled modules carry no types.)
from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh

import draft
from tests.helpers import DRIVE, leg, robot

Array = np.ndarray
LENGTH, RADIUS = 0.3, 0.03  # of a rod [m]
BOTH = [
    {"chain": "leg", "at": [0.1, 0.15, -0.2], "prefix": "L_"},
    {"chain": "leg", "at": [0.1, 0.15, -0.2], "prefix": "R_", "mirror": "y"},
]


def hook(scale: float = 1.0) -> trimesh.Trimesh:
    """A part that is not its own mirror image: a beam with a peg to the left and to the front."""
    corners = [(0, 0), (0.04, 0), (0.04, 0.1), (0.015, 0.1), (0.015, 0.25), (0, 0.25)]
    faces = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    flat = np.array(corners)
    low = np.column_stack([flat[:, 0], np.full(6, 0.01), -flat[:, 1]])
    high = low + np.array([0.004, 0.03, 0.0])  # Sheared, so that no plane is one of symmetry.
    points = np.vstack([low, high])
    sides = [(i, (i + 1) % 6) for i in range(6)]
    triangles = [tuple(reversed(f)) for f in faces] + [tuple(6 + i for i in f) for f in faces]
    for i, j in sides:
        triangles += [(i, j, 6 + j), (i, 6 + j, 6 + i)]
    made = trimesh.Trimesh(points * scale, triangles, process=False)
    if made.volume < 0:
        made.invert()
    assert made.is_watertight
    assert made.volume > 0
    return made


def stl(mesh: trimesh.Trimesh) -> bytes:
    content = mesh.export(file_type="stl")
    assert isinstance(content, bytes)
    return content


def step(*shapes: Any) -> bytes:
    """Content of a STEP file of some shapes of the kernel [mm]."""
    from OCP.Message import Message, Message_Gravity
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer

    for printer in Message.DefaultMessenger_s().Printers():
        printer.SetTraceLevel(Message_Gravity.Message_Fail)
    writer, stream = STEPControl_Writer(), io.BytesIO()
    for shape in shapes:
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
    writer.WriteStream(stream)
    return stream.getvalue()


def rod(length: float = LENGTH, radius: float = RADIUS) -> Any:
    """Cylinder of the kernel from the origin downwards [m]."""
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
    from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt

    axes = gp_Ax2(gp_Pnt(0, 0, -1000 * length), gp_Dir(0, 0, 1))
    return BRepPrimAPI_MakeCylinder(axes, 1000 * radius, 1000 * length).Solid()


def prism(sides: int = 64, length: float = LENGTH, radius: float = RADIUS) -> trimesh.Trimesh:
    """The same with a regular polygon in place of the circle."""
    made = trimesh.creation.cylinder(radius, length, sections=sides)
    made.apply_translation((0, 0, -length / 2))
    return made


def of_prism(sides: int, length: float, radius: float) -> tuple[float, float, float]:
    """Volume, and moments per mass about the axis and across it, of a regular prism."""
    step_ = 2 * math.pi / sides
    area = sides / 2 * radius**2 * math.sin(step_)
    about = radius**2 / 6 * (2 + math.cos(step_))
    return area * length, about, about / 2 + length**2 / 12


def folder(path: Path, spec: draft.Spec, files: dict[str, bytes]) -> Path:
    """Write a robot of files in memory, with its parts, to a folder."""
    for name, content in {**{k: f.read_bytes() for k, f in spec.files.items()}, **files}.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_bytes(content)
    return path


def with_parts(
    files: dict[str, bytes],
    links: dict[str, dict[str, Any]] | None = None,
    motor: dict[str, Any] | None = None,
    trunk: dict[str, Any] | None = None,
    **more: Any,
) -> draft.Spec:
    """A robot with parts.

    Args:
        files: content of the files by path.
        links: `shape` of links of the leg by name.
        motor: `shape` of its actuator class.
        trunk: `shape` of its trunk.
        more: of `tests.helpers.robot`.
    """
    chain = leg(**{name: {"shape": shape} for name, shape in (links or {}).items()})
    actuators = {"leg": DRIVE | ({"shape": motor} if motor else {})}
    more = {"chain": chain, "actuators": actuators, **more}
    return robot(files=files, trunk={"shape": trunk} if trunk else {}, **more)


def everything() -> draft.Spec:
    """A robot on two legs that are mirror images, whose trunk, thighs and motors are parts."""
    box = trimesh.creation.box((0.45, 0.2, 0.12))
    motor = trimesh.creation.box((0.1, 0.06, 0.05))
    motor.apply_translation((0.01, 0.0, 0.005))
    inertia = {"com": [0.02, 0, 0.01], "moments": [0.05, 0.14, 0.16], "products": [0.01, 0.002, 0]}
    return with_parts(
        {"hook.stl": stl(hook(1000)), "motor.obj": str(motor.export(file_type="obj")).encode()}
        | {"parts/box.stl": stl(box)},
        {"thigh": {"file": "hook.stl", "unit": "mm", "density": 2700}},
        {"file": "motor.obj"},
        {"file": "parts/box.stl", "mass": 9.0, **inertia},
        children=BOTH,
    )


def tensor(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Inertia about the centre of mass in the axes of a body [kg m2]."""
    body, turn = model.body(name), np.empty(9)
    mujoco.mju_quat2Mat(turn, body.iquat)
    axes = turn.reshape(3, 3)
    return axes @ np.diag(body.inertia) @ axes.T


def points_of(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Vertices of a mesh in the frame of its body [m]."""
    mesh, turn = model.geom_dataid[geom], np.empty(9)
    start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    mujoco.mju_quat2Mat(turn, model.geom_quat[geom])
    return model.mesh_vert[start : start + count] @ turn.reshape(3, 3).T + model.geom_pos[geom]
