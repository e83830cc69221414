"""Names of GPUs for other processes."""

from __future__ import annotations

from typing import Any

import pytest

from draft.learn.devices import visible
from draft.study import placement


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


def test_workers_of_a_study_take_the_gpus_that_it_sees(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CUDA_VISIBLE_DEVICES", "4,GPU-5")
    monkeypatch.setattr(placement, "_devices", lambda word: ["cuda:0", "cuda:1"])
    toy: Any = None  # The study matters on a CPU alone.
    workers: Any = placement.make_workers(toy, placement.Placement(device="all", workers=3))
    assert [worker._gpu for worker in workers] == ["4", "GPU-5", "4"]
