"""Solids of STEP files, read by Open CASCADE: exact mass properties, and triangles to draw them."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import numpy as np

from draft.errors import counted
from draft.extras import need
from draft.spec.primitives.mesh import Mesh, MeshError, welded
from draft.values import Array

# Greatest distance of the triangles from the solid, as a share of the diagonal of its box, and
# greatest angle between neighbours [rad].
DEFLECTION, ANGLE = 1e-3, 0.35
_METRE = 1e-3  # The kernel's own unit is the millimetre, whatever that of the file is.


def kernel(module: str) -> Any:
    """Module of the kernel, which carries no types.

    Raises:
        DraftError: the extra `cad` is not installed.
    """
    return need(f"OCP.{module}", "cad")


def quiet() -> None:
    """Let the kernel print nothing: it writes on stdout, where commands print JSON."""
    messenger = kernel("Message").Message.DefaultMessenger_s()
    for printer in [*messenger.Printers()]:
        messenger.RemovePrinter(printer)


def solids(data: bytes) -> Any:
    """Solids of a file as one compound of the kernel [mm].

    Raises:
        DraftError: the extra `cad` is not installed.
        MeshError: it is no STEP file, or has no solids.
    """
    quiet()
    reader = kernel("STEPControl").STEPControl_Reader()
    status = reader.ReadStream("part.step", io.BytesIO(data))
    if status != kernel("IFSelect").IFSelect_ReturnStatus.IFSelect_RetDone:
        raise MeshError("the CAD kernel finds no STEP in it", "export it again as STEP AP214")
    reader.TransferRoots()
    whole, found = reader.OneShape(), []
    if not whole.IsNull():
        found = [*_each(whole, "SOLID")]
    if not found:
        count = 0 if whole.IsNull() else sum(1 for _ in _each(whole, "FACE"))
        raise MeshError(f"no solid, only {counted(count, 'face')}", "export its body as a solid")
    compound = kernel("TopoDS").TopoDS_Compound()
    builder = kernel("BRep").BRep_Builder()
    builder.MakeCompound(compound)
    for solid in found:
        builder.Add(compound, solid)
    return compound


def read_step(data: bytes, name: str, file: str) -> Mesh:
    """Mesh of the solids of a STEP file [m], with their exact volume, centre and inertia.

    Its triangles are within `DEFLECTION` of the solids.

    Raises:
        DraftError: the extra `cad` is not installed.
        MeshError: it is no STEP file, has no solids, or they have no volume.
    """
    shape = solids(data)
    found = kernel("GProp").GProp_GProps()
    kernel("BRepGProp").BRepGProp.VolumeProperties_s(shape, found)
    volume = found.Mass() * _METRE**3
    if not volume > 0:
        raise MeshError(f"its solids have a volume of {volume:.3g} m3", "export it again")
    at, about = found.CentreOfMass(), found.MatrixOfInertia()
    com = np.array([at.X(), at.Y(), at.Z()]) * _METRE
    inertia = np.array([[about.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)]) * _METRE**5
    vertices, corners = welded(np.concatenate([*_triangles(shape)]) * _METRE)
    return Mesh(name, file, vertices, corners, volume, com, inertia, data)


def _each(shape: Any, kind: str) -> Iterator[Any]:
    """Parts of a shape of one kind, such as "FACE"."""
    kinds = kernel("TopAbs").TopAbs_ShapeEnum
    explorer = kernel("TopExp").TopExp_Explorer(shape, getattr(kinds, f"TopAbs_{kind}"))
    while explorer.More():
        yield explorer.Current()
        explorer.Next()


def _triangles(shape: Any) -> Iterator[Array]:
    """Outward triangles of each face [mm], shape (n, 3, 3)."""
    box = kernel("Bnd").Bnd_Box()
    kernel("BRepBndLib").BRepBndLib.Add_s(shape, box)
    within = DEFLECTION * float(np.sqrt(box.SquareExtent()))
    kernel("BRepMesh").BRepMesh_IncrementalMesh(shape, within, False, ANGLE, False)
    topology, tool = kernel("TopoDS").TopoDS, kernel("BRep").BRep_Tool
    reversed_ = kernel("TopAbs").TopAbs_Orientation.TopAbs_REVERSED
    for face in _each(shape, "FACE"):
        place = kernel("TopLoc").TopLoc_Location()
        mesh = tool.Triangulation_s(topology.Face(face), place)
        if mesh is None:
            continue
        move = place.Transformation()
        nodes = [mesh.Node(i).Transformed(move) for i in range(1, mesh.NbNodes() + 1)]
        points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
        each = (mesh.Triangle(i) for i in range(1, mesh.NbTriangles() + 1))
        corners = np.array([[one.Value(k) - 1 for k in (1, 2, 3)] for one in each])
        if face.Orientation() == reversed_:
            corners = corners[:, ::-1]
        yield points[corners]
