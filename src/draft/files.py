"""Writing files whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from draft.errors import DraftError, Problem


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
