"""The page: one HTML file with its figures in it. It loads nothing."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from pathlib import Path

from draft.extras import own_version
from draft.study.report import errors
from draft.study.report.curves import PANELS
from draft.study.report.learning import SHOWN, lines
from draft.study.report.missing import missing
from draft.study.report.records import Study, seeds_in_words
from draft.study.report.table import Table, to_html
from draft.study.report.tables import remarks
from draft.webpage import webpage

TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
Content = tuple[str, str, str]


class Page:
    """Content of the page.

    Attributes:
        study: records of the study.
        tables: tables by name.
        pictures: file of each figure by name.
        warnings: what was omitted.
    """

    def __init__(
        self,
        study: Study,
        tables: Mapping[str, Table],
        pictures: Mapping[str, Path],
        warnings: Sequence[str],
    ) -> None:
        self.study = study
        self.tables = tables
        self.pictures = pictures
        self.warnings = warnings

    def text(self) -> str:
        """The page."""
        makers = (
            *(self._robots, self._capability, self._families, self._utilisation, self._seeds),
            *(self._training, self._conditions, self._remarks),
        )
        sections = [found for make in makers if (found := make()) is not None]
        links = "".join(f'<a href="#{name}">{escape(title)}</a>' for name, title, _ in sections)
        body = "".join(
            f'<section id="{name}"><h2>{escape(title)}</h2>{content}</section>\n'
            for name, title, content in sections
        )
        css = (files("draft.study.report") / "page.css").read_text(encoding="utf-8")
        title = f"Study: {self.study.name}"
        header = (
            f"<header><h1>{escape(title)}</h1>{self._about()}{self._toy()}"
            f"<nav>{links}</nav>{self._warned()}</header>"
        )
        return webpage(title, css, f"{header}\n<main>{body}</main>")

    def _about(self) -> str:
        study = self.study
        words = []
        if study.members:
            words.append(
                f"{_count(len(study.members), 'design')}: {', '.join(study.titles.values())}"
            )
            words.append(seeds_in_words(study.seeds))
        if study.families:
            count = len({member.name for run in study.families for member in run.members})
            words.append(f"{_count(count, 'member')} of families")
        whose = " and ".join(errors.WORDS[source] for source in errors.sources(study))
        perturbed = f"perturbed inertia ({whose})" if whose else "perturbed inertia"
        arms = " and ".join(perturbed if arm == "perturbed" else arm for arm in study.arms)
        words.append(f"evaluated: {arms}" if arms else "not evaluated yet")
        if study.arms and study.protocol == "published":
            words.append("by the published protocol, in which 10 % stand still")
        made = f"Draft {own_version()}. SI units. Bands run from the least seed to the greatest."
        return f'<p>{escape("; ".join(words))}.</p><p class="made">{escape(made)}</p>'

    def _toy(self) -> str:
        if not (self.study.planned and self.study.planned.toy):
            return ""
        words = "This is a toy study: it shows that everything runs, and nothing about the designs."
        return f'<div class="warning" role="note">{words}</div>'

    def _warned(self) -> str:
        if not self.warnings:
            return ""
        items = "".join(f"<li>{escape(words)}</li>" for words in self.warnings)
        return f'<div class="warning" role="note">Omitted from this report:<ul>{items}</ul></div>'

    def _robots(self) -> Content | None:
        words = "Home poses at true relative size."
        picture = self._picture("robots", words)
        return ("robots", "Robots", picture) if picture else None

    def _capability(self) -> Content | None:
        if not self.study.members:
            return None
        tables = [self._table("capability"), self._table("capability_normalised")]
        curves = [self._picture(f"curve_{name}", panel.caption) for name, panel in PANELS.items()]
        tables += [self._table("walking"), self._table("energy"), self._table("protocols")]
        if not any(tables):
            words = "<p>No policy has been evaluated; run 'draft evaluate RUN'.</p>"
            return "capability", "Capability", words
        return (
            "capability",
            "Capability",
            _first(tables) + self._key() + _grid(curves) + _rest(tables),
        )

    def _key(self, training: bool = False) -> str:
        drawn = lines(self.study) if training else lines(self.study)[: len(self.study.members)]
        items = [
            f'<span><i style="color:{line.tint}"></i>{escape(line.title)}</span>' for line in drawn
        ]
        if not training and "perturbed" in self.study.arms:
            items.append(
                '<span><i class="dashed" style="color:#57606a"></i>perturbed inertia</span>'
            )
        return f'<div class="key">{"".join(items)}</div>'

    def _families(self) -> Content | None:
        if not self.study.families:
            return None
        runs = ", ".join(one.name for one in self.study.families)
        words = "Their figures are those of 'draft surface ROBOT --policy RUN'."
        return "family", "Family", f"<p>Runs of families: {escape(runs)}. {words}</p>"

    def _utilisation(self) -> Content | None:
        figures = [
            self._picture(name, "", f"{name.replace('_', ' ')}: torque and speed of the joints")
            for name in self.pictures
            if name.startswith("occupancy_")
        ]
        table = self._table("utilisation")
        if not table and not any(figures):
            return None
        words = (
            "Torque and speed of each joint class in the same instant, all seeds and replicas. "
            "Shade: share of the samples in a cell of 0.04 by 0.04, from 0.01 % to 10 % and more. "
            "Slanted: the torque-speed line of the motor. Triangles: 95th percentiles of torque "
            "and of speed; Σ: that of their sum, bold for the joint that limits."
        )
        words = f'<p class="caption">{words}</p>' if any(figures) else ""
        return "utilisation", "Utilisation", table + words + _grid(figures)

    def _seeds(self) -> Content | None:
        table = self._table("seed_variation")
        if not table and len(self.study.seeds) == 1:
            table = "<p>There is one seed, so nothing can be said about their variation.</p>"
        return ("seeds", "Variation over seeds", table) if table else None

    def _training(self) -> Content | None:
        names = [name for name in self.pictures if name.startswith("training_")]
        if not names:
            return None
        words = "Means over fiftieths of a run; lines are medians over seeds, bands all of them."
        figures = [self._picture(name, "", _spoken(name)) for name in names]
        return "training", "Training", f"<p>{words}</p>{self._key(training=True)}{_grid(figures)}"

    def _conditions(self) -> Content | None:
        content = self._table("training") + self._table("evaluations")
        listed = ", ".join(f"{row[0]} {row[1]}" for row in self.tables["versions"].rows)
        content += f"<p>{escape(self.tables['versions'].caption)} {escape(listed)}.</p>"
        return "conditions", "What was run", content

    def _remarks(self) -> Content | None:
        parts, flags = missing(self.study), remarks(self.study)
        content = _list(parts, "Missing") + _list(flags, "Flags of the evaluations")
        return ("remarks", "Missing and flagged", content) if content else None

    def _table(self, name: str) -> str:
        return to_html(self.tables[name]) if name in self.tables else ""

    def _picture(self, name: str, caption: str, spoken: str = "") -> str:
        path = self.pictures.get(name)
        if path is None:
            return ""
        data = base64.b64encode(path.read_bytes()).decode()
        words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
        return (
            f'<figure id="figure-{name}"><img alt="{escape(spoken or caption)}" '
            f'src="data:{TYPES[path.suffix]};base64,{data}">{words}</figure>'
        )


def _spoken(name: str) -> str:
    stage, quantity = name.split("_", 2)[1:]
    return f"{SHOWN[quantity][0]} of stage {stage} over iterations"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"


def _grid(figures: Sequence[str]) -> str:
    shown = "".join(figures)
    return f'<div class="grid">{shown}</div>' if shown else ""


def _first(tables: Sequence[str]) -> str:
    return "".join(tables[:2])


def _rest(tables: Sequence[str]) -> str:
    return "".join(tables[2:])


def _list(items: Sequence[str], title: str) -> str:
    if not items:
        return ""
    return (
        f'<h3>{title}</h3><ul class="plain">{"".join(f"<li>{escape(i)}</li>" for i in items)}</ul>'
    )
