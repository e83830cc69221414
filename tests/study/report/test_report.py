"""Reports on made-up studies: what is there is told, and what is not is said in words."""

from __future__ import annotations

import csv
import re
import shutil
import statistics
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import draft
from draft.errors import DraftError

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from matplotlib import pyplot as plt

from draft.study.report import robots, tables, writing
from draft.study.report.curves import PANELS, over_level, over_speed
from draft.study.report.folder import read
from draft.study.report.labels import label_drops
from draft.study.report.run_tables import remarks
from draft.study.report.spread import Spread, Values
from draft.study.report.table import Table, to_csv, to_tex
from tests.learn import synthetic
from tests.study.report.pages import page_of, tables_of, to_html

KINDS = writing.KINDS
SUMMARY = '{"format": 2, "arm": "nominal", "protocol": "walking"'


def cells(table: Table, *start: str) -> dict[str, dict[str, str]]:
    """Rows of a table's CSV by title; those that begin so."""
    rows = list(csv.reader(to_csv(table).splitlines()))
    return {
        row[0]: dict(zip(rows[0], row, strict=True)) for row in rows[1:] if {*start} & {*row[:4]}
    }


class Links(HTMLParser):
    """What a page would fetch, and what it says."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[str] = []
        self.said = ""
        self._open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [value or "" for name, value in attrs if name in ("src", "href")]
        self._open.append(tag)

    def handle_data(self, data: str) -> None:
        self.said += "" if self._open and self._open[-1] == "style" else data


def test_the_report_is_written_whole_with_its_figures_and_tables_and_again_the_same(
    one: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "KINDS", KINDS)
    page = writing.write(one)
    assert page == one.resolve() / "report" / "index.html"
    figures = list((page.parent / "figures").iterdir())
    assert {path.suffix for path in figures} == {".png", ".pdf", ".svg"}
    names = {path.stem for path in figures}
    assert {"capability", "curve_speed", "curve_survival", "curve_efficiency", "robots"} <= names
    assert {"training_velocity_reward", "occupancy_speed_cheetah"} <= names
    assert {path.suffix for path in (page.parent / "tables").iterdir()} == {".csv", ".tex"}
    assert {path.name for path in one.iterdir()} == {"runs", "report"}
    text = page.read_text(encoding="utf-8")
    assert not any(word in Links(text).said for word in ("NaN", "nan", "None", "inf "))
    outside = [link for link in Links(text).found if not link.startswith(("data:", "#"))]
    assert outside == []
    assert "url(" not in text.partition("<body>")[0]
    first, second = page.parent, writing.write(one, tmp_path / "again").parent
    files = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert len(files) > 15
    assert [f for f in files if (first / f).read_bytes() != (second / f).read_bytes()] == []


def test_the_least_cost_of_transport_is_the_best_and_the_longest_range(
    source: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    study = read(source)
    numbers = dict(zip(study.members, (2.0, 1.0, 3.0), strict=True))
    monkeypatch.setattr(tables, "by_seed", lambda _, name, *__: Values({0: numbers[name]}, {}))
    table = tables.capability(study, "energy")
    assert table is not None
    heads = [column.title for column in table.columns]
    for title, best in (("cost of transport", 1.0), ("range", 3.0)):
        own = [cast("Spread", row[heads.index(title)]) for row in table.rows]
        assert {spread.median for spread in own if spread.best} == {best}


def test_medians_and_bands_are_those_of_the_seeds(source: Path) -> None:
    rows = cells(tables_of(source)["capability"], "nominal")
    for design, row in rows.items():
        values = [synthetic.able(design, seed, "nominal") for seed in (0, 1, 2)]
        for i, scalar in enumerate(("top speed [m/s]", "step [m]", "kick [m/s]", "efficiency η")):
            own = [value[i] for value in values]
            expected = [statistics.median(own), min(own), max(own)]
            said = [float(row[key]) for key in (scalar, f"{scalar}, least", f"{scalar}, greatest")]
            assert said == pytest.approx(expected, rel=1e-5)
    assert list(rows) == ["cheetah", "bear", "giraffe"]  # by leg length


def test_the_capability_table_has_the_masses_and_marks_the_best_of_an_arm(source: Path) -> None:
    table = tables_of(source)["capability"]
    rows = cells(table, "nominal")
    masses = {name: draft.load("quadruped").resolve(name).mass for name in rows}
    assert {name: float(row["mass [kg]"]) for name, row in rows.items()} == pytest.approx(
        masses, rel=1e-4
    )
    heads = [column.title for column in table.columns]
    for title in ("top speed", "kick"):
        at, arm = heads.index(title), heads.index("arm")
        for one in ("nominal", "perturbed inertia"):
            own = [cast("Spread", row[at]) for row in table.rows if row[arm] == one]
            best = max(spread.median for spread in own)
            assert [spread.best for spread in own] == [spread.median == best for spread in own]
    at = heads.index("top speed")
    nominal = [cast("Spread", row[at]) for row in table.rows[::2]]
    (best,) = [one for one in nominal if one.best]
    shown = f"{best.median:.{table.digits(at)}f}"
    assert f"<b>{shown}</b> <small>" in to_html(table)
    assert rf"\textbf{{{shown}}} (" in to_tex(table)


def test_a_hand_made_study_of_three_seeds_reads_as_it_should(tmp_path: Path) -> None:
    for seed, speed in enumerate((3.0, 3.6, 3.1)):
        run = synthetic.trained(tmp_path, "cheetah", "velocity", seed)
        synthetic.evaluated(run, change=lambda s, v=speed: s["scalars"].update(top_speed=v))
    tables = tables_of(tmp_path)
    assert "3.1 <small>3.0–3.6</small>" in to_html(tables["capability"])
    assert "3.1 (3.0--3.6)" in to_tex(tables["capability"])
    # mean 3.2333, standard deviation of the sample 0.32146
    assert "9.9" in to_html(tables["seed_variation"])


def test_normalised_speed_is_per_root_of_g_and_leg_length(source: Path) -> None:
    row = cells(tables_of(source)["capability_normalised"], "nominal")["cheetah"]
    assert float(row["v/√(gL)"]) == pytest.approx(3.4 / (9.81 * 0.48) ** 0.5, rel=1e-4)


def test_curves_are_medians_over_seeds_level_by_level(source: Path) -> None:
    study = read(source)
    x, middle, low, high = over_level(study, "quadruped:bear", "perturbed", PANELS["push"])
    assert x.tolist() == synthetic.KICKS
    evaluations = list(study.of("quadruped:bear", "perturbed"))
    shares = np.array(
        [e.summary.tests["push"].get("recovered") for e in evaluations if "push" in e.summary.tests]
    )
    assert shares.shape == (3, 23)
    np.testing.assert_allclose(middle, np.median(shares, axis=0))
    np.testing.assert_allclose([low, high], [shares.min(axis=0), shares.max(axis=0)])


def test_stairs_are_pooled_as_the_mean_of_up_and_down(source: Path) -> None:
    one = next(e for e in read(source).evaluations if "ascent" in e.summary.tests)
    up, down = (one.summary.tests[name].get("traversed", []) for name in ("ascent", "descent"))
    assert list(PANELS["stairs"].points(one.summary).values()) == [
        (a + b) / 2 for a, b in zip(up, down, strict=True)
    ]


def test_efficiency_is_drawn_to_the_peak_command(source: Path) -> None:
    speeds, *_ = over_speed(read(source), "quadruped:cheetah", "nominal")
    assert len(speeds) == sum(level <= 5.0 for level in synthetic.SPEED)


def test_a_design_alone_has_no_best_and_one_seed_no_band(tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path / "study", designs=("cheetah",), seeds=(0,))
    tables = tables_of(folder)
    assert "seed_variation" not in tables
    shown = to_html(tables["capability"])
    assert "<b>" not in shown
    assert "–" not in re.sub(r"<thead>.*?</thead>", "", shown)
    assert "There is one seed" in page_of(folder)


def test_runs_without_evaluations_have_a_table_of_their_training(tmp_path: Path) -> None:
    synthetic.trained(tmp_path, "cheetah", "base", 0)
    page = page_of(tmp_path)
    assert "No policy has been evaluated" in page
    assert "1 training and 0 evaluations" in page


def test_scalars_that_nobody_reached_are_none_with_their_reason(tmp_path: Path) -> None:
    def lose(summary: dict[str, Any]) -> None:
        curve = summary["tests"]["speed"]
        curve["survival"] = [0.0] * len(synthetic.SPEED)
        curve["speed"] = curve["eta"] = [None] * len(synthetic.SPEED)
        summary["scalars"] = dict.fromkeys(summary["scalars"])
        summary["reasons"] = dict.fromkeys(summary["scalars"], "all fell at every level")
        summary |= {"utilisation": {}, "utilisation_level": {}, "limiting": {}}

    for seed in (0, 1):
        synthetic.evaluated(synthetic.trained(tmp_path, "cheetah", "velocity", seed), change=lose)
    page = writing.write(tmp_path).read_text(encoding="utf-8")
    assert (
        "cheetah, nominal: no top speed or efficiency η for seeds 0, 1: all fell at every level"
        in page
    )
    assert ">none</td>" in page
    assert "nan" not in Links(page).said.lower().replace("nominal", "")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "Invalid JSON"),
        ("[]", "not a summary of this version"),
        ('{"format": 9}', "not a summary of this version"),
        *(
            (f"{SUMMARY}, {text}}}", words)
            for text, words in (
                ('"arm": "odd"', "arm: Input should be"),
                ('"errors": "mine"', "errors: Input should be 'twins', 'survey' or 'paper'"),
                ('"scalars": {"kick": NaN}', "finite"),
                (
                    '"tests": {"speed": {"levels": [1, 2], "survival": [1, 1], "eta": [1, 1], '
                    '"speed": [1]}}',
                    "not have one value for each level",
                ),
                (
                    '"utilisation": {"speed": {"knee": 1}}',
                    "utilisation.speed.knee: Input should be an object",
                ),
                ('"took_s": "long"', "took_s: Input should be a valid number"),
                ('"by_member": {"a": 1}', "by_member.a: Input should be an object"),
            )
        ),
    ],
)
def test_a_broken_summary_is_named_and_omitted(one: Path, text: str, words: str) -> None:
    path = one / "runs/cheetah-velocity-0/evaluation/nominal-walking/summary.json"
    path.write_text(text)
    (warning,) = read(one).warnings
    assert "cheetah-velocity-0/evaluation/nominal-walking/summary.json cannot be read" in warning
    assert words in warning
    assert "Omitted from this report" in page_of(one)


def test_a_broken_run_is_named_and_omitted_and_what_a_killed_process_left_is_none(
    one: Path,
) -> None:
    runs = one / "runs"
    shutil.copytree(runs / "cheetah-velocity-0", runs / ".cheetah-velocity-0-abcdefgh")
    found = read(one)
    assert [run.name for run in found.singles] == ["cheetah-velocity-0"]
    assert found.warnings == ()
    bad = synthetic.trained(one, "bear", "base", 0)
    (bad.folder / "run.json").write_text("{")
    study = read(one)
    assert list(study.titles.values()) == ["cheetah"]
    assert "bear-base-0' is broken" in study.warnings[0]


def test_flags_are_reported_once_with_their_designs_arms_and_seeds(source: Path) -> None:
    said = [words for words in remarks(read(source)) if "velocity" in words and "bear" in words]
    assert len(said) == 1
    assert "velocity, nominal and perturbed inertia, seeds 0, 1, 2: 7 m/s" in said[0]


def test_both_protocols_stand_side_by_side(tmp_path: Path) -> None:
    both = ("walking", "published")
    one = (("cheetah",), (0,), ("nominal",), ("velocity",))
    folder = synthetic.study(tmp_path / "s", *one, protocols=both)
    assert [row[1] for row in tables_of(folder)["protocols"].rows] == list(both)


def test_words_of_designs_do_not_become_markup(one: Path, tmp_path: Path) -> None:
    folder = one.rename(tmp_path / "a<b>&_50%")
    assert "<h1>Study: a&lt;b&gt;&amp;_50%</h1>" in page_of(folder)


def test_latex_is_balanced_and_escaped(source: Path) -> None:
    for table in tables_of(source).values():
        text = to_tex(table)
        lines = [line for line in text.splitlines() if not line.startswith("%")]
        body = "\n".join(lines).replace(r"\_", "").replace(r"\%", "").replace(r"\&", "")
        assert body.count("{") == body.count("}")
        assert body.count("$") % 2 == 0
        assert not re.search(r"[_%#]", body)
        assert text.isascii() or all(line.isascii() for line in lines)
        kinds = re.search(r"begin{tabular}{(\w+)}", body)
        assert kinds
        rows = [line for line in lines if line.endswith(r"\\") and "multicolumn" not in line]
        counts = {re.sub(r"\\&", "", row).count("&") for row in rows}
        assert counts == {len(kinds[1]) - 1}


def test_a_folder_without_runs_or_of_something_else_is_explained(one: Path, tmp_path: Path) -> None:
    mine = tmp_path / "mine"
    mine.mkdir()
    with pytest.raises(DraftError, match="has no run of a study to report on"):
        writing.write(mine)
    assert list(mine.iterdir()) == []
    (mine / "letter.txt").write_text("dear")
    with pytest.raises(DraftError, match="is not a report of Draft; it is kept"):
        writing.write(one, mine)
    assert (mine / "letter.txt").read_text() == "dear"


def test_a_report_that_fails_leaves_the_old_one(one: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "save", lambda *args: [])
    monkeypatch.setattr(writing, "_pictures", lambda *args: {})
    monkeypatch.setattr(writing, "html", lambda page: "old")
    page = writing.write(one)

    def fail(page: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(writing, "html", fail)
    with pytest.raises(DraftError, match="no space left"):
        writing.write(one)
    assert page.read_text() == "old"
    assert {path.name for path in one.iterdir()} == {"runs", "report"}


def test_without_a_renderer_the_page_says_so(one: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(members: Any) -> Any:
        raise DraftError("MuJoCo cannot draw on this machine")

    monkeypatch.setattr(robots, "render", refuse)
    page = writing.write(one)
    words = "the picture of the robots: MuJoCo cannot draw on this machine"
    assert words in page.read_text(encoding="utf-8")
    assert not (page.parent / "figures/robots.png").exists()


def test_names_stand_at_lines_that_fall_and_beside_those_that_do_not() -> None:
    x = np.linspace(0, 10, 50)
    lines = {
        "falls": (x, 1 / (1 + np.exp(2 * (x - 4))), "red"),
        "stays": (x, np.ones(50), "blue"),
        "never": (x, np.zeros(50), "green"),
    }
    figure, ax = plt.subplots()
    ax.set_xlim(0, 8)
    ax.set_ylim(0, 1.05)
    label_drops(ax, lines)
    places = {note.get_text(): note.xy for note in ax.texts}  # type: ignore[attr-defined]
    plt.close(figure)
    assert places["falls"] == pytest.approx((4 - np.log(1.5) / 2, 0.6), abs=0.02)
    assert places["stays"] == pytest.approx((8, 1), abs=0.05)
    assert places["never"] == pytest.approx((8, 0.03), abs=0.05)


def test_a_family_is_named_with_the_command_that_draws_it(tmp_path: Path) -> None:
    synthetic.family(tmp_path, lambda t, r: t * r, (0.21, 0.3), (5.0, 10.0))
    page = page_of(tmp_path)
    assert "4 members of families" in page
    assert "Runs of families: family-velocity-0." in page
    assert "draft surface ROBOT" in page
