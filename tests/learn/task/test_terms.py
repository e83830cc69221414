"""Rewards, terminations, events and stages of other packages and of scripts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

from draft.cli import main
from draft.errors import DraftError
from draft.learn.task import terms
from draft.learn.task.config import STAGES, Config, from_dict
from draft.learn.task.constants import Scaled
from draft.learn.task.groups import Rewards
from draft.learn.task.recipes import LAPTOP
from draft.learn.task.stages import is_like
from draft.learn.task.terms import TERMS, event, number, reward, stage, termination
from draft.learn.training.run import check_same, create, open_run
from tests.learn.small import plan

GATE = number(0.1, "m/s", "largest command that counts as standing", power=0.5, least=0.0)


@pytest.fixture(autouse=True)
def kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Undo what a test registers."""
    for registry in (TERMS, STAGES):
        for names in ("_items", "_origins"):
            monkeypatch.setattr(registry, names, dict(getattr(registry, names)))


@pytest.fixture
def still() -> str:
    """A reward, and its module."""

    @reward(weight=-0.5, gate=GATE, sides=number((1.0, 2.0), "m", "two sides"))
    def still(env: Any, gate: Scaled, sides: tuple[float, float]) -> Any:
        """Speed of a robot that is told to stand.

        More of it.
        """

    return still.__module__


def test_a_reward_brings_its_numbers(still: str) -> None:
    rows = {row.name: row for row in Config().rows(scale=4.0)["still"]}
    assert list(rows) == ["still.weight", "still.gate", "still.sides"]
    doc = "largest command that counts as standing"
    assert rows["still.gate"] == ("still.gate", 0.1, 0.2, "m/s", f"choice: {still}", doc)
    assert (Config().groups()["still"].__doc__ or "").startswith("Speed of a robot that is told")
    changed = Config().with_values({"still.weight": "-2", "still.sides": "3,4"})
    told = changed.groups()["still"]
    assert (told.weight, told.gate, told.sides) == (-2.0, 0.1, (3.0, 4.0))
    assert terms.arguments(told) == {"gate": Scaled(0.1, 0.5), "sides": (3.0, 4.0)}
    with pytest.raises(DraftError, match=r"still.gate must be at least 0, and is -1"):
        Config().with_values({"still.gate": -1})
    assert from_dict(changed.as_dict()) == changed
    older = {name: group for name, group in Config().as_dict().items() if name != "still"}
    assert "still" not in from_dict(older).groups()


def fast(env: Any, limit: float) -> None: ...
def weighed(env: Any, weight: float) -> None: ...
def leap(cfg: Any, task: Any) -> None: ...
def tilted(env: Any) -> None: ...


ONE = number(1.0, "1", "a number")
BELOW = number(-1.0, "m/s", "a limit", least=0.0)


@pytest.mark.parametrize(
    ("register", "function", "words"),
    [
        (lambda: reward(weight=1.0), fast, r"reward 'fast' takes \(env, limit\), not \(env\)"),
        (lambda: reward(1.0, limit=0.1), fast, "'fast' has no unit and meaning for 'limit'"),
        (lambda: reward(1.0, limit=BELOW), fast, r"limit must be at least 0\n  it is -1.0"),
        (lambda: termination(weight=ONE), weighed, "has a number 'weight', a name of Draft's own"),
        (termination, tilted, "there is a termination 'tilted' already"),
        (lambda: event("interval"), fast, "an event of mode 'interval' has no number 'interval'"),
        (lambda: event("intervall"), fast, r"no mode 'intervall'\n  did you mean 'interval'"),  # type: ignore[arg-type]
        (lambda: stage(iterations=1, like="jump"), leap, "no stage 'jump' for stage 'leap'"),
        (lambda: stage(iterations=0), leap, "iterations must be"),
    ],
)
def test_a_term_that_is_not_whole_is_refused(
    register: Callable[[], Any], function: Callable[..., None], words: str
) -> None:
    with pytest.raises(DraftError, match=words):
        register()(function)
    assert "leap" not in STAGES
    assert not TERMS


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("still", "reward"),
        ("height", "reward"),
        ("terrain", "stage"),
        ("episodes", "group of numbers"),
    ],
)
def test_a_name_that_is_taken_is_one_clear_line(
    still: str, monkeypatch: pytest.MonkeyPatch, name: str, what: str
) -> None:
    monkeypatch.setattr(tilted, "__name__", name)
    with pytest.raises(DraftError, match=f"{still}: there is a {what} '{name}' already") as caught:
        termination()(tilted)
    assert len(caught.value.problems) == 1
    assert set(TERMS) == {"still"}


@pytest.mark.slow
def test_names_of_drafts_own_terms_are_refused() -> None:
    pytest.importorskip("mjlab")
    from draft.learn.task.mdp.environment import environment
    from draft.learn.task.world.task import Task

    members, found = plan().members, {"reward": set(), "termination": set(), "event": set()}
    for name in ("base", "velocity", "terrain", "push"):
        for ground in ("flat", "uneven"):
            cfg = environment(Task(members, name, ground=ground), 1)
            for kind, names in found.items():
                names |= {*getattr(cfg, f"{kind}s")}
    weights = {field.name[:-7] for field in fields(Rewards) if field.name.endswith("_weight")}
    assert found["reward"] <= weights | {*terms.RESERVED["reward"]}
    for kind in ("termination", "event"):
        assert found[kind] <= {*terms.RESERVED[kind]}


def test_a_stage_is_like_another_and_has_its_own_numbers() -> None:
    @stage(iterations=7, like="terrain", turn=number(1.5, "rad/s", "largest |wz|", power=-0.5))
    def slalom(cfg: Any, task: Any, turn: Scaled) -> None:
        """Turn quickly while climbing."""

    found = STAGES["slalom"]
    assert (found.origin, found.shares, found.test) == ("base", "terrain", "stairs")
    assert (is_like("slalom", "terrain"), is_like("slalom", "velocity")) == (True, False)
    assert LAPTOP.ground("slalom") == "uneven"
    config = Config().with_values({"slalom.iterations": 9})
    assert (Config().iterations("slalom"), config.iterations("slalom")) == (7, 9)
    assert "slalom" not in Config().rows(stage="base")
    assert "slalom" in Config().rows(stage="slalom")
    assert "slalom" not in plan().record()["config"]
    assert "slalom" in plan(stage="slalom").record()["config"]


def test_a_run_whose_terms_differ_is_refused_in_one_line(still: str, tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), {"quadruped:cheetah": "values: {}\n"})
    assert open_run(run.folder).plan == run.plan

    @reward(weight=-0.5)
    def later(env: Any) -> Any: ...

    with pytest.raises(DraftError, match=r"later.weight differ\n  the terms of tests\.learn"):
        check_same(run, plan())
    del TERMS._items["still"]
    words = rf"was trained with 'still' of {still}, which is not loaded\n  .*install the package"
    with pytest.raises(DraftError, match=words):
        open_run(run.folder)


def test_what_a_term_raises_is_one_line(still: str) -> None:
    def broken() -> None:
        raise KeyError("gate")

    with pytest.raises(DraftError, match=f"the term 'still' of {still} fails: KeyError: 'gate'"):
        terms.guarded("still", broken)()


def test_an_environment_has_the_terms_of_its_configuration(still: str) -> None:
    pytest.importorskip("mjlab")
    from draft.learn.task.mdp.environment import environment
    from draft.learn.training.ppo.worlds import task_of

    task = task_of(plan())
    term = environment(task, 1).rewards["still"]
    assert (term.weight, term.params["gate"]) == (-0.5, Scaled(0.1, 0.5))
    bare = replace(task, config=replace(task.config, terms=()))
    assert "still" not in environment(bare, 1).rewards


# --- an installed package ------------------------------------------------------------------

LIGHT = """
import sys

assert not {"torch", "mjlab"} & {*sys.modules}
"""
PACKAGE = '''
from draft.extend import event, number, reward, stage, termination


@reward(weight=-0.5, gate=number(0.1, "m/s", "largest command that is none", power=0.5))
def still(env, gate):
    """Speed of a robot that is told to stand [m/s]."""
    from draft.learn.task.world.access import command_of, robot_of

    robot = robot_of(env)
    stands = command_of(env)[:, :2].norm(dim=1) < robot.scaled(gate)
    return robot.data.root_link_lin_vel_b.norm(dim=1) * (1.0 + stands)


@termination(height=number(9.0, "m", "height that is too much", power=1.0))
def flown(env, height):
    """Trunk far above the ground."""
    from draft.learn.task.world.access import ground_of, robot_of

    return ground_of(env).height() > robot_of(env).scaled(height)


@event(
    "interval",
    interval=number((0.02, 0.04), "s", "time between two"),
    size=number(0.1, "m/s", "added velocity"),
)
def shove(env, env_ids, size):
    """Push forwards."""
    import torch

    from draft.learn.task.mdp.events import add_velocity
    from draft.learn.task.world.access import robot_of

    push = torch.zeros(env.num_envs, 6, device=env.device)
    push[env_ids, 0] = size
    add_velocity(robot_of(env), push)


@stage(iterations=2, like="velocity", turn=number(1.5, "rad/s", "largest |wz|", power=-0.5))
def slalom(cfg, task, turn):
    """Turn quickly while walking."""
    from draft.learn.task.constants import Scaled

    cfg.commands["twist"].turn = turn
    cfg.rewards["still"].weight *= 2
'''
SETTINGS = (
    *("--set", "learning.steps=4", "learning.hidden=16,16", "observations.map_pitch=0.1"),
    *("ground.rows=4", "ground.border=2", "still.gate=0.2"),
    *("--envs", "4", "--device", "cpu", "--from", "scratch"),
)


SCRIPT = """
import draft
import own_terms

values = {"learning.steps": 4, "learning.hidden": "16,16", "ground.border": 2}
draft.train("cheetah", "run", iterations=1, envs=4, replicas=2, device="cpu", values=values)
"""


def install(folder: Path, module: str, text: str) -> None:
    """Write a package that names a module in the group of extensions."""
    about = folder / f"{module}-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[draft.extensions]\n{module} = {module}\n")
    (folder / f"{module}.py").write_text(text)


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A folder with the package and with one that clashes with Draft."""
    folder = tmp_path / "site"
    install(folder, "walking_terms", PACKAGE + LIGHT)
    clash = PACKAGE.partition("@termination")[0].replace("still", "height")
    install(folder, "clashing_terms", clash)
    return folder


# Commands one after another in one process, which imports PyTorch once: the exit code of each, and
# what it printed.
PROGRAM = """
import contextlib, io, json, sys
from draft.cli import main

for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as ended:
            code = ended.code
    print(json.dumps([code, out.getvalue(), err.getvalue()]))
"""


def python(folder: Path, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *words],
        check=False,
        env={**os.environ, **environment},
        cwd=folder,
        capture_output=True,
        text=True,
    )


def test_a_package_adds_a_reward_and_a_stage_like_built_in_ones(
    site: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mjlab")
    few = ("--replicas", "2", "--levels", "1", "--seconds", "0.5", "--device", "cpu")
    train = ("train", "cheetah", "--stage", "slalom", "--out", "run", *SETTINGS)
    commands = (
        ("learn", "show", "--stage", "slalom", "--json"),
        ("train", "--help"),
        ("--install-completion", "bash"),
        (*train, "--replicas", "1"),
        ("train", "run", "--iterations", "3"),
        ("play", "run", "--onnx", "--device", "cpu"),
        ("evaluate", "run", *few),
    )
    asked = json.dumps(commands)
    done = python(tmp_path, "-c", PROGRAM, asked, PYTHONPATH=str(site), XDG_DATA_HOME=str(tmp_path))
    assert done.returncode == 0, done.stderr
    codes, told, errors = zip(*map(json.loads, done.stdout.splitlines()), strict=True)
    assert codes == (0,) * len(commands), errors
    show, usage, *_, evaluation = told
    numbers = json.loads(show)["numbers"]
    assert numbers["still.weight"]["value"] == -0.5
    assert numbers["slalom.turn"]["source"] == "choice: walking_terms"
    assert errors[0].count("is not used") == 1
    assert "there is a reward 'height' already" in errors[0]
    assert "slalom" in usage
    assert "slalom" in (tmp_path / "bash-completion/completions/draft").read_text()
    header, *rows = (tmp_path / "run/progress.csv").read_text().splitlines()
    assert len(rows) == 3  # Two iterations, and one after it was resumed.
    assert "reward/still" in header.split(",")
    record = json.loads((tmp_path / "run/run.json").read_text())
    assert record["config"]["still"] == {"weight": -0.5, "gate": 0.2}
    assert record["extensions"]["still"] == "walking_terms"
    assert "speed" in evaluation

    # Here the package is not installed.
    monkeypatch.chdir(tmp_path)
    for words in (["train", "run", "--iterations", "4"], ["play", "run"]):
        assert main(words) == 2
        said = capsys.readouterr().err
        assert "'run' was trained with" in said
        assert "walking_terms, which is not loaded" in said


def test_several_processes_import_the_module_of_a_script(tmp_path: Path) -> None:
    pytest.importorskip("mjlab")
    (tmp_path / "own_terms.py").write_text(PACKAGE)
    (tmp_path / "script.py").write_text(SCRIPT)
    done = python(tmp_path, "script.py")
    assert done.returncode == 0, done.stderr
    assert "reward/still" in (tmp_path / "run/progress.csv").read_text()
