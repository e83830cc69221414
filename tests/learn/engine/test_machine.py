"""What this machine offers for training: devices, engines, cores, time and memory."""

from __future__ import annotations

import importlib.util
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.learn.engine import machine
from draft.learn.engine.machine import (
    Engine,
    check_memory,
    choose,
    cores,
    devices,
    gpu_possible,
    minutes,
    obstacle,
    replicas,
    this_machine,
    visible,
)

CPU, GPU, GPUS = ["cpu"], ["cuda:0"], ["cuda:0", "cuda:1"]
NATIVE, WARP = Engine("native", "requested"), Engine("warp", "requested")
MISSING = "mjbatch is not installed (it exists for Linux and macOS)"
OTHER = "mjbatch was built with MuJoCo 3.11.0, and 3.12.0 is installed"


# --- engines -------------------------------------------------------------------------------


Mjbatch = Callable[..., None]


@pytest.fixture
def mjbatch(monkeypatch: pytest.MonkeyPatch) -> Mjbatch:
    """Say what mjbatch requires, None if it is missing, and which MuJoCo is installed."""

    def installs(requires: list[str] | None, mujoco: str | None, has: bool = True) -> None:
        monkeypatch.setattr(importlib.util, "find_spec", lambda name: has or None)
        monkeypatch.setattr(machine, "requires", lambda name: requires)
        monkeypatch.setattr(machine, "installed", lambda name: mujoco)

    return installs


STATES: dict[str, Any] = {
    "usable": (["mujoco==3.11.0", "numpy"], "3.11.0"),
    "missing": (None, "3.11.0", False),
    "other": (["mujoco==3.11.0", "numpy"], "3.12.0"),
}
ANYWHERE = 'use `engine="warp"`, which runs anywhere'
ON_GPUS = '`engine="native"` runs on the CPU, not on cuda:0, cuda:1\n  add `device="cpu"`'


@pytest.mark.parametrize(
    ("state", "asked", "on", "found"),
    [
        ("usable", "auto", CPU, Engine("native", "the fastest without a GPU")),
        ("usable", "native", CPU, NATIVE),
        ("usable", "warp", CPU, WARP),
        ("usable", "auto", GPU, Engine("warp", "it runs on the GPU")),
        ("usable", "auto", GPUS, Engine("warp", "it runs on the GPU")),
        ("usable", "warp", GPU, WARP),
        ("usable", "warp", GPUS, WARP),
        ("usable", "native", GPUS, ON_GPUS),
        ("missing", "auto", CPU, Engine("warp", f"native MuJoCo cannot be used: {MISSING}")),
        ("missing", "warp", CPU, WARP),
        ("missing", "auto", GPU, Engine("warp", "it runs on the GPU")),
        ("missing", "native", CPU, f'`engine="native"`: {MISSING}\n  {ANYWHERE}'),
        ("other", "auto", CPU, Engine("warp", f"native MuJoCo cannot be used: {OTHER}")),
        ("other", "native", CPU, f'`engine="native"`: {OTHER}\n'),
    ],
)
def test_an_engine_is_chosen_for_the_devices_and_the_reason_is_given(
    mjbatch: Mjbatch, state: str, asked: str, on: list[str], found: Engine | str
) -> None:
    mjbatch(*STATES[state])
    check(found, lambda: choose(asked, on))


def check(found: Any, call: Callable[[], Any]) -> None:
    """Check what a call returns, or the start of its message."""
    if not isinstance(found, str):
        assert call() == found
        return
    with pytest.raises(DraftError) as caught:
        call()
    assert str(caught.value).startswith(found)


@pytest.mark.parametrize(
    ("requires", "mujoco", "found"),
    [
        (["numpy", "mujoco==3.11.0"], "3.11.0", None),
        (["mujoco>=3.9", "numpy==2.0"], "3.11.0", None),
        (["mujoco-warp==3.9"], "3.11.0", None),
        (None, "3.11.0", None),
        (None, None, None),
        (["mujoco == 3.12.0"], "3.11.0", "MuJoCo 3.12.0, and 3.11.0 is installed"),
        (["mujoco==3.11.0"], "3.11.1", "MuJoCo 3.11.0, and 3.11.1 is installed"),
        (["mujoco==3.11.0"], None, "MuJoCo 3.11.0, and none is installed"),
    ],
)
def test_mjbatch_needs_the_mujoco_that_it_was_built_with(
    mjbatch: Mjbatch, requires: list[str] | None, mujoco: str | None, found: str | None
) -> None:
    mjbatch(requires, mujoco)
    assert obstacle() == (found and f"mjbatch was built with {found}")


def test_what_is_installed_here_can_be_used() -> None:
    pytest.importorskip("mjbatch")
    assert obstacle() is None


# --- processes -----------------------------------------------------------------------------


CORES = "this machine has 6 physical cores for this process\n  choose 1 to 6"
PER_GPU = (
    "is for a CPU; on GPUs there is one process per device\n"
    '  omit `replicas`, or add `device="cpu"`'
)


@pytest.fixture
def six(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with six cores."""
    monkeypatch.setattr(machine, "cores", lambda: 6)


@pytest.mark.usefixtures("six")
@pytest.mark.parametrize(
    ("asked", "worlds", "engine", "on", "found"),
    [
        pytest.param(None, 4096, NATIVE, CPU, 6, id="native: one per core"),
        pytest.param(None, 6, NATIVE, CPU, 6, id="native: one per world"),
        pytest.param(None, 4, NATIVE, CPU, 4, id="native: not more than worlds"),
        pytest.param(None, 4096, WARP, CPU, 1, id="Warp: one on a CPU"),
        pytest.param(3, 4096, WARP, CPU, 3, id="Warp: unless more are requested"),
        pytest.param(None, 4096, WARP, GPU, 1, id="one GPU"),
        pytest.param(None, 4096, WARP, GPUS, 2, id="one per GPU"),
        (7, 4096, NATIVE, CPU, f"`replicas` 7: {CORES}"),
        (0, 4096, NATIVE, CPU, f"`replicas` 0: {CORES}"),
        (-1, 4096, NATIVE, CPU, f"`replicas` -1: {CORES}"),
        (2, 4096, NATIVE, GPUS, f"`replicas` 2 {PER_GPU}"),
        (1, 4096, NATIVE, GPU, f"`replicas` 1 {PER_GPU}"),
    ],
)
def test_a_run_has_as_many_processes_as_its_engine_and_devices_can_use(
    asked: int | None, worlds: int, engine: Engine, on: list[str], found: int | str
) -> None:
    check(found, lambda: replicas(asked, worlds, engine, on))


@pytest.mark.usefixtures("six")
@given(st.integers(1, 6), st.integers(1, 10000))
def test_a_number_that_can_be_is_what_is_used(asked: int, worlds: int) -> None:
    if asked <= worlds:
        assert replicas(asked, worlds, NATIVE, CPU) == asked
        return
    few = rf"`replicas` {asked}: there (is|are) only {worlds} worlds? to.*\n  add `envs={asked}`"
    with pytest.raises(DraftError, match=few):
        replicas(asked, worlds, NATIVE, CPU)


@pytest.mark.parametrize(
    ("siblings", "usable", "count"),
    [
        ({0: "0,4", 4: "0,4", 1: "1,5", 5: "1,5"}, {0, 1, 4, 5}, 2),
        ({0: "0,4", 4: "0,4", 1: "1,5", 5: "1,5"}, {0, 1}, 2),
        ({0: "0-1", 1: "0-1"}, {0, 1}, 1),
        ({0: "0", 1: "1", 2: "2"}, {0, 1, 2}, 3),
        ({0: "0"}, {0}, 1),
    ],
)
def test_two_threads_of_a_core_count_once(
    siblings: dict[int, str], usable: set[int], count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda pid: usable, raising=False)
    monkeypatch.setattr(machine, "_siblings", siblings.__getitem__)
    assert cores() == count


@pytest.mark.parametrize(("threads", "count"), [(8, 4), (1, 1), (None, 1)])
def test_where_affinity_is_not_known_half_of_the_threads_are_cores(
    threads: int | None, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(machine.os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(machine.os, "cpu_count", lambda: threads)
    assert cores() == count


def test_cores_of_a_system_without_topology_are_its_processors(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda pid: {3, 5, 8}, raising=False)
    with monkeypatch.context() as patch:
        patch.setattr("builtins.open", lambda *_, **__: Path("/nowhere").stat())
        found = cores()
    assert found == 3


# --- time and memory -----------------------------------------------------------------------


@pytest.mark.parametrize("engine", [NATIVE, WARP])
def test_time_is_shared_among_processes_and_grows_with_steps_ground_and_physics(
    engine: Engine,
) -> None:
    one = minutes(1e7, 4, engine, 1, "flat")
    assert minutes(1e7, 4, engine, 4, "flat") == pytest.approx(one / 4)
    assert minutes(3e7, 4, engine, 1, "flat") == pytest.approx(3 * one)
    assert minutes(1e7, 4, engine, 1, "uneven") > one
    assert minutes(1e7, 4, NATIVE, 1, "uneven") < minutes(1e7, 4, WARP, 1, "flat") / 3
    # Finer physics takes longer, but less than in proportion.
    for ground in ("flat", "uneven"):
        coarsest, usual, fine = (minutes(1e7, n, engine, 1, ground) for n in (1, 4, 20))
        assert 0 < coarsest < usual
        assert 2 * usual < fine < 5 * usual


@given(st.floats(2e9, 3e10), st.integers(1, 200_000), st.integers(1, 2))
def test_worlds_that_do_not_fit_into_memory_are_refused_with_a_number_that_fits(
    free: float, worlds: int, processes: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(machine, "free_memory", lambda: free)
        try:
            check_memory(worlds, 24, 494, processes)
        except DraftError as error:
            most = re.search(r"add `envs=(\d+)` or fewer", str(error))
            assert most is not None
            assert int(most[1]) < worlds
            check_memory(int(most[1]), 24, 494, processes)
        patch.setattr(machine, "free_memory", lambda: None)
        check_memory(worlds, 24, 494, processes)


def test_much_fits_into_memory_and_not_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "free_memory", lambda: 16e9)
    check_memory(4096, 24, 494, 8)
    with pytest.raises(DraftError, match=r"1000000 worlds need .* GB, and 16\.0 GB are free"):
        check_memory(1_000_000, 24, 494, 8)


# --- devices -------------------------------------------------------------------------------


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "_REQUIRED", ("json",))
    monkeypatch.setattr(machine, "obstacle", lambda: None)


@pytest.mark.usefixtures("installed")
def test_without_a_gpu_native_mujoco_is_used_and_pytorch_is_not_imported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(machine, "gpu_possible", lambda: False)
    monkeypatch.setattr(machine, "devices", lambda word: pytest.fail("PyTorch is asked"))
    for word in ("auto", "cpu"):
        found = this_machine(word)
        assert found.on_cpu
        assert found.engine is not None
        assert (found.engine.name, found.missing) == ("native", None)
        assert found.cores >= 1


@pytest.mark.usefixtures("installed")
def test_with_a_gpu_pytorch_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "gpu_possible", lambda: True)
    monkeypatch.setattr(machine, "devices", lambda word: ["cuda:0"])
    found = this_machine()
    assert (found.devices, found.on_cpu) == (["cuda:0"], False)
    assert found.engine is not None
    assert found.engine.name == "warp"
    with pytest.raises(DraftError):
        this_machine(engine="native")
    monkeypatch.setattr(machine, "devices", lambda word: ["cpu"])
    assert this_machine().on_cpu


@pytest.mark.usefixtures("installed")
def test_a_missing_library_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine, "_REQUIRED", ("json", "nothing_of_this_name"))
    monkeypatch.setattr(machine, "gpu_possible", lambda: True)
    found = this_machine()
    assert (found.missing, found.engine) == ("nothing_of_this_name", None)
    assert found.on_cpu


@pytest.mark.parametrize(
    ("platform", "seen", "file", "found"),
    [
        ("win32", None, "null", True),
        ("win32", "", "null", False),
        ("win32", "-1", "null", False),
        ("linux", "0", "nvidiactl", True),
        ("linux", "0", "dxg", True),
        ("linux", "0", "nvme0n1", False),
        ("linux", "0", "null", False),
        ("darwin", "0", "nvidiactl", False),
    ],
)
def test_gpus_show_by_the_files_of_their_drivers_unless_they_are_hidden(
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    platform: str,
    seen: str | None,
    file: str,
    found: bool,
) -> None:
    (tmp_path / file).touch()
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(machine, "DEVICE_FILES", tmp_path)
    see(monkeypatch, seen)
    assert gpu_possible() == found


def see(monkeypatch: pytest.MonkeyPatch, seen: str | None) -> None:
    """Say which GPUs this process sees; None for all."""
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    if seen is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", seen)


@pytest.mark.parametrize(
    ("seen", "names"),
    [
        (None, ["0", "2"]),
        ("", ["0", "2"]),
        ("4,5,6", ["4", "6"]),
        ("4, 5, 6 ", ["4", "6"]),
        ("GPU-abc,GPU-def,GPU-123", ["GPU-abc", "GPU-123"]),
        ("MIG-GPU-abc/1/0,MIG-2,MIG-3", ["MIG-GPU-abc/1/0", "MIG-3"]),
    ],
)
def test_gpus_keep_the_names_that_this_process_sees_them_by(
    seen: str | None, names: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    see(monkeypatch, seen)
    assert visible(["cuda:0", "cuda:2"]) == names


@pytest.mark.parametrize(
    ("gpus", "word", "found"),
    [
        (0, "auto", CPU),
        (0, "cuda", "`device` cuda: PyTorch finds no GPU"),
        (0, "0,1", "`device` 0,1: PyTorch finds no GPU"),
        (0, "all", "`device` all: PyTorch finds no GPU"),
        (0, "tpu", "there is no device 'tpu'"),
        (0, "cuda:x", "there is no device 'cuda:x'"),
        (2, "auto", GPU),
        (2, "cuda", GPU),
        (2, "cuda:0", GPU),
        (2, "all", GPUS),
        (2, "0,1", GPUS),
        (2, "cuda:1", ["cuda:1"]),
        (2, "cpu", CPU),
        (2, "cuda:2", "`device` cuda:2: this machine has 2 GPUs, numbered from 0"),
    ],
)
def test_devices_are_named_by_words_and_numbers(
    gpus: int, word: str, found: list[str] | str, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch = pytest.importorskip("torch")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: gpus > 0)
    monkeypatch.setattr(torch.cuda, "device_count", lambda: gpus)
    check(found, lambda: devices(word))
