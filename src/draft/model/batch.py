"""N compiled models of one topology: a template, and arrays of the fields in which they differ.

Compiling one design writes text that MuJoCo reads. Designs of one topology give models that differ
in numbers only, and those numbers follow from the same elements by arrays. `docs/python.md` says
what such a batch has and lacks.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.design.findings import refusal
from draft.errors import DraftError, counted
from draft.laws.structure import MIDDLE
from draft.model import mjcf
from draft.model.batch_compile import Compiler, Patch
from draft.model.batch_layout import Index, layout
from draft.model.model import TOLERANCE
from draft.spec.primitives.root import TWISTED, twists
from draft.values import Array

# Designs compiled at a time, so that their numbers stay in the cache.
_BLOCK = 512


@dataclass(frozen=True, eq=False)
class ModelBatch:
    """Compiled models of designs of one topology.

    Attributes:
        design: the N designs.
        rows: which of them the models are of, shape (M,).
        template: the model of one of them; each other one is this with its own numbers.
        fields: fields of MjModel in which they differ, by name, shape (M, ...).
        outside: reason why one of the designs has no model here, by its row.
    """

    design: Design
    rows: Index
    template: mujoco.MjModel
    fields: Mapping[str, NDArray]
    outside: Mapping[int, str]

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def nbytes(self) -> int:
        """Memory that the fields take [bytes]."""
        return sum(values.nbytes for values in self.fields.values())

    def field(self, name: str) -> NDArray:
        """A field of all models, shape (M, ...); read-only where they share it.

        Raises:
            AttributeError: MjModel has no such field.
        """
        if name in self.fields:
            return self.fields[name]
        own = getattr(self.template, name)
        return np.broadcast_to(own, (len(self), *own.shape))

    def write(
        self, place: int, model: mujoco.MjModel, ids: Mapping[str, Index] | None = None
    ) -> None:
        """Give a model the numbers of one design; derived ones wait for `mujoco.mj_setConst`.

        Args:
            place: of the design among the M.
            model: the template, a copy of it, or a model that contains the robot.
            ids: for the latter, from `indices(batch.template, model)`.
        """
        for name, values in self.fields.items():
            if ids is None:
                getattr(model, name)[:] = values[place]
            else:
                own, there = ids[f"own {kind_of(name)}"], ids[kind_of(name)]
                getattr(model, name)[there] = values[place, own]

    def model(self, place: int) -> mujoco.MjModel:
        """The model of one of the M designs, as if it had been compiled alone."""
        model = copy.copy(self.template)
        self.write(place, model)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        model.stat.meaninertia = model.dof_M0.mean()  # MuJoCo 4 leaves it as it was.
        return model


def build_batch(
    design: Design,
    rows: Index | None = None,
    template: mujoco.MjModel | None = None,
    refused: bool = False,
) -> ModelBatch:
    """Compile N designs of one topology.

    Args:
        design: N designs.
        rows: which of them, increasing; all where None.
        template: model of a design of the same spec; of the first that compiles where None.
        refused: whether to compile those that the filter refuses as well.

    Raises:
        DraftError: this is one design, none of them compiles, or the template has another
            topology.
    """
    if design.count is None:
        raise DraftError("this is one design", "call build() for it")
    if not follows_mujoco():
        cause = f"batches follow the compilers of MuJoCo 3 and 4, and this is {mujoco.__version__}"
        raise DraftError(cause, "build the designs one by one: design[i].build()")
    chosen = np.arange(design.count) if rows is None else np.asarray(rows, dtype=np.intp)
    outside = {} if refused else _refused(design, chosen)
    outside |= dict.fromkeys(_other_topology(design, chosen), "its topology is not the others'")
    outside |= {row: TWISTED for row in _twisted(design, chosen) if row not in outside}
    if template is None:
        template = _template(design, chosen, outside)
    good = chosen[~np.isin(chosen, list(outside))]
    with np.errstate(all="ignore"):
        elements = mjcf.robot_element(design)
    loft = None if design.lofted is None else design.lofted.loft
    compiler = Compiler(layout(elements, template), template, loft)
    fields, sound, mass = compile_fields(compiler, good)
    sound &= _weights_agree(design, good, mass[1:])
    if not sound.all():
        outside |= dict.fromkeys(good[~sound].tolist(), "MuJoCo may not accept it")
        good, fields = good[sound], {name: values[sound] for name, values in fields.items()}
    return ModelBatch(design, good, template, fields, outside)


def follows_mujoco() -> bool:
    """Whether the installed MuJoCo compiles as these batches do."""
    return mujoco.__version__.startswith(("3.", "4."))


def compile_fields(
    compiler: Compiler, rows: Index
) -> tuple[dict[str, NDArray], NDArray[np.bool_], Array]:
    """Compile some of the designs of a compiler.

    Returns:
        Fields in which they differ from the template, by name, shape (M, ...); whether MuJoCo is
        sure to accept each, shape (M,); and masses of the bodies [kg], shape (bodies, M).
    """
    template, count = compiler.template, len(rows)
    fields: dict[str, NDArray] = {}
    sound, mass = np.ones(count, dtype=bool), np.empty((template.nbody, count))
    for start in range(0, count, _BLOCK):
        block = slice(start, start + _BLOCK)
        found = compiler.rows(rows[block])
        sound[block], mass[:, block] = found.sound, found.mass
        for patch in found.patches:
            _apply(patch, fields, template, block, count)
    return fields, sound, mass


def _apply(
    patch: Patch, fields: dict[str, NDArray], template: mujoco.MjModel, block: slice, count: int
) -> None:
    """Write a part of a field; a field appears with the first number that is not the template's."""
    name, values = patch.name, patch.values
    own = getattr(template, name)
    if name not in fields:
        part = own.ravel()[patch.ids] if patch.flat else own[patch.ids]
        part = part[:, patch.columns] if part.ndim > 1 else part
        if (values == part[..., None]).all():
            return
        fields[name] = np.empty((count, *own.shape), own.dtype)
        fields[name][:] = own
    to = fields[name][block]
    to = to.reshape(len(to), -1) if patch.flat else to
    values = np.moveaxis(values, -1, 0)
    if to.ndim == 3:
        to[:, patch.ids, patch.columns] = values
    else:
        to[:, patch.ids] = values


_KINDS = {
    "body": "body",
    "jnt": "joint",
    "dof": "dof",
    "qpos0": "position",
    "qpos": "position",
    "geom": "geom",
    "site": "site",
    "bvh": "box",
    "eq": "equality",
}


def kind_of(field: str) -> str:
    """Kind of element along the first axis of a field of MjModel."""
    return _KINDS[field.partition("_")[0]]


def indices(robot: mujoco.MjModel, model: mujoco.MjModel, prefix: str = "") -> dict[str, Index]:
    """Rows of a robot's fields in a model that contains it, by name.

    Args:
        robot: the model of the robot alone.
        model: a model with the robot in it, such as a scene.
        prefix: what stands before its names in `model`.

    Returns:
        For "body", "joint", "dof", "position", "geom", "site", "box" and "equality" the rows in
        `model`, and under "own body" and so on those in `robot` that they belong to.

    Raises:
        KeyError: the model lacks a part of the robot.
    """
    found: dict[str, list[int]] = {kind: [] for kind in _KINDS.values()}
    own: dict[str, list[int]] = {kind: [] for kind in _KINDS.values()}

    def match(kind: str, here: int, there: int, count: int) -> None:
        own[kind] += range(here, here + count)
        found[kind] += range(there, there + count)

    for i in range(1, robot.nbody):
        j = model.body(prefix + robot.body(i).name).id
        match("body", i, j, 1)
        if robot.body_bvhnum[i] == model.body_bvhnum[j]:
            nodes = int(robot.body_bvhnum[i])
            match("box", int(robot.body_bvhadr[i]), int(model.body_bvhadr[j]), nodes)
    for i in range(robot.njnt):
        here, there = robot.joint(i), model.joint(prefix + robot.joint(i).name)
        match("joint", i, there.id, 1)
        match("dof", int(here.dofadr[0]), int(there.dofadr[0]), here.damping.size)
        match("position", int(here.qposadr[0]), int(there.qposadr[0]), here.qpos0.size)
    for i in range(robot.ngeom):
        match("geom", i, model.geom(prefix + robot.geom(i).name).id, 1)
    for i in range(robot.nsite):
        match("site", i, model.site(prefix + robot.site(i).name).id, 1)
    for i in range(robot.neq):
        match("equality", i, model.equality(prefix + robot.equality(i).name).id, 1)
    both = found | {f"own {kind}": ids for kind, ids in own.items()}
    return {kind: np.array(ids, dtype=np.intp) for kind, ids in both.items()}


def _refused(design: Design, rows: Index) -> dict[int, str]:
    accepted = np.broadcast_to(np.asarray(design.accepted), (design.count or 1,))
    return {int(row): refusal(design.findings, int(row)) for row in rows[~accepted[rows]]}


def _other_topology(design: Design, rows: Index) -> list[int]:
    """Designs in which a member is one rod and not two halves, as it is in others."""
    odd = np.zeros(design.count or 1, dtype=bool)
    for body in design.bodies:
        if body.link.member is not None and isinstance(body.member_centre, np.ndarray):
            middle = body.member_centre == MIDDLE
            if not middle.all():
                odd |= middle
    return rows[odd[rows]].tolist()


def _twisted(design: Design, rows: Index) -> list[int]:
    """Designs whose trunk is lofted to a polygon that is counted from another corner."""
    root, trunk = design.spec.root, design.lofted
    if root is None or trunk is None or (vertices := trunk.loft.vertices).ndim == 2:
        return []
    sections = vertices.reshape(trunk.loft.sections, -1, 3, vertices.shape[2])[..., rows]
    twisted = np.zeros(len(rows), dtype=bool)
    for number, written in enumerate(root.sections[1:], start=1):
        if written.polygon is not None:
            twisted |= twists(sections[number - 1], sections[number])
    return rows[twisted].tolist()


def _template(design: Design, rows: Index, outside: dict[int, str]) -> mujoco.MjModel:
    """Model of the first design that compiles alone; those before it are outside."""
    for row in map(int, rows):
        if row in outside:
            continue
        try:
            return design[row].build().mujoco
        except DraftError as error:
            outside[row] = " ".join(str(error).split())
    reason = next(iter(outside.values()), "there is none")
    raise DraftError(f"none of {counted(len(rows), 'design')} has a model: {reason}")


def _weights_agree(design: Design, rows: Index, mass: Array) -> NDArray[np.bool_]:
    """Whether the bodies weigh what the design says."""
    count = design.count or 1
    expected = [np.broadcast_to(x, (count,))[rows] for x in design.body_masses().values()]
    wrong = abs(mass - expected) > TOLERANCE * np.maximum(expected, 1e-9)
    return np.asarray(~wrong.any(axis=0))
