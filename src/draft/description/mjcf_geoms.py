"""Geoms of an MJCF model: their shapes, and the masses of the primitive ones."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

from draft.description.description import Axes, Geometry, Inertial, MeshMass
from draft.description.mjcf_settings import Compiler, Defaults, from_z
from draft.description.xmlfile import Element
from draft.geometry import Matrix, Vector, add, compose, norm, rotate, scale, subtract

WATER = 1000.0  # MuJoCo's default density [kg/m3]
# Number of sizes of a primitive, without and with `fromto`.
SIZES = {
    "sphere": (1, 1),
    "capsule": (2, 1),
    "cylinder": (2, 1),
    "ellipsoid": (3, 2),
    "box": (3, 2),
}
MASSLESS = ("plane", "hfield")


@dataclass(frozen=True, slots=True)
class Mesh:
    """A mesh asset: file name, scale, and MuJoCo's rule for its volume."""

    file: str
    scale: Vector
    method: str = "legacy"


def mesh_files(root: Element, defaults: Defaults, compiler: Compiler) -> dict[str, Mesh]:
    """Mesh assets by name, which is by default that of the file."""
    table: dict[str, Mesh] = {}
    for assets in root.all("asset"):
        for plain in assets.all("mesh"):
            mesh = defaults.fill(plain, "main")
            file = mesh.attributes.get("file", "")
            folder = compiler.mesh_folder
            stem = file.rsplit("/", 1)[-1].rsplit(".", 1)[0]
            table[mesh.attributes.get("name") or stem] = Mesh(
                f"{folder.rstrip('/')}/{file}" if folder and file else file,
                cast(Vector, mesh.numbers("scale", 3, (1.0, 1.0, 1.0))),
                mesh.attributes.get("inertia", "legacy"),
            )
    return table


def geometry(
    element: Element,
    pose: tuple[Vector, Matrix],
    compiler: Compiler,
    meshes: Mapping[str, Mesh],
    weighs: bool = False,
) -> Geometry:
    """Shape of a geom; `pose` is that of the enclosing <frame>s in its body.

    `weighs`: whether the body's mass is that of its geoms.

    A geom without contacts (contype and conaffinity 0) is visual, any other is collision.
    """
    given = element.attributes
    silent = given.get("contype", "1") == "0" and given.get("conaffinity", "1") == "0"
    use = "visual" if silent else "collision"
    position, rotation = place(element, compiler)
    at, turned = add(pose[0], rotate(pose[1], position)), compose(pose[1], rotation)
    kind = shape(element)
    if kind == "mesh":
        mesh = meshes.get(given.get("mesh", ""), Mesh(given.get("mesh", ""), (1.0, 1.0, 1.0)))
        mass = element.number("mass") if "mass" in given else None
        weight = MeshMass(mass, element.number("density", WATER), mesh.method)
        weight = weight if weighs and solid(element) is None else None
        return Geometry(use, kind, (), mesh.file, mesh.scale, at, cast(Matrix, turned), weight)
    size = _size(element, kind) if kind in SIZES else element.some_numbers("size")
    if kind in ("box", "ellipsoid"):
        size = tuple(2 * x for x in size)
    elif kind in ("cylinder", "capsule"):
        size = (size[0], 2 * size[1])
    return Geometry(use, kind, size, position=at, rotation=cast(Matrix, turned))


def shape(element: Element) -> str:
    """Type of a geom."""
    kind = element.attributes.get("type")
    return kind or ("mesh" if "mesh" in element.attributes else "sphere")


def place(element: Element, compiler: Compiler) -> tuple[Vector, Matrix]:
    """Pose of a geom in the enclosing frame, from `pos` and an orientation, or from `fromto`."""
    if "fromto" in element.attributes:
        start, end = _ends(element)
        along = subtract(end, start)
        length = norm(along)
        if length == 0:
            raise element.error("fromto has no length")
        # MuJoCo points the z axis from the second end to the first.
        return scale(add(start, end), 0.5), from_z(scale(along, -1 / length))
    position = cast(Vector, element.numbers("pos", 3, (0.0, 0.0, 0.0)))
    return position, compiler.rotation(element)


def solid(element: Element) -> Inertial | None:
    """Mass properties of a geom in its own frame; None if they need a mesh."""
    kind = shape(element)
    if element.attributes.get("mass") is not None:
        mass = element.number("mass")
        if mass == 0:
            return _inertial(0.0, (0.0, 0.0, 0.0))
    if kind in MASSLESS or (
        element.number("density", WATER) == 0 and "mass" not in element.attributes
    ):
        return _inertial(0.0, (0.0, 0.0, 0.0))
    if kind not in SIZES:
        return None
    size = _size(element, kind)
    volume, moments = _unit_mass(kind, size)
    mass = element.number("mass", element.number("density", WATER) * volume)
    return _inertial(mass, cast(Vector, tuple(mass * x for x in moments)))


def _unit_mass(kind: str, size: tuple[float, ...]) -> tuple[float, tuple[float, float, float]]:
    """Volume [m3] of a primitive, and its moments of inertia per kilogram [m2]."""
    if kind == "sphere":
        moment = 0.4 * size[0] ** 2
        return 4 / 3 * math.pi * size[0] ** 3, (moment, moment, moment)
    if kind == "box":
        x, y, z = (s * s / 3 for s in size)
        return 8 * math.prod(size), (y + z, x + z, x + y)
    if kind == "ellipsoid":
        x, y, z = (s * s / 5 for s in size)
        return 4 / 3 * math.pi * math.prod(size), (y + z, x + z, x + y)
    r, h = size[0], 2 * size[1]
    tube = math.pi * r * r * h
    side = (3 * r * r + h * h) / 12
    if kind == "cylinder":
        return tube, (side, side, r * r / 2)
    ball = 4 / 3 * math.pi * r**3
    volume = tube + ball
    # Each cap is a half ball, whose centre of mass lies 3/8 r beyond the end of the cylinder.
    cap = 0.4 * r * r + h * h / 4 + 3 * h * r / 8
    across = (tube * side + ball * cap) / volume
    return volume, (across, across, (tube * r * r / 2 + ball * 0.4 * r * r) / volume)


def _size(element: Element, kind: str) -> tuple[float, ...]:
    """Sizes of a primitive in the order of MJCF, lengths as half lengths [m]."""
    whole, rest = SIZES[kind]
    given = element.some_numbers("size")
    if "fromto" not in element.attributes:
        if len(given) < whole:
            raise element.error(f"size of a {kind} has {whole} numbers")
        return given[:whole]
    if len(given) < rest:
        raise element.error(f"size of a {kind} with fromto has {rest} numbers")
    start, end = _ends(element)
    half = float(norm(subtract(end, start))) / 2
    return (*given[:rest], half)


def _ends(element: Element) -> tuple[Vector, Vector]:
    numbers = element.numbers("fromto", 6)
    return cast(Vector, numbers[:3]), cast(Vector, numbers[3:])


def _inertial(mass: float, moments: Vector) -> Inertial:
    x, y, z = (float(moment) for moment in moments)
    axes: Axes = ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
    return Inertial(mass, (0.0, 0.0, 0.0), axes)
