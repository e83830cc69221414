"""Fields of N compiled models of one topology from their MJCF texts.

Texts that `draft.model.mjcf` writes for designs of one topology differ in numbers only. The numbers
are compiled by arrays as those of designs are; a text of another form is compiled alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import chain

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.model.batch import compile_fields, follows_mujoco
from draft.model.batch_compile import Compiler
from draft.model.batch_layout import layout
from draft.model.xml import Element, parse
from draft.spec.primitives.loft import Loft, fan_faces
from draft.values import Array

# Fields in which models of one topology may differ, and which are found here.
FIELDS = (
    *("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"),
    *("jnt_pos", "jnt_axis", "jnt_range", "jnt_actfrcrange"),
    *("dof_armature", "dof_damping", "dof_frictionloss", "qpos0", "qpos_spring"),
    *("geom_size", "geom_pos", "geom_quat", "geom_rbound", "geom_aabb", "site_pos", "site_quat"),
)
# Those that follow from them by `mj_setConst`.
DERIVED = ("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0", "actuator_acc0")
# Fields that may differ without effect on dynamics: meshes are only drawn; trees of boxes and equal
# frames are shortcuts; names are compared one by one; lengths of degrees of freedom are for
# sleeping bodies.
_UNUSED = (
    *("mesh_", "bvh_", "key_", "name"),
    *("body_sameframe", "geom_sameframe", "site_sameframe", "dof_length"),
)
# Attributes that are numbers, and may differ.
_NUMBERS = {
    "body": ("pos", "quat"),
    "joint": ("axis", "range", "armature", "damping", "frictionloss", "actuatorfrcrange"),
    "geom": ("size", "pos", "quat", "density"),
    "site": ("pos",),
    "mesh": ("vertex", "face"),
}
_BLOCK = 256  # Texts taken apart at a time.
_PLACE = "%.10g"  # What a template has in place of a number.


def read_fields(
    texts: Sequence[str], names: Sequence[str]
) -> tuple[mujoco.MjModel, dict[str, NDArray]]:
    """Compile N texts of one topology.

    Args:
        texts: MJCF of the robots.
        names: names of the robots, for messages.

    Returns:
        The model of the first, and those of FIELDS in which one differs from it, by name, shape
        (N, ...). Meshes keep their places and boxes in the first.

    Raises:
        DraftError: MuJoCo does not accept one, or it differs in more than numbers.
    """
    first = _compiled(texts[0], names[0])
    fields: dict[str, NDArray] = {}
    alone = np.ones(len(texts), dtype=bool)
    if follows_mujoco() and (read := _read(texts, first)) is not None:
        rows, compiler = read
        found, sound, _ = compile_fields(compiler, np.arange(len(rows)))
        alone[rows[sound]] = False
        for name in set(found).intersection(FIELDS):
            fields[name] = _repeated(first, name, len(texts))
            fields[name][rows[sound]] = found[name][sound]
    for row in np.flatnonzero(alone).tolist():
        model = _compiled(texts[row], names[row]) if row else first
        differing = differences(first, model)
        if others := differing - {*FIELDS, *DERIVED}:
            cause = f"{names[row]} differs from {names[0]} in {', '.join(sorted(others))}"
            raise DraftError(cause, "compile it alone")
        for name in differing.intersection(FIELDS):
            if name not in fields:
                fields[name] = _repeated(first, name, len(texts))
            solid = slice(None)
            if name.startswith("geom_"):
                solid = first.geom_type != mujoco.mjtGeom.mjGEOM_MESH
            fields[name][row, solid] = getattr(model, name)[solid]
    return first, fields


def packed(texts: Sequence[str]) -> tuple[str, Array] | None:
    """Template of N texts of one topology, and the numbers in which they differ, shape (N, count).

    None if they differ in more than numbers.
    """
    try:
        template, numbers = _Texts(texts).packed()
        return (template, numbers) if unpacked(template, numbers) == list(texts) else None
    except ValueError:
        return None


def unpacked(template: str, numbers: Array) -> list[str]:
    """Texts of a template and of numbers, shape (N, count), as `packed` gives them.

    Raises:
        ValueError: there are more or fewer numbers than places for them.
    """
    start, *rest = template.split(_PLACE)
    form = "".join(["%s", *("%.10g%s" for _ in rest)])
    if numbers.ndim != 2 or numbers.shape[1] != len(rest):
        raise ValueError(f"{len(rest)} numbers have a place, not those of shape {numbers.shape}")
    rows = numbers.tolist()
    return [form % (start, *chain.from_iterable(zip(row, rest, strict=True))) for row in rows]


def differences(first: mujoco.MjModel, other: mujoco.MjModel) -> set[str]:
    """Names of the arrays that differ between two models, except those without effect."""
    names = {
        name
        for name in arrays()
        if not name.startswith(_UNUSED)
        and not np.array_equal(getattr(first, name), getattr(other, name))
    }
    return names | ({"names"} if _names(first) != _names(other) else set())


@cache
def arrays() -> tuple[str, ...]:
    """Names of all arrays of an MjModel."""
    empty = mujoco.MjModel.from_xml_string("<mujoco/>")
    public = (name for name in dir(empty) if not name.startswith("_"))
    return tuple(name for name in public if isinstance(getattr(empty, name), np.ndarray))


def _names(model: mujoco.MjModel) -> list[list[str]]:
    """Names of the elements of each kind."""
    kinds = {"body": model.nbody, "joint": model.njnt, "geom": model.ngeom}
    kinds |= {"site": model.nsite, "actuator": model.nu}
    return [[getattr(model, kind)(i).name for i in range(n)] for kind, n in kinds.items()]


def _compiled(text: str, name: str) -> mujoco.MjModel:
    try:
        return mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        cause = f"MuJoCo does not accept the model of {name}: {' '.join(str(error).split())}"
        raise DraftError(cause) from None


def _repeated(model: mujoco.MjModel, name: str, count: int) -> NDArray:
    return np.repeat(getattr(model, name)[None], count, axis=0)


def _read(
    texts: Sequence[str], template: mujoco.MjModel
) -> tuple[NDArray[np.intp], Compiler] | None:
    """Rows of the texts that differ from the first in numbers only, and their compiler.

    None if the first is not of the form that Draft writes.
    """
    try:
        read = _Texts(texts)
        root, trunk = read.element()
        compiler = None if trunk is None else Compiler(layout(root, template), template, trunk)
    except (ValueError, LookupError, DraftError):
        return None
    return None if compiler is None else (np.flatnonzero(read.regular), compiler)


class _Texts:
    """Texts taken apart into what all share and their numbers.

    Attributes:
        regular: which texts differ from the first in numbers only, shape (N,).
        numbers: numbers of each attribute that differs, shape (N, count).
    """

    def __init__(self, texts: Sequence[str]) -> None:
        self.regular = np.ones(len(texts), dtype=bool)
        self.numbers: dict[int, Array] = {}
        self.root = parse(texts[0])
        # An attribute's value is between every second pair of quotation marks.
        self.slots = list(_attributes(self.root))
        parts = texts[0].split('"')
        self.may_differ = [name in _NUMBERS.get(e.tag, ()) for e, name in self.slots]
        self.shared, self.first = parts[::2], parts[1::2]
        for start in range(0, len(texts), _BLOCK):
            self._read(texts[start : start + _BLOCK], start)

    def _read(self, texts: Sequence[str], start: int) -> None:
        """Read a block of texts."""
        values: list[list[str]] = []
        for row, text in enumerate(texts, start):
            parts = text.split('"')
            if parts[::2] == self.shared:
                values.append(parts[1::2])
            else:
                self.regular[row] = False
        kept = np.flatnonzero(self.regular[start : start + len(texts)]) + start
        columns = list(zip(*values, strict=True))
        wrong: set[int] = set()
        for slot, column in enumerate(columns):
            if column.count(self.first[slot]) == len(column):
                continue
            if self.may_differ[slot]:
                self._keep(slot, column, kept, wrong)
            else:
                wrong.update(
                    int(row)
                    for row, value in zip(kept, column, strict=True)
                    if value != self.first[slot]
                )
        self.regular[list(wrong)] = False

    def _keep(
        self, slot: int, column: Sequence[str], rows: NDArray[np.intp], wrong: set[int]
    ) -> None:
        """Keep the numbers of an attribute that differ."""
        own = self.first[slot]
        spaces = own.count(" ")
        odd = [i for i, value in enumerate(column) if value.count(" ") != spaces]
        if odd:
            wrong.update(int(rows[i]) for i in odd)
            column = [own if value.count(" ") != spaces else value for value in column]
        if slot not in self.numbers:
            self.numbers[slot] = np.tile(_floats(own), (len(self.regular), 1))
        self.numbers[slot][rows] = _floats(" ".join(column)).reshape(len(column), -1)

    def packed(self) -> tuple[str, Array]:
        """Text with a place for each number that differs, and these numbers."""
        values = list(self.first)
        for slot in self.numbers:
            values[slot] = " ".join([_PLACE] * self.numbers[slot].shape[1])
        pieces = [piece for pair in zip(self.shared, values, strict=False) for piece in pair]
        columns = [self.numbers[slot] for slot in sorted(self.numbers)]
        numbers = np.concatenate([np.empty((len(self.regular), 0)), *columns], axis=1)
        return '"'.join([*pieces, self.shared[-1]]), numbers

    def element(self) -> tuple[Element, Loft | None]:
        """The element of the regular texts, and the solid of the trunk's mesh if it is a loft.

        Every number that differs is an array of one per text.
        """
        for slot, (element, name) in enumerate(self.slots):
            if name != "mass" and name not in _NUMBERS.get(element.tag, ()):
                continue
            if slot in self.numbers:
                columns = np.ascontiguousarray(self.numbers[slot][self.regular].T)
                numbers = tuple(float(x[0]) if (x == x[0]).all() else x for x in columns)
            else:
                numbers = tuple(_floats(self.first[slot]).tolist())
            element.attributes[name] = numbers[0] if name in ("density", "mass") else numbers
        return self.root, self._trunk()

    def _trunk(self) -> Loft | None:
        (mesh,) = next(child for child in self.root.children if child.tag == "asset").children
        vertex, face = mesh.attributes["vertex"], mesh.attributes["face"]
        many = np.broadcast_arrays(*vertex)
        vertices = np.stack(many).reshape(-1, 3, *many[0].shape)
        if any(isinstance(x, np.ndarray) for x in face):
            face = [x[0] if isinstance(x, np.ndarray) else x for x in face]
        faces = np.array(face, dtype=np.intp).reshape(-1, 3)
        # The first triangle of the sides is (0, 1, corners + 1).
        corners = int(faces[0, 2]) - 1
        sections = len(vertices) // max(corners, 1)
        if corners < 3 or sections * corners != len(vertices):
            return None
        sides = 2 * corners * (sections - 1)
        if not np.array_equal(faces[:sides], fan_faces(sections, corners)[:sides]):
            return None
        return Loft(vertices, sections, corners, convex=False)


def _attributes(element: Element) -> Iterator[tuple[Element, str]]:
    """Elements and names of all attributes, as a text has them."""
    for name in element.attributes:
        yield element, name
    for child in element.children:
        yield from _attributes(child)


def _floats(text: str) -> Array:
    return np.array([float(word) for word in text.split()])
