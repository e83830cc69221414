"""Capability of a family's members over the parameters in which they differ."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.learn.legged import LeggedRobot
from draft.study.report.gather import parameters
from draft.study.report.records import Study, Trained
from draft.study.report.spread import by_seed
from draft.values import Array

if TYPE_CHECKING:
    from matplotlib.tri import Triangulation

SHOWN = ("top_speed", "step", "kick", "eta")
# Correlation above which two parameters do not span a surface.
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
        members: members by name.
        parameters: parameters by member and name.
        scalars: medians over seeds, by scalar and member.
        seeds: seeds of the runs.
        reasons: reasons why scalars of members are unknown.
        summaries: summaries by member, one per evaluation of the nominal arm.
    """

    members: Mapping[str, LeggedRobot]
    parameters: Mapping[str, Mapping[str, float]]
    scalars: Mapping[str, Mapping[str, float]]
    seeds: tuple[int, ...]
    reasons: tuple[str, ...]
    summaries: Mapping[str, Sequence[Mapping[str, Any]]]

    @property
    def varied(self) -> tuple[str, ...]:
        """Parameters in which members differ."""
        rows = list(self.parameters.values())
        names = [n for n in (rows[0] if rows else ()) if all(n in row for row in rows)]
        return tuple(n for n in names if len({round(row[n], 9) for row in rows}) > 1)

    def axes(self, scalar: str) -> tuple[str, ...]:
        """Return the one or two varied parameters that correlate most with a scalar."""
        known = self.scalars.get(scalar, {})
        names = [n for n in known if n in self.parameters]
        if not self.varied:
            return ()
        if not names:
            return self.varied[:2] if len(self.parameters) >= LEAST else self.varied[:1]
        value = np.array([known[n] for n in names])
        columns = {p: np.array([self.parameters[n][p] for n in names]) for p in self.varied}
        if len(self.varied) > 2:
            ranked = sorted(columns, key=lambda p: -_correlation(columns[p], value))
        else:
            ranked = list(self.varied)
        first = ranked[0]
        others = [p for p in ranked[1:] if _correlation(columns[p], columns[first]) < TOGETHER]
        return (first, others[0]) if others and len(names) >= LEAST else (first,)

    def points(self, scalar: str, axes: tuple[str, ...]) -> tuple[Array, Array]:
        """Return parameters, shape (members, axes), and the scalar, shape (members,)."""
        names = [n for n in self.scalars[scalar] if n in self.parameters]
        at = np.array([[self.parameters[n][p] for p in axes] for n in names])
        return at, np.array([self.scalars[scalar][n] for n in names])

    def interpolate(
        self, scalar: str, axes: tuple[str, ...], at: tuple[float, ...]
    ) -> float | None:
        """Interpolate a scalar linearly between members; None outside of them."""
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
    """Comparison of a design that was trained alone with the family.

    Attributes:
        title: title of the design.
        at: parameters of the design.
        own: value of the design, the median over seeds.
        interpolated: value between the family's members; None outside of them.
    """

    title: str
    at: tuple[float, ...]
    own: float
    interpolated: float | None


def families(study: Study) -> list[Family]:
    """Return the families that were evaluated, with runs of the same robots together."""
    groups: dict[str, list[Trained]] = {}
    for one in study.families:
        groups.setdefault(one.robots, []).append(one)
    found = [_family(study, runs) for runs in groups.values()]
    return [family for family in found if family.summaries]


def checks(study: Study, family: Family, scalar: str) -> tuple[list[Check], list[str]]:
    """Compare designs trained alone that differ from the family only in what it varies.

    Returns:
        The comparisons, and the reasons why other designs are not compared.
    """
    axes, found, omitted = family.axes(scalar), [], []
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
            omitted.append(f"{title} is not compared: it does not have the family's {words}")
            continue
        at = tuple(own[name] for name in axes)
        found.append(Check(title, at, band.median, family.interpolate(scalar, axes, at)))
    return found, omitted


def triangles(points: Array, unit: bool = False) -> Triangulation:
    """Triangulate points with both axes scaled alike, in their own or in unit coordinates."""
    from matplotlib.tri import Triangulation

    scaled = (points - points.min(axis=0)) / np.ptp(points, axis=0)
    found = Triangulation(scaled[:, 0], scaled[:, 1])
    return found if unit else Triangulation(points[:, 0], points[:, 1], found.triangles)


def figure_name(number: int, count: int, what: str) -> str:
    """Return the name of a figure or table of one of several families."""
    return f"family{'' if count == 1 else number + 1}_{what}"


def axis_words(parameter: str) -> str:
    """Return the label of a parameter, with its unit if its name gives it."""
    name = parameter.rpartition(".")[2].replace("_", " ")
    if parameter.count(".") > 1:
        name = f"{name} ({parameter.split('.')[-2]})"
    last = parameter.rpartition("_")[2]
    return f"{name} [{UNITS[last]}]" if last in UNITS else name


def _plain(name: str) -> str:
    return name.replace("actuators.", "").replace(".", " ").replace("_", " ")


def _correlation(a: Array, b: Array) -> float:
    """Return the absolute correlation of two arrays; 0 if one is constant."""
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return abs(float(np.corrcoef(a, b)[0, 1]))


def _family(study: Study, runs: list[Trained]) -> Family:
    values: dict[str, dict[str, list[float]]] = {scalar: {} for scalar in SHOWN}
    reasons: dict[str, None] = {}
    summaries: dict[str, list[Mapping[str, Any]]] = {}
    for one in study.evaluations:
        if one.run not in runs or one.arm != "nominal" or one.protocol != study.protocol:
            continue
        for name, member in one.data["by_member"].items():
            summaries.setdefault(name, []).append(member)
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
        summaries=summaries,
    )
