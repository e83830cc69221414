"""`draft doctor` describes an installation, also a broken one, and imports nothing large."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from draft import doctor, extras
from draft.cli import main
from draft.learn.engine import machine

ASK_RENDERERS, SIZE_OF_CUDA = doctor.renderers, doctor._cuda_size
# Not imported: that takes seconds, and the doctor does not either.
needs_mjlab = pytest.mark.skipif(find_spec("mjlab") is None, reason="needs the extra learn")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let renderers and packages answer at once."""
    monkeypatch.setattr(doctor, "renderers", lambda: {"egl": "draws", "osmesa": "fails"})
    monkeypatch.setattr(doctor, "_cuda_size", lambda: 0)


def rows(**options: bool) -> dict[str, str]:
    return {row.item: row.text for row in doctor.examine(**options)}


def record(capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    assert main(["doctor", "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def without(monkeypatch: pytest.MonkeyPatch, *libraries: str) -> None:
    real = extras.installed
    monkeypatch.setattr(extras, "installed", lambda n: None if n in libraries else real(n))


def test_the_table_is_markdown_with_a_row_for_every_extra(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(doctor, "renderers", lambda: {"egl": "fails (a | b)"})
    assert main(["doctor"]) == 0
    lines = capsys.readouterr().out.splitlines()
    cells = [line.removeprefix("| ").removesuffix(" |").split(" | ") for line in lines]
    assert lines[0].startswith("| item")
    assert set(lines[1]) == {"|", "-"}
    assert all(len(row) == 2 for row in cells[2:])
    assert any("fails (a \\| b)" in text for _, text in cells[2:])
    items = [item.strip() for item, _ in cells[2:]]
    assert set(items) >= {"draft", "python", "libraries", "gpu", "drawing", "browser", "cores"}
    known = {"explore", "figures", "learn", "report", "view"}
    assert {item.removeprefix("extra ") for item in items} >= known


def test_versions_are_those_that_the_libraries_state(capsys: pytest.CaptureFixture[str]) -> None:
    mujoco = pytest.importorskip("mujoco")
    assert record(capsys)["libraries"]["mujoco"] == mujoco.__version__


def test_a_missing_library_comes_with_the_command_that_installs_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    without(monkeypatch, "optuna")
    command = extras.remedy("explore")
    text = rows()["extra explore"]
    assert text.startswith("missing optuna")
    assert text.endswith(f": {command}")
    found = record(capsys)["extras"]["explore"]
    assert found["missing"][0] == "optuna"
    assert found["install"] == command


def test_a_library_that_only_some_systems_need_is_not_missing() -> None:
    assert "mjbatch" not in extras.required()["learn"]
    assert {"mjlab", "scipy"} <= set(extras.required()["learn"])


@needs_mjlab
def test_the_expected_minutes_are_those_of_learn_show(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(machine, "gpu_possible", lambda: False)
    minutes = record(capsys)["learning"]["minutes"]
    assert main(["learn", "show", "--json"]) == 0
    assert minutes == json.loads(capsys.readouterr().out)["minutes"]
    assert min(minutes.values()) > 0


@needs_mjlab
def test_a_gpu_is_assumed_from_its_driver_unless_pytorch_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(machine, "gpu_possible", lambda: True)
    asked: list[str] = []
    monkeypatch.setattr(machine, "devices", lambda name: asked.append(name) or ["cpu"])
    told = rows()["learning"]
    assert told.startswith("MuJoCo Warp")
    assert told.endswith("`torch` asks PyTorch")
    assert asked == []
    assert "asks PyTorch" not in rows(ask=True)["learning"]
    assert asked == ["auto"]


@pytest.mark.parametrize(
    ("version", "driver", "said"),
    [
        ("cuda: Optional[str] = '13.0'", False, True),
        ("cuda = '12.8'", False, True),
        ("cuda: Optional[str] = None", False, False),
        ("cuda: Optional[str] = '13.0'", True, False),
    ],
)
def test_a_build_of_pytorch_for_cuda_is_named_where_there_is_no_gpu(
    version: str, driver: bool, said: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "torch").mkdir()
    (tmp_path / "torch/__init__.py").touch()
    (tmp_path / "torch/version.py").write_text(f"debug = False\n{version}\nhip = None\n")
    monkeypatch.delitem(sys.modules, "torch", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(extras, "installed", lambda name: "2.9.0")
    monkeypatch.setattr(doctor, "gpu_possible", lambda: driver)
    monkeypatch.setattr(doctor, "_nvidia", list)
    monkeypatch.setattr(doctor, "_cuda_size", SIZE_OF_CUDA)
    row = doctor._gpu()
    assert ("is a build for CUDA" in row.text) == said
    assert ("docs/reference/installing.md" in row.text) == said
    assert row.record["cuda"] == (version.split("'")[1] if "'" in version else None)


@pytest.mark.parametrize("name", ["foo", "osmesa", "disabled"])
def test_a_renderer_of_the_environment_that_does_not_draw_is_named_with_one_that_does(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MUJOCO_GL", name)
    told = rows()["drawing"]
    assert told.endswith(f"used: {name} (MUJOCO_GL), set MUJOCO_GL=egl")


@pytest.mark.parametrize(
    ("done", "answer"),
    [
        ("print('bright')", "draws"),
        ("print('black')", "draws black pictures"),
        ("raise ValueError('no | driver')", "fails (ValueError: no | driver)"),
        ("import os; os.abort()", "crashes (signal 6)"),
        ("import time; time.sleep(60)", "does not answer in 0 s"),
    ],
)
def test_each_renderer_is_tried_in_a_process_of_its_own(
    done: str, answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_DRAWING", done)
    monkeypatch.setattr(doctor, "RENDERERS", {sys.platform: ("wgl",)})
    if "sleep" in done:
        monkeypatch.setattr(doctor, "_PATIENCE", 0.2)
    assert ASK_RENDERERS() == {"wgl": answer}


def test_broken_learning_is_a_row_and_the_rest_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**_: object) -> None:
        raise ImportError("libcudart.so.12: cannot open shared object file")

    monkeypatch.setattr(doctor, "this_machine", broken)
    found = rows()
    assert "libcudart.so.12" in found["learning"]
    assert "draft" in found
    assert "drawing" in found


def fresh(code: str, more: Mapping[str, str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **more},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
def test_nothing_large_is_imported(tmp_path: Path) -> None:
    code = (
        "import sys\nfrom draft import doctor\nfrom draft.cli import main\n"
        "doctor.renderers = lambda: {}\nassert main(['doctor']) == 0\n"
        "print('LOADED', *[m for m in ('torch', 'mjlab', 'scipy', 'warp') if m in sys.modules])"
    )
    done = fresh(code, {"CUDA_VISIBLE_DEVICES": ""}, tmp_path)
    assert done.stdout.splitlines()[-1] == "LOADED", done.stderr


@pytest.mark.slow
def test_an_invalid_renderer_is_bad_input_for_other_commands_and_none_for_the_doctor(
    tmp_path: Path,
) -> None:
    head = "import sys\nfrom draft.cli import main\n"
    build = fresh(f"{head}sys.exit(main(['build', 'hopper']))", {"MUJOCO_GL": "foo"}, tmp_path)
    assert build.returncode == 2
    assert "MUJOCO_GL=foo" in build.stderr
    assert "draft doctor" in build.stderr
    code = f"{head}from draft import doctor\ndoctor.renderers = lambda: {{}}\n"
    told = fresh(f"{code}sys.exit(main(['doctor']))", {"MUJOCO_GL": "foo"}, tmp_path)
    assert told.returncode == 0
    assert "learning" in told.stdout


@pytest.mark.slow
def test_a_deleted_current_folder_is_bad_input(tmp_path: Path) -> None:
    for words in (["check", "bear"], ["sweep", "bear"], ["new", "mine"]):
        code = (
            "import os, sys\nos.mkdir('gone'); os.chdir('gone'); os.rmdir('../gone')\n"
            f"from draft.cli import main\nsys.exit(main({words!r}))"
        )
        done = fresh(code, {}, tmp_path)
        assert done.returncode == 2
        assert done.stderr.startswith("error: the current folder was deleted\n  change to")
