"""Files are written whole or not at all."""

from __future__ import annotations

from pathlib import Path

import pytest

from draft import files
from draft.errors import DraftError


def test_a_file_and_its_folder_are_made(tmp_path: Path) -> None:
    files.write(tmp_path / "a" / "b.txt", "µ")
    assert (tmp_path / "a" / "b.txt").read_text(encoding="utf-8") == "µ"
    files.write(tmp_path / "a" / "b.txt", b"two")
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b.txt"]


def test_what_cannot_be_written_leaves_what_was(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    with pytest.raises(DraftError, match=r"cannot write .*below: file exists"):
        files.write(tmp_path / "file" / "below", "x")
    with pytest.raises(DraftError, match=r"cannot write .*folder: is a directory"):
        files.write(tmp_path / "folder", "x")
    assert (tmp_path / "file").read_text(encoding="utf-8") == "kept"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "folder"]


def test_a_folder_that_is_taken_is_known(tmp_path: Path) -> None:
    assert not files.locked(tmp_path)
    with files.lock(tmp_path, "draft train"):
        assert files.locked(tmp_path)
    assert not files.locked(tmp_path)
