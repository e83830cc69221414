"""References to designs: shipped ones, designs in the folder of a robot, and built models."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from draft.design.design import Design
from draft.errors import DraftError, Problem, SpecError, suggest
from draft.spec import Spec
from draft.spec.load import load, shipped
from draft.values import scalar

_SAME = 1e-6


def open_designs(references: Sequence[Design | Spec | str | Path]) -> list[Design]:
    """Return the design of each reference; see `open_design`."""
    return [open_design(reference) for reference in references]


def open_design(reference: Design | Spec | str | Path) -> Design:
    """Return the design of a reference.

    Args:
        reference: SPEC, SPEC:DESIGN, SPEC:FILE.yaml, the folder of a model that Draft wrote, or
            the name of a shipped robot's design alone; a Spec stands for its default design, and
            a Design for itself.

    Raises:
        DraftError: the reference names no design.
    """
    if isinstance(reference, Design):
        return reference
    if isinstance(reference, Spec):
        return reference.resolve()
    return _open(str(reference))


def _open(word: str) -> Design:
    folder = Path(word)
    if (folder / "design.yaml").is_file() and (folder / "report.json").is_file():
        return _saved(folder)
    robot, colon, design = word.rpartition(":")
    if folder.is_dir() or word in shipped():
        return load(word).resolve()
    if not colon:
        return _design_alone(word)
    if not design:
        raise DraftError(Problem(f"'{word}' names no design", None, f"such as {robot}, alone"))
    chosen = Path(design) if design.endswith((".yaml", ".yml")) else design
    return load(robot).resolve(chosen)


def _design_alone(word: str) -> Design:
    """A shipped robot's design by its own name."""
    robots = {name: load(name) for name in shipped()}
    owners = [spec for spec in robots.values() if word in spec.designs]
    if len(owners) == 1:
        return owners[0].resolve(word)
    known = [*robots, *(design for spec in robots.values() for design in spec.designs)]
    cause = f"'{word}' is neither a shipped robot nor a folder, nor one shipped robot's design"
    raise DraftError(Problem(cause, None, suggest(word, known, "shipped robots and designs")))


def _saved(folder: Path) -> Design:
    """The design of a model's folder, by the robot that it names."""
    path = folder / "design.yaml"
    remedy = f"name its robot: SPEC:{path}"
    try:
        record = json.loads((folder / "report.json").read_text(encoding="utf-8"))
        name, mass = str(record["name"]), float(record["mass_kg"])
    except (OSError, ValueError, KeyError, TypeError):
        raise DraftError(
            Problem(f"'{folder}' has no report that can be read", None, remedy)
        ) from None
    try:
        spec = load(name)
    except SpecError:
        cause = f"'{folder}' is of a robot '{name}', which is neither shipped nor a folder here"
        raise DraftError(Problem(cause, None, remedy)) from None
    design = spec.resolve(path)
    now = scalar(design.mass)
    if abs(now - mass) > _SAME * mass:
        cause = f"'{folder}' was written of {mass:.4g} kg, and '{name}' now gives {now:.4g} kg"
        raise DraftError(Problem(cause, None, f"build it again, or {remedy}"))
    return design
