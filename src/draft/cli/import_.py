"""`draft import`: turn the description of a real robot into a spec."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.options import JsonOutput, KneeDrive, Population, Speeds, Strict, Torques
from draft.imports.importer import Imported, import_robot
from draft.imports.options import Options
from draft.imports.stated import parse


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
    json: JsonOutput = False,
) -> int:
    """Turn a robot's URDF or MJCF into a spec of three files."""
    options = Options(
        torque=parse(torque, "--torque", "N m"),
        speed=parse(speed, "--speed", "rad/s"),
        strict=strict,
        knee_drive=knee_drive,
    )
    found = import_robot(file, out, population=population, options=options)
    if json:
        record = {
            "folder": str(found.folder),
            "population": found.spec.population,
            "population_reason": found.limbs.reason,
            "joints": found.joints,
            "ignored": found.ignored,
            "notes": [str(note) for note in found.notes],
        }
        print(json_.dumps(record, indent=1))
    else:
        _print(found)
    return 0


def _print(found: Imported) -> None:
    for note in found.notes:
        print(f"warning: {note}")
    if found.ignored:
        print("omitted: " + ", ".join(f"{n} {what}" for what, n in found.ignored.items()))
    print(f"population: {found.spec.population}: {found.limbs.reason}")
    kinds = len(found.spec.actuators)
    print(
        f"made {found.folder}: a {found.spec.population} with {len(found.joints)} joints and "
        f"{kinds} actuator class{'es' * (kinds > 1)}; run 'draft show {found.folder}'"
    )
