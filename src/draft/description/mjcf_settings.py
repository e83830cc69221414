"""Settings that MJCF elements inherit: compiler settings, default classes and orientations.

Source: MuJoCo's XML reference (compiler, default, frame orientations).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import cast

from draft.description.xmlfile import Element
from draft.geometry import (
    IDENTITY,
    Matrix,
    Rotation,
    Vector,
    about,
    compose,
    cross,
    norm,
    scale,
    transposed,
)

AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
MAX_CLASSES = 500
# Kinds of actuator, all of which take their defaults from one set per class.
ACTUATORS = (
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "general",
)


@dataclass(frozen=True, slots=True)
class Compiler:
    """Settings of <compiler> that the other elements depend on.

    Attributes:
        angle: factor from the unit of angles to radians.
        euler: sequence of the axes of Euler angles; upper case for fixed axes.
        autolimits: whether a joint with a range is limited unless it states otherwise.
        inertia_from_geometry: `inertiafromgeom`.
        mesh_folder: folder of the meshes, relative to the file.
        groups: first and last group of the geoms that weigh, `inertiagrouprange`.
    """

    angle: float = math.pi / 180
    euler: str = "xyz"
    autolimits: bool = True
    inertia_from_geometry: str = "auto"
    mesh_folder: str = ""
    groups: tuple[float, float] = (0, 5)

    @staticmethod
    def read(root: Element) -> Compiler:
        """Read all <compiler> elements of a model; later ones override earlier ones."""
        settings = Compiler()
        for element in root.all("compiler"):
            given = element.attributes
            if "angle" in given:
                factor = 1.0 if given["angle"] == "radian" else math.pi / 180
                settings = replace(settings, angle=factor)
            if "eulerseq" in given:
                if len(given["eulerseq"]) != 3 or set(given["eulerseq"].lower()) - set("xyz"):
                    raise element.error(f'eulerseq="{given["eulerseq"][:20]}" is not three axes')
                settings = replace(settings, euler=given["eulerseq"])
            if "autolimits" in given:
                settings = replace(settings, autolimits=given["autolimits"] == "true")
            if "inertiafromgeom" in given:
                settings = replace(settings, inertia_from_geometry=given["inertiafromgeom"])
            if "inertiagrouprange" in given:
                first, last = element.numbers("inertiagrouprange", 2)
                settings = replace(settings, groups=(first, last))
            folder = given.get("meshdir", given.get("assetdir"))
            if folder is not None:
                settings = replace(settings, mesh_folder=folder)
        return settings

    def weighs(self, geom: Element) -> bool:
        """Whether a geom counts for the mass of its body."""
        return self.groups[0] <= geom.number("group", 0) <= self.groups[1]

    def rotation(self, element: Element) -> Matrix:
        """Orientation of an element, from quat, axisangle, euler, xyaxes or zaxis."""
        given = element.attributes
        if "quat" in given:
            return from_quaternion(element)
        if "axisangle" in given:
            *axis, angle = element.numbers("axisangle", 4)
            return about(_unit(element, cast(Vector, tuple(axis))), angle * self.angle)
        if "euler" in given:
            return self._from_euler(element.numbers("euler", 3))
        if "xyaxes" in given:
            return _from_axes(element)
        if "zaxis" in given:
            return from_z(_unit(element, cast(Vector, element.numbers("zaxis", 3))))
        return IDENTITY

    def _from_euler(self, angles: tuple[float, ...]) -> Matrix:
        turned: Rotation = None
        for letter, angle in zip(self.euler, angles, strict=True):
            turn = about(AXES[letter.lower()], angle * self.angle)
            turned = compose(turned, turn) if letter.islower() else compose(turn, turned)
        return turned or IDENTITY


class Defaults:
    """Default classes: default attributes by tag."""

    def __init__(self, root: Element) -> None:
        self.classes: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        waiting = [(element, "main", True) for element in root.all("default")][::-1]
        while waiting:
            element, parent, top = waiting.pop()
            name = "main" if top else element.text("class")
            table = self.classes.setdefault(
                name, {tag: dict(own) for tag, own in self.classes[parent].items()}
            )
            if len(self.classes) > MAX_CLASSES:
                raise element.error(f"more than {MAX_CLASSES} default classes")
            for child in element.children:
                if child.tag != "default":
                    table.setdefault(_family(child.tag), {}).update(child.attributes)
            inner = [(child, name, False) for child in element.all("default")]
            waiting.extend(reversed(inner))

    def fill(self, element: Element, inherited: str) -> Element:
        """Return an element with the attributes of its default class filled in.

        Args:
            element: the element.
            inherited: class of an element that states none: the `childclass` of its body.

        Raises:
            DescriptionError: its class does not exist.
        """
        name = element.attributes.get("class", inherited)
        if name not in self.classes:
            raise element.error(
                f"default class '{name}' does not exist",
                f"classes: {', '.join(sorted(self.classes)[:24])}",
            )
        table = self.classes[name].get(_family(element.tag), {})
        return Element(
            element.tag, {**table, **element.attributes}, element.where, element.children
        )


def _family(tag: str) -> str:
    """Tag under which the defaults of an element are stored."""
    return "general" if tag in ACTUATORS else tag


def from_quaternion(element: Element) -> Matrix:
    """Rotation matrix of the attribute quat (w, x, y, z), which need not be normalised."""
    numbers = element.numbers("quat", 4)
    length = math.hypot(*numbers)
    if length == 0:
        raise element.error(f"quat of <{element.tag}> is zero")
    w, x, y, z = (number / length for number in numbers)
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _unit(element: Element, vector: Vector) -> Vector:
    length = norm(vector)
    if length == 0:
        raise element.error(f"an axis of <{element.tag}> has no direction")
    return scale(vector, 1 / length)


def _from_axes(element: Element) -> Matrix:
    numbers = element.numbers("xyaxes", 6)
    x = _unit(element, cast(Vector, numbers[:3]))
    y = cast(Vector, numbers[3:])
    along = sum(a * b for a, b in zip(x, y, strict=True))
    y = _unit(element, cast(Vector, tuple(b - along * a for a, b in zip(x, y, strict=True))))
    return transposed((x, y, cross(x, y)))


def from_z(z: Vector) -> Matrix:
    """Smallest rotation that turns the z axis to the unit vector `z`."""
    axis = cross(AXES["z"], z)
    sine = float(norm(axis))
    if sine < 1e-12:
        return IDENTITY if z[2] > 0 else about(AXES["x"], math.pi)
    return about(scale(axis, 1 / sine), math.atan2(sine, float(z[2])))
