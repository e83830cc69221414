"""Rewards, terminations, events and stages of other packages and of scripts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import pytest

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
    gate = rows["still.gate"]
    assert (gate.value, gate.scaled, gate.unit, gate.source) == (
        0.1,
        0.2,
        "m/s",
        f"choice: {still}",
    )
    assert (Config().groups()["still"].__doc__ or "").startswith("Speed of a robot that is told")
    changed = Config().with_values({"still.weight": "-2", "still.sides": "3,4"})
    told = changed.groups()["still"]
    assert (told.weight, told.gate, told.sides) == (-2.0, 0.1, (3.0, 4.0))
    assert terms.arguments(told) == {"gate": Scaled(0.1, 0.5), "sides": (3.0, 4.0)}
    with pytest.raises(DraftError, match=r"still.gate must be at least 0, and is -1"):
        Config().with_values({"still.gate": -1})
    with pytest.raises(DraftError, match=r"there is no number 'still.gat'"):
        Config().with_values({"still.gat": 1})


def test_numbers_of_a_term_are_read_back_and_an_older_run_has_none(still: str) -> None:
    changed = Config().with_values({"still.weight": -2})
    assert from_dict(changed.as_dict()) == changed
    older = {name: group for name, group in Config().as_dict().items() if name != "still"}
    assert "still" not in from_dict(older).groups()
    assert "still" in Config().groups()


def test_a_name_that_is_taken_is_one_clear_line(still: str) -> None:
    def named(name: str) -> Any:
        def function(env: Any) -> None: ...

        function.__name__ = name
        return function

    for name, what in (
        ("still", "reward"),
        ("height", "reward"),
        ("terrain", "stage"),
        ("episodes", "group of numbers"),
    ):
        words = f"{still}: there is a {what} '{name}' already"
        with pytest.raises(DraftError, match=words) as caught:
            termination()(named(name))
        assert len(caught.value.problems) == 1
    assert set(TERMS) == {"still"}


def test_parameters_without_numbers_and_numbers_without_a_unit_are_refused() -> None:
    def fast(env: Any, limit: float) -> None: ...

    with pytest.raises(DraftError, match=r"reward 'fast' takes \(env, limit\), not \(env\)"):
        reward(weight=1.0)(fast)
    with pytest.raises(DraftError, match="reward 'fast' has no unit and meaning for 'limit'"):
        reward(weight=1.0, limit=0.1)(fast)
    with pytest.raises(DraftError, match="an event of mode 'interval' has no number 'interval'"):
        event("interval")
    with pytest.raises(DraftError, match="no stage 'jump' for stage 'leap'"):

        @stage(iterations=1, like="jump")
        def leap(cfg: Any, task: Any) -> None: ...

    assert "leap" not in STAGES
    assert not TERMS


def test_numbers_out_of_range_or_with_names_of_draft_are_refused() -> None:
    def gated(env: Any, gate: float) -> None: ...

    def weighed(env: Any, weight: float) -> None: ...

    def short(cfg: Any, task: Any) -> None: ...

    with pytest.raises(DraftError, match=r"gate must be at least 0\n  it is -1.0"):
        reward(weight=1.0, gate=number(-1.0, "m/s", "a gate", least=0.0))(gated)
    with pytest.raises(DraftError, match="has a number 'weight', a name of Draft's own"):
        termination(weight=number(1.0, "1", "a weight"))(weighed)
    with pytest.raises(DraftError, match="iterations must be"):
        stage(iterations=0)(short)


def test_an_event_has_a_known_mode() -> None:
    with pytest.raises(DraftError, match=r"no mode 'intervall'\n  did you mean 'interval'"):
        event("intervall")  # type: ignore[arg-type]


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


def test_a_run_whose_term_is_missing_is_refused_in_one_line(still: str, tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), {"quadruped:cheetah": "values: {}\n"})
    assert open_run(run.folder).plan == run.plan
    del TERMS._items["still"]
    words = f"was trained with 'still' of {still}, which is not loaded"
    with pytest.raises(DraftError, match=words) as caught:
        open_run(run.folder)
    assert "install the package" in str(caught.value)


def test_a_term_that_was_added_since_a_run_began_is_named(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), {"quadruped:cheetah": "values: {}\n"})

    @reward(weight=-0.5)
    def later(env: Any) -> Any: ...

    with pytest.raises(DraftError, match=r"later.weight differ\n  the terms of tests\.learn"):
        check_same(run, plan())


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


def install(folder: Path, module: str, text: str) -> None:
    """Write a package that names a module in the group of extensions."""
    about = folder / f"{module}-1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {module}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[draft.extensions]\n{module} = {module}\n")
    (folder / f"{module}.py").write_text(text)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package and with one that clashes with Draft."""
    folder = tmp_path_factory.mktemp("site")
    install(folder, "walking_terms", PACKAGE + LIGHT)
    clash = PACKAGE.partition("@termination")[0].replace("still", "height")
    install(folder, "clashing_terms", clash)
    return folder


def draft(site: Path | None, folder: Path, *words: str) -> tuple[int, str, str]:
    """Run the command, with or without the packages."""
    environment = {**os.environ, "PYTHONPATH": "" if site is None else str(site)}
    environment["XDG_DATA_HOME"] = str(folder)
    done = subprocess.run(
        [sys.executable, "-m", "draft", *words],
        check=False,
        env=environment,
        cwd=folder,
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout, done.stderr


def test_a_package_adds_a_reward_and_a_stage_like_built_in_ones(site: Path, tmp_path: Path) -> None:
    pytest.importorskip("mjlab")
    code, told, errors = draft(site, tmp_path, "learn", "show", "--stage", "slalom", "--json")
    assert code == 0
    numbers = json.loads(told)["numbers"]
    assert numbers["still.weight"]["value"] == -0.5
    assert numbers["slalom.turn"]["source"] == "choice: walking_terms"
    assert errors.count("is not used") == 1
    assert "there is a reward 'height' already" in errors
    assert "slalom" in draft(site, tmp_path, "train", "--help")[1]
    assert draft(site, tmp_path, "--install-completion", "bash")[0] == 0
    assert "slalom" in (tmp_path / "bash-completion/completions/draft").read_text()

    train = ("train", "cheetah", "--stage", "slalom", "--out", "run", *SETTINGS)
    code, _, errors = draft(site, tmp_path, *train, "--replicas", "1")
    assert code == 0, errors
    header, *rows = (tmp_path / "run/progress.csv").read_text().splitlines()
    assert len(rows) == 2
    assert "reward/still" in header.split(",")
    record = json.loads((tmp_path / "run/run.json").read_text())
    assert record["config"]["still"] == {"weight": -0.5, "gate": 0.2}
    assert record["extensions"]["still"] == "walking_terms"

    code, _, errors = draft(site, tmp_path, "train", "run", "--iterations", "3")
    assert code == 0, errors
    assert len((tmp_path / "run/progress.csv").read_text().splitlines()) == 4
    code, _, errors = draft(site, tmp_path, "play", "run", "--onnx", "--device", "cpu")
    assert code == 0, errors
    few = ("--replicas", "2", "--levels", "1", "--seconds", "0.5", "--device", "cpu")
    code, told, errors = draft(site, tmp_path, "evaluate", "run", *few)
    assert code == 0, errors
    assert "speed" in told

    for words in (("train", "run", "--iterations", "4"), ("play", "run")):
        code, told, errors = draft(None, tmp_path, *words)
        assert code != 0
        assert "'run' was trained with" in (told + errors)
        assert "walking_terms, which is not loaded" in (told + errors)
        assert "Traceback" not in errors


def test_several_processes_import_the_module_of_a_script(tmp_path: Path) -> None:
    pytest.importorskip("mjlab")
    (tmp_path / "own_terms.py").write_text(PACKAGE)
    script = (
        "import draft\nimport own_terms\n"
        "values = {'learning.steps': 4, 'learning.hidden': '16,16', 'ground.border': 2}\n"
        "draft.train('cheetah', 'run', iterations=1, envs=4, replicas=2, device='cpu', "
        "values=values)\n"
    )
    (tmp_path / "script.py").write_text(script)
    done = subprocess.run(
        [sys.executable, "script.py"], check=False, cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "reward/still" in (tmp_path / "run/progress.csv").read_text()


def test_what_a_term_raises_is_one_line(still: str) -> None:
    def broken() -> None:
        raise KeyError("gate")

    with pytest.raises(DraftError, match=f"the term 'still' of {still} fails: KeyError: 'gate'"):
        terms.guarded("still", broken)()


def test_an_environment_has_the_terms_of_its_configuration(site: Path, still: str) -> None:
    pytest.importorskip("mjlab")
    from draft.learn.task.mdp.environment import environment
    from draft.learn.training.ppo.trainer import task_of

    def tilted(env: Any) -> Any: ...

    with pytest.raises(DraftError, match="there is a termination 'tilted' already"):
        termination()(tilted)
    task = task_of(plan())
    config = task.config
    task = replace(task, config=replace(config, terms=config.terms[:1]))
    term = environment(task, 1).rewards["still"]
    assert (term.weight, term.params["gate"]) == (-0.5, Scaled(0.1, 0.5))
    assert "still" not in environment(replace(task, config=replace(config, terms=())), 1).rewards
