"""Commands take designs one way: a robot, a design, a file, a folder, or a shipped name."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import draft
from draft.cli import main, view
from draft.spec.load import find
from tests.written import edit, write_robot

FORMS = (
    ("bear",),
    ("quadruped:bear",),
    ("quadruped", "--design", "bear"),
    ("quadruped:bear.yaml",),
    ("quadruped", "--design", "bear.yaml"),
    ("model",),
    ("mine:bear",),
    ("./mine", "--design", "bear"),
)
SINGLE = [form for form in FORMS if len(form) == 1]


@pytest.fixture(autouse=True)
def here(robot: Path) -> None:
    """A file, a built model and a robot of one's own, all of the shipped bear."""
    bear = find("quadruped") / "designs" / "bear.yaml"
    shutil.copy(bear, "bear.yaml")
    draft.load("quadruped").resolve("bear").build().save("model")
    assert main(["new", "mine", "--like", "quadruped"]) == 0
    Path("mine/designs").mkdir()
    shutil.copy(bear, "mine/designs/bear.yaml")


def mass() -> float:
    return float(draft.load("quadruped").resolve("bear").mass)


@pytest.mark.parametrize("form", FORMS, ids=" ".join)
@pytest.mark.parametrize("command", ["check", "show", "build", "export"])
def test_each_form_names_the_same_design(
    command: str, form: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main([command, *form, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["mass_kg"] == pytest.approx(mass())


@pytest.mark.parametrize("form", FORMS, ids=" ".join)
def test_values_override_those_of_any_form(
    form: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    capsys.readouterr()
    assert main(["metrics", *form, "--set", "actuators.leg.peak_torque=80", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["metrics"]["mass"]
    expected = draft.load("quadruped").resolve("bear", {"actuators.leg.peak_torque": 80})
    assert found == pytest.approx(float(expected.mass))
    assert found != pytest.approx(mass())


@pytest.mark.parametrize("form", SINGLE, ids=" ".join)
def test_several_designs_are_named_in_the_same_forms(
    form: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("plotly")
    capsys.readouterr()
    assert main(["learn", "show", *form, "--stage", "base", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["scale"] == pytest.approx(_scale())
    assert main(["report", *form, "cheetah", "--out", "page.html", "--json"]) == 0
    assert "page.html" in capsys.readouterr().out


def _scale() -> float:
    from draft.learn.bodies.legged import legged_robot

    return legged_robot(draft.load("quadruped").resolve("bear")).scale


@pytest.mark.parametrize("form", FORMS, ids=" ".join)
def test_screens_draw_around_the_design(
    form: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("pyarrow")
    capsys.readouterr()
    options = ("--vary", "crouch=0.9,1.1", "--n", "2", "--sampler", "grid", "--json")
    assert main(["screen", *form, "--out", "rows.parquet", *options, "--metrics", "mass"]) == 0
    from pyarrow import parquet

    found = parquet.read_table("rows.parquet")["mass"].to_pylist()
    assert found == pytest.approx([mass(), mass()])


def test_view_and_studio_take_the_same_forms(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("viser")
    from draft.studio import server

    seen: list[Any] = []

    def stop(library: Any, design: str, *_: object) -> None:
        seen.append((library.spec.name, design))
        raise KeyboardInterrupt

    monkeypatch.setattr(view, "view_in_window", lambda model, data: seen.append(model))
    monkeypatch.setattr(server, "Studio", stop)
    assert main(["view", "bear"]) == 0
    assert sum(seen.pop().body_mass) == pytest.approx(mass())
    for form in ("bear", "quadruped:bear"):
        assert main(["studio", form]) == 130
        assert seen.pop() == ("quadruped", "bear")


def test_the_studio_starts_from_named_designs_only(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("viser")
    capsys.readouterr()
    assert main(["studio", "quadruped:bear.yaml"]) == 2
    assert capsys.readouterr().err == (
        "error: 'bear.yaml' is a file, and the studio starts from named designs\n"
        "  copy it to quadruped_designs, and pass its name without .yaml\n"
    )


def test_a_twin_is_compared_with_any_form(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "cheetah", "--out", "vendor", "--format", "urdf"]) == 0
    for form in SINGLE:
        capsys.readouterr()
        words = ("twin", "vendor/robot.urdf", "--spec", *form, "--poses", "2", "--json")
        assert main([*words]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["mass_kg"]["twin"] == pytest.approx(mass(), rel=1e-5)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("baer",),
            "'baer' names no robot or design\n  did you mean 'bear'? available: bear, cheetah, "
            "giraffe, hopper, humanoid, mine, quadruped, robot; or a robot's or a model's folder",
        ),
        (("baer:x",), "'baer' names no robot or design\n  did you mean 'bear'?"),
        (
            ("bear:giraffe",),
            "'bear' in 'bear:giraffe' is a design, not a robot\n  name its robot: "
            "quadruped:giraffe",
        ),
        (("quadruped:",), "'quadruped:' names no design\n  add one, or name the robot alone"),
        (("quadruped:baer",), "'quadruped' has no design 'baer'\n  did you mean 'bear'?"),
        (
            ("bear", "--design", "giraffe"),
            "'bear' names a design already, and --design names 'giraffe'\n  omit --design",
        ),
        (("model", "--design", "giraffe"), "'model' names a design already"),
        (("bear.yaml",), "'bear.yaml' is a file, not a robot\n  name its robot: SPEC:bear.yaml"),
        (
            ("robot/tree.yaml",),
            "'robot/tree.yaml' is a file, not a robot\n  name its folder: robot",
        ),
        (("quadruped:none.yaml",), "none.yaml: file not found"),
        (("",), "no robot is named\n"),
        (("empty",), "empty/parameters.yaml: file not found"),
    ],
)
def test_what_names_nothing_is_explained_with_what_is_available(
    words: tuple[str, ...], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("empty").mkdir()
    capsys.readouterr()
    for command in ("show", "metrics"):
        assert main([command, *words]) == 2
        assert capsys.readouterr().err.startswith(f"error: {message}")


def test_a_folder_that_is_no_robot_does_not_hide_a_shipped_design(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("cheetah").mkdir()
    assert main(["check", "cheetah"]) == 0
    assert "quadruped (cheetah): accepted" in capsys.readouterr().out


def test_a_robot_of_ones_own_hides_a_shipped_design_of_its_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    robot = write_robot(Path("giraffe"))
    edit(robot, "parameters.yaml", "name: monoped", "name: giraffe")
    assert main(["check", "giraffe"]) == 0
    assert "giraffe (default): accepted" in capsys.readouterr().out
