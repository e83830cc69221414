"""References to designs: a robot, one of its designs, a design file, or a built model."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from draft.design.design import Design
from draft.errors import DraftError, SpecError, suggest
from draft.spec import Spec
from draft.spec.load import FOLDERS, load, shipped
from draft.values import Value, scalar

_SAME = 1e-6
_DESIGN_FILES = (".yaml", ".yml")


@dataclass(frozen=True)
class DesignChoice:
    """A robot and one of its designs, not resolved yet.

    Attributes:
        spec: the robot.
        design: name of a design, a design file, or None for the values in parameters.yaml.
    """

    spec: Spec
    design: str | Path | None = None

    def resolve(self, values: Mapping[str, Value | str | None] | None = None) -> Design:
        """Return the design, with values that override its own; errors as `Spec.resolve`."""
        return self.spec.resolve(self.design, values)


def open_designs(references: Sequence[Design | Spec | str | Path]) -> list[Design]:
    """Return the design of each reference; see `open_design`."""
    return [open_design(reference) for reference in references]


def open_design(reference: Design | Spec | str | Path) -> Design:
    """Return the design of a reference.

    Args:
        reference: as `find_design` takes it; a Spec stands for its default design, and a Design
            for itself.

    Raises:
        DraftError: the reference names no design.
    """
    if isinstance(reference, Design):
        return reference
    return find_design(reference).resolve()


def find_design(reference: Spec | str | Path, design: str | None = None) -> DesignChoice:
    """Find the robot and the design that a reference names.

    Args:
        reference: SPEC, SPEC:DESIGN, SPEC:FILE.yaml, the name of a shipped robot's design alone,
            or the folder of a model that Draft wrote; SPEC is a shipped robot's name or a robot's
            folder. A Spec stands for its default design.
        design: name of a design or a design file, if the reference names only a robot.

    Raises:
        DraftError: the reference names nothing, or `design` is given in addition to its own design.
    """
    choice = DesignChoice(reference) if isinstance(reference, Spec) else _find(str(reference))
    if design is None:
        return choice
    if choice.design is not None:
        cause = f"'{reference}' names a design already, and `design` names '{design}'"
        raise DraftError(cause, "omit `design`, or name the robot alone")
    return replace(choice, design=_named(design))


def shipped_designs() -> dict[str, tuple[str, ...]]:
    """Return the names of the designs of each shipped robot, without reading them."""
    return {
        robot: tuple(sorted(path.stem for path in (folder / "designs").glob("*.yaml")))
        for robot, folder in sorted(FOLDERS.items())
    }


def _named(design: str) -> str | Path:
    """Return the name of a design, or the path of a design file."""
    return Path(design) if design.endswith(_DESIGN_FILES) else design


def _find(reference: str) -> DesignChoice:
    if not reference.strip():
        remedy = f"{_available('')}; '.' is the current folder"
        raise DraftError("no robot is named", remedy)
    if _is_model(reference):
        return _saved(Path(reference))
    if reference in shipped() or _is_robot(reference):
        return DesignChoice(load(reference))
    owners = [robot for robot, designs in shipped_designs().items() if reference in designs]
    if len(owners) == 1:
        return DesignChoice(load(owners[0]), reference)
    if os.path.isdir(reference):
        return DesignChoice(load(reference))  # It reports what is missing.
    robot, colon, design = reference.rpartition(":")
    if colon and not design:
        cause = f"'{reference}' names no design"
        raise DraftError(cause, f"add one, or name the robot alone: {robot}")
    if colon:
        choice = _find(robot)
        if choice.design is not None:
            cause = f"'{robot}' in '{reference}' is a design, not a robot"
            raise DraftError(cause, f"name its robot: {choice.spec.name}:{design}")
        return replace(choice, design=_named(design))
    if os.path.isfile(reference):
        folder = os.path.dirname(reference) or "."
        local = f"name its folder: {folder}" if _is_robot(folder) else ""
        remedy = local or f"name its robot: SPEC:{reference}"
        raise DraftError(f"'{reference}' is a file, not a robot", remedy)
    raise DraftError(f"'{reference}' names no robot or design", _available(reference))


def _available(reference: str) -> str:
    """Return the shipped robots and designs and the robots of this folder, in words."""
    designs = shipped_designs()
    local = {path.parent.name for path in Path().glob("*/parameters.yaml")}
    known = {*designs, *(name for names in designs.values() for name in names), *local}
    return f"{suggest(reference, known)}; or a robot's or a model's folder"


# os.path answers where pathlib raises: a name too long, a folder not to be entered.
def _is_robot(folder: str) -> bool:
    return os.path.isfile(os.path.join(folder, "parameters.yaml"))


def _is_model(folder: str) -> bool:
    files = ("design.yaml", "report.json")
    return all(os.path.isfile(os.path.join(folder, file)) for file in files)


def _saved(folder: Path) -> DesignChoice:
    """Return the design of a model's folder, if its robot still gives the same mass."""
    path = folder / "design.yaml"
    remedy = f"name its robot: SPEC:{path}"
    try:
        record = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        name, mass = str(record["name"]), float(record["mass_kg"])
    except (OSError, ValueError, KeyError, TypeError):
        cause = f"'{folder / 'report.json'}' cannot be read"
        raise DraftError(cause, remedy) from None
    try:
        choice = DesignChoice(load(name), path)
    except SpecError:
        cause = f"'{folder}' is of a robot '{name}', which is neither shipped nor a folder here"
        raise DraftError(cause, remedy) from None
    now = scalar(choice.resolve().mass)
    if abs(now - mass) > _SAME * mass:
        cause = f"'{folder}' was written of {mass:.4g} kg, and '{name}' now gives {now:.4g} kg"
        raise DraftError(cause, f"build it again, or {remedy}")
    return choice
