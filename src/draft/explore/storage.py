"""Storage of a search: an SQLite file in its folder, or a database of Optuna by its URL.

Optuna's relational storage takes some twenty statements and 20 ms for a trial. The file in the
folder is a log of Optuna's operations instead, one row each, which takes less than 1 ms. Optuna's
own file of operations syncs the disk for each of them, and a kill can leave its lock, for which the
next process waits 30 s, and half a line, with which the study cannot be continued.
"""

from __future__ import annotations

import json
import sqlite3
import weakref
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError
from draft.extras import need

if TYPE_CHECKING:
    from optuna import Study

STUDY = "draft"
_MANIFEST = "manifest"
FILE = "study.db"


class _Connection(sqlite3.Connection):
    """Connection with a write-ahead log: safe against a kill, without a disk sync per write."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.execute("PRAGMA journal_mode=WAL")
        self.execute("PRAGMA synchronous=NORMAL")


class SqliteLog:
    """Log of a `JournalStorage` in an SQLite file, which processes may share.

    A transaction is written whole or not at all, and a killed process leaves no lock.
    """

    def __init__(self, path: Path) -> None:
        """Open the log, or create it.

        Args:
            path: the file.

        Raises:
            DraftError: the file is a database that Optuna wrote itself.
        """
        # Kept open while this object lives: closing the last connection syncs the disk.
        self._log = sqlite3.connect(path, timeout=60, factory=_Connection, isolation_level=None)
        weakref.finalize(self, self._log.close)
        tables = {name for (name,) in self._log.execute("SELECT name FROM sqlite_master")}
        if "studies" in tables:
            cause = f"'{path}' is a database of Optuna, not a log of this version; it is kept"
            remedy = f"choose another `out`, or add `storage` sqlite:///{path}"
            raise DraftError(cause, remedy)
        self._log.execute("CREATE TABLE IF NOT EXISTS log (number INTEGER PRIMARY KEY, entry TEXT)")

    def read_logs(self, log_number_from: int) -> Iterator[dict[str, Any]]:
        """Yield the entries from a number on."""
        query = "SELECT entry FROM log WHERE number >= ? ORDER BY number"
        for (entry,) in self._log.execute(query, (log_number_from,)).fetchall():
            yield json.loads(entry)

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Append entries in one transaction."""
        entries = [json.dumps(entry) for entry in logs]
        with self._log:
            self._log.execute("BEGIN IMMEDIATE")
            query = "SELECT COALESCE(MAX(number) + 1, 0) FROM log"
            (first,) = self._log.execute(query).fetchone()
            self._log.executemany("INSERT INTO log VALUES (?, ?)", enumerate(entries, first))


@contextmanager
def stored(out: Path, url: str | None, trials: Callable[[], int]) -> Iterator[None]:
    """Report a database that can no longer be written, such as on a full disk, as bad input.

    Args:
        out: folder of the study.
        url: URL of another database; None for a file in `out`.
        trials: number of the trials that are stored.

    Raises:
        DraftError: the database failed inside the `with` block.
    """
    errors = (
        need("optuna").exceptions.StorageInternalError,
        need("sqlalchemy").exc.SQLAlchemyError,
        sqlite3.Error,
    )
    try:
        yield
    except errors as error:
        cause = getattr(error, "orig", None) or error.__cause__ or error
        cause = getattr(cause, "orig", None) or cause
        reason = " ".join(str(cause).split())[:200]
        remedy = f"about {trials()} trials are kept; free some space and repeat the command"
        message = f"cannot write the study at '{url or out / FILE}': {reason}"
        raise DraftError(message, remedy) from None


def open_storage(
    manifest: Mapping[str, Any], directions: list[str], out: Path, url: str | None
) -> tuple[Study, dict[str, Any]]:
    """Open the stored study, or create it.

    Args:
        manifest: identity of the search, stored with a new study.
        directions: "minimize" or "maximize" for each goal of a new study.
        out: folder of the study.
        url: URL of another database; None for a file in `out`.

    Returns:
        The study, and the manifest of the search that created it.

    Raises:
        DraftError: the folder cannot be written, or the database does not answer.
    """
    optuna = need("optuna")
    try:
        if url is None:
            storage = optuna.storages.JournalStorage(SqliteLog(out / FILE))
        else:
            options: dict[str, Any] = {}
            if url.startswith("sqlite:"):
                options = {"connect_args": {"factory": _Connection, "timeout": 60}}
            storage = optuna.storages.RDBStorage(url, engine_kwargs=options)
        names = optuna.get_all_study_names(storage)
        if STUDY in names:
            directions = [
                d.name.lower()
                for d in optuna.load_study(study_name=STUDY, storage=storage).directions
            ]
        study = optuna.create_study(
            storage=storage, study_name=STUDY, directions=directions, load_if_exists=True
        )
        if _MANIFEST not in study.user_attrs:
            study.set_user_attr(_MANIFEST, dict(manifest))
        return study, study.user_attrs[_MANIFEST]
    except DraftError:
        raise
    except Exception as error:  # of SQLAlchemy, its drivers, or the file system
        reason = " ".join(str(error).split())[:200]
        cause = f"cannot open the study at '{url or out}': {reason}"
        remedy = "give another `out`, or `storage` such as sqlite:///search.db"
        raise DraftError(cause, remedy) from None
