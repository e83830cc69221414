"""A family in the report: surfaces, curves, limits, and designs held against it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")


from draft.plotting import save
from draft.study.report import members, surface, writing
from draft.study.report.family import checks, families
from draft.study.report.gather import gather
from draft.study.report.learning import lines
from draft.study.report.table import to_csv
from tests.learn import synthetic
from tests.study.report.pages import page_of, tables_of


def test_a_family_s_surface_is_held_against_a_design_trained_alone(tmp_path: Path) -> None:
    def plane(thigh: float, ratio: float) -> float:
        return 2 + 6 * thigh - 0.05 * ratio

    synthetic.family(tmp_path, plane, (0.21, 0.3), (5.0, 8.0, 10.0))
    run = synthetic.trained(tmp_path, "cheetah", "velocity", 0)
    synthetic.evaluated(run, change=lambda s: s["scalars"].update(top_speed=3.0))
    study = gather(tmp_path)
    (family,) = families(study)
    assert set(family.varied) == {"thigh_length", "actuators.leg.gear_ratio"}
    (check,), omitted = checks(study, family, "top_speed")
    assert omitted == []
    # The cheetah has a thigh of 0.25 m and a reduction of 6; a plane is met between any members.
    assert check.interpolated == pytest.approx(plane(0.25, 6.0))
    assert check.own == 3.0
    text = to_csv(tables_of(tmp_path)["family_check"])
    assert f"{100 * (plane(0.25, 6.0) / 3 - 1):.6g}" in text
    save(tmp_path / "figures", surface.makers(study, [family]), 40, ("png",))
    assert (tmp_path / "figures/family_top_speed.png").stat().st_size > 4000


def test_a_design_that_differs_otherwise_is_not_compared_with_the_family(tmp_path: Path) -> None:
    synthetic.family(tmp_path, lambda t, r: t * r, (0.21, 0.3), (5.0, 10.0))
    synthetic.evaluated(synthetic.trained(tmp_path, "bear", "velocity", 0))
    study = gather(tmp_path)
    compared, omitted = checks(study, families(study)[0], "top_speed")
    assert compared == []
    assert "bear is not compared: it does not have the family's" in omitted[0]


def test_a_family_s_members_have_curves_limits_and_training(tmp_path: Path) -> None:
    synthetic.family(tmp_path, lambda t, r: 10 * t, (0.21, 0.25, 0.3), (5.0, 8.0))
    synthetic.trained(tmp_path, "cheetah", "velocity", 0)
    study = gather(tmp_path)
    (family,) = found = families(study)
    drawn = members.curves(family, "speed")
    assert len(drawn) == 6
    name, x, y = drawn[0]
    told = family.summaries[name][0]["batteries"]["speed"]
    kept = [(a, b) for a, b in zip(told["levels"], told["speed"], strict=True) if b is not None]
    assert list(zip(x.tolist(), y.tolist(), strict=True)) == kept
    assert members.curves(family, "push") == []
    limits = members.limits(family, "speed")
    assert Counter(limit.joint for limit in limits.values()) == {"hip pitch": 4, "knee": 2}
    assert {limit[1:] for limit in limits.values()} == {("speed", 1, 1, 0.97)}
    made = members.makers(found)
    assert list(made) == ["family_curves_speed", "family_curves_efficiency", "family_limits_speed"]
    save(tmp_path / "figures", made, 40, ("png",))
    assert [line.title for line in lines(study)] == ["cheetah", "family"]
    page = page_of(tmp_path)
    assert '<i style="color:#595959"></i>family' not in page  # no figure of training was drawn
    text = writing.write(tmp_path).read_text(encoding="utf-8")
    assert 'id="figure-family_limits_speed"' in text
    assert '<i style="color:#595959"></i>family' in text


def test_a_family_that_fell_at_every_level_is_reported(tmp_path: Path) -> None:
    run = synthetic.family(tmp_path, lambda t, r: t, (0.21, 0.3), (5.0, 8.0))
    path = run.folder / "evaluation/nominal-walking/summary.json"
    summary = json.loads(path.read_text())
    for one in summary["by_member"].values():
        one |= {"scalars": {"top_speed": None}, "batteries": {}, "limiting": {}}
        one["reasons"] = {"top_speed": "all fell at every level"}
    path.write_text(json.dumps(summary))
    page = writing.write(tmp_path).read_text(encoding="utf-8")
    assert "No member reached a value of any scalar" in page
    assert "quadruped-1, top speed: all fell at every level" in page


def test_a_family_of_one_parameter_is_a_line(tmp_path: Path) -> None:
    synthetic.family(tmp_path, lambda t, r: 10 * t, (0.21, 0.25, 0.3), (6.0,))
    (family,) = families(gather(tmp_path))
    assert family.axes("top_speed") == ("thigh_length",)
    assert family.interpolate("top_speed", ("thigh_length",), (0.23,)) == pytest.approx(2.3)
    assert family.interpolate("top_speed", ("thigh_length",), (0.5,)) is None
    figures = writing.write(tmp_path).parent / "figures"
    assert (figures / "family_top_speed.svg").is_file()
    assert (figures / "family_limits_speed.svg").is_file()
