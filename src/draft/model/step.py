"""Export to STEP (ISO 10303-21, AP214) for CAD: an assembly in the home pose, in millimetres.

Every link and every actuator is a part, with the name, the solids and the colours that Draft draws.
A part has the frame of its link; that of an actuator is on its axis, with z along the shaft. The
trunk is the faceted solid that is weighed, with coplanar triangles as one face. A part of one's own
is the solid of its STEP file, or of its triangles. STEP has no joints:
an axis is a line in a part of its own, as CAD programs exchange construction geometry, from a point
on the axis in its positive direction. Mean densities are material properties.

Open CASCADE, the kernel of build123d and CadQuery, writes the file from a document of assemblies
(XCAF).
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from draft import geometry as g
from draft.design.design import Body, Design
from draft.errors import ModelError
from draft.extras import own_version
from draft.geometry import Frame, Vector
from draft.spec.primitives import colors
from draft.spec.primitives.base import Geom
from draft.spec.primitives.loft import Loft
from draft.spec.primitives.mesh import Mesh
from draft.spec.step_file import kernel, quiet, solids
from draft.values import Array, Value, scalar

if TYPE_CHECKING:
    from draft.model.model import Model


# The exporter imports this module when it writes, so a missing kernel is an error of the export.
_gp, _make, _text = kernel("gp"), kernel("BRepBuilderAPI"), kernel("TCollection")
_prim, _topology, _xcaf = kernel("BRepPrimAPI"), kernel("TopoDS"), kernel("XCAFDoc")

_MM = 1000.0  # per metre
_SEWN = 1e-6  # Distance of edges that are one [mm].
_SAME = 1e-6  # Relative difference of volumes, as of masses in MuJoCo.
_AXIS = 0.1  # Length of an axis, as a share of the diagonal of the box around the robot.
_AXIS_KIND = "drawn"
_MOST = 10_000  # Triangles of a part, which the kernel sews in about 20 s.


def robot_step(model: Model) -> bytes:
    """Bytes of a STEP file of the robot, with the floor at z = 0.

    Raises:
        ModelError: the kernel cannot make the trunk's solid, or cannot write the file.
    """
    design = model.design
    assembly = _Assembly(f"{design.name}_{design.label}")
    floor: Vector = (0.0, 0.0, design.lowest(home=True) if design.floating else 0.0)
    joints, shafts = {}, {}
    for body, own in zip(design.bodies, design.frames(home=True), strict=True):
        frame = _inside((floor, None), own)
        _add_link(assembly, design, body, frame)
        if (motor := _motor(body)) is not None:
            geom, within = motor
            name, place = f"{body.name}{geom.suffix}", _placement(_inside(frame, within))
            part = body.actuator.shape if body.actuator is not None else None
            volume = geom.volume if part is None else part.mesh.volume
            solid = _solid(geom) if part is None else _own(part.mesh)
            assembly.add(name, place, [(solid, geom.kind)], geom.mass or 0.0, volume)
            shafts[name] = place
        if body.link.pulley is not None:
            geom = body.link.pulley.geom(body.link.tip)
            name = f"{body.name}{geom.suffix}"
            assembly.add(name, _placement(frame), [(_solid(geom), geom.kind)], 0.0, geom.volume)
        if body.joint is not None:
            axis = _direction(g.rotate(frame[1], body.joint_axis))
            joints[body.prefix + body.joint.name] = _gp.gp_Ax3(_point(frame[0]), axis)
    length = _AXIS * assembly.diagonal()
    assembly.add_axes("joint_axes", joints, length)
    assembly.add_axes("motor_axes", shafts, length)
    return assembly.written(design.reference)


def _inside(outer: Frame, inner: Frame) -> Frame:
    """Frame that is given in another one."""
    origin, rotation = outer
    return g.add(origin, g.rotate(rotation, inner[0])), g.compose(rotation, inner[1])


def _add_link(assembly: _Assembly, design: Design, body: Body, frame: Frame) -> None:
    """Add the solids of a link as one part; a link without any, as of a housing, has none."""
    found: list[tuple[Any, str]] = []
    mass: Value = 0.0
    volume: Value = 0.0
    if body.parent is None and (trunk := design.lofted) is not None:
        own = None if trunk.shape is None else trunk.shape.mesh
        found.append((_lofted(trunk.loft) if own is None else _own(own), "trunk"))
        mass, volume = trunk.mass, (own or trunk.loft).volume
    for geom, part in body.replaced():
        found.append((_solid(geom) if part is None else _own(part.mesh), geom.kind))
        mass = mass + (geom.mass or 0.0)
        volume = volume + (geom.volume if part is None else part.mesh.volume)
    if found:
        assembly.add(body.name, _placement(frame), found, mass, volume)


def _motor(body: Body) -> tuple[Geom, Frame] | None:
    """Actuator of a body in its own frame, and that frame in that of the body."""
    motor = body.link.motor
    if motor is None:
        return None
    x, _, z = g.IDENTITY
    upright = body.link._replace(motor=motor._replace(center=g.ZERO, axis=z, long=x))
    geom = body._replace(link=upright).motor_geom
    return None if geom is None else (geom, motor.frame)


def _point(at: Vector) -> Any:
    return _gp.gp_Pnt(*(scalar(x) * _MM for x in at))


def _direction(along: Vector) -> Any:
    return _gp.gp_Dir(*map(scalar, along))


def _placement(frame: Frame) -> Any:
    """Axes of the kernel at a frame."""
    x, _, z = g.transposed(frame[1] or g.IDENTITY)
    return _gp.gp_Ax3(_point(frame[0]), _direction(z), _direction(x))


def _solid(geom: Geom) -> Any:
    """Solid of the kernel in the frame of its geom's body [mm]."""
    size = [scalar(x) * _MM for x in geom.size]
    if geom.form == "sphere":
        return _prim.BRepPrimAPI_MakeSphere(_point(geom.center), *size).Solid()
    if geom.form == "cylinder":
        foot = g.subtract(geom.center, g.scale(geom.axis, geom.size[1] / 2))
        axes = _gp.gp_Ax2(_point(foot), _direction(geom.axis))
        return _prim.BRepPrimAPI_MakeCylinder(axes, *size).Solid()
    corner = g.rotate(geom.rotation, (geom.size[0] / -2, geom.size[1] / -2, geom.size[2] / -2))
    axes = _placement((g.add(geom.center, corner), geom.rotation)).Ax2()
    return _prim.BRepPrimAPI_MakeBox(axes, *size).Solid()


def _lofted(loft: Loft) -> Any:
    """Solid of the trunk: its triangles, and both caps as polygons.

    Raises:
        ModelError: the solid is not that of the design, as of a section that touches itself.
    """
    k = loft.corners
    sides = loft.faces()[: 2 * k * (loft.sections - 1)]
    faces = [loft.vertices[:k], *loft.vertices[sides], loft.vertices[-k:]]
    remedy = "correct the sections in root.yaml: none may touch itself"
    return _sewn(faces, loft.volume, "the trunk", remedy)


def _own(mesh: Mesh) -> Any:
    """Solid of a part of one's own.

    Raises:
        ModelError: the solid is not that of the design, as of a surface that cuts itself, or the
            mesh has too many triangles.
    """
    if mesh.step is None:
        if len(mesh.corners) > _MOST:
            raise ModelError(
                f"'{mesh.file}' has {len(mesh.corners)} triangles, and its solid at most {_MOST}",
                "export the part as STEP, or coarser",
            )
        remedy = "mend it in the program that made it, or export it as STEP"
        faces = [*mesh.vertices[mesh.faces()]]
        return _sewn(faces, mesh.volume, f"'{mesh.file}'", remedy)
    shape = solids(mesh.step)
    for axis, sign in zip(g.IDENTITY, mesh.signs, strict=True):
        if sign < 0:
            mirror = _gp.gp_Trsf()
            mirror.SetMirror(_gp.gp_Ax2(_point(g.ZERO), _direction(axis)))
            shape = _make.BRepBuilderAPI_Transform(shape, mirror, True).Shape()
    return shape


def _sewn(faces: Sequence[Array], expected: Value, what: str, remedy: str) -> Any:
    """Solid of polygons, whose coplanar ones become one face.

    Args:
        faces: corners of each [m], shape (n, 3).
        expected: volume that it must have [m3].
        what: what it is, for messages.
        remedy: what to do about one that is no solid.

    Raises:
        ModelError: it is none, or has another volume.
    """
    sewing = _make.BRepBuilderAPI_Sewing(_SEWN)
    for corners in faces:
        places = corners * _MM
        # Corners coincide where a plain rectangle is between chamfered ones.
        places = places[np.linalg.norm(places - np.roll(places, 1, axis=0), axis=1) > _SEWN]
        if len(places) < 3:
            continue
        wire = _make.BRepBuilderAPI_MakePolygon()
        for place in places.tolist():
            wire.Add(_gp.gp_Pnt(*place))
        wire.Close()
        sewing.Add(_make.BRepBuilderAPI_MakeFace(wire.Wire(), True).Face())
    sewing.Perform()
    volume, sewed = 0.0, sewing.SewedShape()
    if sewed.ShapeType() == kernel("TopAbs").TopAbs_ShapeEnum.TopAbs_SHELL:
        solid = _make.BRepBuilderAPI_MakeSolid(_topology.TopoDS.Shell(sewed)).Solid()
        kernel("BRepLib").BRepLib.OrientClosedSolid_s(solid)
        merged = kernel("ShapeUpgrade").ShapeUpgrade_UnifySameDomain(solid, True, True, False)
        merged.Build()
        properties = kernel("GProp").GProp_GProps()
        kernel("BRepGProp").BRepGProp.VolumeProperties_s(merged.Shape(), properties)
        volume = properties.Mass() / _MM**3
        valid = kernel("BRepCheck").BRepCheck_Analyzer(merged.Shape()).IsValid()
        if valid and abs(volume - expected) <= _SAME * expected:
            return merged.Shape()
    raise ModelError(
        f"{what} of {expected:.9g} m3 is no solid for the CAD kernel, which finds {volume:.9g} m3",
        remedy,
    )


class _Assembly:
    """A document of the kernel with one assembly of parts.

    Args:
        name: name of the assembly.
    """

    def __init__(self, name: str) -> None:
        self._document = kernel("TDocStd").TDocStd_Document(_extended("BinXCAF"))
        tool, main = _xcaf.XCAFDoc_DocumentTool, self._document.Main()
        tool.SetLengthUnit_s(self._document, 1 / _MM)
        self._shapes, self._colors = tool.ShapeTool_s(main), tool.ColorTool_s(main)
        self._materials = tool.MaterialTool_s(main)
        self._shapes.SetAutoNaming_s(False)
        self._root = _named(self._shapes.NewShape(), name)

    def add(
        self,
        name: str,
        place: Any,
        solids: Sequence[tuple[Any, str]],
        mass: Value,
        volume: Value,
    ) -> None:
        """Add a part.

        Args:
            name: its name.
            place: its axes in the world [mm].
            solids: its solids in these axes [mm], each with the kind of geom that colours it.
            mass: its mass [kg]; one without mass has no material.
            volume: sum of the volumes of its solids [m3].
        """
        shape = solids[0][0]
        if len(solids) > 1:
            shape = _topology.TopoDS_Compound()
            builder = kernel("BRep").BRep_Builder()
            builder.MakeCompound(shape)
            for solid, _ in solids:
                builder.Add(shape, solid)
        part = self._component(self._root, shape, name, place)
        for solid, kind in solids:
            of = part if len(solids) == 1 else self._shapes.AddSubShape(part, solid)
            self._color(of, kind)
        if (kg := scalar(mass)) > 0:
            # In g/cm3, as the kernel has it.
            density = kg / scalar(volume) / 1000
            texts = (f"{name}, mean density", "", "density measure", "POSITIVE_RATIO_MEASURE")
            title, description, quantity, measure = map(_ascii, texts)
            self._materials.SetMaterial(part, title, description, density, quantity, measure)

    def add_axes(self, name: str, axes: Mapping[str, Any], length: float) -> None:
        """Add lines along z of axes, by name, as an assembly in the assembly.

        Args:
            name: its name.
            axes: the axes in the world [mm], by name of what turns about them.
            length: length of the lines [mm].
        """
        if not axes:
            return
        group = _named(self._shapes.NewShape(), name)
        for of, place in axes.items():
            ends = (_gp.gp_Pnt(0.0, 0.0, 0.0), _gp.gp_Pnt(0.0, 0.0, length))
            line = _make.BRepBuilderAPI_MakeEdge(*ends).Edge()
            self._color(self._component(group, line, f"{of}_axis", place), _AXIS_KIND)
        _named(self._shapes.AddComponent(self._root, group, _location(_gp.gp_Ax3())), name)

    def diagonal(self) -> float:
        """Diagonal of the box around the assembly [mm]."""
        self._shapes.UpdateAssemblies()
        box = kernel("Bnd").Bnd_Box()
        kernel("BRepBndLib").BRepBndLib.Add_s(self._shapes.GetShape_s(self._root), box)
        return 0.0 if box.IsVoid() else float(np.sqrt(box.SquareExtent()))

    def written(self, title: str) -> bytes:
        """Text of the file.

        Raises:
            ModelError: the kernel cannot write it.
        """
        self._shapes.UpdateAssemblies()
        quiet()
        writer = kernel("STEPCAFControl").STEPCAFControl_Writer()
        writer.SetMaterialMode(True)
        as_is = kernel("STEPControl").STEPControl_StepModelType.STEPControl_AsIs
        stream, status = io.BytesIO(), None
        if writer.Transfer(self._document, as_is):
            steps = writer.Writer().Model()
            _correct_densities(steps)
            header = kernel("APIHeaderSection").APIHeaderSection_MakeHeader(steps)
            header.SetName(_ascii(title))
            header.SetOriginatingSystem(_ascii(f"Draft {own_version()}"))
            # Of the kernel, otherwise.
            header.SetAuthorValue(1, _ascii(""))
            header.SetOrganizationValue(1, _ascii(""))
            status = writer.WriteStream(stream)
        if status != kernel("IFSelect").IFSelect_ReturnStatus.IFSelect_RetDone:
            raise ModelError(
                f"the CAD kernel cannot write STEP: {status or 'nothing is transferred'}",
                "this is a bug in Draft: report it with the spec",
            )
        return stream.getvalue()

    def _component(self, assembly: Any, shape: Any, name: str, place: Any) -> Any:
        """Add a shape to an assembly as a part; return its label."""
        part = _named(self._shapes.AddShape(shape, False, False), name)
        _named(self._shapes.AddComponent(assembly, part, _location(place)), name)
        return part

    def _color(self, label: Any, kind: str) -> None:
        quantity = kernel("Quantity")
        srgb = quantity.Quantity_TypeOfColor.Quantity_TOC_sRGB
        color = quantity.Quantity_Color(*colors()[kind][:3], srgb)
        self._colors.SetColor(label, color, _xcaf.XCAFDoc_ColorType.XCAFDoc_ColorGen)


def _location(place: Any) -> Any:
    """Location of the kernel at some axes."""
    move = _gp.gp_Trsf()
    move.SetTransformation(place, _gp.gp_Ax3())
    return kernel("TopLoc").TopLoc_Location(move)


def _extended(text: str) -> Any:
    return _text.TCollection_ExtendedString(text, True)


def _ascii(text: str) -> Any:
    return _text.TCollection_HAsciiString(text)


def _named(label: Any, name: str) -> Any:
    kernel("TDataStd").TDataStd_Name.Set_s(label, _extended(name))
    return label


def _correct_densities(steps: Any) -> None:
    """Correct the unit of densities: the kernel writes g3 cm2 where it means g/cm3.

    Args:
        steps: the entities of the file.
    """
    basic = kernel("StepBasic")
    for i in range(1, steps.NbEntities() + 1):
        entity = steps.Value(i)
        if isinstance(entity, basic.StepBasic_DerivedUnitElement):
            mass = isinstance(entity.Unit(), basic.StepBasic_SiUnitAndMassUnit)
            entity.SetExponent(1.0 if mass else -3.0)
