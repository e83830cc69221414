"""Results are set beside those of other studies, and what differs between them is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("pyarrow")

from draft.cli import BAD_INPUT, main
from draft.errors import DraftError
from draft.study.report.collect import collect
from draft.study.report.comparison import comparison
from draft.study.report.folder import read
from draft.study.report.spread import Spread
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


@pytest.fixture
def main_study(tmp_path: Path) -> Path:
    folder = synthetic.study(tmp_path / "main", DESIGNS, (0, 1, 2), stages=("velocity", "push"))
    plan_of(folder, name="main")
    return folder


def test_only_designs_seeds_and_skills_in_common_are_compared(
    main_study: Path, tmp_path: Path
) -> None:
    other = faster(tmp_path / "other", {"cheetah": 1.25, "bear": 0.5})
    made = comparison(read(main_study), read(other))
    cells = {(row[0], row[1]): row[2:] for row in made.rows}
    assert list(cells) == [
        ("top speed [m/s]", "cheetah"),
        ("top speed [m/s]", "bear"),
        ("efficiency η", "cheetah"),
        ("efficiency η", "bear"),
    ]
    spreads = [cell for cell in cells["top speed [m/s]", "cheetah"] if isinstance(cell, Spread)]
    here, there, change, every = spreads
    speeds = [synthetic.able("cheetah", seed, "nominal")[0] for seed in (0, 1, 2)]
    assert (here.median, here.count) == (pytest.approx(speeds[0]), 1)
    assert there.median == pytest.approx(1.25 * speeds[0])
    assert change.median == pytest.approx(25)
    assert (every.low, every.high) == (pytest.approx(min(speeds)), pytest.approx(max(speeds)))
    assert "seed 0, nominal arm" in made.caption
    assert "main and other (the same numbers)" in made.caption


def test_results_of_one_name_have_columns_of_their_own(main_study: Path) -> None:
    study = read(main_study)
    made = comparison(study, study)
    assert [column.title for column in made.columns][2:4] == ["main", "other main"]
    assert made.name == "against_other_main"


def test_it_is_said_whether_the_order_of_the_designs_is_the_same(
    main_study: Path, tmp_path: Path
) -> None:
    alike = comparison(read(main_study), read(faster(tmp_path / "a", dict.fromkeys(DESIGNS, 1.1))))
    assert "top speed: cheetah > bear in both" in alike.notes
    turned = comparison(
        read(main_study), read(faster(tmp_path / "b", {"cheetah": 0.5, "bear": 1.0}))
    )
    assert "top speed: cheetah > bear, but bear > cheetah in b" in turned.notes


def test_a_policy_of_the_other_study_that_does_not_walk_is_named(
    main_study: Path, tmp_path: Path
) -> None:
    other = faster(tmp_path / "other", {"cheetah": 0.01})
    run = synthetic.trained(other, "cheetah", "base", 0)
    synthetic.evaluated(run, change=lambda s: s["tests"]["walk"].update(speed=[0.0]))
    (said,) = [note for note in comparison(read(main_study), read(other)).notes if "walk" in note]
    assert said.startswith("other: cheetah, seed 0, did not learn to walk")


def test_a_design_without_the_skill_in_the_other_study_is_named_with_the_reason(
    main_study: Path, tmp_path: Path
) -> None:
    def change(summary: dict[str, Any]) -> None:
        summary["scalars"].update(top_speed=None)
        summary["reasons"].update(top_speed="fewer than 80 % stay up at any command")

    other = faster(tmp_path / "other", {"bear": 1.0})
    synthetic.evaluated(synthetic.trained(other, "cheetah", "velocity", 0), change=change)
    made = comparison(read(main_study), read(other))
    why = "seed 0: fewer than 80 % stay up at any command"
    assert f"cheetah has no top speed in other: {why}" in made.notes
    assert ("top speed [m/s]", "cheetah") not in [tuple(row[:2]) for row in made.rows]


def test_the_choices_that_differ_are_named(main_study: Path, tmp_path: Path) -> None:
    other = faster(tmp_path / "other", dict.fromkeys(DESIGNS, 1.0))
    plan_of(other, name="other", recipe="paper")
    for file in other.glob("runs/*/run.json"):
        told = json.loads(file.read_text())
        told["config"]["physics"]["timestep"] = 0.001
        told["environments"] = 512
        file.write_text(json.dumps(told))
    said = comparison(read(main_study), read(other)).caption
    assert "recipe paper instead of laptop" in said
    assert "512 instead of 4096 worlds in stage velocity" in said
    assert "physics.timestep 0.001 instead of 0.005" in said


def test_studies_without_anything_in_common_are_refused(main_study: Path, tmp_path: Path) -> None:
    other = faster(tmp_path / "other", {"giraffe": 1.0})
    with pytest.raises(DraftError) as refused:
        comparison(read(main_study), read(other))
    assert "'other' has no skill of a design and seed in common with 'main'" in str(refused.value)
    assert "quadruped:bear" in str(refused.value)


def test_the_command_prints_and_writes_comparisons(
    main_study: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    collect(main_study, Path("results/main"))
    for name, factor in (("slow", 0.5), ("fast", 2.0)):
        collect(faster(tmp_path / name, {"cheetah": factor}), Path("results") / name)
    asked = ["study", "results", "results/main", "--against", "results/slow", "results/fast"]
    assert main([*asked, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [told[f"against_{name}"][0]["change [%]"] for name in ("slow", "fast")] == ["-50", "100"]
    assert main(asked) == 0
    assert "main and slow" in " ".join(capsys.readouterr().out.split())
    assert main([*asked, "--write", "page.md"]) == 0
    page = Path("page.md").read_text()
    assert "## How far it depends on our choices" in page
    assert "--against results/slow results/fast --write page.md" in page
    capsys.readouterr()
    assert main(["study", "results", "results/main", "--against", "results/none"]) == BAD_INPUT
    assert "'results/none' holds no results" in capsys.readouterr().err
