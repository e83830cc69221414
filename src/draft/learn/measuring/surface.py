"""Capability over a plane of two varied numbers, with a trained policy."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, Protocol

import numpy as np

from draft.design import Design
from draft.design.findings import first_error
from draft.design.references import find_design
from draft.errors import DraftError
from draft.files import new_folder, write
from draft.learn.measuring import learned_metrics as learned
from draft.learn.measuring.evaluation_options import SurfaceSettings
from draft.learn.measuring.learned_metrics import Learned
from draft.learn.measuring.policies import Source, source_for
from draft.settings import by_keyword
from draft.values import Array

if TYPE_CHECKING:
    from draft.variation.axes import Axis, Vary

P = ParamSpec("P")
TABLE, PAGE, RECORD = "surface.csv", "surface.html", "surface.json"


@dataclass(frozen=True)
class Surface:
    """Capabilities of the designs of a grid, in its order: the last axis varies fastest.

    Attributes:
        robot: name of the robot and design that is varied.
        axes: names of the two numbers.
        units: unit of each axis; "" for none.
        values: values of each axis, rising.
        mass: mass of each design [kg], shape (N,).
        refusal: reason why a design is not measured, such as a finding; "" if it is.
        learned: capabilities; NaN for designs that are not measured.
        designs: the designs, as arrays of N.
    """

    robot: str
    axes: tuple[str, str]
    units: tuple[str, str]
    values: tuple[Array, Array]
    mass: Array
    refusal: tuple[str, ...]
    learned: Learned
    designs: Design

    def grid(self, values: Array) -> Array:
        """Values of all designs as a table, shape (first axis, second axis)."""
        return values.reshape(len(self.values[0]), len(self.values[1]))

    def columns(self) -> dict[str, Sequence[object]]:
        """Columns of the table, by name."""
        first, second = np.meshgrid(*self.values, indexing="ij")
        return {
            self.axes[0]: first.ravel().tolist(),
            self.axes[1]: second.ravel().tolist(),
            "mass": self.mass.tolist(),
            "refusal": self.refusal,
            "inside": [bool(one) for one in self.learned.inside],
            **{name: getattr(self.learned, name).tolist() for name in learned.NUMBERS},
            "limiting": self.learned.limiting,
        }


class _Surface(Protocol[P]):
    """Type of `surface`, with the settings as keyword arguments."""

    def __call__(
        self,
        design: Design | str,
        vary: Vary,
        policy: Source | str | Path | None = None,
        *args: P.args,
        **settings: P.kwargs,
    ) -> Surface: ...


def _with_settings(
    record: Callable[P, SurfaceSettings],
) -> Callable[[Callable[..., Surface]], _Surface[P]]:
    return by_keyword(record)


@_with_settings(SurfaceSettings)
def surface(
    design: Design | str,
    vary: Vary,
    policy: Source | str | Path | None = None,
    *,
    settings: SurfaceSettings,
) -> Surface:
    """Measure a trained policy on designs over a plane of two numbers.

        >>> plane = {"thigh_length": (0.24, 0.3), "actuators.leg.peak_torque": (60.0, 90.0)}
        >>> found = draft.surface("quadruped", plane, points=2, replicas=1, seconds=1.0)
        >>> found.axes, found.learned.top_speed.shape
        (('thigh_length', 'actuators.leg.peak_torque'), (4,))

    Args:
        design: the design that is varied, or its name.
        vary: two ranges, such as `{"thigh_length": (0.2, 0.4), ...}` or "thigh_length=0.2:0.4".
        policy: run or ONNX file of a policy that observes its design; None for the one that ships.
        settings: fields of `SurfaceSettings`, by keyword.

    Raises:
        DraftError: the ranges are not two, an argument is invalid, no design can be measured, or
            the policy does not fit.
    """
    from draft.variation import axes as axes_of
    from draft.variation import sampling

    if isinstance(design, str):
        design = find_design(design).resolve()
    if len(vary) != 2:
        cause = f"a surface needs two ranges, and `vary` has {len(vary)}"
        remedy = "such as `vary` thigh_length=0.2:0.4 actuators.leg.peak_torque=40:120"
        raise DraftError(cause, remedy)
    source = policy if isinstance(policy, Source) else source_for(policy, design)
    axes = [_rising(axis) for axis in axes_of.parse(design.spec, vary)]
    first, second = axes
    count = math.prod(len(axis.values) or settings.points for axis in axes)
    drawn = sampling.draw(axes, "grid", count, 0, 0, count)
    many = design.spec.resolve(dict(design.values), drawn)
    found, reasons = learned.of_designs(
        source,
        many,
        settings,
        device=settings.device,
        engine=settings.engine,
        report=settings.progress or (lambda done, of: None),
    )
    refusal = tuple(first_error(many.findings, row) or reasons.get(row, "") for row in range(count))
    if all(refusal):
        cause = f"none of the {count} designs can be measured: {refusal[0]}"
        raise DraftError(cause, "change the ranges of `vary`")
    return Surface(
        robot=design.reference,
        axes=(first.name, second.name),
        units=(axes_of.unit_of(design.spec, first.name), axes_of.unit_of(design.spec, second.name)),
        values=(np.unique(drawn[first.name]), np.unique(drawn[second.name])),
        mass=np.broadcast_to(np.asarray(many.mass, float), count).copy(),
        refusal=refusal,
        learned=found,
        designs=many,
    )


def save(
    found: Surface, folder: Path, record: dict[str, object], command: str = "", studio: str = ""
) -> None:
    """Write a surface: table, figure as PNG and PDF, page, and a record of its settings.

    Args:
        found: the surface.
        folder: folder to write, whole or not at all.
        record: settings that gave it.
        command: command that made it, for the page.
        studio: command that lets the varied robot walk, up to the values it adds; "" for none.

    Raises:
        DraftError: it cannot be written, or matplotlib is missing.
    """
    from draft import plotting
    from draft.learn.measuring.surface_figure import draw
    from draft.learn.measuring.surface_page import page

    with new_folder(folder) as new:
        plotting.save(new, {"surface": lambda: draw(found)})
        write(new / TABLE, _csv(found))
        write(new / PAGE, page(found, command, studio))
        write(new / RECORD, json.dumps({"command": command} | record, indent=1) + "\n")


def _csv(found: Surface) -> str:
    columns = found.columns()
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        table.writerow([_cell(value) for value in row])
    return out.getvalue()


def _cell(value: object) -> object:
    """A value of the table; empty where there is none."""
    if isinstance(value, float):
        return f"{value:.6g}" if np.isfinite(value) else ""
    return value


def _rising(axis: Axis) -> Axis:
    """The axis with its listed values in order.

    Raises:
        DraftError: it has one value, or one twice.
    """
    listed = tuple(sorted(axis.values))
    if axis.low == axis.high or len(set(listed)) < len(listed):
        cause = f"`vary` {axis.name} needs different values, at least two, for a surface"
        raise DraftError(cause, f"such as {axis.name}=0.2:0.4, or 0.2,0.3,0.4")
    return replace(axis, values=listed)
