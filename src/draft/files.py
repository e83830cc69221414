"""Writing files whole or not at all, and folders that one process has at a time."""

from __future__ import annotations

import os
import shutil
import tempfile
from pathlib import Path
from typing import IO

from draft.errors import DraftError, Problem

LOCK = ".lock"


def write(path: Path, content: str | bytes) -> None:
    """Write a file, its folder too: first beside its place, then moved into it.

    Raises:
        DraftError: it cannot be written; what was there is as it was.
    """
    data = content.encode() if isinstance(content, str) else content
    temporary = path.with_name(f".{path.name[:200]}.tmp{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            temporary.write_bytes(data)
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        cause = f"cannot write {path}: {(error.strerror or str(error)).lower()}"
        raise DraftError(Problem(cause, None, "give another place")) from None


def replace_folder(new: Path, target: Path) -> None:
    """Move a folder to its place; what was there is removed after.

    Args:
        new: beside the target, on the same file system.
        target: it may exist.

    Raises:
        OSError: it cannot be moved; what was there is as it was.
    """
    if not target.exists():
        os.rename(new, target)
        return
    aside = Path(tempfile.mkdtemp(prefix=f".{target.name}-", dir=target.parent))
    try:
        os.rename(target, aside / "old")
        os.rename(new, target)
    finally:
        if not target.exists() and (aside / "old").exists():
            os.rename(aside / "old", target)
        shutil.rmtree(aside, ignore_errors=True)


def lock(folder: Path, command: str) -> IO[str]:
    """Take a folder for this process; the system lets go of it however the process ends.

    Args:
        folder: it must exist.
        command: what takes it, for the message.

    Returns:
        The open lock; close it to let go.

    Raises:
        DraftError: another process has it.
        OSError: the lock cannot be written.
    """
    import fcntl  # Not on Windows, where the rest of this module works.

    file = (folder / LOCK).open("a+", encoding="utf-8")
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.seek(0)
        cause = f"another '{command}' is at work in '{folder}' (process {file.read() or '?'})"
        file.close()
        raise DraftError(Problem(cause, None, "wait for it, or choose another --out")) from None
    file.truncate(0)
    file.write(str(os.getpid()))
    file.flush()
    return file


def locked(folder: Path) -> bool:
    """Tell whether a process has a folder by `lock`."""
    import fcntl

    try:
        with (folder / LOCK).open(encoding="utf-8") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False  # Nobody ever took it.
    return False
