"""`draft learn`, called as a shell would call it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from pytest_regressions.file_regression import FileRegressionFixture

from draft.cli import learn
from draft.extras import remedy
from draft.learn.engine import machine
from draft.learn.engine.machine import Engine, Machine
from draft.learn.task.config import Config
from draft.learn.task.recipes import RECIPES, Change, Recipe
from tests.commands import Command

# As the shipped recipe is made; its numbers are tuned again and again.
LAPTOP = Recipe(
    "laptop",
    {
        "learning.environments": Change(512, "shared by all cores"),
        "learning.iterations_base": Change(200, "2.5 million steps"),
        "learning.iterations_velocity": Change(300, "3.7 million steps"),
        "learning.iterations_terrain": Change(500, "6.1 million steps"),
        "learning.iterations_push": Change(250, "3.1 million steps"),
        "learning.mirror": Change(True, "each sample teaches both sides"),
    },
    plane=True,
)
LAPTOP_LINES = """\
engine: native MuJoCo (the fastest without a GPU), 2 cores, 2 processes
recipe laptop: base 200 iterations of 512 worlds on flat ground, about 4 min
               velocity 300 iterations of 512 worlds on flat ground, about 7 min
               terrain 500 iterations of 512 worlds on uneven ground, about 20 min
               push 250 iterations of 512 worlds on flat ground, about 5 min

"""


def here(monkeypatch: pytest.MonkeyPatch, **values: Any) -> None:
    """Let the machine be another one than this."""
    cpu = Machine(["cpu"], Engine("native", "the fastest without a GPU"), None, 2)
    monkeypatch.setattr(learn, "this_machine", lambda: replace(cpu, **values))
    monkeypatch.setattr(machine, "cores", lambda: 2)


@pytest.fixture(autouse=True)
def a_laptop(monkeypatch: pytest.MonkeyPatch) -> None:
    here(monkeypatch)
    monkeypatch.setitem(RECIPES, "laptop", LAPTOP)
    monkeypatch.setattr(machine, "_RATES", {"native": {"flat": 4700.0, "uneven": 2500.0}})


@pytest.fixture
def shown(command: Command) -> Callable[..., str]:
    """What `draft learn show` prints."""

    def ask(*words: str) -> str:
        out, err = command("learn show", *words)
        assert err == ""
        return "\n".join(line.rstrip() for line in out.splitlines()) + "\n"

    return ask


def line_of(shown: str, name: str) -> str:
    return next(line for line in shown.splitlines() if line.startswith(name))


def test_every_number_is_shown_with_its_source(
    shown: Callable[..., str], file_regression: FileRegressionFixture
) -> None:
    out = shown("giraffe", "--recipe", "paper")
    file_regression.check(out.partition("\n\n")[2])


def test_the_first_lines_tell_what_would_train_here(shown: Callable[..., str]) -> None:
    assert shown().startswith(LAPTOP_LINES)
    first = shown("--stage", "terrain", "--recipe", "paper").splitlines()
    words = "recipe paper: terrain 2000 iterations of 4096 worlds on uneven ground, about 655 min"
    assert first[1:3] == [words, ""]
    few = ("learning.iterations_base=3", "learning.environments=1")
    out = shown("--stage", "base", "--set", *few).splitlines()
    assert out[0].endswith("2 cores, 1 process")
    assert out[1].endswith("base 3 iterations of 1 world on flat ground, less than 1 min")


def test_more_joints_take_more_iterations_each_of_which_takes_longer(
    shown: Callable[..., str],
) -> None:
    out = shown("humanoid", "--stage", "base")
    assert out.splitlines()[1].endswith("751 iterations of 512 worlds on flat ground, about 40 min")
    assert line_of(out, "learning.iterations_base").endswith("200 x (29 joints / 12)^1.5")
    few = shown("humanoid", "--stage", "base", "--set", "learning.iterations_base=250")
    assert "250 iterations of 512 worlds on flat ground, about 13 min" in few


def test_numbers_of_a_recipe_tell_its_reasons(shown: Callable[..., str]) -> None:
    out = shown()
    assert out.count("\n") > len(Config().rows())
    assert "s = " not in out.replace("s = L", "")  # Without a design there is one value.
    assert out.count("choice: laptop") == len(LAPTOP.changes)
    why = LAPTOP.changes["learning.environments"].why
    words = f"learning.environments 512 1 choice: laptop number of worlds; {why}"
    assert words in " ".join(out.split())
    assert "choice: laptop" not in shown("--recipe", "paper")
    # What is given otherwise has nothing to do with the recipe.
    line = line_of(shown("--set", "learning.environments=64"), "learning.environments")
    assert "choice: released code" in line
    assert line.endswith("number of worlds")


def test_on_a_gpu_the_published_numbers_are_the_default(
    shown: Callable[..., str], command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    here(monkeypatch, devices=["cuda:0"], engine=Engine("warp", "it runs on the GPU"))
    out = shown("--stage", "base").splitlines()
    assert out[0] == "engine: MuJoCo Warp (it runs on the GPU), cuda:0"
    assert out[1] == "recipe paper: base 1200 iterations of 4096 worlds on uneven ground"
    told = command.json("learn show")
    assert (told["recipe"], told["engine"], told["processes"]) == ("paper", "warp", 1)
    assert set(told["minutes"].values()) == {None}


def test_what_is_missing_to_train_is_reported_and_the_numbers_are_shown(
    shown: Callable[..., str], command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    here(monkeypatch, engine=None, missing="torch")
    out = shown("--stage", "base").splitlines()
    words = f"engine: none yet, torch is not installed ({remedy('learn')}); 2 cores"
    assert out[0] == words
    assert out[1] == "recipe laptop: base 200 iterations of 512 worlds on flat ground"
    told = command.json("learn show")
    assert (told["engine"], told["missing"], told["processes"]) == (None, "torch", None)
    assert set(told["minutes"].values()) == {None}
    assert told["numbers"]["learning.environments"]["value"] == 512


def test_as_json_there_is_what_would_train_here(command: Command) -> None:
    told = command.json("learn show")
    expected = {"devices": ["cpu"], "engine": "native", "why": "the fastest without a GPU"}
    expected |= {"missing": None, "cores": 2, "processes": 2, "recipe": "laptop"}
    assert {name: told[name] for name in expected} == expected
    assert told["ground"] == {stage: LAPTOP.ground(stage) for stage in LAPTOP.stages()}
    assert told["minutes"]["base"] == pytest.approx(200 * 512 * 24 / 4700 / 2 / 60)
    worlds = told["numbers"]["learning.environments"]
    assert (worlds["source"], worlds["doc"]) == ("choice: laptop", "number of worlds")
    assert worlds["why"] == LAPTOP.changes["learning.environments"].why
    assert command.json("learn show --stage push")["minutes"].keys() == {"push"}


def test_as_json_every_number_has_its_value_at_the_designs_scale(command: Command) -> None:
    found = command.json("learn show giraffe --recipe paper")
    assert (found["design"], found["stage"]) == ("quadruped:giraffe", None)
    assert found["scale"] == pytest.approx(1.3 / 0.48)
    names = {f"{g}.{n}" for g, numbers in Config().as_dict().items() for n in numbers}
    assert set(found["numbers"]) == names
    assert found["numbers"]["rewards.height"] == {
        "value": 0.43,
        "scaled": pytest.approx(0.43 * 1.3 / 0.48),
        "unit": "m",
        "source": "paper",
        "doc": "target height of the trunk",
        "why": None,
    }
    root = (1.3 / 0.48) ** 0.5
    pushes = found["numbers"]["episodes.push_linear"]["scaled"]
    assert pushes == pytest.approx([0.5 * root, 0.5 * root, 0.4 * root])
    assert found["numbers"]["ground.rows"]["scaled"] == 10


@pytest.mark.parametrize("stage", ["base", "velocity", "terrain", "push"])
def test_a_stage_leaves_out_what_is_of_others_only(command: Command, stage: str) -> None:
    found = command.json(f"learn show --stage {stage}")["numbers"]
    groups = {name.split(".")[0] for name in found}
    assert groups & {"velocity", "terrain", "push"} == {stage} - {"base"}
    assert {"rewards", "commands", "episodes", "learning"} < groups
    assert [n for n in found if "iterations_" in n] == [f"learning.iterations_{stage}"]


def test_changed_numbers_are_shown_changed(shown: Callable[..., str], command: Command) -> None:
    words = ("--set", "rewards.height=0.5", "push.ramp=[[0, 1], [10, 3.5]]", "learning.mirror=true")
    found = command.json("learn show", *words)["numbers"]
    assert found["rewards.height"]["value"] == 0.5
    assert found["push.ramp"]["value"] == [[0, 1.0], [10, 3.5]]
    assert found["learning.mirror"]["value"] is True
    assert "[[0, 1], [10, 3.5]]" in line_of(shown(*words), "push.ramp")
