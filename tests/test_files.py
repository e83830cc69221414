"""Files and folders are written atomically; a folder is locked by one process at a time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from draft import files
from draft.errors import DraftError


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_and_its_folder_are_made(tmp_path: Path) -> None:
    files.write(tmp_path / "a" / "b.txt", "µ")
    assert (tmp_path / "a" / "b.txt").read_text(encoding="utf-8") == "µ"
    files.write(tmp_path / "a" / "b.txt", b"two")
    assert names(tmp_path / "a") == ["b.txt"]


def test_what_cannot_be_written_leaves_what_was(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept", encoding="utf-8")
    (tmp_path / "folder").mkdir()
    with pytest.raises(DraftError, match=r"cannot write .*below: file exists"):
        files.write(tmp_path / "file" / "below", "x")
    with pytest.raises(DraftError, match=r"cannot write .*folder: is a directory"):
        files.write(tmp_path / "folder", "x")
    assert (tmp_path / "file").read_text(encoding="utf-8") == "kept"
    assert names(tmp_path) == ["file", "folder"]


def test_an_output_has_its_suffix_and_replaces_only_its_like(tmp_path: Path) -> None:
    (tmp_path / "mine.html").write_text("mine", encoding="utf-8")
    (tmp_path / "folder.html").mkdir()
    for name, said in {
        "a.pdf": r"`out` '.*a.pdf' does not end in .html",
        "folder.html": "is a folder",
        "mine.html/a.html": "mine.html is not a folder",
        "mine.html": "was not written by this command; it is kept",
    }.items():
        with pytest.raises(DraftError, match=said):
            files.check_output(tmp_path / name, ".html", mark="Draft")
    (tmp_path / "ours.HTML").write_text("by Draft", encoding="utf-8")
    for name in ("ours.HTML", "new/a.html"):
        assert files.check_output(tmp_path / name, ".html", mark="Draft") == tmp_path / name
    assert names(tmp_path) == ["folder.html", "mine.html", "ours.HTML"]


def test_a_file_appears_after_its_content_is_on_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    flushed: list[int] = []
    monkeypatch.setattr(os, "fsync", lambda file: flushed.append(os.fstat(file).st_ino))
    files.write(tmp_path / "a", "x")
    with files.new_folder(tmp_path / "folder") as folder:
        (folder / "b").write_text("x", encoding="utf-8")
    found = [(tmp_path / name).stat().st_ino for name in ("a", "folder/b")]
    assert flushed == found


def test_a_writer_may_need_the_suffix_of_the_file(tmp_path: Path) -> None:
    with files.new_file(tmp_path / "a.mp4", keep_suffix=True) as video:
        assert video.suffix == ".mp4"
        video.write_bytes(b"x")
    with files.new_file(tmp_path / "a.parquet") as table:
        table.write_bytes(b"x")
        assert list(tmp_path.glob("*.parquet")) == []
    assert names(tmp_path) == ["a.mp4", "a.parquet"]


@pytest.mark.parametrize("fault", [KeyboardInterrupt, OSError])
@pytest.mark.parametrize("exchange", [True, False])
def test_a_folder_that_is_not_finished_leaves_the_old_one(
    tmp_path: Path, fault: type[BaseException], exchange: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not exchange:
        monkeypatch.setattr(files, "_exchange", lambda a, b: False)
    with files.new_folder(tmp_path / "a" / "out") as folder:
        (folder / "old").write_text("", encoding="utf-8")
    with (
        pytest.raises(DraftError if fault is OSError else fault),
        files.new_folder(tmp_path / "a" / "out"),
    ):
        raise fault
    assert names(tmp_path / "a" / "out") == ["old"]
    with files.new_folder(tmp_path / "a" / "out") as folder:
        (folder / "new").write_text("", encoding="utf-8")
    assert names(tmp_path / "a" / "out") == ["new"]
    assert names(tmp_path / "a") == ["out"]
    assert (tmp_path / "a" / "out").stat().st_mode & 0o777 == 0o755


def test_a_folder_that_is_not_finished_leaves_no_parents(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="cannot write"), files.new_folder(tmp_path / "a" / "b"):
        raise OSError(28, "No space left on device")
    assert names(tmp_path) == []


def test_a_new_folder_does_not_replace_one_with_content(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with files.new_folder(tmp_path / "out", replace=False) as folder:
        (folder / "mine").write_text("", encoding="utf-8")
    with (
        pytest.raises(DraftError, match="directory not empty"),
        files.new_folder(tmp_path / "out", replace=False) as folder,
    ):
        (folder / "theirs").write_text("", encoding="utf-8")
    assert names(tmp_path / "out") == ["mine"]
    assert names(tmp_path) == ["out"]


def test_a_locked_folder_is_known_and_locked_once(tmp_path: Path) -> None:
    assert not files.locked(tmp_path)
    with files.lock(tmp_path, "training"):
        assert files.locked(tmp_path)
        words = rf"another study is running in .*process {os.getpid()}"
        with pytest.raises(DraftError, match=words):
            files.lock(tmp_path, "study")
    assert not files.locked(tmp_path)


def test_windows_locks_a_byte_behind_the_number_of_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    held: list[int] = []

    def locking(file: int, mode: int, count: int) -> None:
        if held:
            raise PermissionError(13, "Permission denied")
        held.append(os.lseek(file, 0, os.SEEK_CUR))

    windows = SimpleNamespace(locking=locking, LK_NBLCK=2)
    monkeypatch.setitem(sys.modules, "msvcrt", windows)
    monkeypatch.setattr(sys, "platform", "win32")
    with files.lock(tmp_path, "training"):
        assert held[0] > 1000
        assert (tmp_path / files.LOCK).read_text() == str(os.getpid())
        assert files.locked(tmp_path)
        with pytest.raises(DraftError, match=f"another study .*process {os.getpid()}"):
            files.lock(tmp_path, "study")
    held.clear()
    assert not files.locked(tmp_path)


def dead() -> int:
    """Number of a process that has ended."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    return process.pid


@pytest.mark.skipif(sys.platform == "win32", reason="whether a process runs cannot be asked")
def test_what_a_kill_leaves_is_removed_by_the_next_write(tmp_path: Path) -> None:
    gone, living = dead(), os.getppid()
    (tmp_path / f".model.tmp{gone}-x1").mkdir()
    (tmp_path / f".model.tmp{gone}-x1" / "robot.xml").write_text("half")
    (tmp_path / f".model.tmp{living}-x2").mkdir()
    (tmp_path / f".other.tmp{gone}-x3").mkdir()
    (tmp_path / f".row.csv.tmp{gone}").write_text("half")
    (tmp_path / f".row.csv.tmp{living}").write_text("being written")
    (tmp_path / ".row.csv.tmpl").write_text("of the user")
    with files.new_folder(tmp_path / "model") as folder:
        (folder / "robot.xml").write_text("whole")
    files.write(tmp_path / "row.csv", "whole")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {
        "model",
        "row.csv",
        f".model.tmp{living}-x2",
        f".other.tmp{gone}-x3",
        f".row.csv.tmp{living}",
        ".row.csv.tmpl",
    }


@pytest.mark.skipif(sys.platform == "win32", reason="needs a kill")
def test_a_killed_write_of_a_folder_is_swept_by_its_repetition(tmp_path: Path) -> None:
    code = (
        "import os, sys\nfrom pathlib import Path\nfrom draft import files\n"
        "with files.new_folder(Path(sys.argv[1])) as folder:\n"
        "    (folder / 'half').write_text('x')\n    os.kill(os.getpid(), 9)"
    )
    target = tmp_path / "out" / "model"
    subprocess.run([sys.executable, "-c", code, str(target)], check=False)
    assert [path.name[:10] for path in tmp_path.iterdir()] == [".model.tmp"]
    with files.new_folder(target) as folder:
        (folder / "robot.xml").write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_lock_that_fails_takes_its_empty_folders_along(tmp_path: Path) -> None:
    def fail(write: bool) -> None:
        with files.held(tmp_path / "a" / "b", "test"):
            if write:
                (tmp_path / "a" / "b" / "row").write_text("kept")
            raise ValueError

    with pytest.raises(ValueError):  # noqa: PT011
        fail(False)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ValueError):  # noqa: PT011
        fail(True)
    assert (tmp_path / "a" / "b" / "row").is_file()
