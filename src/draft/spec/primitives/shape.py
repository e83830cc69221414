"""Parts of one's own in place of drawn solids: a mesh or a STEP file, with its mass."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
from pydantic import BeforeValidator, WithJsonSchema, model_validator

from draft import geometry as g
from draft.errors import Problem, ResolveError
from draft.geometry import Rotation, Vector
from draft.spec.evaluate import Evaluator
from draft.spec.field_types import Model, Number, NumberVector, broken_rule
from draft.spec.primitives.base import HIDDEN, Geom, Written
from draft.spec.primitives.mesh import Mesh
from draft.values import Array, Value, is_array, some

_PART = re.compile(
    r"([A-Za-z0-9_][A-Za-z0-9_.-]*/)*[A-Za-z0-9_][A-Za-z0-9_-]*\.(stl|obj|step|stp)", re.IGNORECASE
)
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
# A part that is larger or smaller than what it replaces by more than this has another unit.
_OTHER_UNIT = 8.0
_THINNEST = 1e-12  # of the box of an inertia, as a share of its squared diagonal


def _part_file(value: object) -> str:
    if not isinstance(value, str) or not _PART.fullmatch(value):
        found = repr(value) if isinstance(value, str) else "this"
        raise broken_rule(
            f"{found} is no path of a part in the robot's folder",
            "copy the .stl, .obj, .step or .stp file there, under a name of letters, digits, _ "
            "and -, and write 'file: parts/NAME.stl'",
        )
    return value


PartFile = Annotated[
    str,
    BeforeValidator(_part_file),
    WithJsonSchema(
        {"type": "string", "pattern": r"\.([sS][tT][lL]|[oO][bB][jJ]|[sS][tT][eE]?[pP])$"}
    ),
]


class Shape(Model):
    """A part of your own in place of what Draft draws.

    It takes its place in pictures and exports, in mass and inertia, and, if it `collides`, in
    contacts. The design filter keeps to Draft's solid, which is the space that the laws reserve.

    The coordinates in the file are those of the link: its origin is on the axis of its joint, and
    its axes are those of its parent with all joints at zero, turned by `rpy`. Those of an actuator
    begin on its output axis, in the middle of its length along it, with z along its shaft and x
    along `long`. Copies on the other side of a mirror have the mirrored part; an actuator is turned
    and not mirrored.
    """

    file: PartFile
    """STL, OBJ or STEP file in the robot's folder, such as `parts/thigh.stl`: a closed mesh, or one
    or more solids. STEP needs the extra `cad`; its mass properties are exact, and its drawing is
    within 0.1 % of its diagonal."""
    unit: Literal["m", "cm", "mm", "in"] | None = None
    """Unit of the numbers of a mesh. Default: m. A STEP file states its own."""
    density: Number | None = None
    """Mass over volume [kg/m3], which gives the mass. Default: the mass remains that of the laws,
    and is spread over the part."""
    collides: bool = False
    """Whether its convex hull collides with the floor and with objects. Default: Draft's solid
    does."""

    @model_validator(mode="before")
    @classmethod
    def _more_than_a_file(cls, data: object) -> object:
        if isinstance(data, str):
            raise broken_rule("expected a mapping, found a text", f"write '{{file: {data}}}'")
        return data

    @model_validator(mode="after")
    def _step_states_its_unit(self) -> Self:
        if self.unit is not None and is_step(self.file):
            raise broken_rule("a 'unit', and a STEP file states its own", "remove 'unit'")
        return self


class LinkShape(Shape):
    """The same with its mass, for a link or for the trunk.

    It takes the place of the member; what is at the tip stays. The mass of a trunk's part is that
    of all that is in the trunk, battery and electronics too.
    """

    mass: Number | None = None
    """Mass [kg]. State this, `density`, or neither."""
    com: NumberVector | None = None
    """Centre of mass in the frame of the link [m], with `mass` and `moments`. Default: that of a
    uniform solid."""
    moments: NumberVector | None = None
    """Moments of inertia Ixx, Iyy and Izz about the centre of mass [kg m2], axes as of the link.
    Default: those of a uniform solid."""
    products: NumberVector | None = None
    """Products of inertia Ixy, Ixz and Iyz, with the signs of URDF: -sum(m x y) and so on [kg m2].
    Default: 0."""

    @model_validator(mode="after")
    def _one_mass(self) -> Self:
        if self.mass is not None and self.density is not None:
            remedy = "state one of them, 'mass: ...' [kg] or 'density: ...' [kg/m3]"
            raise broken_rule("a shape with both 'mass' and 'density'", remedy)
        stated = [self.mass, self.com, self.moments]
        if (self.com or self.moments or self.products) and None in stated:
            remedy = "state 'mass', 'com' and 'moments', and 'products' unless they are 0"
            raise broken_rule("a shape with a part of its inertia alone", remedy)
        return self

    @property
    def weighs(self) -> bool:
        """Whether it states its mass."""
        return self.mass is not None or self.density is not None


def is_part(file: str) -> bool:
    """Whether a name can be that of a part."""
    return _PART.fullmatch(file) is not None


def is_step(file: str) -> bool:
    """Whether a file is STEP by its name."""
    return file.lower().endswith((".step", ".stp"))


class ShapePart(NamedTuple):
    """A part in the frame of its link or actuator.

    Its inertia is that of a uniform box that is not drawn, so that every engine has the numbers of
    the exact solid, or the stated ones, whatever its triangles are.

    Attributes:
        mesh: the mesh.
        mass: its mass [kg]; None where the laws give it.
        com: its centre of mass [m].
        box: full sizes of the box that has its inertia [m].
        axes: frame of that box in the frame of the part.
        collides: whether the part collides, in place of the solid that it replaces.
    """

    mesh: Mesh
    mass: Value | None
    com: Vector
    box: Vector
    axes: Rotation
    collides: bool

    @classmethod
    def read(cls, written: Written[Any], mesh: Mesh, name: str, r: Evaluator) -> ShapePart:
        """Evaluate its mass, and its inertia if that is stated.

        Args:
            written: the fields of the file.
            mesh: its mesh.
            name: of its link or actuator class, for messages.
            r: evaluator of expressions.

        Raises:
            ResolveError: a number is invalid, or no body has such moments.
        """
        mass: Value | None = None
        if (stated := written.optional("mass")) is not None:
            mass = r.positive(stated, f"mass of the shape of {name}")
        elif (density := written.optional("density")) is not None:
            mass = r.positive(density, f"density of the shape of {name}") * mesh.volume
        if mass is None or "moments" not in written.numbers:
            x, y, z = (float(c) for c in mesh.com)
            box, axes = _box(mesh.inertia / mesh.volume)
            return cls(mesh, mass, (x, y, z), box, axes, written.fields.collides)
        xx, yy, zz = r.vector(written.triple("moments"))
        xy, xz, yz = g.ZERO
        if "products" in written.numbers:
            xy, xz, yz = r.vector(written.triple("products"))
        rows = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
        each = np.broadcast_arrays(*(x / mass for row in rows for x in row))
        box, axes = _box(np.array(each, dtype=float).reshape(3, 3, *each[0].shape))
        least = np.minimum(np.minimum(box[0], box[1]), box[2])
        r.require(
            least > 0 if is_array(least) else bool(least > 0),
            written.triple("moments")[0],
            f"Ixx of the shape of {name}",
            xx,
            "must belong to a body: each principal moment is below the sum of the other two",
        )
        com = r.vector(written.triple("com"))
        return cls(mesh, mass, com, box, axes, written.fields.collides)

    def mirrored(self, signs: Vector) -> ShapePart:
        """Return its reflection: the mirrored mesh, with its centre and its inertia."""
        return self._replace(
            mesh=self.mesh.mirrored(signs),
            com=g.reflect(self.com, signs),
            axes=g.mirrored(self.axes, signs),
        )

    def inertia(self, mass: Value) -> Array:
        """Inertia about its centre of mass, axes of the part [kg m2], shape (3, 3)."""
        x, y, z = (np.square(edge) for edge in self.box)
        turn = np.eye(3) if self.axes is None else np.array(self.axes, dtype=float)
        return turn @ np.diag([y + z, x + z, x + y]) @ turn.T * (mass / 12)

    def geoms(self, drawn: Geom, at: Vector = g.ZERO, turn: Rotation = None) -> Iterator[Geom]:
        """Geoms of the part in place of a solid: its mesh, its inertia, and what collides.

        What collides has the name of the solid.

        Args:
            drawn: the solid, with the mass.
            at: origin of the part in the frame of the body [m].
            turn: frame of the part in that of the body.
        """
        suffix = drawn.suffix if self.collides else f"{drawn.suffix}_shape"
        yield Geom(suffix, drawn.kind, "mesh", at, (), None, g.ZERO, self.collides, turn, self.mesh)
        yield Geom(
            f"{drawn.suffix}_inertia",
            HIDDEN,
            "box",
            g.add(at, g.rotate(turn, self.com)),
            self.box,
            drawn.mass,
            collides=False,
            rotation=g.compose(turn, self.axes),
        )
        if not self.collides:
            yield drawn._replace(kind=HIDDEN, mass=None)

    def check_size(self, written: Written[Any], replaced: Value, what: str, r: Evaluator) -> None:
        """Check that it has about the size of what it replaces.

        Args:
            written: the fields of the file.
            replaced: longest edge of what it replaces [m].
            what: what that is.
            r: evaluator that marks designs of many.

        Raises:
            ResolveError: it is far larger or smaller, as with another unit.
        """
        own = float(self.mesh.size.max())
        fold = own / replaced
        wrong = (fold > _OTHER_UNIT) | (fold < 1 / _OTHER_UNIT)
        if is_array(wrong):
            r.mark(np.asarray(wrong))
        elif wrong:
            given = written.fields.unit or "m"
            off = {unit: abs(np.log(fold * scale / UNITS[given])) for unit, scale in UNITS.items()}
            unit = min(off, key=lambda one: off[one])
            remedy = "export it in its own size, or correct the design"
            if unit != given and not is_step(self.mesh.file) and off[unit] < np.log(_OTHER_UNIT):
                remedy = f"state 'unit: {unit}', or export it in {given}"
            raise ResolveError(
                Problem(
                    f"'{self.mesh.file}' is {own:.4g} m long, and {what} that it replaces "
                    f"{replaced:.4g} m",
                    written.places["unit" if written.fields.unit else "file"],
                    remedy,
                )
            )


def _box(inertia: Any) -> tuple[Vector, Rotation]:
    """Full sizes [m] and frame of the uniform box of an inertia per mass [m2], (3, 3) or (3, 3, N).

    A size whose square is negative, as no body has it, is 0.
    """
    whole = np.moveaxis(inertia, (0, 1), (-2, -1))
    off = whole - whole * np.eye(3)
    moments, frame = np.linalg.eigh(whole)
    if not some(abs(off) > 1e-12 * np.trace(whole, axis1=-2, axis2=-1)[..., None, None]):
        # Along the axes of the part, where the order of the moments turns nothing.
        moments, frame = np.diagonal(whole, axis1=-2, axis2=-1), np.eye(3)
    frame = frame * np.where(np.linalg.det(frame) < 0, -1.0, 1.0)[..., None, None]
    square = 6.0 * (moments.sum(axis=-1, keepdims=True) - 2.0 * moments)
    least = _THINNEST * abs(square).max(axis=-1, keepdims=True)
    x, y, z = np.moveaxis(np.sqrt(np.where(square > least, square, 0.0)), -1, 0)
    if (frame == np.eye(3)).all():
        return (_plain(x), _plain(y), _plain(z)), None
    rows = [[_plain(frame[..., i, j]) for j in range(3)] for i in range(3)]
    a, b, c = ((row[0], row[1], row[2]) for row in rows)
    return (_plain(x), _plain(y), _plain(z)), (a, b, c)


def _plain(value: Any) -> Value:
    return value if np.ndim(value) else float(value)
