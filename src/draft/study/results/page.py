"""Results page: Markdown with figures beside it, made from collected results."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from draft.extras import need
from draft.files import new_folder, write
from draft.learn.policy import policy
from draft.learn.task.config import STAGES
from draft.metrics.capabilities import CAPABILITIES, RANKED
from draft.plotting import save
from draft.study.report import errors, learning
from draft.study.report import tables as report_tables
from draft.study.report.curves import PANELS
from draft.study.report.missing import missing
from draft.study.report.occupancy import Utilisation
from draft.study.report.records import Study, seeds_in_words
from draft.study.report.spread import by_seed
from draft.study.report.table import Table, to_markdown
from draft.study.results import anomalies, figures, tables
from draft.study.results.comparison import comparison

STRIPS = "strips"
# Name of a policy by its stage, as in the file names of strips.
WORDS = {stage: skill for skill, stage in policy.SKILLS.items()}
OCCUPANCY = (
    "Torque and speed of each joint class in the same instant, of all seeds and replicas. Shade: "
    "share of the samples in a cell of 0.04 by 0.04, from 0.01 % to 10 % and more. Slanted: the "
    "torque-speed line of the motor. Triangles: 95th percentiles of torque and of speed; Σ: that "
    "of their sum, bold for the joint that limits."
)


def write_page(
    study: Study, folder: Path, page: Path, others: Mapping[Path, Study] | None = None
) -> list[Path]:
    """Write the page, and its figures to `images/NAME/` beside it.

    Args:
        study: the results.
        folder: folder of the results; its `strips/` are linked.
        page: the page, NAME.md.
        others: results to compare with, by folder, see `draft.study.results.comparison`.

    Returns:
        The files, the page first.

    Raises:
        DraftError: matplotlib is not installed, another study has nothing in common with this one,
            or the files cannot be written.
    """
    need("matplotlib", "figures")
    beside = {where: comparison(study, other) for where, other in (others or {}).items()}
    used = Utilisation(study)
    images = page.parent / "images" / page.stem
    pictures = _draw(study, used, images)
    text = Page(study, used, folder, page, [path.stem for path in pictures], beside).text()
    write(page, text)
    return [page, *pictures]


def _draw(study: Study, used: Utilisation, images: Path) -> list[Path]:
    """Draw the figures, and remove old ones that are no longer drawn."""
    with new_folder(images, "choose another --write") as new:
        found = save(new, figures.makers(study, used), figures.DPI, ("png",))
        for path in found:
            figures.shrink(path)
    return [images / path.name for path in found]


class Page:
    """Content of the page.

    Attributes:
        study: the results.
        tables: tables of the report and of the results, by name.
        folder: folder of the results.
        page: file of the page.
        pictures: names of the figures that were drawn.
        beside: comparisons with other results, by folder.
    """

    def __init__(
        self,
        study: Study,
        used: Utilisation,
        folder: Path,
        page: Path,
        pictures: Sequence[str],
        beside: Mapping[Path, Table] | None = None,
    ) -> None:
        self.study = study
        self.tables = report_tables.all_tables(study, used) | tables.all_tables(study)
        self.folder, self.page, self.pictures = folder, page, pictures
        self.beside = beside or {}

    def text(self) -> str:
        """Return the page."""
        makers: tuple[Callable[[], str], ...] = (
            *(self._title, self._abilities, self._orders, self._curves, self._perturbed),
            *(self._joints, self._learning, self._seeds, self._choices, self._strips),
            *(self._wrong, self._redo),
        )
        return "\n".join(found for make in makers if (found := make()))

    def _title(self) -> str:
        study, planned = self.study, self.study.planned
        recipe = f" Recipe `{planned.recipe}`." if planned and planned.recipe else ""
        toy = "\n**This is the toy of a study: it shows that all of it runs, and nothing more.**\n"
        absent = missing(study)
        count = f"\n**Not complete: {len(absent)} parts are missing, see the end.**\n"
        stages = ", ".join(s for s in STAGES if s in {one.stage for one in study.singles})
        return (
            f"# Results: {study.name.replace('_', ' ')}\n\n"
            f"<!-- Written by `{self._command()}`; do not edit. -->\n\n"
            f"Designs: {', '.join(study.titles.values())}. Stages: {stages}. "
            f"{seeds_in_words(study.seeds).capitalize()}.{recipe} {len(study.singles)} trainings "
            f"and {len(study.evaluations)} evaluations. SI units; a median over seeds is followed "
            f"by the least and the greatest value in brackets.{self._definitions()}\n"
            + toy * bool(planned and planned.toy)
            + count * bool(absent)
            + f"\n{self._table('designs')}"
        )

    def _definitions(self) -> str:
        """Return the section that says where quantities are defined."""
        if not (self.page.parent / "learning.md").is_file():
            return ""
        return " [Learning](learning.md#what-can-a-policy-do) defines every quantity."

    def _abilities(self) -> str:
        lines = [line for scalar in RANKED if (line := self._ranking(scalar))]
        names = ("capability", "capability_normalised", "walking", "protocols")
        body = "".join(f"\n{table}" for name in names if (table := self._table(name)))
        words = "No policy has been evaluated yet.\n" if not body else ""
        return "## What the robots can do\n\n" + "".join(lines) + words + body

    def _ranking(self, scalar: str) -> str:
        """Return the designs by a skill, the best first, in words."""
        study, arm = self.study, "nominal"
        words, unit = CAPABILITIES[scalar].label, CAPABILITIES[scalar].unit
        found = {design: by_seed(study, design, arm, scalar) for design in study.members}
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
        unit = "" if unit == "1" else f" [{unit}]"
        head = words[0].upper() + words[1:]
        return f"- **{head}**{unit}: {', '.join(places)}\n" if places else ""

    def _orders(self) -> str:
        if not self._table("orders"):
            return ""
        return (
            "## Order of the designs, and how sure it is\n\n"
            f"{self._table('orders')}\n{self._table('pairs')}"
        )

    def _curves(self) -> str:
        body = ""
        for battery, panels in figures.CURVES.items():
            captions = " ".join(PANELS[name].caption for name in panels)
            body += self._picture(f"curves_{battery}", f"Capability by level: {battery}", captions)
        words = "Lines: medians over seeds. Shaded: from the least seed to the greatest. Dashed: "
        words += "the perturbed arm.\n"
        return f"## Capability by level\n\n{words}{body}" if body else ""

    def _perturbed(self) -> str:
        table = self._table("changes")
        if not table:
            return ""
        moved = []
        found = tables.of_skill(self.study, RANKED)
        for scalar in RANKED:
            pair = [found.get((scalar, arm)) for arm in report_tables.ARM_WORDS]
            if pair[0] and pair[1] and pair[0].designs != pair[1].designs:
                names = " > ".join(self.study.titles[name] for name in pair[1].designs)
                moved.append(f"{CAPABILITIES[scalar].label}: {names}")
        order = f"They change the order by {'; by '.join(moved)}." if moved else (
            "The order of the designs by median is the same with and without them."
        )  # fmt: skip
        return f"## With inertia errors\n\n{order}\n\n{table}"

    def _joints(self) -> str:
        planes = [name for name in self.pictures if name.startswith("occupancy_")]
        body = "".join(self._picture(n, f"Torque and speed: {n.split('_')[1]}") for n in planes)
        words = f"{OCCUPANCY}\n" if planes else ""
        table = self._table("utilisation")
        parts = [part for part in (table, words + body) if part]
        return "## What limits them\n\n" + "\n".join(parts) if parts else ""

    def _learning(self) -> str:
        body = "".join(
            self._picture(f"training_{stage}", f"Training: stage {stage}")
            for stage in learning.stages(self.study)
        )
        words = "Lines: medians over seeds of means over fiftieths of a run. Shaded: all seeds.\n"
        curves = f"\n{words}{body}" if body else ""
        return f"## Learning\n\n{self._table('spent')}\n{self._table('training')}{curves}"

    def _seeds(self) -> str:
        table = self._table("seed_variation")
        return f"## Variation over seeds\n\n{table}" if table else ""

    def _choices(self) -> str:
        found = "\n".join(map(to_markdown, self.beside.values()))
        return f"## How far it depends on our choices\n\n{found}" if found else ""

    def _strips(self) -> str:
        body = ""
        for title in self.study.titles.values():
            for word in WORDS.values():
                path = self.folder / STRIPS / f"{title}-{word}.png"
                if path.is_file():
                    link = Path(os.path.relpath(path.resolve(), self.page.resolve().parent))
                    body += f"\n![{title}: {word}]({link.as_posix()})\n\n{title}: {word}\n"
        words = "Each strip is of the seed with the median top speed.\n"
        return f"## In motion\n\n{words}{body}" if body else ""

    def _wrong(self) -> str:
        found = anomalies.anomalies(self.study)
        checks = (
            "These checks were made: every base policy walks; every design climbs; the top speed "
            f"ranges over at most {100 * anomalies.RANGE:.0f} % of its median; no efficiency is "
            "above what the counted torques and speeds allow; no skill is better with inertia "
            "errors in every seed.\n"
        )
        body = _list(found) or "\nNone of them failed.\n"
        flags, absent = report_tables.remarks(self.study), missing(self.study)
        body += f"\nFlags of the evaluations:\n{_list(flags)}" if flags else ""
        body += f"\nMissing:\n{_list(absent)}" if absent else ""
        return f"## What looks wrong, and what is missing\n\n{checks}{body}"

    def _redo(self) -> str:
        study, planned = self.study, self.study.planned
        file = self.folder / f"{study.name}.yaml"
        toy = " --toy" * bool(planned and planned.toy)
        source = f"studies/{study.name}{'-toy' * bool(toy)}"
        known, place = file.is_file(), _place(self.folder)
        commands = [f"draft study {place}/{file.name}{toy}   # to {source}, in slices if need be"]
        commands *= known
        commands += [f"draft study collect {source} --out {place}", self._command()]
        listed = "\n".join(commands)
        whose = "; ".join(errors.WORDS[source] for source in errors.sources(study))
        whose = f" Inertia errors: {whose}." if whose else ""
        return (
            f"## How to redo it\n\n```sh\n{listed}\n```\n\n"
            f"All numbers, curves and counts are in `{place}`, as plain text.{whose}\n\n"
            f"{self._table('provenance')}\n{self._table('versions')}\n{self._table('evaluations')}"
        )

    def _command(self) -> str:
        page = os.path.relpath(self.page)
        named = self.page.name if page.startswith("..") else Path(page).as_posix()
        others = " ".join(map(_place, self.beside))
        against = f" --against {others}" if others else ""
        return f"draft study results {_place(self.folder)}{against} --write {named}"

    def _table(self, name: str) -> str:
        table: Table | None = self.tables.get(name)
        return to_markdown(table) if table else ""

    def _picture(self, name: str, spoken: str, caption: str = "") -> str:
        if name not in self.pictures:
            return ""
        link = f"images/{self.page.stem}/{name}.png"
        return f"\n![{spoken}]({link})\n" + (f"\n{caption}\n" if caption else "")


def _place(folder: Path) -> str:
    """Return the path of a results folder for a command in the current folder."""
    relative = os.path.relpath(folder)
    return folder.resolve().name if relative.startswith("..") else Path(relative).as_posix()


def _list(items: Sequence[str]) -> str:
    return "".join(f"\n- {item}" for item in items) + "\n" if items else ""
