"""A model's folder on disk, written whole or not at all: as built, or as exported."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import yaml

from draft.design.report import design_file, report
from draft.errors import DraftError, Problem, suggest

if TYPE_CHECKING:
    from draft.design import Design
    from draft.model.model import Model

FORMATS = ("urdf", "glb", "mjcf")
# What Draft writes into such a folder; one that holds anything else is kept.
KNOWN = frozenset(
    (
        "robot.xml",
        "scene.xml",
        "design.yaml",
        "report.json",
        "robot.urdf",
        "actuators.json",
        "meshes",
        "meshes/trunk.stl",
        "robot.glb",
        "report.html",
    )
)
# libyaml's writes the same text five times as fast; not every build of PyYAML has it.
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_EXCHANGE = 2  # RENAME_EXCHANGE of renameat2(2)
_AT_FDCWD = -100


def save(
    model: Model, folder: Path, formats: Sequence[str], more: Mapping[str, str] | None = None
) -> Path:
    """Write design.yaml, report.json and the files of some formats.

    Every text is made and the scene is loaded first, the files go to a temporary folder beside the
    target, and that is moved into place: an interrupted save leaves what was there.

    Args:
        model: the model.
        folder: its folder. What Draft wrote there before goes, so that all in it is of one design.
        formats: of FORMATS: "mjcf" is robot.xml and scene.xml; "urdf" is robot.urdf,
            meshes/trunk.stl and actuators.json; "glb" is robot.glb.
        more: further files by name, which KNOWN must have.

    Returns:
        The folder.

    Raises:
        DraftError: the folder holds something that Draft did not write, or cannot be written.
        ModelError: MuJoCo does not accept the scene.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown:
        cause = f"there is no format '{unknown[0]}'"
        raise DraftError(Problem(cause, None, suggest(unknown[0], FORMATS, "formats")))
    try:
        _check_target(folder)
    except OSError as error:
        raise _cannot(folder, error) from None
    files = _files(model, formats) | dict(more or {})
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise _cannot(folder, error) from None
    try:
        _write(files, temporary)
        _swap(temporary, folder)
    except OSError as error:
        raise _cannot(folder, error) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def design_text(design: Design) -> str:
    """Text of a design file that gives a design again."""
    heading = (
        "# Written by Draft. 'draft build SPEC --design design.yaml' gives this model again.\n"
    )
    data = plain(design_file(design))
    body = yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
    return heading + body


def plain(value: Any) -> Any:
    """Numbers and containers as JSON and YAML know them."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return value


def _check_target(folder: Path) -> None:
    """Refuse to replace anything but a model that Draft wrote."""
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise DraftError(
            Problem(f"'{folder}' exists and is not a folder", None, "choose another --out")
        )
    if folder.is_dir() and any(folder.iterdir()):
        found = (path.relative_to(folder).as_posix() for path in folder.rglob("*"))
        others = sorted(name for name in found if name not in KNOWN)
        if others or not (folder / "report.json").is_file():
            held = ", ".join(others[:4]) or "no report.json"
            raise DraftError(
                Problem(
                    f"'{folder}' holds something else than a model of Draft ({held}); it is kept",
                    None,
                    "choose another --out, or empty the folder",
                )
            )


def _files(model: Model, formats: Sequence[str]) -> dict[str, str | bytes]:
    """Contents by path in the folder."""
    record = report(model.design) | {
        "versions": {"draft": version("draft"), "mujoco": mujoco.__version__}
    }
    files: dict[str, str | bytes] = {}
    if "mjcf" in formats:
        model.scene()
        files |= {"robot.xml": model.xml, "scene.xml": model.scene_xml}
    if "urdf" in formats:
        from draft.model import urdf

        sidecar = json.dumps(plain(urdf.actuators(model.design)), indent=2) + "\n"
        files |= {
            "robot.urdf": urdf.robot_urdf(model),
            urdf.TRUNK: urdf.trunk_stl(model.design.trunk.loft),
            "actuators.json": sidecar,
        }
    if "glb" in formats:
        from draft.model.glb import robot_glb

        files["robot.glb"] = robot_glb(model)
    return files | {
        "design.yaml": design_text(model.design),
        "report.json": json.dumps(plain(record), indent=2) + "\n",
    }


def _write(files: Mapping[str, str | bytes], folder: Path) -> None:
    os.chmod(folder, 0o755)
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        with path.open("wb") as file:
            file.write(content.encode() if isinstance(content, str) else content)
            file.flush()
            os.fsync(file.fileno())


def _swap(temporary: Path, folder: Path) -> None:
    """Put the new folder where the old one is; the old one ends up at the temporary path."""
    if not folder.exists():
        os.rename(temporary, folder)
        return
    if _exchange(temporary, folder):
        return
    old = temporary.with_name(f"{temporary.name}-old")
    os.rename(folder, old)
    try:
        os.rename(temporary, folder)
    except BaseException:
        os.rename(old, folder)
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


def _cannot(folder: Path, error: OSError) -> DraftError:
    return DraftError(
        Problem(f"cannot write '{folder}': {error.strerror}", None, "choose another --out")
    )
