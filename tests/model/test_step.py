"""The STEP file, read again: parts stand where the design has them, with its volumes and masses."""

# pyright: reportAttributeAccessIssue=false
# (The compiled modules of MuJoCo and of the kernel carry no types.)
from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np
import pytest

import draft
from draft import geometry as g
from draft.errors import DraftError, RefusedError
from draft.extras import own_version
from draft.spec.primitives import colors
from draft.values import scalar
from tests.helpers import robot
from tests.model.shipped import SHIPPED, built

pytest.importorskip("OCP", reason="the extra `cad` is not installed")

from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.BRepGProp import BRepGProp
from OCP.collections import Sequence_TDF_Label
from OCP.GProp import GProp_GProps
from OCP.Quantity import Quantity_Color, Quantity_TypeOfColor
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
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

from draft.model.step import robot_step


class Read(NamedTuple):
    """A part as read: its volume and place in mm, its density in g/cm3, its colours in sRGB."""

    parent: str
    shape: Any
    volume: float
    centre: np.ndarray
    density: float
    colors: set[tuple[float, ...]]


def _volume(shape: Any) -> tuple[float, np.ndarray]:
    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found, 1e-9)
    at = found.CentreOfMass()
    return found.Mass(), np.array([at.X(), at.Y(), at.Z()])


def _name(label: Any) -> str:
    found = TDataStd_Name()
    assert label.FindAttribute(TDataStd_Name.GetID_s(), found)
    return found.Get().ToExtString()


def _color(label: Any) -> tuple[float, ...] | None:
    color = Quantity_Color()
    for kind in (
        XCAFDoc_ColorType.XCAFDoc_ColorGen,
        XCAFDoc_ColorType.XCAFDoc_ColorSurf,
        XCAFDoc_ColorType.XCAFDoc_ColorCurv,
    ):
        if XCAFDoc_ColorTool.GetColor_s(label, kind, color):
            return tuple(np.round(color.Values(Quantity_TypeOfColor.Quantity_TOC_sRGB), 4))
    return None


def _labels(sequence: Any) -> list[Any]:
    return [sequence.Value(i) for i in range(1, sequence.Length() + 1)]


def densities(text: str) -> dict[str, float]:
    """Densities by name of the part, from the entities of a file.

    The kernel's reader finds none of a part of several solids.
    """
    flat = re.sub(r"\n *", "", text)

    def links(pattern: str) -> dict[str, str]:
        return dict(re.findall(pattern, flat))

    names = links(r"#(\d+) = PRODUCT\('(\w+)'")
    products = links(r"#(\d+) = PRODUCT_DEFINITION_FORMATION\('','',#(\d+)\)")
    formations = links(r"#(\d+) = PRODUCT_DEFINITION\('design','',#(\d+),")
    properties = links(r"#(\d+) = PROPERTY_DEFINITION\('material property','density',#(\d+)\)")
    held = links(r"PROPERTY_DEFINITION_REPRESENTATION\(#(\d+),#(\d+)\)")
    items = links(r"#(\d+) = REPRESENTATION\('density',\(#(\d+)\)")
    values = links(
        r"#(\d+) = MEASURE_REPRESENTATION_ITEM\('density measure',POSITIVE_RATIO_MEASURE\((.*?)\)"
    )
    return {
        names[products[formations[owner]]]: float(values[items[held[one]]])
        for one, owner in properties.items()
    }


def read(path: Path) -> tuple[str, dict[str, Read]]:
    """Name of the assembly of a file, and its parts by name."""
    document = TDocStd_Document(TCollection_ExtendedString("BinXCAF"))
    reader = STEPCAFControl_Reader()
    reader.ReadFile(str(path))
    assert reader.Transfer(document)
    shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
    free = Sequence_TDF_Label()
    shapes.GetFreeShapes(free)
    (root,) = _labels(free)
    masses = densities(path.read_text(encoding="ascii"))
    parts: dict[str, Read] = {}

    def walk(assembly: Any, parent: str, within: Any) -> None:
        components = Sequence_TDF_Label()
        XCAFDoc_ShapeTool.GetComponents_s(assembly, components)
        for component in _labels(components):
            part = TDF_Label()
            assert XCAFDoc_ShapeTool.GetReferredShape_s(component, part)
            assert _name(part) == _name(component)
            if XCAFDoc_ShapeTool.IsAssembly_s(part):
                walk(part, _name(part), within * XCAFDoc_ShapeTool.GetLocation_s(component))
                continue
            below = Sequence_TDF_Label()
            XCAFDoc_ShapeTool.GetSubShapes_s(part, below)
            shown = {_color(label) for label in (component, part, *_labels(below))}
            shape = XCAFDoc_ShapeTool.GetShape_s(component).Moved(within)
            assert _name(part) not in parts
            density = masses.get(_name(part), 0.0)
            found = {color for color in shown if color is not None}
            parts[_name(part)] = Read(parent, shape, *_volume(shape), density, found)

    walk(root, "", TopLoc_Location())
    return _name(root), parts


def line(shape: Any) -> tuple[np.ndarray, np.ndarray]:
    """Start and end of the only edge of a shape [mm]."""
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_EDGE)
    curve = BRepAdaptor_Curve(TopoDS.Edge(explorer.Current()))
    ends = [curve.Value(t) for t in (curve.FirstParameter(), curve.LastParameter())]
    explorer.Next()
    assert not explorer.More()
    start, end = (np.array([p.X(), p.Y(), p.Z()]) for p in ends)
    return start, end


def written(model: draft.Model, folder: Path) -> tuple[str, dict[str, Read]]:
    path = folder / "robot.step"
    path.write_bytes(robot_step(model))
    return read(path)


def expected(design: draft.Design) -> dict[str, tuple[float, np.ndarray, float, set[Any]]]:
    """Volume [m3], centre in the world [m], mass [kg] and colours of each part, by closed forms."""
    found = {}
    up = scalar(design.lowest(home=True)) if design.floating else 0.0
    for i, (body, (origin, turn)) in enumerate(
        zip(design.bodies, design.frames(home=True), strict=True)
    ):
        at = np.add(np.array(origin, float), (0, 0, up))
        matrix = np.array(turn or g.IDENTITY, float)
        motor, pulley = body.motor_geom, body.link.pulley
        groups = {body.name: [one for one in body.solids() if one.suffix != "_motor"]}
        if motor is not None:
            groups[body.name + "_motor"] = [motor]
        if pulley is not None:
            groups[body.name + "_pulley"] = [pulley.geom(body.link.tip)]
        for name, geoms in groups.items():
            volumes = [scalar(one.volume) for one in geoms]
            centres = [np.array(one.center, float) for one in geoms]
            mass, kinds = sum(one.mass or 0.0 for one in geoms), {one.kind for one in geoms}
            if i == 0 and name == body.name and design.lofted is not None:
                volumes.append(scalar(design.trunk.loft.volume))
                centres.append(design.trunk.loft.com)
                mass, kinds = mass + design.trunk.mass, kinds | {"trunk"}
            if not volumes:
                continue
            volume = sum(volumes)
            centre = np.average(centres, axis=0, weights=volumes)
            shown = {tuple(np.round(colors()[kind][:3], 4)) for kind in kinds}
            found[name] = volume, at + matrix @ centre, float(mass), shown
    return found


@pytest.mark.parametrize(
    ("name", "label"), SHIPPED, ids=["-".join(filter(None, pair)) for pair in SHIPPED]
)
def test_every_part_has_its_volume_place_mass_and_colours(
    name: str, label: str | None, tmp_path: Path
) -> None:
    model = built(name, label)
    title, parts = written(model, tmp_path)
    design = model.design
    assert title == f"{design.name}_{design.label}"
    solids = {key: one for key, one in parts.items() if not one.parent}
    wanted = expected(design)
    assert [*solids] == [*wanted]
    size = np.ptp([centre for _, centre, _, _ in wanted.values()], axis=0).max()
    mass = 0.0
    for key, (volume, centre, kg, shown) in wanted.items():
        part = solids[key]
        assert part.volume == pytest.approx(volume * 1e9, rel=1e-6), key
        assert np.abs(part.centre / 1e3 - centre).max() < 1e-6 * size, key
        assert part.volume * part.density / 1e6 == pytest.approx(kg, rel=1e-6), key
        assert part.colors == shown, key
        assert BRepCheck_Analyzer(part.shape).IsValid(), key
        mass += part.volume * part.density / 1e6
    assert mass == pytest.approx(scalar(design.mass), rel=1e-6)


@pytest.mark.parametrize("name", ["quadruped", "arm", "hand"])
def test_motors_and_axes_stand_where_mujoco_has_them_in_the_home_pose(
    name: str, tmp_path: Path
) -> None:
    model = built(name, None)
    _, parts = written(model, tmp_path)
    scene = model.scene()
    data = mujoco.MjData(scene)
    mujoco.mj_resetDataKeyframe(scene, data, 0)
    mujoco.mj_kinematics(scene, data)
    joints = {key: one for key, one in parts.items() if one.parent == "joint_axes"}
    motors = {key: one for key, one in parts.items() if one.parent == "motor_axes"}
    assert {*joints} == {f"{joint}_axis" for joint in model.design.joints}
    for joint in model.design.joints:
        i = scene.joint(joint).id
        start, end = line(joints[f"{joint}_axis"].shape)
        assert start / 1e3 == pytest.approx(data.xanchor[i], abs=1e-6)
        assert (end - start) / np.linalg.norm(end - start) == pytest.approx(data.xaxis[i], abs=1e-6)
    bodies = [body for body in model.design.bodies if body.motor_geom is not None]
    assert {*motors} == {f"{body.name}_motor_axis" for body in bodies}
    for body in bodies:
        i, actuator = scene.geom(f"{body.name}_motor").id, body.actuator
        assert actuator is not None
        part, (start, end) = (
            parts[f"{body.name}_motor"],
            line(motors[f"{body.name}_motor_axis"].shape),
        )
        assert part.centre / 1e3 == pytest.approx(data.geom_xpos[i], abs=1e-6)
        along = (end - start) / np.linalg.norm(end - start)
        assert abs(along @ data.geom_xmat[i].reshape(3, 3)[:, 2]) == pytest.approx(1, abs=1e-9)
        # The shaft of a servo is half of its shorter edge from one end of the box.
        off = (actuator.height - actuator.width) / 2 if actuator.is_box else 0.0
        aside = np.linalg.norm(np.cross(part.centre - start, along)) / 1e3
        assert aside == pytest.approx(scalar(off), abs=1e-6)
        assert np.linalg.norm(part.centre - start) / 1e3 == pytest.approx(scalar(off), abs=1e-6)
    assert {tuple(one.colors) for one in (*joints.values(), *motors.values())} == {
        ((0.95, 0.55, 0.2),)
    }


def test_a_part_has_the_frame_of_its_link_and_a_motor_one_along_its_shaft(tmp_path: Path) -> None:
    model = built("quadruped", None)
    _, parts = written(model, tmp_path)
    for body in model.design.bodies:
        if body.name in parts and body.link.member is not None:
            own, centre = _volume(parts[body.name].shape.Located(TopLoc_Location()))
            assert own == pytest.approx(parts[body.name].volume)
            tip = np.array(body.link.tip, float)
            # On the straight line from its origin to its tip.
            assert np.cross(centre / 1e3, tip) == pytest.approx([0, 0, 0], abs=1e-9)
    one = _volume(parts["FL_abduction_motor"].shape.Located(TopLoc_Location()))
    assert one[1] == pytest.approx([0, 0, 0], abs=1e-9)


SECTIONS = {
    "box": [{"at": -0.2, "rectangle": [0.2, 0.1]}, {"at": 0.2, "rectangle": [0.2, 0.1]}],
    "one chamfer": [
        {"at": -0.2, "rectangle": [0.2, 0.1], "chamfer": 0.3},
        {"at": 0.1, "rectangle": [0.3, 0.2], "offset": [0.02, 0.01]},
        {"at": 0.2, "rectangle": [0.1, 0.05], "chamfer": 0.49},
    ],
    "skew": [
        {"at": -0.2, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]},
        {"at": 0.2, "polygon": [[-0.05, -0.14], [0.14, -0.05], [0.05, 0.14], [-0.14, 0.05]]},
    ],
    "concave": [
        {"at": at, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [0.0, -0.02], [-0.1, 0.1]]}
        for at in (-0.2, 0.2)
    ],
    "corner twice": [
        {"at": at, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}
        for at in (-0.2, 0.2)
    ],
}


@pytest.mark.parametrize("kind", SECTIONS)
def test_any_trunk_is_the_solid_that_is_weighed(kind: str, tmp_path: Path) -> None:
    model = robot(root={"sections": SECTIONS[kind]}).resolve().build()
    loft = model.design.trunk.loft
    trunk = written(model, tmp_path)[1]["trunk"]
    assert trunk.volume == pytest.approx(loft.volume * 1e9, rel=1e-9)
    height = scalar(model.design.lowest(home=True))
    assert trunk.centre / 1e3 == pytest.approx(np.add(loft.com, (0, 0, height)), abs=1e-9)
    assert BRepCheck_Analyzer(trunk.shape).IsValid()
    faces, explorer = 0, TopExp_Explorer(trunk.shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        faces += 1
        explorer.Next()
    # Coplanar triangles are one face; skew sides are two.
    assert faces == {"box": 6, "skew": 10, "concave": 7, "corner twice": 6}.get(kind, faces)


def test_a_trunk_that_touches_itself_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    slit = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [0, 0.1], [0, -0.1], [0, 0.1], [-0.1, 0.1]]
    model = robot(root={"sections": [{"at": at, "polygon": slit} for at in (-0.2, 0.2)]})
    with pytest.raises(DraftError, match=r"trunk .* CAD kernel.*\n.* in root.yaml"):
        draft.export(model.resolve(), tmp_path / "out", ["step"])
    assert not any(tmp_path.iterdir())


def test_the_file_is_in_millimetres_and_names_draft_and_the_design(tmp_path: Path) -> None:
    text = robot_step(built("quadruped", "bear")).decode("ascii")
    assert text.startswith("ISO-10303-21;")
    head, _, data = text.partition("ENDSEC;")
    assert "FILE_NAME('quadruped:bear'" in head
    assert f"'Draft {own_version()}'" in head
    assert "AUTOMOTIVE_DESIGN" in head
    lengths = set(re.findall(r"LENGTH_UNIT\(\) NAMED_UNIT\(\*\) SI_UNIT\((\S+),\.METRE\.\)", data))
    assert lengths == {".MILLI.", ".CENTI."}  # Of places, and of densities.
    assert {*re.findall(r"DERIVED_UNIT_ELEMENT\(#\d+,(\S+)\)", data)} == {"1.", "-3."}
    assert "POSITIVE_RATIO_MEASURE(0.65352" in data  # of the trunk [g/cm3]


def test_the_kernel_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    robot_step(built("hopper", None))
    assert capfd.readouterr() == ("", "")


def test_an_export_holds_both_files_and_replaces_only_a_folder_of_draft(tmp_path: Path) -> None:
    design = built("hopper", None).design
    folder = draft.export(design, tmp_path / "out", ["step"])
    assert {path.name for path in folder.iterdir()} == {
        *("robot.step", "bom.csv", "design.yaml", "report.json")
    }
    draft.export(design, folder, ["step", "urdf"])
    assert {"robot.step", "robot.urdf"} <= {path.name for path in folder.iterdir()}
    (folder / "drawing.sldprt").touch()
    with pytest.raises(DraftError, match=r"drawing.sldprt\); it is kept"):
        draft.export(design, folder, ["step"])
    assert (folder / "robot.urdf").is_file()


def test_a_refused_design_writes_nothing(tmp_path: Path) -> None:
    refused = draft.load("hopper").resolve({"actuators.leg.peak_torque": 900})
    with pytest.raises(RefusedError):
        draft.export(refused, tmp_path / "out", ["step"])
    assert not any(tmp_path.iterdir())


def test_without_the_extra_the_message_names_it_and_nothing_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "OCP"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.delitem(sys.modules, "draft.model.step")
    with pytest.raises(DraftError, match=r"^OCP is not installed\n.*cad"):
        draft.export(built("hopper", None), tmp_path / "out", ["step"])
    assert not any(tmp_path.iterdir())
