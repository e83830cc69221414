"""One thread for each tab: order, overtaking, and faults that do not end it."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import Any
from unittest.mock import MagicMock

import pytest

import draft
from draft.studio.library import Library
from draft.studio.session import Session
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


def test_a_tab_that_cannot_be_built_leaves_no_thread(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("viser", reason="needs the extra 'view'")
    from draft.studio import panel

    made: list[TaskThread] = []

    def noted(*arguments: Any) -> TaskThread:
        made.append(TaskThread(*arguments))
        return made[-1]

    monkeypatch.setattr(panel, "TaskThread", noted)
    monkeypatch.setattr(panel.Panel, "_build", lambda _: 1 / 0)
    session = Session(Library(draft.load("hopper"), tmp_path))
    with pytest.raises(ZeroDivisionError):
        panel.Panel(MagicMock(), session, tmp_path, "/report/x")
    made[0]._thread.join(10.0)
    assert not made[0]._thread.is_alive()
