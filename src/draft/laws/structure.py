"""Structure laws: what the structural mass of real robots' segments is at a given length.

m = c L^e per segment class and population, from published descriptions of 29 humanoids and 20
quadrupeds; outside a class's fitted lengths the mass per metre is held at its value at the edge.
A link of no class is of the class `other`: the median mass per metre of all classes, e = 1.
Source: arXiv 2609.38405, structure trends; coefficients: `draft.fitting.structure.refit`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Location, Problem
from draft.values import Mask, Value, clip, either, power

FILE = Path(__file__).resolve().parent / "data" / "structure_trends.json"
MIDDLE = 0.5


@dataclass(frozen=True, slots=True)
class Centre:
    """Where the structure of a class of segments balances, as a share of its length.

    Attributes:
        value: median over n robots, from 0 at the first joint to 1 at the next joint or the tip.
        n: robots.
        p25, p75: quartiles over them.
        held_out, held_out_maker: mean absolute error on robots, and on makers, held out.
        held_out_middle: that error of the middle of the segment.
    """

    value: float
    n: int
    p25: float
    p75: float
    held_out: float
    held_out_maker: float
    held_out_middle: float


@dataclass(frozen=True, slots=True)
class SegmentTrend:
    """Structural mass m = coefficient L^exponent [kg] of one class of segment.

    `fold` is the geometric mean fold error over its n rows, in sample; `range` the fitted
    lengths [m]; `centre` where the structure balances, None where no more than the middle is known.
    """

    name: str
    coefficient: float
    exponent: float
    n: int
    fold: float
    range: tuple[float, float]
    centre: Centre | None = None

    @property
    def formula(self) -> str:
        """The law in words."""
        return f"m = {self.coefficient:.3g} L^{self.exponent:.3g}"

    def mass(self, length: Value) -> Value:
        """Structural mass [kg] at a joint-to-joint length [m]."""
        inside = clip(length, *self.range)
        return self.coefficient * power(inside, self.exponent - 1.0) * length

    def outside(self, length: Value) -> Mask:
        """Mask of the lengths outside the fitted range."""
        low, high = self.range
        # The range is printed to a millimetre, so a length may miss it by half of one.
        return either(length < low - 5e-4, length > high + 5e-4)


@dataclass(frozen=True, slots=True)
class Allometry:
    """Whole-robot mass m = coefficient size^exponent [kg], with its log-normal spread."""

    coefficient: float
    exponent: float
    sigma_log: float
    size: str
    n: int


@dataclass(frozen=True, slots=True)
class WholeTrend:
    """Structural mass S = coefficient L^exponent [kg] of a whole robot, L = thigh + shank [m].

    On robots held out, S plus the actuators is nearer to the true mass than the sum over the
    segments' classes is. `sigma_log` is the standard deviation of ln S; `range` the fitted L.
    """

    coefficient: float
    exponent: float
    n: int
    sigma_log: float
    range: tuple[float, float]
    size: str

    def mass(self, leg: Value) -> Value:
        """Structural mass [kg] of a robot whose thigh and shank are together this long [m]."""
        return self.coefficient * power(leg, self.exponent)


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Geometric mean fold error of total mass over n robots, each predicted by the others.

    Attributes:
        n: robots.
        paper: segments by class, trunk by volume, actuators by torque.
        draft: structure by leg length, actuators by torque.
        median_alone: the median mass of the other robots.
        paper_maker_out, draft_maker_out: with all robots of the same maker held out.
    """

    n: int
    paper: float
    draft: float
    median_alone: float
    paper_maker_out: float
    draft_maker_out: float


@dataclass(frozen=True, slots=True)
class Population:
    """Structure trends of one surveyed population.

    Attributes:
        name: "humanoid" or "quadruped".
        segments: trend by segment class; `other` is the last.
        trunk_density: median structural mass over volume of the trunk [kg/m3], from `trunk_n`.
        trunk_fold: geometric mean fold error of that density over its rows.
        end_density: median mass over volume of the spheres that quadrupeds stand on [kg/m3], from
            `end_n` robots; no other ends are surveyed, so it stands for those of humanoids, too.
        allometry: mass of a whole robot by its size.
        share: 10th percentile, median and 90th percentile of the actuators' share of mass.
        whole: structural mass of a whole robot by its legs.
        held_out: fold errors of total mass, robots held out.
        source: where it comes from.
    """

    name: str
    segments: Mapping[str, SegmentTrend]
    trunk_density: float
    trunk_n: int
    trunk_fold: float
    end_density: float
    end_n: int
    allometry: Allometry
    share: tuple[float, float, float]
    whole: WholeTrend
    held_out: HeldOut
    source: str

    @property
    def held_out_total(self) -> float:
        """Fold error of total mass by the segments' classes, robots held out one by one."""
        return self.held_out.paper


_SCORES = frozenset(HeldOut.__dataclass_fields__)


@lru_cache(maxsize=8)
def population(name: str) -> Population:
    """Structure trends of "humanoid" or "quadruped", as shipped."""
    return _population(name, json.loads(FILE.read_text(encoding="utf-8")))


def read_population(name: str, path: Path) -> Population:
    """Structure trends of "humanoid" or "quadruped" in a file that `draft survey fit --out` wrote.

    Raises:
        DraftError: it cannot be read, or is no such file.
    """
    try:
        return _population(name, json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        cause = f"cannot be read: {(error.strerror or str(error)).lower()}"
    except (ValueError, KeyError, TypeError, AttributeError):
        cause = f"holds no structure trends of {name}s"
    remedy = "write one: draft survey fit --rows YOURS.csv --out FILE"
    raise DraftError(Problem(cause, Location(str(path)), remedy))


def _population(name: str, table: Mapping[str, Any]) -> Population:
    record = table[name]
    share, end = record["actuator_share"], table["quadruped"]["end"]
    return Population(
        name=name,
        segments={
            key: _segment(key, row)
            for key, row in {**record["segments"], "other": record["other"]}.items()
        },
        trunk_density=record["trunk"]["density"],
        trunk_n=record["trunk"]["n"],
        trunk_fold=record["trunk"]["fold"],
        end_density=end["density"],
        end_n=end["n"],
        allometry=Allometry(**record["allometry"]),
        share=(share["p10"], share["median"], share["p90"]),
        whole=WholeTrend(**{**record["whole"], "range": tuple(record["whole"]["range"])}),
        held_out=HeldOut(**{k: v for k, v in record["held_out"].items() if k in _SCORES}),
        source=table["source"],
    )


def _segment(name: str, row: Mapping[str, Any]) -> SegmentTrend:
    centre = Centre(**row["centre"]) if "centre" in row else None
    return SegmentTrend(name, **{**row, "range": tuple(row["range"]), "centre": centre})
