"""One thread for each tab: order, overtaking, and faults that do not end it."""

from __future__ import annotations

import threading

import pytest

from draft.studio.tasks import TaskThread


def test_wishes_run_in_order_and_the_newest_of_a_key_counts() -> None:
    done: list[str] = []
    first, gate, last = threading.Event(), threading.Event(), threading.Event()
    worker = TaskThread(lambda: done.append("after"), lambda: None)
    worker.submit("block", lambda: (first.set(), gate.wait()))  # type: ignore[arg-type]
    first.wait()
    for k in range(50):
        worker.submit("slider", lambda k=k: done.append(f"slider {k}"))
    assert worker.waits("slider")
    worker.submit("undo", lambda: done.append("undo"))
    worker.submit("last", last.set)
    gate.set()
    last.wait()
    worker.close()
    assert done[:3] == ["after", "slider 49", "undo"]


def test_a_fault_does_not_leave_the_tab_dead(capsys: pytest.CaptureFixture[str]) -> None:
    last = threading.Event()
    worker = TaskThread(lambda: None, lambda: None)
    worker.submit("fault", lambda: 1 / 0)  # type: ignore[arg-type,return-value]
    while worker.waits("fault"):
        pass
    worker.submit("last", last.set)
    last.wait()
    worker.close()
    assert "ZeroDivisionError" in capsys.readouterr().err
