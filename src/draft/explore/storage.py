"""Storage of a search: an SQLite file in its folder, or a database shared by processes."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError, Problem
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
        raise DraftError(Problem(message, None, remedy)) from None


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
    options: dict[str, Any] = {}
    if url is None or url.startswith("sqlite:"):
        options = {"connect_args": {"factory": _Connection, "timeout": 60}}
    try:
        address = url or f"sqlite:///{(out / FILE).absolute()}"
        storage = optuna.storages.RDBStorage(address, engine_kwargs=options)
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
        remedy = "give another --out, or --storage such as sqlite:///search.db"
        raise DraftError(Problem(cause, None, remedy)) from None
