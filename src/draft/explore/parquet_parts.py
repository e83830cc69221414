"""Rows on disk, in parts: each part is a whole Parquet file or is not there.

A folder of parts has a manifest, which says what run they belong to. A run that begins again goes
on with the parts that are missing; another run is refused. A part appears under its name by a
rename, so that no kill leaves half of one.
"""

from __future__ import annotations

import io
import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from draft import files
from draft.errors import DraftError, Problem
from draft.extras import need

MANIFEST = "_manifest.json"  # what begins with _ is no data to those who read Parquet folders
_LOCK = "_lock"
_PART = re.compile(r"part-(\d{6,})\.parquet")
_META = b"draft"

Summary = dict[str, Any]


def encode(columns: Mapping[str, Any], about: Mapping[str, Any]) -> bytes:
    """A whole Parquet file of some columns.

    Args:
        columns: NumPy arrays of one length or pyarrow arrays, by name.
        about: plain data for its schema's metadata.
    """
    pa, pq = need("pyarrow"), need("pyarrow.parquet")
    table = pa.table(dict(columns)).replace_schema_metadata({_META: json.dumps(about)})
    buffer = io.BytesIO()
    # Numbers of a search hardly repeat: a dictionary of them would only cost time.
    words = [f.name for f in table.schema if pa.types.is_dictionary(f.type)]
    pq.write_table(table, buffer, compression="zstd", use_dictionary=words, write_statistics=True)
    return buffer.getvalue()


def about(path: Path) -> dict[str, Any]:
    """Plain data of a Parquet file's metadata; empty where it is not one of Draft's."""
    pq, pa = need("pyarrow.parquet"), need("pyarrow")
    try:
        found = pq.read_schema(path).metadata or {}
        return json.loads(found.get(_META, b"{}"))
    except (pa.ArrowInvalid, OSError, ValueError):
        return {}


class Parts:
    """A folder of parts.

    Attributes:
        folder: where they are.
        manifest: what run they belong to.
        count: how many there are in the end.
        done: what each finished part says of itself, by number.
    """

    def __init__(self, folder: Path, manifest: Mapping[str, Any], count: int) -> None:
        self.folder = folder
        self.manifest = dict(manifest)
        self.count = count
        self.done: dict[int, Summary] = {}

    @contextmanager
    def held(self) -> Iterator[Parts]:
        """Open the folder for this process alone, and find out what is done.

        Raises:
            DraftError: it belongs to another run or process, or cannot be written.
        """
        path = self.folder / MANIFEST
        if self.folder.exists() and not path.is_file() and _strangers(self.folder):
            cause = f"'{self.folder}' holds something else than a run of Draft; it is kept"
            raise DraftError(Problem(cause, None, "choose another --out"))
        with _lock(self.folder):
            if path.is_file():
                check_same(_read(path), self.manifest, str(self.folder))
            else:
                files.write(path, json.dumps(self.manifest, indent=1) + "\n")
            self._find()
            yield self

    def missing(self) -> Iterator[int]:
        """Numbers of the parts that are still to be made."""
        return (number for number in range(self.count) if number not in self.done)

    def add(self, number: int, content: bytes, summary: Summary) -> None:
        """Write one part.

        Raises:
            DraftError: it cannot be written, as when the disk is full.
        """
        try:
            files.write(self.path(number), content)
        except DraftError as error:
            kept = f"{len(self.done)} of {self.count} parts stay in {self.folder}"
            remedy = f"{kept}; make room and run the same command to go on"
            raise DraftError(Problem(error.problems[0].cause, None, remedy)) from None
        self.done[number] = summary

    def path(self, number: int) -> Path:
        """File of a part."""
        return self.folder / f"part-{number:06d}.parquet"

    def merge(self, target: Path, extra: Mapping[str, Any]) -> None:
        """Write all parts into one file, one row group each, and take the folder away.

        Args:
            target: the file; it appears whole or not at all.
            extra: plain data for its metadata, besides the manifest.

        Raises:
            DraftError: it cannot be written; the parts stay.
        """
        pa, pq = need("pyarrow"), need("pyarrow.parquet")
        temporary = self.folder / f".merged.tmp{os.getpid()}"  # a later run clears it away
        about_all = {_META: json.dumps({"manifest": self.manifest, **extra})}
        try:
            schema = pq.read_schema(self.path(0)).with_metadata(about_all)
            with pq.ParquetWriter(
                temporary, schema, compression="zstd", use_dictionary=_words(pa, schema)
            ) as writer:
                for number in range(self.count):
                    part = pq.read_table(self.path(number)).replace_schema_metadata(about_all)
                    if part.num_rows:
                        writer.write_table(part)
            os.replace(temporary, target)
        except OSError as error:
            cause = f"cannot write {target}: {(error.strerror or str(error)).lower()}"
            remedy = f"all parts stay in {self.folder}; make room and run the same command again"
            raise DraftError(Problem(cause, None, remedy)) from None
        finally:
            temporary.unlink(missing_ok=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _find(self) -> None:
        """Read what each finished part says, and clear away what a kill left."""
        for path in self.folder.iterdir():
            if path.name.startswith(".") and ".tmp" in path.name:
                path.unlink(missing_ok=True)
            match = _PART.fullmatch(path.name)
            if match and int(match[1]) < self.count:
                summary = about(path)
                if summary:
                    self.done[int(match[1])] = summary


def check_same(found: Mapping[str, Any], wanted: Mapping[str, Any], what: str) -> None:
    """Hold what is on disk to belonging to the run that is asked for.

    Raises:
        DraftError: it does not; with what differs.
    """
    names = [key for key in {**wanted, **found} if found.get(key) != wanted.get(key)]
    if not names:
        return
    shown = [
        name
        if isinstance(wanted.get(name), (dict, list)) or name in ("spec", "trends")
        else f"{name} ({found.get(name)!r} there, {wanted.get(name)!r} asked for)"
        for name in names
    ]
    verb = "differs" if len(names) == 1 else "differ"
    cause = f"'{what}' belongs to another run: {', '.join(shown)} {verb}"
    raise DraftError(Problem(cause, None, "choose another --out, or remove it"))


def _words(pa: Any, schema: Any) -> list[str]:
    return [field.name for field in schema if pa.types.is_dictionary(field.type)]


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found = None
    if not isinstance(found, dict):
        cause = f"{path} is not the manifest of a run"
        raise DraftError(Problem(cause, None, "choose another --out, or remove the folder"))
    return found


def _strangers(folder: Path) -> bool:
    """Whether a path without a manifest holds anything that Draft did not put there."""
    if not folder.is_dir():
        return True
    return any(path.name != _LOCK and ".tmp" not in path.name for path in folder.iterdir())


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Keep other processes out; the lock goes with the process, however it ends."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / _LOCK).open("w")
    except OSError as error:
        cause = f"cannot write {folder}: {(error.strerror or str(error)).lower()}"
        raise DraftError(Problem(cause, None, "choose another --out")) from None
    with file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:  # no such locks on Windows
            pass
        except OSError:
            cause = f"another process is writing to '{folder}'"
            raise DraftError(Problem(cause, None, "wait for it, or choose another --out")) from None
        yield
