"""Folder of a model on disk: the files of a build or an export."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence, Set
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import yaml
from numpy.typing import NDArray

from draft.design.report import design_file, report
from draft.errors import DraftError
from draft.extras import own_version
from draft.files import cannot_write, new_folder
from draft.model.exporters import check_formats, contents, is_known, known_files
from draft.values import plain, plain_value

if TYPE_CHECKING:
    from draft.design import Design
    from draft.model.model import Model

# The dumper of libyaml writes the same text five times as fast; some builds of PyYAML lack it.
_Dumper: type[yaml.SafeDumper] = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_REMEDY = "choose another `out`"
_BYTECODE = "__pycache__"


def save(
    model: Model, folder: Path, formats: Sequence[str], more: Mapping[str, str] | None = None
) -> Path:
    """Write design.yaml, report.json and the files of some formats, atomically.

    All texts are generated and the scene is compiled before anything is written.

    Args:
        model: the model.
        folder: folder to write. Everything that Draft wrote there before is removed, so that all
            files are of one design.
        formats: names of `EXPORTERS`: "mjcf" is robot.xml and scene.xml; "urdf" is robot.urdf,
            meshes and actuators.json; "sdf" is robot.sdf, model.config and meshes; "glb" is
            robot.glb; "step" is robot.step and bom.csv; "usd" is robot.usda; "mjlab" and "isaaclab"
            are a Python file with robot.xml, or with robot.urdf and its meshes.
        more: text of further files by name, all of them known.

    Returns:
        The folder.

    Raises:
        DraftError: a format is unknown, the folder holds files that Draft did not write, it
            cannot be written, an extra is missing, or an exporter of an extension fails.
        ModelError: MuJoCo does not accept the scene, or the CAD kernel the trunk.
    """
    check_formats(formats)
    check_target(folder, known_files(), "Draft model")
    files = {path: text for name in formats for path, text in contents(model, name).items()}
    return write_folder(folder, files | records(model) | dict(more or {}))


def write_folder(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write the contents of files by path into a folder, all or none; return the folder."""
    with new_folder(folder, _REMEDY) as temporary:
        for name, content in files.items():
            path = temporary / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder


def design_text(design: Design) -> str:
    """Text of a design file from which `Spec.resolve` gives the same design."""
    return _dumped(plain(design_file(design)))


def design_texts(design: Design, rows: NDArray[np.intp]) -> list[str]:
    """Texts of the design files of some of N designs."""
    columns: list[list[float]] = []

    def marked(value: Any) -> Any:
        """The content with a mark in the place of each number that differs."""
        if isinstance(value, dict):
            return {str(key): marked(item) for key, item in value.items()}
        if isinstance(value, (list, tuple)):
            return [marked(item) for item in value]
        if isinstance(value, np.ndarray) and value.ndim:
            columns.append(value[rows].tolist())
            return f"{_MARK}{len(columns) - 1}{_MARK}"
        return plain_value(value)

    parts = _dumped(marked(design_file(design))).split(_MARK)
    words = [[_float_text(x) for x in columns[int(number)]] for number in parts[1::2]]
    between = parts[::2]
    return [
        "".join(chain.from_iterable(zip(between, (*row, ""), strict=True)))
        for row in (zip(*words, strict=True) if words else [()] * len(rows))
    ]


# Stands for a number in a text; no name of a spec has it.
_MARK = "\N{SYMBOL FOR UNIT SEPARATOR}"


def _float_text(value: float) -> str:
    """A number as PyYAML writes it."""
    text = repr(value)
    if not math.isfinite(value):
        return {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}[text]
    return text.replace("e", ".0e") if "e" in text and "." not in text else text


def _dumped(data: Any) -> str:
    heading = "# Written by Draft. 'draft build SPEC:design.yaml' gives this model again.\n"
    return heading + yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)


def check_target(folder: Path, known: Set[str], what: str) -> None:
    """Refuse to replace what is not a folder that Draft wrote.

    Args:
        folder: the folder.
        known: paths, or patterns of paths, of all files and folders that Draft may have written
            there.
        what: what such a folder is, for messages.

    Raises:
        DraftError: it is none, or it cannot be read.
    """
    try:
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise DraftError(f"'{folder}' exists and is not a folder", _REMEDY)
        if not folder.is_dir() or not any(folder.iterdir()):
            return
        found = (path.relative_to(folder) for path in folder.rglob("*"))
        # Whoever runs a file of Python there leaves its bytecode.
        written = (path.as_posix() for path in found if _BYTECODE not in path.parts)
        others = sorted(path for path in written if not is_known(path, known))
        if others or not (folder / "report.json").is_file():
            held = f"it holds {', '.join(others[:4])}" if others else "it has no report.json"
            cause = f"'{folder}' is not a folder of a {what} ({held}); it is kept"
            raise DraftError(cause, f"{_REMEDY}, or empty the folder")
    except OSError as error:
        raise cannot_write(folder, error, _REMEDY) from None


def records(model: Model) -> dict[str, str | bytes]:
    """Contents of design.yaml and report.json."""
    record = report(model.design) | {
        "versions": {"draft": own_version(), "mujoco": mujoco.__version__}
    }
    return {
        "design.yaml": design_text(model.design),
        "report.json": json.dumps(plain(record), indent=2) + "\n",
    }
