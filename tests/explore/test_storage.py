"""The log of a search: shared, whole or not at all."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.explore.storage import FILE, SqliteLog, open_storage


@given(st.lists(st.tuples(st.integers(0, 1), st.integers(1, 3)), max_size=12))
def test_two_writers_see_one_sequence_of_entries(
    tmp_path_factory: pytest.TempPathFactory, turns: list[tuple[int, int]]
) -> None:
    path = tmp_path_factory.mktemp("log") / "log.db"
    writers = [SqliteLog(path), SqliteLog(path)]
    written: list[dict[str, int]] = []
    for who, count in turns:
        entries = [{"entry": len(written) + i} for i in range(count)]
        writers[who].append_logs(entries)
        written += entries
    for writer in writers:
        for first in range(len(written) + 1):
            assert list(writer.read_logs(first)) == written[first:]


def test_entries_that_cannot_all_be_written_leave_none(tmp_path: Path) -> None:
    path = tmp_path / "log.db"
    log = SqliteLog(path)
    log.append_logs([{"entry": 0}])
    other = sqlite3.connect(path)
    other.execute(
        "CREATE TRIGGER full BEFORE INSERT ON log WHEN NEW.number >= 2 "
        "BEGIN SELECT RAISE(ABORT, 'database or disk is full'); END"
    )
    other.close()
    with pytest.raises(sqlite3.IntegrityError):
        log.append_logs([{"entry": 1}, {"entry": 2}])
    assert list(log.read_logs(0)) == [{"entry": 0}]
    assert list(SqliteLog(path).read_logs(0)) == [{"entry": 0}]


def test_a_database_of_optuna_itself_is_kept_and_can_be_continued(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    path = tmp_path / FILE
    open_storage({"seed": 0}, ["minimize"], tmp_path, f"sqlite:///{path}")
    before = path.read_bytes()
    with pytest.raises(DraftError, match=r"(?s)is a database of Optuna.*add `storage` sqlite:///"):
        open_storage({"seed": 0}, ["minimize"], tmp_path, None)
    assert path.read_bytes() == before
    _, manifest = open_storage({"seed": 1}, ["minimize"], tmp_path, f"sqlite:///{path}")
    assert manifest == {"seed": 0}
