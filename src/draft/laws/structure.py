"""Structure laws: structural mass of the segments of real robots, by length.

m = c L^e per segment class and population, from published descriptions of 29 humanoids and 20
quadrupeds; outside the fitted lengths of a class, the mass per metre is that at the edge. A link
without a class has the class `other`: the median mass per metre of all classes, e = 1.
Source: arXiv 2609.38405, structure trends; coefficients: `draft.fitting.structure.survey_refit`.

Links of arms and hands were not surveyed with robots on legs; each has a class of its own in every
population: `cobot_link`, `light_link` and `finger` (`draft.fitting.structure.links`).

The trunk weighs its volume times a density: `calibrated`, Draft's own law, which also depends on
the leg length (`draft.fitting.structure.calibrated`), or `paper`, the published median.
`draft.design.structure_law` tells which holds for a design.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Location, Problem
from draft.extensions import Registry
from draft.files import Readable
from draft.laws.law import Law

FILE = Path(__file__).resolve().parent / "data" / "structure_trends.json"
LINKS = FILE.with_name("link_trends.json")
MIDDLE = 0.5

# Laws of the trunk, by the names that parameters.yaml uses.
PAPER, CALIBRATED = "paper", "calibrated"
# Key of a coefficients file: the one that robots with that file use.
USES = "structure"
# Legs of the surveyed robots of each population, which the calibrated law was fitted to.
LEGS = {"humanoid": 2, "quadruped": 4}


@dataclass(frozen=True, slots=True)
class Centre:
    """Centre of mass of the structure of a segment class, as a share of its length.

    Attributes:
        value: median over n robots, from 0 at the first joint to 1 at the next joint or the tip.
        n: number of robots.
        p25, p75: quartiles over the robots.
        held_out, held_out_maker: mean absolute error on held-out robots and makers.
        held_out_middle: mean absolute error of 0.5, the middle of the segment.
    """

    value: float
    n: int
    p25: float
    p75: float
    held_out: float
    held_out_maker: float
    held_out_middle: float


@dataclass(frozen=True, slots=True)
class HeldOut:
    """Geometric mean fold error of total mass over n robots, each predicted by the others.

    Attributes:
        n: number of robots.
        paper: error with segments by class, trunk by volume, actuators by torque.
        draft: error with structure by leg length, actuators by torque.
        calibrated: error with segments by class, trunk by volume and leg length, actuators by
            torque.
        median_alone: error of the median mass of the other robots.
        paper_maker_out: as `paper`, with all robots of the same maker held out.
        draft_maker_out: as `draft`, with all robots of the same maker held out.
        calibrated_maker_out: as `calibrated`, with all robots of the same maker held out.
    """

    n: int
    paper: float
    draft: float
    calibrated: float
    median_alone: float
    paper_maker_out: float
    draft_maker_out: float
    calibrated_maker_out: float


@dataclass(frozen=True, slots=True)
class Population:
    """Structure laws of one surveyed population.

    Attributes:
        name: "humanoid" or "quadruped".
        segments: structural mass [kg] by segment class, from length [m]: those surveyed, those of
            arms and hands, and `other`, the last.
        centres: centre of mass by segment class, for the classes with a known centre.
        uses: the law of the trunk that holds, `trunk` ("paper") or `calibrated`.
        trunk: structural mass of the trunk [kg] from its volume [m3], by a median density.
        calibrated: density of the trunk [kg/m3] from its volume [m3] and thigh + shank [m].
        end: mass of a foot [kg] from its volume [m3], by the median density of the spherical feet
            of quadrupeds; no other feet are surveyed, so humanoids use it too.
        allometry: mass of a whole robot [kg] from its size [m], with its log-normal spread.
        share: 10th percentile, median and 90th percentile of the share of the actuators in the
            mass.
        whole: structural mass of a whole robot [kg] from thigh + shank [m]. With the actuators, it
            is closer to the true mass of held-out robots than the sum over segments.
        held_out: fold errors of total mass on held-out robots.
        source: the publication.
    """

    name: str
    uses: str
    segments: Mapping[str, Law]
    centres: Mapping[str, Centre]
    trunk: Law
    calibrated: Law
    end: Law
    allometry: Law
    share: tuple[float, float, float]
    whole: Law
    held_out: HeldOut
    source: str

    def origin(self, kind: str) -> str:
        """Name of a class of segments, with the population that it was surveyed in."""
        words = self.segments[kind].name.replace("_", " ")
        return words if kind in link_laws() else f"{self.name} {words}"

    @property
    def trunk_density(self) -> float:
        """Median structural mass over volume of the trunk [kg/m3]."""
        return self.trunk.coefficient

    @property
    def end_density(self) -> float:
        """Median mass over volume of a foot [kg/m3]."""
        return self.end.coefficient

    @property
    def trunk_law(self) -> Law:
        """Law of the trunk that holds."""
        return self.calibrated if self.uses == CALIBRATED else self.trunk

    @property
    def trunk_words(self) -> str:
        """The law of the trunk that holds, for reports."""
        if self.uses == PAPER:
            return "median structural mass / volume of the trunk"
        return f"calibrated: {self.calibrated.formula}"

    @property
    def held_out_total(self) -> float:
        """Fold error of the total mass on held-out robots, by the law that holds."""
        return self.held_out.calibrated if self.uses == CALIBRATED else self.held_out.paper


_SCORES = frozenset(HeldOut.__dataclass_fields__)


STRUCTURE_LAWS: Registry[Callable[[str], Population]] = Registry("set of structure laws")


def structure_laws(function: Callable[[str], Population]) -> Callable[[str], Population]:
    """Register a function as a set of structure laws, for `structure` in parameters.yaml.

    The set has the name of the function, which takes "humanoid" or "quadruped". It is that of a
    coefficients file, by `read_population`, or a shipped one of which some laws are replaced:

        @structure_laws
        def printed(name: str) -> Population:
            \"\"\"Links of twice the mass.\"\"\"
            usual = population(name)
            return replace(usual, segments={k: law.scaled(2) for k, law in usual.segments.items()})

    Raises:
        DraftError: a set of this name exists already.
    """
    STRUCTURE_LAWS.add(function.__name__, function, function.__module__)
    return function


def population(name: str, uses: str = CALIBRATED) -> Population:
    """Structure laws of a population.

    Args:
        name: "humanoid" or "quadruped".
        uses: "calibrated" or "paper", the shipped laws with one of those of the trunk, or a set of
            an extension.

    Raises:
        DraftError: the function of an extension fails.
    """
    return _made(name, uses, STRUCTURE_LAWS[uses])


@lru_cache(maxsize=8)
def _made(name: str, uses: str, function: Callable[[str], Population]) -> Population:
    with STRUCTURE_LAWS.calls(uses, "correct it, or write another one for 'structure'"):
        made = function(name)
        if not isinstance(made, Population):
            raise TypeError("it does not give a Population")
        return replace(made, name=name)


def _shipped(uses: str, name: str) -> Population:
    return _population(name, json.loads(FILE.read_text(encoding="utf-8")) | {USES: uses})


for _uses in (CALIBRATED, PAPER):
    STRUCTURE_LAWS.add(_uses, partial(_shipped, _uses), __name__)


def read_population(name: str, path: Readable) -> Population:
    """Read the structure laws of "humanoid" or "quadruped" from a file of `draft survey fit`.

    Raises:
        DraftError: the file cannot be read, or holds no structure laws.
    """
    try:
        return _population(name, json.loads(path.read_bytes()))
    except OSError as error:
        cause = f"cannot be read: {(error.strerror or str(error)).lower()}"
    except (ValueError, KeyError, TypeError, AttributeError):
        cause = f"holds no structure trends of {name}s"
    remedy = "write one with 'draft survey fit'"
    raise DraftError(Problem(cause, Location(str(path)), remedy))


def _population(name: str, table: Mapping[str, Any]) -> Population:
    record = table[name]
    share = record["actuator_share"]
    segments = {key: Law.read(key, row) for key, row in record["segments"].items()}
    segments |= {**link_laws(), "other": Law.read("other", record["other"])}
    uses = table.get(USES, PAPER)
    if uses not in (PAPER, CALIBRATED):
        raise ValueError(uses)
    return Population(
        name=name,
        uses=uses,
        segments=segments,
        centres={
            key: Centre(**row["centre"])
            for key, row in record["segments"].items()
            if "centre" in row
        },
        trunk=Law.read("trunk", record["trunk"]),
        calibrated=Law.read("trunk", record["calibrated"]),
        end=Law.read("end", table["quadruped"]["end"]),
        allometry=Law.read("allometry", record["allometry"]),
        share=(share["p10"], share["median"], share["p90"]),
        whole=Law.read("whole", record["whole"]),
        held_out=HeldOut(**{k: v for k, v in record["held_out"].items() if k in _SCORES}),
        source=table["source"],
    )


@lru_cache(maxsize=1)
def link_laws() -> Mapping[str, Law]:
    """Structural mass [kg] of links of arms and hands from length [m], by class."""
    table = json.loads(LINKS.read_text(encoding="utf-8"))
    return {key: Law.read(key, row) for key, row in table.items()}
