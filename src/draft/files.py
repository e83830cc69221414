"""Atomic writes of files and folders, and locks on folders.

A file or folder is written under a temporary name, flushed to the disk, and moved into place in one
step, so that an interrupted write keeps the old content.
"""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Protocol

from draft.errors import DraftError

LOCK = ".lock"
_LOCKED_BYTE = 1 << 20
_EXCHANGE = 2  # RENAME_EXCHANGE of renameat2(2)
_AT_FDCWD = -100


class Readable(Protocol):
    """A file that is read: a `Path` on the disk, or `Content` in memory; its text is its place."""

    @property
    def name(self) -> str:
        """Last part of its path."""
        ...

    def read_bytes(self) -> bytes:
        """Read all of it."""
        ...


@dataclass(frozen=True)
class Content:
    """A file in memory, by its path and its bytes."""

    path: str
    data: bytes = field(repr=False)

    @property
    def name(self) -> str:
        """Last part of its path."""
        return Path(self.path).name

    def read_bytes(self) -> bytes:
        """Return its bytes."""
        return self.data

    def __str__(self) -> str:
        return self.path


def write(path: Path, content: str | bytes) -> None:
    """Write a file atomically; a missing folder is created.

    Raises:
        DraftError: it cannot be written; the old content is kept.
    """
    with new_file(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def check_output(name: str | Path, suffix: str, option: str = "`out`", mark: str = "") -> Path:
    """Return the path of a file that a command is going to write, checked before the work starts.

    Args:
        name: the file.
        suffix: how its name has to end, such as ".html".
        option: option that names it, for messages.
        mark: text in what the command writes: a file without it is another's.

    Raises:
        DraftError: the name ends otherwise, it cannot be written, or it would replace what the
            command has not written.
    """
    path = Path(name)
    if str(name) and os.path.isdir(path):
        raise DraftError(f"{option} '{name}' is a folder", f"name a file in it: FILE{suffix}")
    if path.suffix.lower() != suffix:
        example = f"{path.stem or 'name'}{suffix}"
        raise DraftError(f"{option} '{name}' does not end in {suffix}", f"such as {example}")
    if mark and os.path.exists(path):
        own = False
        with suppress(OSError):
            own = mark.encode() in path.read_bytes()
        if not own:
            cause = f"'{path}' exists and was not written by this command; it is kept"
            raise DraftError(cause, f"choose another {option}")
    for parent in path.absolute().parents:
        if parent.is_dir():
            break
        if parent.exists():
            cause = f"{option} '{name}': {parent} is not a folder"
            raise DraftError(cause, "choose another path")
    return path


@contextmanager
def new_file(
    path: Path,
    remedy: str = "give another place",
    folder: Path | None = None,
    keep_suffix: bool = False,
) -> Iterator[Path]:
    """Write a file atomically with any writer that takes a path.

    Args:
        path: the file. A missing folder is created.
        remedy: remedy of the error message.
        folder: folder of the temporary file, on the same file system; by default that of the file.
        keep_suffix: give the temporary file the suffix of the file, for writers that depend on it.
            Otherwise a temporary file left by a killed process matches no pattern like `*.parquet`.

    Yields:
        A temporary path, to be written inside the `with` block.

    Raises:
        DraftError: an OSError in the block or after it; the old content is kept.
    """
    name = f"{_temporary(path)}{os.getpid()}{path.suffix if keep_suffix else ''}"
    temporary = (folder or path.parent) / name
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _sweep(temporary.parent, path)
        try:
            yield temporary
            _flush(temporary)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(path, error, remedy) from None


@contextmanager
def new_folder(
    target: Path, remedy: str = "choose another `out`", replace: bool = True
) -> Iterator[Path]:
    """Write a folder atomically.

    Args:
        target: the folder. Missing parents are created.
        remedy: remedy of the error message.
        replace: whether to replace an existing folder with its content.

    Yields:
        A temporary folder, to be filled inside the `with` block.

    Raises:
        DraftError: an OSError in the block or after it; the old folder is kept, and no parent is
            created if the block fails.
    """
    try:
        beside = next((parent for parent in target.parents if os.path.lexists(parent)), Path())
        _sweep(beside, target)
        temporary = Path(tempfile.mkdtemp(prefix=f"{_temporary(target)}{os.getpid()}-", dir=beside))
        try:
            os.chmod(temporary, 0o755)
            yield temporary
            for path in temporary.rglob("*"):
                if path.is_file():
                    _flush(path)
            target.parent.mkdir(parents=True, exist_ok=True)
            _move_folder(temporary, target, replace)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        raise cannot_write(target, error, remedy) from None


def _temporary(path: Path) -> str:
    """Beginning of the temporary names of a file or folder; the number of a process follows."""
    return f".{path.name[:200]}.tmp"


def _sweep(folder: Path, path: Path) -> None:
    """Remove what processes that were killed left of a file or folder that they wrote."""
    start = _temporary(path)
    try:
        left = [entry for entry in os.scandir(folder) if entry.name.startswith(start)]
    except OSError:
        return
    for entry in left:
        number = re.match(r"\d+", entry.name.removeprefix(start))
        if number is None or _alive(int(number[0])):
            continue
        if entry.is_dir(follow_symlinks=False):
            shutil.rmtree(entry.path, ignore_errors=True)
        else:
            with suppress(OSError):
                os.unlink(entry.path)


def _alive(process: int) -> bool:
    """Whether a process of this machine runs; True where that cannot be asked."""
    if sys.platform == "win32":
        return True  # os.kill would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def cannot_write(path: Path, error: OSError, remedy: str) -> DraftError:
    """Error for a file or folder that cannot be written."""
    reason = (error.strerror or str(error)).strip().partition("\n")[0].lower()
    cause = f"cannot write {path}: {reason}"
    return DraftError(cause, remedy)


def _flush(path: Path) -> None:
    """Flush a file to the disk; otherwise its renaming may be stored before its content."""
    with path.open("r+b") as file:  # Windows flushes only what is open for writing
        os.fsync(file.fileno())


def _move_folder(new: Path, target: Path, replace: bool) -> None:
    """Move a folder into place; the old one ends up at the path of the new one, or is removed."""
    if not target.exists() or not replace:
        os.rename(new, target)
        return
    if _exchange(new, target):
        return
    old = new.with_name(f"{new.name}-old")
    os.rename(target, old)
    try:
        os.rename(new, target)
    except BaseException:
        os.rename(old, target)
        raise
    shutil.rmtree(old, ignore_errors=True)


def _exchange(a: Path, b: Path) -> bool:
    """Exchange two folders in one step, where the system can (Linux)."""
    if not sys.platform.startswith("linux"):
        return False
    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    return call(_AT_FDCWD, os.fsencode(a), _AT_FDCWD, os.fsencode(b), _EXCHANGE) == 0


@contextmanager
def held(folder: Path, what: str) -> Iterator[None]:
    """Hold the lock of a folder, which is made if it is missing.

    A block that fails leaves none of the folders that were made for it, unless it wrote something.

    Args:
        folder: the folder.
        what: what locks it, for the message, such as "search".

    Raises:
        DraftError: another process holds the lock, or the folder cannot be written.
    """
    made = [one for one in (folder, *folder.parents) if not os.path.lexists(one)]
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            file = lock(folder, what)
        except OSError as error:
            raise cannot_write(folder, error, "choose another `out`") from None
        with file:
            yield
    except BaseException:
        if made and [path.name for path in folder.glob("*")] == [LOCK]:
            (folder / LOCK).unlink(missing_ok=True)
        for one in made:
            with suppress(OSError):  # not empty, or never made
                one.rmdir()
        raise


def lock(folder: Path, what: str) -> IO[str]:
    """Lock a folder for this process; the system releases the lock however the process ends.

    Args:
        folder: it must exist.
        what: what locks it, for the message, such as "search".

    Returns:
        The open lock file; close it to release the lock.

    Raises:
        DraftError: another process holds the lock.
        OSError: the lock cannot be written.
    """
    file = (folder / LOCK).open("a+", encoding="utf-8")
    if not _hold(file):
        file.seek(0)
        cause = f"another {what} is running in '{folder}' (process {file.read() or '?'})"
        file.close()
        raise DraftError(cause, "wait for it, or choose another `out`") from None
    file.truncate(0)
    file.write(str(os.getpid()))
    file.flush()
    return file


def locked(folder: Path) -> bool:
    """Whether a process holds the lock of a folder."""
    try:
        with (folder / LOCK).open(encoding="utf-8") as file:
            return not _hold(file, shared=True)
    except OSError:
        return False  # never locked


def _hold(file: IO[str], shared: bool = False) -> bool:
    """Lock an open file until it is closed; return False if another process holds it."""
    if sys.platform == "win32":
        import msvcrt

        # Windows lets nobody else read what is locked: a byte far behind the process's number.
        file.seek(_LOCKED_BYTE)
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
    import fcntl

    try:
        fcntl.flock(file, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
