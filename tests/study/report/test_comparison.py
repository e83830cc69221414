"""Results are set beside those of other studies, and what differs between them is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyarrow")

from draft.errors import DraftError
from draft.study.report.collect import collect
from draft.study.report.comparison import comparison
from draft.study.report.folder import read
from draft.study.report.records import Study
from draft.study.report.spread import Spread
from tests.commands import Command
from tests.learn import synthetic
from tests.study.report.conftest import plan_of

DESIGNS = ("cheetah", "bear")


def faster(folder: Path, by: dict[str, float], seeds: tuple[int, ...] = (0,)) -> Path:
    """A study in which some designs run faster or slower than in that of the fixture."""
    for design, factor in by.items():
        for seed in seeds:

            def change(summary: dict[str, Any], factor: float = factor) -> None:
                summary["scalars"]["top_speed"] *= factor

            run = synthetic.trained(folder, design, "velocity", seed)
            synthetic.evaluated(run, change=change)
    plan_of(folder, name=folder.name)
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("comparison") / "main"
    synthetic.study(made, DESIGNS, (0, 1, 2), stages=("velocity", "push"))
    plan_of(made, name="main")
    return made


@pytest.fixture(scope="module")
def main(folder: Path) -> Study:
    return read(folder)


def test_only_designs_seeds_and_skills_in_common_are_compared(main: Study, tmp_path: Path) -> None:
    made = comparison(main, read(faster(tmp_path / "other", {"cheetah": 1.25, "bear": 0.5})))
    cells = {(row[0], row[1]): row[2:] for row in made.rows}
    skills = ("top speed [m/s]", "efficiency η")
    assert list(cells) == [(skill, design) for skill in skills for design in DESIGNS]
    spreads = [cell for cell in cells["top speed [m/s]", "cheetah"] if isinstance(cell, Spread)]
    here, there, change, every = spreads
    speeds = [synthetic.able("cheetah", seed, "nominal")[0] for seed in (0, 1, 2)]
    assert (here.median, here.count) == (pytest.approx(speeds[0]), 1)
    assert there.median == pytest.approx(1.25 * speeds[0])
    assert change.median == pytest.approx(25)
    assert (every.low, every.high) == (pytest.approx(min(speeds)), pytest.approx(max(speeds)))
    assert "seed 0, nominal arm" in made.caption
    assert "main and other (the same numbers)" in made.caption


def test_a_study_of_more_seeds_is_shown_by_all_of_its_seeds_too(
    main: Study, tmp_path: Path
) -> None:
    made = comparison(main, read(faster(tmp_path / "other", {"cheetah": 1.25}, (0, 1, 2, 3))))
    assert [column.title for column in made.columns][-2:] == ["main, all seeds", "other, all seeds"]
    change, here, there = made.rows[0][-3:]
    assert isinstance(change, Spread)
    assert isinstance(here, Spread)
    assert isinstance(there, Spread)
    assert (change.count, here.count, there.count) == (3, 3, 4)
    speeds = [1.25 * synthetic.able("cheetah", seed, "nominal")[0] for seed in range(4)]
    assert (there.low, there.high) == (pytest.approx(min(speeds)), pytest.approx(max(speeds)))


def test_results_of_one_name_have_columns_of_their_own(main: Study) -> None:
    made = comparison(main, main)
    assert [column.title for column in made.columns][2:4] == ["main", "other main"]
    assert made.name == "against_other_main"


@pytest.mark.parametrize(
    ("by", "words"),
    [
        ({"cheetah": 1.1, "bear": 1.1}, "cheetah > bear in both"),
        ({"cheetah": 0.5, "bear": 1.0}, "cheetah > bear, but bear > cheetah in other"),
    ],
)
def test_it_is_said_whether_the_order_of_the_designs_is_the_same(
    by: dict[str, float], words: str, main: Study, tmp_path: Path
) -> None:
    made = comparison(main, read(faster(tmp_path / "other", by)))
    assert f"top speed: {words}" in made.notes


def test_a_policy_of_the_other_study_that_does_not_walk_is_named(
    main: Study, tmp_path: Path
) -> None:
    other = faster(tmp_path / "other", {"cheetah": 0.01})
    run = synthetic.trained(other, "cheetah", "base", 0)
    synthetic.evaluated(run, change=lambda s: s["tests"]["walk"].update(speed=[0.0]))
    (said,) = [note for note in comparison(main, read(other)).notes if "walk" in note]
    assert said.startswith("other: cheetah, seed 0, did not learn to walk")


def test_a_design_without_the_skill_in_the_other_study_is_named_with_the_reason(
    main: Study, tmp_path: Path
) -> None:
    def change(summary: dict[str, Any]) -> None:
        summary["scalars"].update(top_speed=None)
        summary["reasons"].update(top_speed="fewer than 80 % stay up at any command")

    other = faster(tmp_path / "other", {"bear": 1.0})
    synthetic.evaluated(synthetic.trained(other, "cheetah", "velocity", 0), change=change)
    made = comparison(main, read(other))
    why = "seed 0: fewer than 80 % stay up at any command"
    assert f"cheetah has no top speed in other: {why}" in made.notes
    assert ("top speed [m/s]", "cheetah") not in [tuple(row[:2]) for row in made.rows]


def test_the_choices_that_differ_are_named(main: Study, tmp_path: Path) -> None:
    other = faster(tmp_path / "other", dict.fromkeys(DESIGNS, 1.0))
    plan_of(other, name="other", recipe="paper")
    for file in other.glob("runs/*/run.json"):
        told = json.loads(file.read_text())
        told["config"]["physics"]["timestep"] = 0.001
        told["environments"] = 512
        file.write_text(json.dumps(told))
    said = comparison(main, read(other)).caption
    assert "recipe paper instead of laptop" in said
    assert "512 instead of 4096 worlds in stage velocity" in said
    assert "physics.timestep 0.001 instead of 0.005" in said


def test_studies_without_anything_in_common_are_refused(main: Study, tmp_path: Path) -> None:
    other = read(faster(tmp_path / "other", {"giraffe": 1.0}))
    words = "'other' has no skill of a design and seed in common with 'main'\n.*quadruped:bear"
    with pytest.raises(DraftError, match=words):
        comparison(main, other)


def test_the_command_prints_and_writes_comparisons(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    collect(folder, Path("results/main"))
    for name, factor in (("slow", 0.5), ("fast", 2.0)):
        collect(faster(tmp_path / name, {"cheetah": factor}), Path("results") / name)
    asked = "study results results/main --against"
    told = command.json(f"{asked} results/slow results/fast")
    assert [told[f"against_{name}"][0]["change [%]"] for name in ("slow", "fast")] == ["-50", "100"]
    assert "main and slow" in " ".join(command(f"{asked} results/slow results/fast").out.split())
    command(f"{asked} results/slow results/fast --write page.md")
    page = Path("page.md").read_text()
    assert "## How far it depends on our choices" in page
    assert "--against results/slow results/fast --write page.md" in page
    assert "'results/none' holds no results" in command.refuses(f"{asked} results/none")
