"""Rows of a run on disk, as a folder of Parquet parts that are written atomically.

A manifest in the folder identifies the run. A run that is repeated computes the missing parts; a
run with another manifest is refused.
"""

from __future__ import annotations

import io
import json
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft import files
from draft.errors import DraftError
from draft.extras import need

if TYPE_CHECKING:
    import pyarrow

MANIFEST = "_manifest.json"  # readers of Parquet folders skip names that begin with "_" or "."
_PART = re.compile(r"part-(\d{6,})\.parquet")
_META = b"draft"

Summary = dict[str, Any]


def encode(columns: Mapping[str, Any], about: Mapping[str, Any]) -> bytes:
    """Bytes of a Parquet file.

    Args:
        columns: NumPy arrays of one length, or pyarrow arrays, by name.
        about: plain data for the metadata of its schema.
    """
    pa, pq = need("pyarrow"), need("pyarrow.parquet")
    table = pa.table(dict(columns)).replace_schema_metadata({_META: json.dumps(about)})
    buffer = io.BytesIO()
    encoded = _dictionary_columns(pa, table.schema)
    pq.write_table(table, buffer, compression="zstd", use_dictionary=encoded, write_statistics=True)
    return buffer.getvalue()


def about(path: Path) -> dict[str, Any]:
    """Plain data in the metadata of a Parquet file; empty if Draft did not write the file."""
    pq, pa = need("pyarrow.parquet"), need("pyarrow")
    try:
        found = pq.read_schema(path).metadata or {}
        return json.loads(found.get(_META, b"{}"))
    except (pa.ArrowInvalid, OSError, ValueError):
        return {}


class Parts:
    """A folder of parts.

    Attributes:
        folder: its path.
        manifest: identity of the run, as plain data.
        count: parts of the complete run.
        done: summaries of the finished parts, by number.
    """

    def __init__(self, folder: Path, manifest: Mapping[str, Any], count: int) -> None:
        self.folder = folder
        self.manifest = dict(manifest)
        self.count = count
        self.done: dict[int, Summary] = {}

    @contextmanager
    def held(self) -> Iterator[Parts]:
        """Lock the folder and read which parts are done.

        Raises:
            DraftError: the folder belongs to another run, another process works in it, or it
                cannot be written.
        """
        path = self.folder / MANIFEST
        if self.folder.exists() and not path.is_file() and _has_other_files(self.folder):
            cause = f"'{self.folder}' is not a folder of a Draft run; it is kept"
            raise DraftError(cause, "choose another `out`")
        with files.held(self.folder, self.manifest["command"]):
            new = not path.is_file()
            if new:
                files.write(path, json.dumps(self.manifest, indent=1) + "\n")
            else:
                check_same(_read_manifest(path), self.manifest, str(self.folder))
            self._read_done()
            try:
                yield self
            except BaseException:
                if new and not self.done:  # nothing to resume
                    path.unlink(missing_ok=True)
                raise

    def missing(self) -> Iterator[int]:
        """Numbers of the parts that are not written yet."""
        return (number for number in range(self.count) if number not in self.done)

    def add(self, number: int, content: bytes, summary: Summary) -> None:
        """Write one part.

        Raises:
            DraftError: it cannot be written, for example because the disk is full.
        """
        try:
            files.write(self.path(number), content)
        except DraftError as error:
            kept = f"{len(self.done)} of {self.count} parts are kept in {self.folder}"
            remedy = f"{kept}; free some space and repeat the command to resume"
            raise DraftError(error.problems[0].cause, remedy) from None
        self.done[number] = summary

    def path(self, number: int) -> Path:
        """Path of a part."""
        return self.folder / f"part-{number:06d}.parquet"

    def merge(self, target: Path, extra: Mapping[str, Any]) -> None:
        """Write all parts into one file, one row group each, and remove the folder.

        Args:
            target: the file, written atomically.
            extra: plain data for its metadata, besides the manifest.

        Raises:
            DraftError: it cannot be written; the parts are kept.
        """
        pa, pq = need("pyarrow"), need("pyarrow.parquet")
        about_all = {_META: json.dumps({"manifest": self.manifest, **extra})}
        remedy = f"all parts are kept in {self.folder}; free some space and repeat the command"
        # The temporary file lies among the parts, where a later run removes what a kill left.
        with files.new_file(target, remedy, self.folder) as temporary:
            schema = pq.read_schema(self.path(0)).with_metadata(about_all)
            encoded = _dictionary_columns(pa, schema)
            with pq.ParquetWriter(
                temporary, schema, compression="zstd", use_dictionary=encoded
            ) as writer:
                for number in range(self.count):
                    part = pq.read_table(self.path(number)).replace_schema_metadata(about_all)
                    if part.num_rows:
                        writer.write_table(part)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _read_done(self) -> None:
        """Read the summaries of the finished parts, and remove the temporary files of a kill."""
        for path in self.folder.iterdir():
            if path.name.startswith(".") and ".tmp" in path.name:
                path.unlink(missing_ok=True)
            match = _PART.fullmatch(path.name)
            if match and int(match[1]) < self.count:
                summary = about(path)
                if summary:
                    self.done[int(match[1])] = summary


def check_same(found: Mapping[str, Any], wanted: Mapping[str, Any], what: str) -> None:
    """Check that the manifest on disk is that of the requested run.

    Raises:
        DraftError: it is not; the message lists what differs.
    """
    names = [key for key in {**wanted, **found} if found.get(key) != wanted.get(key)]
    if not names:
        return
    shown = [
        name
        if isinstance(wanted.get(name), (dict, list)) or name in ("spec", "trends")
        else f"{name} ({found.get(name)!r} there, {wanted.get(name)!r} requested)"
        for name in names
    ]
    verb = "differs" if len(names) == 1 else "differ"
    cause = f"'{what}' belongs to another run: {', '.join(shown)} {verb}"
    raise DraftError(cause, "choose another `out`, or remove it")


def _dictionary_columns(pa: Any, schema: pyarrow.Schema) -> list[str]:
    """Columns to encode by dictionary; varied numbers hardly repeat, so it would only cost time."""
    return [field.name for field in schema if pa.types.is_dictionary(field.type)]


def _read_manifest(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found = None
    if not isinstance(found, dict):
        cause = f"{path} is not the manifest of a run"
        raise DraftError(cause, "choose another `out`, or remove the folder")
    return found


def _has_other_files(folder: Path) -> bool:
    """Tell whether a path without a manifest holds anything that Draft did not write."""
    if not folder.is_dir():
        return True
    return any(path.name != files.LOCK and ".tmp" not in path.name for path in folder.iterdir())
