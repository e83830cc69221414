"""Commands take designs one way: a robot, a design, a file, a folder, or a shipped name."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

import draft
from draft.cli import view
from draft.spec.load import find
from tests.commands import Command
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
def here(robot: Path, command: Command) -> None:
    """A file, a built model and a robot of one's own, all of the shipped bear."""
    bear = find("quadruped") / "designs" / "bear.yaml"
    shutil.copy(bear, "bear.yaml")
    draft.load("quadruped").resolve("bear").build().save("model")
    command("new mine --like quadruped")
    Path("mine/designs").mkdir()
    shutil.copy(bear, "mine/designs/bear.yaml")


@pytest.fixture(scope="module")
def mass() -> float:
    return float(draft.load("quadruped").resolve("bear").mass)


@pytest.mark.parametrize("form", FORMS, ids=" ".join)
def test_each_form_names_the_same_design_and_values_override_it(
    form: tuple[str, ...], mass: float, command: Command
) -> None:
    for word in ("check", "show", "build", "export"):
        assert command.json(word, *form)["mass_kg"] == pytest.approx(mass)
    found = command.json("metrics", *form, "--set", "actuators.leg.peak_torque=80")["metrics"]
    expected = draft.load("quadruped").resolve("bear", {"actuators.leg.peak_torque": 80})
    assert found["mass"] == pytest.approx(float(expected.mass))
    assert found["mass"] != pytest.approx(mass)


@pytest.mark.parametrize("form", FORMS, ids=" ".join)
def test_screens_draw_around_the_design(
    form: tuple[str, ...], mass: float, command: Command
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    options = "--out rows.parquet --vary crouch=0.9,1.1 --n 2 --sampler grid --metrics mass"
    command("screen", *form, *options.split())
    found = parquet.read_table("rows.parquet")["mass"].to_pylist()
    assert found == pytest.approx([mass, mass])


def test_other_commands_take_the_same_forms(mass: float, command: Command) -> None:
    pytest.importorskip("plotly")
    from draft.learn.bodies.legged import legged_robot

    scale = legged_robot(draft.load("quadruped").resolve("bear")).scale
    command("export cheetah --out vendor --format urdf")
    for (form,) in SINGLE:
        assert command.json(f"learn show {form} --stage base")["scale"] == pytest.approx(scale)
        assert "page.html" in command(f"report {form} cheetah --out page.html --json").out
        found = command.json(f"twin vendor/robot.urdf --spec {form} --poses 2")
        assert found["mass_kg"]["twin"] == pytest.approx(mass, rel=1e-5)


def test_view_and_studio_take_the_same_forms(
    mass: float, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("viser")
    from draft.studio import server

    seen: list[Any] = []

    def stop(library: Any, design: str, *_: object) -> None:
        seen.append((library.spec.name, design))
        raise KeyboardInterrupt

    monkeypatch.setattr(view, "view_in_window", lambda model, data: seen.append(model))
    monkeypatch.setattr(server, "Studio", stop)
    command("view bear")
    assert sum(seen.pop().body_mass) == pytest.approx(mass)
    for form in ("bear", "quadruped:bear"):
        command(f"studio {form}", code=130)
        assert seen.pop() == ("quadruped", "bear")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("baer",),
            "'baer' names no robot or design\n  did you mean 'bear'? available: arm, bear, "
            "biped, cheetah, giraffe, hand, hexapod, hopper, humanoid, mine, quadruped, robot, "
            "wheeled; or a robot's or a model's folder",
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
        ((":long",), "no robot is named\n"),
        (("empty",), "empty/parameters.yaml: file not found"),
    ],
)
def test_what_names_nothing_is_explained_with_what_is_available(
    words: tuple[str, ...], message: str, command: Command
) -> None:
    Path("empty").mkdir()
    for word in ("show", "metrics"):
        assert command.refuses(word, *words).startswith(f"error: {message}")


def test_a_folder_hides_a_shipped_design_of_its_name_only_if_it_is_a_robot(
    command: Command,
) -> None:
    Path("cheetah").mkdir()
    assert "quadruped (cheetah): accepted" in command("check cheetah").out
    edit(write_robot(Path("giraffe")), "parameters.yaml", "name: monoped", "name: giraffe")
    assert "giraffe (default): accepted" in command("check giraffe").out
