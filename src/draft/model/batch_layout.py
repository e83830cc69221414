"""Layout: fields of the compiled model that hold the numbers of a robot's MJCF elements."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.model.decimals import rounded
from draft.model.xml import Element
from draft.values import Array, Value

Index = NDArray[np.intp]
NO_TURN = (1.0, 0.0, 0.0, 0.0)
ZERO = (0.0, 0.0, 0.0)
DENSITY = 1000.0  # MuJoCo's, where an element states neither density nor mass [kg/m3]
TYPES = {
    "sphere": int(mujoco.mjtGeom.mjGEOM_SPHERE),
    "cylinder": int(mujoco.mjtGeom.mjGEOM_CYLINDER),
    "box": int(mujoco.mjtGeom.mjGEOM_BOX),
    "mesh": int(mujoco.mjtGeom.mjGEOM_MESH),
}


@dataclass
class Numbers:
    """The different numbers of all elements: constants, and arrays of one number per design."""

    constants: dict[float, int] = field(default_factory=dict)
    arrays: dict[int, tuple[int, Array]] = field(default_factory=dict)

    def place(self, value: Value) -> int:
        """Row of a number in the table."""
        count = len(self.constants) + len(self.arrays)
        if isinstance(value, np.ndarray) and value.ndim:
            return self.arrays.setdefault(id(value), (count, value))[0]
        return self.constants.setdefault(float(value), count)

    def places(self, values: Iterable[Value]) -> list[int]:
        """Rows of several numbers."""
        return [self.place(value) for value in values]

    def are_constant(self, places: Index) -> bool:
        """Whether the numbers at some rows of the table are the same for all designs."""
        return not np.isin(places, [place for place, _ in self.arrays.values()]).any()

    def table(self, rows: Index) -> Array:
        """All numbers for some designs as the text of a model gives them, shape (numbers, N)."""
        found = np.empty((len(self.constants) + len(self.arrays), len(rows)))
        constants = np.array([*self.constants], dtype=np.float64)
        found[[*self.constants.values()]] = rounded(constants)[:, None]
        if self.arrays:
            places = [place for place, _ in self.arrays.values()]
            found[places] = rounded(np.stack([array[rows] for _, array in self.arrays.values()]))
        return found


@dataclass(frozen=True)
class Geoms:
    """Geoms by index in the model, with rows of their numbers in the table.

    Attributes:
        ids, bodies: index of each geom and of its body, shape (geoms,).
        types: MuJoCo's type of each, shape (geoms,).
        size, pos, quat: shapes (geoms, 3), (geoms, 3) and (geoms, 4).
        density: shape (geoms,).
        massless: whether it has no mass whatever its size, shape (geoms,).
    """

    ids: Index
    bodies: Index
    types: Index
    size: Index
    pos: Index
    quat: Index
    density: Index
    massless: NDArray[np.bool_]


@dataclass(frozen=True)
class Layout:
    """Mapping of numbers to entries of fields.

    Attributes:
        numbers: the table of numbers.
        plain: for each field, flat indices in it and rows of the table: the numbers themselves.
        unit: for each field, indices along its first axis and rows of the table, shape (k, 3 or
            4): vectors or quaternions that MuJoCo brings to unit length.
        geoms: the geoms.
    """

    numbers: Numbers
    plain: Mapping[str, tuple[Index, Index]]
    unit: Mapping[str, tuple[Index, Index]]
    geoms: Geoms


def layout(root: Element, template: mujoco.MjModel) -> Layout:
    """Match the elements of N designs with the fields of a compiled model, by name.

    Raises:
        DraftError: one has a body, joint, geom or site that the other lacks.
    """
    found = _Reader(root, template)
    try:
        found.walk(_child(root, "worldbody"), 0)
        found.couplings(root)
    except KeyError as error:
        raise _other_topology(str(error.args[0])) from None
    if len(found.geoms) != template.ngeom or found.bodies != template.nbody - 1:
        raise _other_topology(f"it has {template.nbody - 1} bodies and {template.ngeom} geoms")
    return found.layout()


def _other_topology(cause: str) -> DraftError:
    remedy = "use the model of one of these designs"
    return DraftError(f"the template has another topology: {cause}", remedy)


class _Reader:
    """Reads the elements of bodies one by one."""

    def __init__(self, root: Element, template: mujoco.MjModel) -> None:
        self.template = template
        self.numbers = Numbers()
        self.bodies = 0
        self.classes = {
            kind.attributes["class_"]: kind.children[0].attributes
            for kind in _child(root, "default").children
            if kind.tag == "default"
        }
        self.plain: dict[str, tuple[list[int], list[int]]] = {}
        self.unit: dict[str, tuple[list[int], list[list[int]]]] = {}
        self.geoms: list[tuple[int, int, int, list[int], list[int], list[int], int, bool]] = []

    def layout(self) -> Layout:
        """Layout of all elements read so far."""
        ids, bodies, types, size, pos, quat, density, massless = zip(*self.geoms, strict=True)
        geoms = Geoms(
            *(_index(x) for x in (ids, bodies, types, size, pos, quat, density)),
            massless=np.array(massless, dtype=bool),
        )
        return Layout(
            self.numbers,
            {name: (_index(to), _index(rows)) for name, (to, rows) in self.plain.items()},
            {name: (_index(to), _index(rows)) for name, (to, rows) in self.unit.items()},
            geoms,
        )

    def walk(self, element: Element, body: int) -> None:
        """Read what an element of a body holds, and the bodies in it."""
        for child in element.children:
            a = child.attributes
            if child.tag == "body":
                inner = self.template.body(a["name"]).id
                self.bodies += 1
                self.put("body_pos", inner, a.get("pos") or ZERO)
                self.put_unit("body_quat", inner, a.get("quat") or NO_TURN)
                self.walk(child, inner)
            elif child.tag == "freejoint":
                self.free(a, body)
            elif child.tag == "joint":
                self.joint(a)
            elif child.tag == "geom":
                self.geom(a, body)
            elif child.tag == "site":
                self.put("site_pos", self.template.site(a["name"]).id, a.get("pos") or ZERO)

    def put(self, name: str, at: int, values: Sequence[Value]) -> None:
        """Numbers that are a row of a field as they are."""
        to, rows = self.plain.setdefault(name, ([], []))
        to += range(at * len(values), (at + 1) * len(values))
        rows += self.numbers.places(values)

    def put_unit(self, name: str, at: int, values: Sequence[Value]) -> None:
        """Numbers that are a row of a field after they were brought to unit length."""
        to, rows = self.unit.setdefault(name, ([], []))
        to.append(at)
        rows.append(self.numbers.places(values))

    def free(self, a: Mapping[str, Any], body: int) -> None:
        """A floating base: its place is its reference position."""
        start = int(self.template.joint(a["name"]).qposadr[0])
        to, rows = self.plain["body_pos"]
        pos = rows[to.index(3 * body) :][:3]
        for name in ("qpos0", "qpos_spring"):
            field_to, field_rows = self.plain.setdefault(name, ([], []))
            field_to += range(start, start + 3)
            field_rows += pos

    def joint(self, a: Mapping[str, Any]) -> None:
        """A hinge or a slide."""
        joint = self.template.joint(a["name"])
        dof = int(joint.dofadr[0])
        self.put_unit("jnt_axis", joint.id, a["axis"])
        for name, of, at in (
            ("range", "jnt_range", joint.id),
            ("armature", "dof_armature", dof),
            ("damping", "dof_damping", dof),
            ("frictionloss", "dof_frictionloss", dof),
            ("actuatorfrcrange", "jnt_actfrcrange", joint.id),
        ):
            value = a.get(name)
            if value is not None:
                self.put(of, at, value if isinstance(value, tuple) else (value,))

    def couplings(self, root: Element) -> None:
        """Joints that follow others."""
        for section in root.children:
            for one in section.children if section.tag == "equality" else ():
                at = self.template.equality(one.attributes["name"]).id
                start = at * self.template.eq_data.shape[1]
                polynomial = one.attributes["polycoef"]
                to, rows = self.plain.setdefault("eq_data", ([], []))
                to += range(start, start + len(polynomial))
                rows += self.numbers.places(polynomial)

    def geom(self, a: Mapping[str, Any], body: int) -> None:
        """A geom with the defaults of its class."""
        a = self.classes[a["class_"]] | {key: x for key, x in a.items() if x is not None}
        size = tuple(a.get("size") or ())
        density = a.get("density")
        self.geoms.append(
            (
                self.template.geom(a["name"]).id,
                body,
                TYPES[a["type"]],
                self.numbers.places((*size, 0.0, 0.0, 0.0)[:3]),
                self.numbers.places(a.get("pos") or ZERO),
                self.numbers.places(a.get("quat") or NO_TURN),
                self.numbers.place(DENSITY if density is None else density),
                a.get("mass") is not None,
            )
        )


def _child(element: Element, tag: str) -> Element:
    return next(child for child in element.children if child.tag == tag)


def _index(values: object) -> Index:
    return np.array(values, dtype=np.intp)
