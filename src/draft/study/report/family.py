"""Capability of a family's members over the parameters that tell them apart."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.learn.quadruped import Quadruped
from draft.study.report.gather import parameters
from draft.study.report.records import Study, Trained
from draft.study.report.spread import by_seed
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.tri import Triangulation

SHOWN = ("top_speed", "step", "kick", "eta")
# Two parameters whose values run together tell no surface.
TOGETHER = 0.99
LEAST = 4
UNITS = {
    **{"length": "m", "width": "m", "height": "m", "offset": "m", "spacing": "m"},
    **{"torque": "N m", "ratio": "1", "speed": "rad/s", "inertia": "kg m²", "mass": "kg"},
}


@dataclass(frozen=True, eq=False)
class Family:
    """Members of one family, over all its runs.

    Attributes:
        members: by name.
        parameters: numbers of each member by name.
        scalars: of each member by scalar and name, the median over seeds.
        seeds: of its runs.
        reasons: why scalars of members are not known.
        told: summaries of each member, one per evaluation of the nominal arm.
    """

    members: Mapping[str, Quadruped]
    parameters: Mapping[str, Mapping[str, float]]
    scalars: Mapping[str, Mapping[str, float]]
    seeds: tuple[int, ...]
    reasons: tuple[str, ...]
    told: Mapping[str, Sequence[Mapping[str, Any]]]

    @property
    def varied(self) -> tuple[str, ...]:
        """Parameters that are not the same in all members."""
        rows = list(self.parameters.values())
        names = [n for n in (rows[0] if rows else ()) if all(n in row for row in rows)]
        return tuple(n for n in names if len({round(row[n], 9) for row in rows}) > 1)

    def axes(self, scalar: str) -> tuple[str, ...]:
        """The one or two varied parameters that a scalar goes with most; the first without one."""
        known = self.scalars.get(scalar, {})
        names = [n for n in known if n in self.parameters]
        if not self.varied:
            return ()
        if not names:
            return self.varied[:2] if len(self.parameters) >= LEAST else self.varied[:1]
        value = np.array([known[n] for n in names])
        columns = {p: np.array([self.parameters[n][p] for n in names]) for p in self.varied}
        if len(self.varied) > 2:
            ranked = sorted(columns, key=lambda p: -_alike(columns[p], value))
        else:
            ranked = list(self.varied)
        first = ranked[0]
        others = [p for p in ranked[1:] if _alike(columns[p], columns[first]) < TOGETHER]
        return (first, others[0]) if others and len(names) >= LEAST else (first,)

    def points(self, scalar: str, axes: tuple[str, ...]) -> tuple[Array, Array]:
        """Parameters, shape (members, axes), and the scalar, shape (members,)."""
        names = [n for n in self.scalars[scalar] if n in self.parameters]
        at = np.array([[self.parameters[n][p] for p in axes] for n in names])
        return at, np.array([self.scalars[scalar][n] for n in names])

    def says(self, scalar: str, axes: tuple[str, ...], at: tuple[float, ...]) -> float | None:
        """The scalar between members, linear; None outside of them."""
        points, values = self.points(scalar, axes)
        if len(axes) == 1:
            order = np.argsort(points[:, 0])
            x = points[order, 0]
            return float(np.interp(at[0], x, values[order])) if x[0] <= at[0] <= x[-1] else None
        from matplotlib.tri import LinearTriInterpolator

        low, span = points.min(axis=0), np.ptp(points, axis=0)
        found = LinearTriInterpolator(triangles(points, unit=True), values)(
            *((np.array(at) - low) / span)
        )
        return None if np.ma.is_masked(found) else float(found)


@dataclass(frozen=True)
class Check:
    """A design that was trained alone, held against the family.

    Attributes:
        title: the design's.
        at: its parameters.
        own: its own value, the median over seeds.
        said: what lies between the family's members there; None outside of them.
    """

    title: str
    at: tuple[float, ...]
    own: float
    said: float | None


def families(study: Study) -> list[Family]:
    """Families that were evaluated, runs of the same robots together."""
    groups: dict[str, list[Trained]] = {}
    for one in study.families:
        groups.setdefault(one.robots, []).append(one)
    found = [_family(study, runs) for runs in groups.values()]
    return [family for family in found if family.told]


def checks(study: Study, family: Family, scalar: str) -> tuple[list[Check], list[str]]:
    """Designs trained alone that differ from the family in nothing but what it varies.

    Returns:
        The designs, and why others are not compared.
    """
    axes, found, left_out = family.axes(scalar), [], []
    rows = list(family.parameters.values())
    fixed = {n: v for n, v in rows[0].items() if n not in family.varied} if rows else {}
    for design, title in study.titles.items():
        band = by_seed(study, design, "nominal", scalar).spread
        run = next(one for one in study.singles if one.key[0] == design)
        own = parameters(run).get(design)
        if band is None or own is None or not axes:
            continue
        other = [n for n, v in fixed.items() if abs(own.get(n, np.inf) - v) > 1e-6 * max(1, abs(v))]
        if other or any(name not in own for name in axes):
            words = ", ".join(_plain(name) for name in other[:4]) or "a parameter that is varied"
            left_out.append(f"{title} is not compared: it has not the family's {words}")
            continue
        at = tuple(own[name] for name in axes)
        found.append(Check(title, at, band.median, family.says(scalar, axes, at)))
    return found, left_out


def triangles(points: Array, unit: bool = False) -> Triangulation:
    """Triangles between points whose axes count alike, in the points' or in unit coordinates."""
    from matplotlib.tri import Triangulation

    scaled = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    found = Triangulation(scaled[:, 0], scaled[:, 1])
    return found if unit else Triangulation(points[:, 0], points[:, 1], found.triangles)


def figure_name(number: int, count: int, what: str) -> str:
    """Name of a figure or table of one of several families."""
    return f"family{'' if count == 1 else number + 1}_{what}"


def axis_words(parameter: str) -> str:
    """A parameter as an axis says it, with its unit where its name tells it."""
    name = parameter.rpartition(".")[2].replace("_", " ")
    if parameter.count(".") > 1:
        name = f"{name} ({parameter.split('.')[-2]})"
    last = parameter.rpartition("_")[2]
    return f"{name} [{UNITS[last]}]" if last in UNITS else name


def _plain(name: str) -> str:
    return name.replace("actuators.", "").replace(".", " ").replace("_", " ")


def _alike(a: Array, b: Array) -> float:
    """Size of the correlation of two lists; 0 where one is constant."""
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return abs(float(np.corrcoef(a, b)[0, 1]))


def _family(study: Study, runs: list[Trained]) -> Family:
    values: dict[str, dict[str, list[float]]] = {scalar: {} for scalar in SHOWN}
    reasons: dict[str, None] = {}
    told: dict[str, list[Mapping[str, Any]]] = {}
    for one in study.evaluations:
        if one.run not in runs or one.arm != "nominal" or one.protocol != study.protocol:
            continue
        for name, member in one.data["by_member"].items():
            told.setdefault(name, []).append(member)
            for scalar in SHOWN:
                value = member.get("scalars", {}).get(scalar)
                if value is not None:
                    values[scalar].setdefault(name, []).append(float(value))
                elif scalar in member.get("scalars", {}):
                    why = member.get("reasons", {}).get(scalar, "no reason is given")
                    reasons[f"{name}, {scalar.replace('_', ' ')}: {why}"] = None
    return Family(
        members={member.name: member for member in runs[0].members},
        parameters=parameters(runs[0]),
        scalars={
            scalar: {name: statistics.median(v) for name, v in by_name.items()}
            for scalar, by_name in values.items()
        },
        seeds=tuple(sorted({one.seed for one in runs})),
        reasons=tuple(reasons),
        told=told,
    )
