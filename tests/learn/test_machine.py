"""What there is to learn on, told without PyTorch where it can be."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.learn import engine
from draft.learn import machine as module
from draft.learn.machine import gpu_possible, machine


@pytest.fixture(autouse=True)
def all_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_NEEDED", ("json",))
    monkeypatch.setattr(engine, "obstacle", lambda: None)


def test_without_a_gpu_native_mujoco_is_used_and_pytorch_is_not_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "gpu_possible", lambda: False)
    monkeypatch.setattr(module, "devices", lambda word: pytest.fail("PyTorch is asked"))
    for word in ("auto", "cpu"):
        found = machine(word)
        assert found.on_cpu
        assert found.engine is not None
        assert (found.engine.name, found.missing) == ("native", None)
        assert found.cores >= 1


def test_with_a_gpu_pytorch_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "gpu_possible", lambda: True)
    monkeypatch.setattr(module, "devices", lambda word: ["cuda:0"])
    found = machine()
    assert (found.devices, found.on_cpu) == (["cuda:0"], False)
    assert found.engine is not None
    assert found.engine.name == "warp"
    with pytest.raises(DraftError, match="--engine native runs on the CPU"):
        machine(engine="native")
    monkeypatch.setattr(module, "devices", lambda word: ["cpu"])
    assert machine().on_cpu


def test_what_is_missing_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_NEEDED", ("json", "nothing_of_this_name"))
    monkeypatch.setattr(module, "gpu_possible", lambda: True)
    found = machine()
    assert (found.missing, found.engine) == ("nothing_of_this_name", None)
    assert found.on_cpu


@pytest.mark.parametrize("hidden", ["", "-1"])
def test_hidden_gpus_are_none(monkeypatch: pytest.MonkeyPatch, hidden: str) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    assert gpu_possible()
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", hidden)
    assert not gpu_possible()


@pytest.mark.parametrize(("platform", "file", "found"), [
    ("linux", "nvidiactl", True),
    ("linux", "dxg", True),
    ("linux", "nvme0n1", False),
    ("linux", "null", False),
    ("darwin", "nvidiactl", False),
])  # fmt: skip
def test_drivers_show_by_their_files(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, platform: str, file: str, found: bool
) -> None:
    (tmp_path / file).touch()
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(module, "DEVICE_FILES", tmp_path)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "0")
    assert gpu_possible() == found
