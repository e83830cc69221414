"""Sections of a study's page, as data: what a report in HTML and a page in Markdown show."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from draft.errors import counted
from draft.learn.policy import policy
from draft.learn.task.stages import STAGES
from draft.metrics.capabilities import CAPABILITIES, RANKED
from draft.study.report import anomalies, errors
from draft.study.report.blocks import (
    Block,
    Commands,
    Items,
    Key,
    Page,
    Paragraph,
    Picture,
    Pictures,
    Section,
)
from draft.study.report.learning import lines
from draft.study.report.missing import missing
from draft.study.report.records import Study, seeds_in_words
from draft.study.report.run_tables import remarks
from draft.study.report.spread import ARM_WORDS, by_seed
from draft.study.report.table import Table
from draft.study.report.tables import of_skill

STRIPS = "strips"
# Name of a policy by its stage, as in the file names of strips.
WORDS = {stage: skill for skill, stage in policy.STUDIED.items()}
TOY = "This is the toy of a study: it shows that all of it runs, and nothing about the designs."
CURVES = (
    "Lines: medians over seeds. Shaded: from the least seed to the greatest. Dashed: the perturbed "
    "arm."
)
OCCUPANCY = (
    "Torque and speed of each joint class in the same instant, of all seeds and replicas. Shade: "
    "share of the samples in a cell of 0.04 by 0.04, from 0.01 % to 10 % and more. Slanted: the "
    "torque-speed line of the motor. Triangles: 95th percentiles of torque and of speed; Σ: that "
    "of their sum, bold for the joint that limits."
)
CHECKS = (
    "These checks were made: every base policy walks; every design climbs; the top speed ranges "
    f"over at most {100 * anomalies.RANGE:.0f} % of its median; no efficiency is above what the "
    "counted torques and speeds allow; no skill is better with inertia errors in every seed."
)


@dataclass(frozen=True)
class Source:
    """Where collected results are, and where their page is.

    Attributes:
        folder: folder of the results; its `strips/` are shown.
        page: file of the page.
        beside: comparisons with other results, by folder.
        commands: command lines that repeat the study, of which the last one writes the page.
    """

    folder: Path
    page: Path
    beside: Mapping[Path, Table]
    commands: Sequence[str]


class Contents:
    """Content of a page.

    Attributes:
        study: records of the study.
        tables: tables by name.
        pictures: figures that were drawn, by section.
        source: place of the results; None for a page on the folder of a study.
    """

    def __init__(
        self,
        study: Study,
        tables: Mapping[str, Table],
        pictures: Mapping[str, Sequence[Picture]],
        source: Source | None = None,
    ) -> None:
        self.study, self.tables, self.pictures = study, tables, pictures
        self.source = source

    def page(self) -> Page:
        """Return the page; sections without content are left out."""
        title = f"Study: {self.study.name}"
        comment, last = "", "What was run"
        if self.source is not None:
            title = f"Results: {self.study.name.replace('_', ' ')}"
            comment = f"Written by `{self.source.commands[-1]}`; do not edit."
            last = "How to redo it"
        found = (
            Section("robots", "Robots", self._pictures("robots")),
            Section("capability", "What the robots can do", [*self._capability()]),
            Section(
                *("orders", "Order of the designs, and how sure it is"),
                self._tables("orders", "pairs"),
            ),
            Section("curves", "Capability by level", [*self._curves()]),
            Section("errors", "With inertia errors", [*self._errors()]),
            Section("family", "Family", [*self._families()]),
            Section("utilisation", "What limits them", [*self._utilisation()]),
            Section("training", "Learning", [*self._training()]),
            Section("seeds", "Variation over seeds", [*self._seeds()]),
            Section("choices", "How far it depends on our choices", self._choices()),
            Section("motion", "In motion", [*self._strips()]),
            Section("remarks", "What looks wrong, and what is missing", [*self._remarks()]),
            Section("conditions", last, [*self._conditions()]),
        )
        return Page(title, [*self._about()], [one for one in found if one.blocks], comment)

    def _about(self) -> Iterator[Block]:
        study, planned = self.study, self.study.planned
        runs = study.runs
        words = []
        if study.members:
            words.append(f"Designs: {', '.join(study.titles.values())}")
        if study.families:
            count = len({member.name for run in study.families for member in run.members})
            words.append(f"{counted(count, 'member')} of families")
        words.append(f"Stages: {', '.join(s for s in STAGES if s in {one.stage for one in runs})}")
        words.append(seeds_in_words(sorted({one.seed for one in runs})).capitalize())
        if planned and planned.recipe:
            words.append(f"Recipe `{planned.recipe}`")
        evaluations = counted(len(study.evaluations), "evaluation")
        words.append(f"{counted(len(runs), 'training')} and {evaluations}{self._arms()}")
        words.append(
            "SI units; a median over seeds is followed by the least and the greatest value"
        )
        if self.source and (self.source.page.parent / "learning.md").is_file():
            words.append("[Learning](learning.md#what-can-a-policy-do) defines every quantity")
        yield Paragraph(". ".join(words) + ".")
        if planned and planned.toy:
            yield Paragraph(TOY, "warning")
        if absent := missing(study):
            parts = "1 part is" if len(absent) == 1 else f"{len(absent)} parts are"
            yield Paragraph(f"Not complete: {parts} missing, see the end.", "warning")
        if self.study.warnings:
            yield Items(self.study.warnings, "Omitted from this report:", "warning")
        yield from self._tables("designs")

    def _arms(self) -> str:
        """Return the arms of the evaluations, and how they were made, in words."""
        study = self.study
        whose = " and ".join(errors.WORDS[source] for source in errors.sources(study))
        arms = [ARM_WORDS[arm] + f" ({whose})" * (arm == "perturbed" and bool(whose))
                for arm in study.arms]  # fmt: skip
        published = bool(arms) and study.protocol == "published"
        how = " by the published protocol, in which 10 % stand still" * published
        return f", {' and '.join(arms)}{how}" if arms else ""

    def _capability(self) -> Iterator[Block]:
        if not self.study.members:
            return
        names = ("capability", "capability_normalised", "walking", "energy", "protocols")
        tables = self._tables(*names)
        if ranked := [line for scalar in RANKED if (line := self._ranking(scalar))]:
            yield Items(ranked)
        yield from tables or [
            Paragraph("No policy has been evaluated yet; run `draft evaluate RUN`.")
        ]

    def _ranking(self, scalar: str) -> str:
        """Return the designs by a skill, the best first, in words."""
        study = self.study
        found = {design: by_seed(study, design, "nominal", scalar) for design in study.members}
        known = [(design, v.spread) for design, v in found.items() if v.spread]
        known.sort(key=lambda item: (-item[1].median, item[0]))
        none = [study.titles[design] for design, v in found.items() if v.measured and not v.known]
        places = []
        for design, one in known:
            digits = max(2, one.decimals)
            text = f"{study.titles[design]} {one.median:.{digits}f}"
            text += f" ({one.low:.{digits}f}–{one.high:.{digits}f})" if one.count > 1 else ""
            places.append(text)
        places += [f"{name} none" for name in none]
        words, unit = CAPABILITIES[scalar].label, CAPABILITIES[scalar].unit
        unit = "" if unit == "1" else f" [{unit}]"
        head = words[0].upper() + words[1:]
        return f"**{head}**{unit}: {', '.join(places)}" if places else ""

    def _curves(self) -> Iterator[Block]:
        if found := self._pictures("curves"):
            yield from (Paragraph(CURVES), self._key(), *found)

    def _key(self, families: bool = False) -> Key:
        drawn = lines(self.study)
        drawn = drawn if families else drawn[: len(self.study.members)]
        colors: list[tuple[str, str | None]] = [(line.title, line.tint) for line in drawn]
        if not families and "perturbed" in self.study.arms:
            colors.append((ARM_WORDS["perturbed"], None))
        return Key(colors)

    def _errors(self) -> Iterator[Block]:
        found = of_skill(self.study, RANKED)
        moved, same = [], 0
        for scalar in RANKED:
            right, wrong = (found.get((scalar, arm)) for arm in ARM_WORDS)
            if right and wrong and right.designs != wrong.designs:
                names = " > ".join(self.study.titles[name] for name in wrong.designs)
                moved.append(f"{CAPABILITIES[scalar].label}: {names}")
            same += bool(right and wrong and right.designs == wrong.designs)
        tables = self._tables("changes")
        if tables and moved:
            yield Paragraph(f"They change the order by {'; by '.join(moved)}.")
        elif tables and same:
            yield Paragraph("The order of the designs by median is the same with and without them.")
        yield from tables

    def _families(self) -> Iterator[Block]:
        if self.study.families:
            runs = ", ".join(one.name for one in self.study.families)
            yield Paragraph(
                f"Runs of families: {runs}. Their figures are those of `draft surface ROBOT` with "
                "the run as its policy."
            )

    def _utilisation(self) -> Iterator[Block]:
        yield from self._tables("utilisation")
        if found := self._pictures("utilisation"):
            yield from (Paragraph(OCCUPANCY, "caption"), *found)

    def _training(self) -> Iterator[Block]:
        yield from self._tables("spent", "training")
        if found := self._pictures("training"):
            words = "Lines: medians over seeds of means over fiftieths of a run. Shaded: all seeds."
            yield from (Paragraph(words), self._key(families=True), *found)

    def _seeds(self) -> Iterator[Block]:
        tables = self._tables("seed_variation")
        if not tables and len(self.study.seeds) == 1:
            yield Paragraph("There is one seed, so nothing can be said about their variation.")
        yield from tables

    def _choices(self) -> list[Block]:
        return [*self.source.beside.values()] if self.source else []

    def _strips(self) -> Iterator[Block]:
        folder = self.source.folder / STRIPS if self.source else Path()
        paths = {
            f"{title}: {word}": folder / f"{title}-{word}.png"
            for title in self.study.titles.values()
            for word in WORDS.values()
            if self.source
        }
        found = [Picture(p.stem, words, p, words) for words, p in paths.items() if p.is_file()]
        if found:
            yield Paragraph("Each strip is of the seed with the median top speed.")
            yield Pictures(found)

    def _remarks(self) -> Iterator[Block]:
        study = self.study
        if study.members and study.evaluations:
            yield Paragraph(CHECKS)
            found = anomalies.anomalies(study)
            yield Items(found) if found else Paragraph("All of them passed.")
        if flags := remarks(study):
            yield Items(flags, "Flags of the evaluations:")
        if absent := missing(study):
            yield Items(absent, "Missing:")

    def _conditions(self) -> Iterator[Block]:
        if self.source:
            yield Commands(self.source.commands)
            whose = "; ".join(errors.WORDS[source] for source in errors.sources(self.study))
            whose = f" Inertia errors: {whose}." if whose else ""
            place = place_of(self.source.folder)
            words = f"All numbers, curves and counts are in `{place}`, as plain text.{whose}"
            yield Paragraph(words)
        yield from self._tables("provenance", "versions", "evaluations")

    def _tables(self, *names: str) -> list[Block]:
        return [self.tables[name] for name in names if name in self.tables]

    def _pictures(self, section: str) -> list[Block]:
        found = self.pictures.get(section)
        return [Pictures(found)] if found else []


def place_of(folder: Path) -> str:
    """Return the path of a results folder for a command in the current folder."""
    relative = os.path.relpath(folder)
    return folder.resolve().name if relative.startswith("..") else Path(relative).as_posix()
