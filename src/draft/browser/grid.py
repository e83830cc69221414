"""Bodies under sliders: a design compiled over a grid of its numbers, and what lies between.

A page has no compiler of Draft. It holds the numbers of bodies at the nodes of a grid, and
interpolates them linearly along each axis. The nodes are as many as keep bodies between them
within `BARS`. Inertias are full tensors in the frames of the bodies, since principal axes change
places from node to node; likewise vertices of the trunk, which are only drawn, are in the frame of
its body.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.browser.robots import Driven, body_numbers, driven, network_numbers, said
from draft.design import Design
from draft.errors import DraftError, quoted
from draft.explore.sensitivity import stated_numbers
from draft.learn.policy.reduced import AnyPolicy
from draft.learn.policy.validity import Fit
from draft.model import Model
from draft.model.batch import ModelBatch, build_batch
from draft.model.batch_text import FIELDS
from draft.model.model import preview
from draft.model.principal import apply, matrices, turned
from draft.values import Array
from draft.variation.axes import Axis, Vary, parse, unit_of

MOST_SLIDERS = 5
# Largest errors between nodes: of masses and of inertias, as shares; of lengths [m].
BARS = {"mass": 0.005, "inertia": 0.02, "length": 1e-4}
_AIM = 0.8  # Share of the bars that halfway between two nodes may reach, to begin with.
_MOST_NODES = 4096
_ROUNDS = 16
_FACTORS = re.compile(r"\* *(\d*\.?\d+) *: *\* *(\d*\.?\d+)")
_KINDS = {
    **dict.fromkeys(("body_pos", "body_ipos", "geom_pos", "geom_size"), "length"),
    **dict.fromkeys(("site_pos", "mesh_vert", "qpos0"), "length"),
    **dict.fromkeys(("body_tensor", "dof_armature"), "inertia"),
}
_TENSOR = "body_tensor"  # xx, yy, zz, xy, xz, yz of each body, in its own frame [kg m2].
_ENTRIES = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
_COMPRESSED = 0.02  # Share of the bars that the compression of the nodes may cost.
_OTHER = 1e-4  # Precision of other numbers, as a share of their size.


@dataclass(frozen=True)
class Grid:
    """Bodies of a design over a grid.

    Attributes:
        by: policy of the design itself, and then of the nodes.
        plain: what the page reads: sliders, columns, what is said of each node, errors.
        numbers: means of the columns, their components, and each node's coefficients in these, in
            one row, shape (n,).
    """

    by: Driven
    plain: dict[str, Any]
    numbers: NDArray[np.float32]


def grid(model: Model, vary: Vary, skill: str, policies: Sequence[AnyPolicy]) -> Grid:
    """Compile a design over ranges of its numbers.

    Args:
        model: the design's model; its other numbers stay as they are.
        vary: ranges of up to 5 numbers, see `draft.variation.axes.parse`; a word such as
            "thigh_length=*0.8:*1.2" is about the design's own number.
        skill: what the policy can do, see `draft.browser.robots.driven`.
        policies: see there.

    Raises:
        DraftError: a range cannot be used, a body of the grid has no model, or no grid of a page's
            size keeps to the errors of `BARS`.
    """
    design = model.design
    axes = parse(design.spec, _own_ranges(design, vary))
    _check(axes)
    space = _Space(model, axes)
    nodes, table, errors = _refined(space)
    names, values, steps = list(table.names), table.values, table.steps
    many = space.designs(nodes)
    models = [preview(many[i]) for i in range(len(values))]
    by = driven([model, *models], skill, policies)
    if by.fits:
        more, extra = _of_policies(by.fits[1:], models)
        names += more
        values = np.hstack((values, extra))
        steps = np.concatenate((steps, _OTHER * np.maximum(np.abs(extra).max(axis=0), 1e-3)))
    moving = np.flatnonzero((values != values[0]).any(axis=0))
    mean, parts, shares = _compressed(values[:, moving], steps[moving] * _COMPRESSED)
    own = stated_numbers(design)
    plain = {
        "sliders": [
            {
                "name": axis.name,
                "unit": unit_of(design.spec, axis.name),
                "nodes": at.tolist(),
                "value": float(min(max(own.get(axis.name, float(at.mean())), at[0]), at[-1])),
            }
            for axis, at in zip(axes, nodes, strict=True)
        ],
        "columns": _columns([names[i] for i in moving]),
        "components": len(parts),
        "errors": errors,
        "said": [
            said(one.design, chosen)
            for one, chosen in zip(models, by.fits[1:] or [None] * len(models), strict=True)
        ],
    }
    numbers = np.concatenate((mean, parts.ravel(), shares.ravel()))
    return Grid(by, plain, numbers.astype(np.float32))


def _own_ranges(design: Design, vary: Vary) -> Vary:
    """Ranges, in which factors of the design's own numbers have become numbers."""
    if isinstance(vary, Mapping):
        return vary
    own = stated_numbers(design)
    found = []
    for word in [vary] if isinstance(vary, str) else vary:
        name, _, text = map(str.strip, str(word).partition("="))
        factors = _FACTORS.fullmatch(text)
        if factors and name not in own:
            cause = f"`vary` '{word}': '{name}' is not a stated number of {design.name}"
            raise DraftError(cause, f"give a plain range, or vary one of {quoted(own)}")
        ends = [own[name] * float(factor) for factor in factors.groups()] if factors else []
        found.append(f"{name}={ends[0]!r}:{ends[1]!r}" if ends else word)
    return found


def _check(axes: Sequence[Axis]) -> None:
    if len(axes) > MOST_SLIDERS:
        cause = f"a page has up to {MOST_SLIDERS} sliders, not {len(axes)}"
        raise DraftError(cause, "vary fewer numbers")
    for axis in axes:
        if axis.values:
            cause = f"`vary` '{axis.name}' lists values, and a slider has a range"
            raise DraftError(cause, f"write {axis.name}={axis.low:g}:{axis.high:g}")


@dataclass(frozen=True)
class _Table:
    """Numbers of bodies.

    Attributes:
        names: field and index of each column.
        values: shape (bodies, columns).
        steps: the error that each column may have, shape (columns,).
    """

    names: Sequence[tuple[str, int]]
    values: Array
    steps: Array


@dataclass(frozen=True)
class _Space:
    """Designs over ranges.

    Attributes:
        model: model of the design itself.
        axes: its ranges.
    """

    model: Model
    axes: Sequence[Axis]

    def designs(self, values: Sequence[Array]) -> Design:
        """N designs at all combinations of values of the axes, the last axis the fastest."""
        mesh = np.meshgrid(*values, indexing="ij")
        given = {axis.name: one.ravel() for axis, one in zip(self.axes, mesh, strict=True)}
        design = self.model.design
        own = {k: v for k, v in design.values.items() if k not in given}
        return design.spec.resolve(own, given)

    def table(self, values: Sequence[Array]) -> _Table:
        """Numbers of the bodies at all combinations of values of the axes.

        Raises:
            DraftError: one has no model.
        """
        many = self.designs(values)
        batch = build_batch(many, template=self.model.mujoco, refused=True)
        if batch.outside:
            row, reason = next(iter(batch.outside.items()))
            at = np.unravel_index(row, [len(one) for one in values])
            words = [
                f"{axis.name}={one[i]:.4g}"
                for axis, one, i in zip(self.axes, values, at, strict=True)
            ]
            cause = f"the body with {', '.join(words)} has no model: {reason}"
            raise DraftError(cause, "narrow the ranges")
        fields = _fields(batch)
        names, columns, steps = [], [], []
        for name, found in fields.items():
            flat = found.reshape(len(batch), -1)
            names += [(name, i) for i in range(flat.shape[1])]
            columns.append(flat)
            steps.append(_allowed(name, found).reshape(-1))
        return _Table(names, np.hstack(columns), np.concatenate(steps))


def _fields(batch: ModelBatch) -> dict[str, Array]:
    """Fields of the bodies that a page needs, shape (N, ...), in frames that turn with no axis."""
    model = batch.template
    left_out = ("body_iquat", "body_inertia")
    fields = {
        name: np.array(batch.field(name), float)
        for name in FIELDS
        if name not in left_out and getattr(model, name).size
    }
    moments, turns = (
        np.moveaxis(batch.field(name), 0, -1) for name in ("body_inertia", "body_iquat")
    )
    tensors = turned(moments, matrices(turns))
    fields[_TENSOR] = np.stack([tensors[:, i, j] for i, j in _ENTRIES], axis=-1).swapaxes(0, 1)
    # Only that of the trunk changes; copies of a part share theirs.
    trunk = (model.geom_type == mujoco.mjtGeom.mjGEOM_MESH) & (model.geom_bodyid == 1)
    for geom in np.flatnonzero(trunk):
        mesh = model.geom_dataid[geom]
        start = model.mesh_vertadr[mesh]
        rows = slice(start, start + model.mesh_vertnum[mesh])
        points = fields.setdefault("mesh_vert", np.array(batch.field("mesh_vert"), float))
        turn = matrices(fields["geom_quat"][:, geom].T)
        for i in range(rows.start, rows.stop):
            points[:, i] = apply(turn, points[:, i].T).T + fields["geom_pos"][:, geom]
        fields["geom_pos"][:, geom] = 0.0
        fields["geom_quat"][:, geom] = (1.0, 0.0, 0.0, 0.0)
    return fields


def _allowed(name: str, values: Array) -> Array:
    """Error that each number of a field may have, by `BARS`, shape of the field."""
    size = np.abs(values).max(axis=0)
    kind = _KINDS.get(name, "")
    if kind == "length":
        return np.full(size.shape, BARS["length"])
    if name == _TENSOR:  # Products of inertia count by the moments.
        size = np.broadcast_to(size[:, :3].max(axis=1, keepdims=True), size.shape)
    share = BARS["mass"] if name == "body_mass" else BARS["inertia"] if kind else BARS["mass"]
    return share * np.maximum(size, 1e-12)


def _refined(space: _Space) -> tuple[list[Array], _Table, dict[str, float]]:
    """Values of the nodes along each axis, their bodies, and the largest errors between them.

    Intervals in whose middle a number is off by more than a share of its bar are halved, as where
    a law of Draft has a kink. The share falls until the middles of all cells are within the bars.
    """
    shares = [np.linspace(0.0, 1.0, 3) for _ in space.axes]
    most = _AIM
    for _ in range(_ROUNDS):
        nodes = _at(space.axes, shares)
        known = space.table(nodes)
        values = known.values.reshape(*map(len, nodes), -1)
        finer = list(shares)
        for i, share in enumerate(shares):
            middle = (share[1:] + share[:-1]) / 2
            there = [middle if j == i else one for j, one in enumerate(shares)]
            off = _off(space, there, _halfway(values, [i]), known.steps)
            worst = off.max(axis=(*(j for j in range(len(shares)) if j != i), -1))
            finer[i] = np.sort(np.concatenate((share, middle[worst > most])))
        if all(len(one) == len(share) for one, share in zip(finer, shares, strict=True)):
            middles = [(one[1:] + one[:-1]) / 2 for one in shares]
            off = _off(space, middles, _halfway(values, range(len(shares))), known.steps)
            ratio = off.reshape(-1, off.shape[-1]).max(axis=0)
            if ratio.max(initial=0.0) <= 1.0:
                return nodes, known, _errors(known, ratio)
            most /= 2
        shares = finer
        if math.prod(map(len, shares)) > _MOST_NODES:
            break
    cause = (
        f"over these ranges, {_MOST_NODES} bodies leave errors above those of a page between them"
    )
    raise DraftError(cause, "narrow the ranges, or vary fewer numbers")


def _at(axes: Sequence[Axis], shares: Sequence[Array]) -> list[Array]:
    return [axis.at(share) for axis, share in zip(axes, shares, strict=True)]


def _off(space: _Space, shares: Sequence[Array], guess: Array, steps: Array) -> Array:
    """Errors of guessed numbers, in units of those they may have, shape of the guess."""
    true = space.table(_at(space.axes, shares)).values
    return np.abs(true.reshape(guess.shape) - guess) / steps


def _halfway(values: Array, axes: Sequence[int] | range) -> Array:
    """Values interpolated halfway between the nodes of some axes."""
    for axis in axes:
        low = np.take(values, range(values.shape[axis] - 1), axis)
        high = np.take(values, range(1, values.shape[axis]), axis)
        values = (low + high) / 2
    return values


def _errors(table: _Table, ratio: Array) -> dict[str, float]:
    """Largest error found between nodes, by kind: mass and inertia as shares, length [m]."""
    found = dict.fromkeys(BARS, 0.0)
    for (name, _), value in zip(table.names, ratio, strict=True):
        kind = "mass" if name == "body_mass" else _KINDS.get(name)
        if kind is not None:
            found[kind] = max(found[kind], float(value) * BARS[kind])
    return found


def _of_policies(
    found: Sequence[Fit], models: Sequence[Model]
) -> tuple[list[tuple[str, int]], Array]:
    """Columns of what a body's start and policy need, names and values, shape (bodies, columns)."""
    rows = [body_numbers(model, one) for one, model in zip(found, models, strict=True)]
    names = [(f"number {name}", i) for name, one in rows[0].items() for i in range(len(one))]
    values = np.array([np.concatenate([*one.values()]) for one in rows])
    if all(one.policy.network is found[0].policy.network for one in found):
        return names, values
    # The network of all legs has the numbers of its body in few of its own.
    first = network_numbers(found[0].policy)
    differing = np.zeros(len(first), bool)
    for one in found:
        differing |= network_numbers(one.policy) != first
    networks = np.array([network_numbers(one.policy)[differing] for one in found], float)
    names += [("network", int(i)) for i in np.flatnonzero(differing)]
    return names, np.hstack((values, networks))


def _compressed(values: Array, steps: Array) -> tuple[Array, Array, Array]:
    """Values as means, few components, and coefficients in these.

    Args:
        values: shape (nodes, columns).
        steps: error that each column may have, shape (columns,).

    Returns:
        Means, shape (columns,), components, shape (k, columns), and coefficients, shape (nodes, k):
        as many components as keep all values within the errors.
    """
    mean = values.mean(axis=0)
    left, size, right = np.linalg.svd((values - mean) / steps, full_matrices=False)
    shares, parts = left * size, right * steps
    for k in range(1, len(size) + 1):
        off = values - mean - shares[:, :k] @ parts[:k]
        if (np.abs(off) <= steps).all():
            return mean, parts[:k], shares[:, :k]
    return mean, parts, shares


def _columns(names: Sequence[tuple[str, int]]) -> dict[str, list[int]]:
    """Indices of the columns by field, in order."""
    found: dict[str, list[int]] = {}
    for name, i in names:
        found.setdefault(name, []).append(i)
    return found
