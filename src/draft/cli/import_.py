"""`draft import`: turn the description of a real robot into a spec."""

from __future__ import annotations

import json as json_
import sys
import textwrap
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import JsonOutput, KneeDrive, Population, Root, Speeds, Strict, Torques
from draft.cli.spelling import spelt
from draft.design.machine import machine
from draft.errors import DraftError, counted
from draft.files import write
from draft.imports import summary
from draft.imports.expected import expected_mass
from draft.imports.importer import Imported, import_robot
from draft.imports.options import Options
from draft.imports.stated import parse
from draft.offscreen import can_draw

WIDTH = 98
PREVIEW = (900, 515)


def main(
    file: Annotated[
        tyro.conf.Positional[Path],
        tyro.conf.arg(
            metavar="FILE",
            help="A robot's URDF, MJCF or xacro file, or its name, such as menagerie:unitree_go2.",
        ),
    ],
    /,
    out: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="DIR",
            help="New folder for the spec.",
            help_behavior_hint="(default: ./NAME-OF-FILE)",
        ),
    ] = None,
    population: Population = None,
    torque: Torques = (),
    speed: Speeds = (),
    strict: Strict = False,
    knee_drive: KneeDrive = None,
    root: Root = "",
    no_preview: Annotated[
        bool,
        tyro.conf.arg(help="Do not draw preview.png, the maker's robot beside the spec."),
    ] = False,
    json: JsonOutput = False,
) -> int:
    """Turn a robot's URDF or MJCF into a spec of three files."""
    options = Options(
        torque=parse(torque, "--torque", "N m"),
        speed=parse(speed, "--speed", "rad/s"),
        strict=strict,
        knee_drive=knee_drive,
        root=root,
    )
    with if_interrupted(NOTHING):
        found = import_robot(file, out, population=population, options=options)
    mass = expected_mass(found.spec.resolve(), found.files)
    picture = _preview(file, found, options) if not no_preview else None
    if json:
        record = {
            "folder": str(found.folder),
            "population": found.spec.population,
            "population_reason": found.limbs.reason,
            "joints": found.joints,
            "ignored": found.ignored,
            "notes": [str(note) for note in found.notes],
            "summary": summary.record(found.files, mass),
            "preview": None if picture is None else str(picture),
        }
        print(spelt(json_.dumps(record, indent=1)))
    else:
        _print(found)
        for heading, text in summary.summary(found.files, mass):
            print(textwrap.fill(spelt(f"{heading}: {text}"), WIDTH, subsequent_indent="  "))
        if picture is not None:
            print(f"picture: {picture}, the maker's robot on the left")
    return 0


def _preview(file: Path, found: Imported, options: Options) -> Path | None:
    """Draw the maker's robot beside the spec where there are meshes; None where it cannot be."""
    if not found.files.shapes.meshes.count or not can_draw():
        return None
    from draft.model.picture import png
    from draft.twins.compare import compare_twin
    from draft.twins.look import side_by_side

    try:
        twin = compare_twin(file, found.spec, options=options, poses=2)
        pixels = side_by_side(twin, PREVIEW)
    except DraftError as error:
        print(f"no picture: {error.problems[0].cause}", file=sys.stderr)
        return None
    path = found.folder / "preview.png"
    write(path, png(pixels))
    return path


def _print(found: Imported) -> None:
    for note in found.notes:
        print(f"warning: {spelt(str(note))}")
    if found.ignored:
        print("omitted: " + ", ".join(f"{n} {what}" for what, n in found.ignored.items()))
    kinds = counted(len(found.spec.actuators), "actuator class")
    what = machine(found.spec.resolve()) if found.files.fixed else found.spec.population
    print(
        f"made {found.folder}: a {what} with "
        f"{counted(len(found.joints), 'joint')} and {kinds}; run 'draft show {found.folder}'"
    )
