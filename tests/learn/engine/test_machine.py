"""What this machine offers for training: devices, engines, cores, time and memory."""

from __future__ import annotations

import importlib.util
import re
import sys
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
    gpu_possible,
    incompatibility,
    minutes,
    obstacle,
    replicas,
    this_machine,
    visible,
)

CPU, GPU, GPUS = ["cpu"], ["cuda:0"], ["cuda:0", "cuda:1"]
NATIVE, WARP = Engine("native", "requested"), Engine("warp", "requested")


# --- engines -------------------------------------------------------------------------------


@pytest.fixture
def usable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mjbatch is installed, and so is its MuJoCo."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: object())
    monkeypatch.setattr(machine, "requires", lambda name: ["mujoco==3.11.0", "numpy"])
    monkeypatch.setattr(machine, "installed", lambda name: "3.11.0")


@pytest.fixture
def missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mjbatch is not installed."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)


@pytest.fixture
def other(usable: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Mjbatch was built with another MuJoCo."""
    monkeypatch.setattr(machine, "installed", lambda name: "3.12.0")


@pytest.mark.usefixtures("usable")
def test_native_mujoco_is_taken_where_there_is_no_gpu() -> None:
    assert choose("auto", CPU) == Engine("native", "the fastest without a GPU")
    assert choose("native", CPU) == NATIVE
    assert choose("warp", CPU) == WARP


@pytest.mark.usefixtures("usable")
@pytest.mark.parametrize("devices", [GPU, GPUS])
def test_warp_is_taken_on_gpus(devices: list[str]) -> None:
    assert choose("auto", devices) == Engine("warp", "it runs on the GPU")
    assert choose("warp", devices) == WARP


@pytest.mark.usefixtures("missing")
def test_warp_is_taken_where_mjbatch_is_missing_and_the_reason_is_given() -> None:
    found = choose("auto", CPU)
    assert found.name == "warp"
    assert "cannot be used: mjbatch is not installed (it exists for Linux and macOS)" in found.why
    assert choose("warp", CPU) == WARP
    assert choose("auto", GPU).why == "it runs on the GPU"


@pytest.mark.usefixtures("other")
def test_warp_is_taken_where_mjbatch_is_of_another_mujoco() -> None:
    found = choose("auto", CPU)
    assert found.name == "warp"
    assert found.why.endswith("mjbatch was built with MuJoCo 3.11.0, and 3.12.0 is installed")


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ("missing", '`engine="native"`: mjbatch is not installed'),
        ("other", '`engine="native"`: mjbatch was built with MuJoCo 3.11.0, and 3.12.0 is'),
    ],
)
def test_native_mujoco_that_is_requested_and_cannot_be_used_is_explained(
    how: str, words: str, request: pytest.FixtureRequest
) -> None:
    request.getfixturevalue(how)
    with pytest.raises(DraftError, match=words) as caught:
        choose("native", CPU)
    assert 'use `engine="warp"`, which runs anywhere' in caught.value.problems[0].remedy


@pytest.mark.usefixtures("usable")
def test_native_mujoco_on_gpus_is_refused() -> None:
    with pytest.raises(DraftError, match=r"runs on the CPU, not on cuda:0, cuda:1") as caught:
        choose("native", GPUS)
    assert caught.value.problems[0].remedy == 'add `device="cpu"`, or use `engine="warp"`'


@pytest.mark.parametrize(
    ("needed", "installed", "words"),
    [
        ("3.11.0", "3.11.0", None),
        (None, "3.11.0", None),
        (None, None, None),
        ("3.11.0", "3.11.1", "built with MuJoCo 3.11.0, and 3.11.1 is installed"),
        ("3.11.0", None, "built with MuJoCo 3.11.0, and none is installed"),
    ],
)
def test_mjbatch_needs_the_mujoco_that_it_was_built_with(
    needed: str | None, installed: str | None, words: str | None
) -> None:
    found = incompatibility(needed, installed)
    assert (found is None) == (words is None)
    assert (words or "") in (found or "")


@pytest.mark.usefixtures("usable")
@pytest.mark.parametrize(
    ("lines", "fits"),
    [
        (["numpy", "mujoco==3.11.0"], True),
        (["mujoco == 3.12.0"], False),
        (["mujoco>=3.9", "numpy==2.0"], True),
        (["mujoco-warp==3.9"], True),
        (None, True),
    ],
)
def test_the_version_is_read_from_what_mjbatch_requires(
    lines: list[str] | None, fits: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine, "requires", lambda name: lines)
    assert (obstacle() is None) == fits


def test_what_is_installed_here_can_be_used() -> None:
    pytest.importorskip("mjbatch")
    assert obstacle() is None


# --- processes -----------------------------------------------------------------------------


@pytest.fixture
def six(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine with six cores."""
    monkeypatch.setattr(machine, "cores", lambda: 6)


@pytest.mark.usefixtures("six")
def test_native_mujoco_has_a_process_per_core_but_not_more_than_worlds() -> None:
    assert replicas(None, 4096, NATIVE, CPU) == 6
    assert replicas(None, 6, NATIVE, CPU) == 6
    assert replicas(None, 4, NATIVE, CPU) == 4


@pytest.mark.usefixtures("six")
def test_warp_has_one_process_on_a_cpu_unless_more_are_requested() -> None:
    assert replicas(None, 4096, WARP, CPU) == 1
    assert replicas(3, 4096, WARP, CPU) == 3


@pytest.mark.usefixtures("six")
def test_gpus_have_a_process_each() -> None:
    assert replicas(None, 4096, WARP, GPU) == 1
    assert replicas(None, 4096, WARP, GPUS) == 2


@pytest.mark.usefixtures("six")
@pytest.mark.parametrize(
    ("asked", "worlds", "devices", "words"),
    [
        (7, 4096, CPU, r"`replicas` 7: this machine has 6 physical cores.*\n  choose 1 to 6"),
        (0, 4096, CPU, r"`replicas` 0: .*\n  choose 1 to 6"),
        (-1, 4096, CPU, r"`replicas` -1: .*\n  choose 1 to 6"),
        (5, 4, CPU, r"`replicas` 5: there are only 4 worlds.*\n  add `envs=5` or more"),
        (2, 4096, GPUS, r"`replicas` 2 is for a CPU.*\n  omit `replicas`, or add `device=\"cpu\"`"),
        (1, 4096, GPU, r"`replicas` 1 is for a CPU.*\n  omit `replicas`, or add `device=\"cpu\"`"),
    ],
)
def test_numbers_of_processes_that_cannot_be_are_explained(
    asked: int, worlds: int, devices: list[str], words: str
) -> None:
    with pytest.raises(DraftError, match=words):
        replicas(asked, worlds, NATIVE, devices)


@given(st.integers(1, 6), st.integers(1, 10000))
def test_a_number_that_can_be_is_what_is_used(asked: int, worlds: int) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(machine, "cores", lambda: 6)
        if asked <= worlds:
            assert replicas(asked, worlds, NATIVE, CPU) == asked
        else:
            with pytest.raises(DraftError, match=rf"there (is|are) only {worlds} worlds? to"):
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
    def refuse(*_: Any, **__: Any) -> Any:
        raise FileNotFoundError

    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda pid: {3, 5, 8}, raising=False)
    monkeypatch.setattr("builtins.open", refuse)
    found = cores()
    monkeypatch.undo()
    assert found == 3


# --- time and memory -----------------------------------------------------------------------


def test_time_is_shared_among_processes_and_grows_with_the_steps() -> None:
    for found in (NATIVE, WARP):
        one = minutes(1e7, 4, found, 1, "flat")
        assert minutes(1e7, 4, found, 4, "flat") == pytest.approx(one / 4)
        assert minutes(3e7, 4, found, 1, "flat") == pytest.approx(3 * one)
        assert minutes(1e7, 4, found, 1, "uneven") > one
    assert minutes(1e7, 4, NATIVE, 1, "uneven") < minutes(1e7, 4, WARP, 1, "flat") / 3


@pytest.mark.parametrize("ground", ["flat", "uneven"])
def test_finer_physics_takes_longer_but_less_than_in_proportion(ground: str) -> None:
    for found in (NATIVE, WARP):
        coarsest, usual, fine = (minutes(1e7, n, found, 1, ground) for n in (1, 4, 20))
        assert 0 < coarsest < usual
        assert 2 * usual < fine < 5 * usual


@given(st.floats(2e9, 1e12), st.integers(1, 200_000), st.integers(1, 2))
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
    with pytest.raises(DraftError, match='`engine="native"` runs on the CPU'):
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
    monkeypatch.setattr(machine, "DEVICE_FILES", tmp_path)
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "0")
    assert gpu_possible() == found


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
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    if seen is not None:
        monkeypatch.setenv("CUDA_VISIBLE_DEVICES", seen)
    assert visible(["cuda:0", "cuda:2"]) == names
