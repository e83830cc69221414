"""The page holds what it is about, is sound HTML, loads nothing and runs nobody's text."""

from __future__ import annotations

import dataclasses
import json
import re
from html import unescape
from html.parser import HTMLParser
from typing import Any
from unittest.mock import patch

import pytest

import draft
from draft.errors import DraftError
from draft.explore.comparison import compare
from draft.explore.comparison_tables import section
from draft.metrics import METRICS, Metric
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects
from draft.reporting.tables import actuators, number
from draft.values import scalar
from tests.commands import Command
from tests.helpers import parameter, robot

pytest.importorskip("plotly")

VOID = {"meta", "link", "br", "img", "hr", "input"}
HOSTILE = "<script>alert(1)</script><img src=x onerror=alert(1)>\"'&"


class Reader(HTMLParser):
    """Ids, attributes and words of a page; every element must be closed in order."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.loads: list[str] = []
        self.handlers: list[str] = []
        self.scripts: dict[str, str] = {}
        self.words: list[str] = []
        self._script = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.tags.append(tag)
        self.ids += [str(given["id"])] if "id" in given else []
        names = ("src", "href", "srcset", "data", "action", "poster")
        self.loads += [str(given[name]) for name in names if name in given]
        self.handlers += [name for name in given if name.startswith("on")]
        self._script = str(given.get("id", "code")) if tag == "script" else ""
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[self._script] = self.scripts.get(self._script, "") + data
        elif self.open and self.open[-1] != "style":
            self.words.append(data)


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    reader.close()
    assert reader.open == []
    return reader


@pytest.fixture(scope="module")
def text(three: list[Subject]) -> str:
    return page(three)


def own_words(reader: Reader) -> str:
    return " ".join(" ".join(reader.words).split())


def test_the_page_names_every_design_with_its_mass_and_findings(
    text: str, three: list[Subject]
) -> None:
    words = own_words(read(text))
    for subject in three:
        assert subject.title in words
        assert number(subject.design.mass) in words
        for finding in subject.design.findings:
            assert finding.message in words
            assert finding.source in words
    for name in ("thigh_length", "peak torque", "90 % band of the mass", "accepted"):
        assert name in words


def test_the_page_is_sound_the_same_every_time_and_loads_nothing(
    text: str, three: list[Subject]
) -> None:
    assert page(three) == text
    reader = read(text)
    assert len(set(reader.ids)) == len(reader.ids)
    figures = json.loads(reader.scripts["draft-figures"])
    assert {f"plot-{name}" for name in figures} <= set(reader.ids)
    assert {"masses", "trends"} <= set(figures)
    assert len(json.loads(reader.scripts["draft-robots"])["robots"]) == 3
    assert reader.loads == ["data:,"]
    assert reader.handlers == []
    assert "Content-Security-Policy" in text
    style = text[text.index("<style>") : text.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style
    data = json.loads(reader.scripts["draft-report"])
    own = [
        reader.scripts["draft-figures"],
        reader.scripts["draft-robots"],
        json.dumps(_without_sources(data)),
    ]
    assert not any(re.search(r"https?://", script) for script in own)


def test_the_comparison_is_that_of_the_command(
    text: str, three: list[Subject], command: Command
) -> None:
    data = json.loads(read(text).scripts["draft-report"])["comparison"]
    record = command.json("compare cheetah bear giraffe")
    names = {one: one.partition(":")[2] for one in record["designs"]}
    assert data["designs"] == {names[one]: row for one, row in record["designs"].items()}
    for own, one in zip(data["against_first"], record["against_first"], strict=True):
        assert own == one | {"design": names[one["design"]]}
    assert [*data["limits"].values()] == [*record["limits"].values()]
    assert [*data["findings_alone"].values()] == [*record["findings_alone"].values()]
    shown = section(compare([one.design for one in three], names=[one.title for one in three]))
    words = own_words(read(text))
    for table in (shown.summary, shown.metrics, shown.limits, *shown.shares):
        assert not isinstance(table, str)
        for row in table.rows:
            assert " ".join(cell for cell in row if cell) in words
    assert all(line in words for line in shown.alone)


def test_a_page_about_one_design_or_other_robots_compares_what_it_can() -> None:
    spec = draft.load("quadruped")
    one = page(subjects([spec.resolve()]))
    assert 'id="comparison"' not in one
    other = page(subjects([spec.resolve(), draft.load("hopper").resolve()]))
    assert "another robot, so no number of one is one of the other" in other


def _without_sources(data: Any) -> Any:
    """Data without the texts that name where a number is published."""
    if isinstance(data, dict):
        return {key: _without_sources(of) for key, of in data.items() if key != "source"}
    return [_without_sources(item) for item in data] if isinstance(data, list) else data


def test_scripts_can_read_the_reports_in_the_page(text: str, three: list[Subject]) -> None:
    data = json.loads(read(text).scripts["draft-report"])
    assert list(data["designs"]) == [subject.title for subject in three]
    for subject in three:
        assert data["designs"][subject.title]["mass_kg"] == subject.design.mass


def hostile() -> Subject:
    """A robot whose every text is hostile."""
    spec = robot(parameters={"long": parameter(0.3) | {"doc": HOSTILE}})
    design = dataclasses.replace(spec, doc=HOSTILE, name=HOSTILE).resolve()
    finding = draft.load("quadruped").resolve("giraffe").findings[0]
    finding = dataclasses.replace(finding, where=HOSTILE, text=HOSTILE, source=HOSTILE)
    design = dataclasses.replace(design, label=HOSTILE, findings=(finding,))
    return subjects([design, design])[1]


def test_hostile_texts_are_words_and_nothing_else() -> None:
    written = page([hostile()])
    reader = read(written)
    assert reader.tags.count("script") == 7  # Data, Plotly, the page's own, and its modules.
    assert "img" not in reader.tags
    assert reader.handlers == []
    assert HOSTILE in unescape(own_words(reader))
    figures = json.loads(reader.scripts["draft-figures"])
    assert "<" not in json.dumps(
        [trace.get("name", "") for figure in figures.values() for trace in figure["data"]]
        + [trace.get("text", "") for figure in figures.values() for trace in figure["data"]]
    ).replace("<extra>", "")


def test_a_refused_design_is_shown_with_its_reasons() -> None:
    design = draft.load("quadruped").resolve({"actuators.leg.peak_torque": 5000})
    assert not design.accepted
    (subject,) = subjects([design])
    words = own_words(read(page([subject])))
    assert "refused" in words
    for finding in design.findings:
        if finding.severity == "error":
            assert finding.message in words
            assert finding.remedy in words


def test_metrics_are_compared() -> None:
    def metric(name: str, unit: str, better: Any, function: Any) -> Metric:
        return Metric(name, unit, "Words.", "a / b", "A book.", better, "design", function)

    made = (
        metric("trunk_mass", "kg", "less", lambda d: d.trunk.mass),
        metric("stands", "bool", "more", lambda d: True),
        metric("nowhere", "m", "", lambda d: float("nan")),
        metric("seldom", "m", "", lambda d: 1.0 if d.label == "bear" else float("nan")),
    )
    spec = draft.load("quadruped")
    with patch.dict(METRICS._items, {one.name: one for one in made}, clear=True):
        found = subjects([spec.resolve("cheetah"), spec.resolve("bear")])
        text = page(found)
    words = own_words(read(text))
    assert "trunk mass" in words
    assert "yes" in words
    assert "nowhere" not in words
    assert "kg, lower is better" in words
    metrics = text[text.index('<section id="metrics"') : text.index("</main>")]
    assert metrics.count("seldom") == 1  # in the table: one value is no comparison
    assert json.loads(read(text).scripts["draft-report"])["metrics"]["cheetah"]["nowhere"] is None


@pytest.mark.parametrize(
    ("value", "words"),
    [
        *((33.61, "33.6"), (0.0198, "0.0198"), (1.0, "1.00"), (1272.3, "1272"), (112.74, "113")),
        *((999.6, "1000"), (2.5e-6, "2.50e-06"), (0.0, "0"), (float("nan"), "–"), (-3.25, "-3.25")),
    ],
)
def test_numbers_have_three_digits(value: float, words: str) -> None:
    assert number(value) == words


def test_the_page_of_none_or_many_is_refused() -> None:
    for count in (0, 13):
        with pytest.raises(DraftError, match="1 to 12 designs"):
            subjects([draft.load("hopper").resolve()] * count)


def test_rated_torque_is_in_the_table_of_actuators(three: list[Subject]) -> None:
    shown = actuators(three)
    assert "rated torque" in shown
    rated = [scalar(one.design.actuators["leg"].rated_torque) for one in three]
    assert len(set(rated)) == 3
    assert all(number(value) in shown for value in rated)
