"""Fields of N compiled models of one topology from their MJCF texts.

The numbers of texts with one template are compiled by arrays as those of designs are; a text of
another form is compiled alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.model.batch import compile_fields, follows_mujoco
from draft.model.batch_compile import Compiler
from draft.model.batch_layout import layout
from draft.model.texts import Text
from draft.model.xml import PLACE, Element, parse
from draft.spec.primitives.loft import Loft, fan_faces
from draft.values import Value

# Fields in which models of one topology may differ, and which are found here.
FIELDS = (
    *("body_pos", "body_quat", "body_ipos", "body_iquat", "body_mass", "body_inertia"),
    *("jnt_pos", "jnt_axis", "jnt_range", "jnt_actfrcrange"),
    *("dof_armature", "dof_damping", "dof_frictionloss", "qpos0", "qpos_spring"),
    "eq_data",
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
    "joint": (
        "axis",
        "range",
        "armature",
        "damping",
        "frictionloss",
        "actuatorfrcrange",
        "polycoef",
    ),
    "geom": ("size", "pos", "quat", "density"),
    "site": ("pos",),
    "mesh": ("vertex", "face"),
}


def read_fields(
    texts: Sequence[Text],
    names: Sequence[str],
    load: Callable[[int], mujoco.MjModel] | None = None,
) -> tuple[mujoco.MjModel, dict[str, NDArray]]:
    """Compile N texts of one topology; those with the template of the first at once.

    Args:
        texts: MJCF of the robots, see `draft.model.texts.with_template`.
        names: names of the robots, for messages.
        load: makes the model of a robot by its number, where it has more than its text says.

    Returns:
        The model of the first, and those of FIELDS in which one differs from it, by name, shape
        (N, ...). Meshes keep their places and boxes in the first.

    Raises:
        DraftError: MuJoCo does not accept one, or it differs in more than numbers.
    """

    def compiled(row: int) -> mujoco.MjModel:
        return load(row) if load else _compiled(texts[row], names[row])

    first = compiled(0)
    fields: dict[str, NDArray] = {}
    alone = np.ones(len(texts), dtype=bool)
    rows = np.array([i for i, text in enumerate(texts) if text.template == texts[0].template])
    by_arrays = load is None and follows_mujoco()
    compiler = _compiler([texts[row] for row in rows], first) if by_arrays else None
    if compiler is not None:
        found, sound, _ = compile_fields(compiler, np.arange(len(rows)))
        alone[rows[sound]] = False
        for name in set(found).intersection(FIELDS):
            fields[name] = _repeated(first, name, len(texts))
            fields[name][rows[sound]] = found[name][sound]
    for row in np.flatnonzero(alone).tolist():
        model = compiled(row) if row else first
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


def _compiled(text: Text, name: str) -> mujoco.MjModel:
    try:
        return mujoco.MjModel.from_xml_string(str(text))
    except ValueError as error:
        cause = f"MuJoCo does not accept the model of {name}: {' '.join(str(error).split())}"
        raise DraftError(cause) from None


def _repeated(model: mujoco.MjModel, name: str, count: int) -> NDArray:
    return np.repeat(getattr(model, name)[None], count, axis=0)


def _compiler(texts: Sequence[Text], template: mujoco.MjModel) -> Compiler | None:
    """Compiler of texts with one template; None if it is not of the form that Draft writes."""
    try:
        root = parse(texts[0].template)
        columns = np.ascontiguousarray(np.stack([text.numbers for text in texts], axis=1))
        _fill(root, (float(x[0]) if (x == x[0]).all() else x for x in columns))
        trunk = _trunk(root)
        return None if trunk is None else Compiler(layout(root, template), template, trunk)
    except (ValueError, LookupError, DraftError):
        return None


def _fill(root: Element, columns: Iterator[Value]) -> None:
    """Turn attributes from words into numbers; one that differs is an array of one per text.

    Raises:
        ValueError: more than the numbers of bodies differs.
    """
    for element, name in _attributes(root):
        words = element.attributes[name].split(" ")
        may_differ = name in _NUMBERS.get(element.tag, ())
        if PLACE in words and not may_differ:
            raise ValueError(f"{name} of {element.tag} differs")
        if may_differ or name == "mass":
            numbers = tuple(next(columns) if word == PLACE else float(word) for word in words)
            element.attributes[name] = numbers[0] if name in ("density", "mass") else numbers


def _trunk(root: Element) -> Loft | None:
    """Solid of the trunk's mesh; None if it is no loft."""
    (mesh,) = next(child for child in root.children if child.tag == "asset").children
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
