"""MuJoCo's warnings are printed, and no log file appears in the user's folder."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import draft

SOURCE = Path(draft.__file__).parent
# Modules that compute physics, without the libraries for learning.
MODULES = [
    ".".join(path.relative_to(SOURCE.parent).with_suffix("").parts)
    for path in sorted(SOURCE.rglob("*.py"))
    if re.search(r"(?m)^ .*\bmj_(?:step|forward)\w*\(", path.read_text(encoding="utf-8"))
    and "start_mjlab" not in (path.parent / "__init__.py").read_text(encoding="utf-8")
]
UNSTABLE = """
import importlib, sys, mujoco
importlib.import_module(sys.argv[1])
xml = "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
model = mujoco.MjModel.from_xml_string(xml)
data = mujoco.MjData(model)
data.qvel[:] = 1e30
mujoco.mj_step(model, data)
"""


def _run(code: str, *words: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        check=True,
    )
    return done.stdout + done.stderr


@pytest.mark.parametrize("module", ["draft.model.model", *MODULES])
def test_an_unstable_simulation_writes_no_file(module: str, tmp_path: Path) -> None:
    assert "The simulation is unstable" in _run(UNSTABLE, module, folder=tmp_path)
    assert not [*tmp_path.iterdir()]


def test_a_log_file_that_the_user_has_named_is_kept(tmp_path: Path) -> None:
    named = """
import mujoco
config = mujoco.MjLogConfig.get()
config.logfile = "mine.txt"
config.set()
"""
    _run(named + UNSTABLE, "draft.model.model", folder=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
