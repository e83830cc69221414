"""The table of `docs/reference/installing.md`: which extra a command needs, and that it says so."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

from docs import blocks
from draft.extras import usd_possible
from tests.environments import warm
from tests.warm import Warm

TABLE = blocks.DOCS / "reference" / "installing.md"
VARY = "quadruped --vary thigh_length=0.2:0.3"
SEARCH = f"optimise {VARY} --minimise mass --trials 5 --out o"
# Of each extra: a word of the table's row, and a command.
NEEDS = {
    "view": {
        "`studio`": "studio quadruped",
        "`view --web`": "view quadruped --web",
        "`play` of shipped policies": "play cheetah",
    },
    "report": {
        "`report`": "report bear --out r.html",
        "`build --report`": "build bear --out b --report",
    },
    "figures": {"`trends figures`": "trends figures --out t"},
    "explore": {
        "`screen`": f"screen {VARY} --n 10 --out s.parquet",
        "`sweep`": f"sweep {VARY} --n 10 --out s",
        "`optimise`": SEARCH,
    },
    "mcp": {"`mcp`": "mcp ."},
    "cad": {"`export --format step`": "export bear --out e --format step"},
    **(
        {"usd": {"`export --format usd`": "export bear --out e --format usd"}}
        if usd_possible()
        else {}
    ),
    "cluster": {"`study --ray`": "study examples/three_quadrupeds.yaml --toy --ray"},
    "robots": {"`import` of robots by name": "import menagerie:unitree_go2 --out i"},
    "learn": {
        "`train`": "train cheetah",
        "`study`": "study examples/three_quadrupeds.yaml --toy",
        "`surface`": "surface quadruped --vary thigh_length=0.2:0.36 shank_length=0.2:0.36",
        "`metrics --learned`": "metrics bear --learned",
    },
}
FREE = {
    "`build`": "build bear --out b",
    "`check`": "check bear",
    "`show`": "show bear",
    "`export`": "export bear --out e",
    "`metrics`": "metrics bear",
    "`import`": "import examples/descriptions/unitree_go2/go2.urdf --out i",
    "`twin`": "twin examples/descriptions/unitree_go2/go2.urdf --out t",
    "`trends`": "trends check",
    "`survey`": "survey table",
    "`list`": "list",
    "`new`": "new mine --like hopper",
    "`schema`": "schema --out s",
    "`learn show`": "learn show cheetah",
    "`doctor`": "doctor",
}


def row(extra: str) -> str:
    """The table's row of an extra."""
    found = re.search(rf"^\| {extra} \| (.*?) \|", TABLE.read_text(encoding="utf-8"), re.MULTILINE)
    assert found is not None
    return found[1]


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Warm:
    """Python of an environment without extras."""
    return warm(tmp_path_factory, ())


def run(python: Warm, folder: Path, command: str) -> subprocess.CompletedProcess[str]:
    blocks.copy_examples(folder)
    return python(["-m", "draft", *shlex.split(command)], folder, dict(os.environ))


@pytest.mark.slow
@pytest.mark.parametrize("extra", NEEDS)
def test_a_command_without_its_extra_names_it_and_leaves_no_file(
    extra: str, python: Warm, tmp_path: Path
) -> None:
    for number, (word, command) in enumerate(NEEDS[extra].items()):
        assert word in row(f"`{extra}`")
        folder = tmp_path / str(number)
        done = run(python, folder, command)
        assert done.returncode == 2, command
        assert f"draft-robotics[{extra}]'" in done.stderr, command
        assert [path.name for path in folder.iterdir()] == ["examples"], command


@pytest.mark.slow
def test_the_commands_that_need_no_extra_work_without_one(python: Warm, tmp_path: Path) -> None:
    # `view` opens a window.
    assert set(re.findall(r"`[\w ]+`", row("none"))) == FREE.keys() | {"`view`"}
    for number, command in enumerate(FREE.values()):
        done = run(python, tmp_path / str(number), command)
        # 1: a finding, such as a doubt about a row of the catalogue.
        assert done.returncode in (0, 1), f"{command}: {done.stderr}"
        assert "Traceback" not in done.stderr
