"""Picture of a STEP file as a CAD kernel reads it, and of the actuators of a bill of materials."""

# pyright: reportAttributeAccessIssue=false
# (The kernel's compiled modules carry no types.)
from __future__ import annotations

import csv
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.collections import Sequence_TDF_Label
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS
from OCP.XCAFDoc import (
    XCAFDoc_ColorTool,
    XCAFDoc_ColorType,
    XCAFDoc_DocumentTool,
    XCAFDoc_ShapeTool,
)

from docs.howto_figures import WIDTH, save
from draft.values import Array

# Of triangles from what they stand for [mm, rad].
_COARSE = 0.5, 0.25
_LIGHT = np.array([0.35, -0.55, 0.75])
_COLUMNS = {
    "count": "count",
    "name": "class",
    "peak_torque_nm": "N m",
    "nearest_module": "nearest module",
}


class _Drawn(NamedTuple):
    """Triangles, shape (n, 3, 3), or ends of lines, shape (n, 2, 3), in metres, and a colour."""

    points: Array
    color: tuple[float, ...]


def assembly(folder: Path, path: Path) -> None:
    """Draw robot.step and bom.csv of a folder.

    Args:
        folder: folder of `draft export --format step`.
        path: PNG to write.
    """
    save(path, partial(_assembly, folder))


def _assembly(folder: Path) -> Figure:
    figure = plt.figure(figsize=(WIDTH, 2.8), layout="none")
    axes: Any = figure.add_axes((-0.13, -0.16, 0.66, 1.3), projection="3d")
    drawn = [*_read(folder / "robot.step")]
    for points, color in drawn:
        if points.shape[1] == 2:
            axes.add_collection3d(Line3DCollection(points, colors=[color], linewidths=0.9))
            continue
        normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        shade = 0.62 + 0.38 * np.abs(normal @ (_LIGHT / np.linalg.norm(_LIGHT)))
        faces = np.clip(shade[:, None] * np.array(color), 0, 1)
        axes.add_collection3d(Poly3DCollection(points, facecolors=faces, edgecolors="none"))
    every = np.vstack([points.reshape(-1, 3) for points, _ in drawn])
    low, high = every.min(axis=0), every.max(axis=0)
    half = (high - low).max() / 2
    ranges = np.stack([(low + high) / 2 - half, (low + high) / 2 + half], axis=1)
    axes.set(xlim=ranges[0], ylim=ranges[1], zlim=ranges[2])
    axes.set_box_aspect((1, 1, 1), zoom=1.25)
    axes.view_init(14, -38)
    axes.set_axis_off()
    figure.text(0.2, 0.95, "robot.step: parts and axes", ha="center", fontsize=7)
    with (folder / "bom.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["kind"] == "actuator"]
    right = figure.add_axes((0.43, 0.3, 0.56, 0.4))
    right.set_axis_off()
    right.set_title("bom.csv: actuators", fontsize=7)
    table = right.table(
        [[row[key] for key in _COLUMNS] for row in rows],
        colLabels=[*_COLUMNS.values()],
        colWidths=[0.14, 0.2, 0.14, 0.52],
        cellLoc="center",
        loc="center",
        edges="horizontal",
    )
    table.auto_set_font_size(False)
    table.set_fontsize(6)
    for cell in table.get_celld().values():
        cell.set_linewidth(0.4)
        cell.set_height(0.16)
    return figure


def _read(path: Path) -> Iterator[_Drawn]:
    """Solids and lines of a STEP file, with their colours."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    reader = STEPCAFControl_Reader()
    reader.ReadFile(str(path))
    reader.Transfer(document)
    roots = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetFreeShapes(roots)
    for root in _labels(roots):
        yield from _parts(root, TopLoc_Location())


def _parts(assembly: Any, within: Any) -> Iterator[_Drawn]:
    components = Sequence_TDF_Label()
    XCAFDoc_ShapeTool.GetComponents_s(assembly, components)
    for component in _labels(components):
        part, below = TDF_Label(), Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(component, part)
        place = within * XCAFDoc_ShapeTool.GetLocation_s(component)
        if XCAFDoc_ShapeTool.IsAssembly_s(part):
            yield from _parts(part, place)
            continue
        XCAFDoc_ShapeTool.GetSubShapes_s(part, below)
        # A part of several solids has the colours of these.
        for label in _labels(below) or [part]:
            shape = XCAFDoc_ShapeTool.GetShape_s(label).Moved(place)
            yield _Drawn(_points(shape), _color(label))


def _labels(sequence: Any) -> list[Any]:
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def _color(label: Any) -> tuple[float, ...]:
    color = Quantity_Color()
    for kind in ("Gen", "Surf", "Curv"):
        kind_of = getattr(XCAFDoc_ColorType, f"XCAFDoc_Color{kind}")
        if XCAFDoc_ColorTool.GetColor_s(label, kind_of, color):
            break
    return tuple(color.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB))


def _points(shape: Any) -> Array:
    """Triangles of a solid [m], shape (n, 3, 3), or the ends of a line, shape (1, 2, 3)."""
    BRepMesh_IncrementalMesh(shape, _COARSE[0], False, _COARSE[1]).Perform()
    explorer, triangles = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE), []
    if not explorer.More():
        edge = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_EDGE).Current()
        curve = BRepAdaptor_Curve(TopoDS.Edge(edge))
        ends = curve.Value(curve.FirstParameter()), curve.Value(curve.LastParameter())
        return np.array([[(p.X(), p.Y(), p.Z()) for p in ends]]) / 1000
    while explorer.More():
        place = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(TopoDS.Face(explorer.Current()), place)
        nodes = [
            mesh.Node(i + 1).Transformed(place.Transformation()) for i in range(mesh.NbNodes())
        ]
        points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes])
        corners = [mesh.Triangle(i + 1).Get() for i in range(mesh.NbTriangles())]
        triangles.append(points[np.array(corners) - 1])
        explorer.Next()
    return np.vstack(triangles) / 1000
