"""`draft export`: write a robot for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.build import default_folder
from draft.cli.display.record import record
from draft.cli.display.verdict import print_verdict
from draft.cli.options import (
    DesignArgument,
    DesignName,
    JsonOutput,
    Values,
    check_folder,
    open_design,
)
from draft.errors import DraftError
from draft.model.exporters import EXPORTERS, FORMATS

# Those of extensions too: this module is imported for its command alone.
if TYPE_CHECKING:
    Format = str
else:
    Format = Literal[*EXPORTERS]


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder of the files; replaces what Draft wrote there before.",
            help_behavior_hint="(default: out/ROBOT or out/ROBOT-DESIGN)",
        ),
    ] = None,
    formats: Annotated[
        tuple[Format, ...],
        tyro.conf.arg(
            name="format",
            metavar=f"{{{','.join(EXPORTERS)}}} ...",
            help="urdf with its mesh and actuators.json, glb, mjcf, sdf with its mesh, step with "
            "bom.csv, usd; mjlab and isaaclab with a Python file that configures the robot there.",
            help_behavior_hint=f"(default: {' '.join(FORMATS)})",
        ),
    ] = FORMATS,
    ros2: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Write a ROS 2 package into this folder, and nothing else.",
            help_behavior_hint="(default: none)",
        ),
    ] = None,
    json: JsonOutput = False,
) -> int:
    """Write a robot as URDF with an actuator table, as glTF for viewers, as MJCF, and for CAD."""
    check_folder(out)
    check_folder(ros2, "ros2")
    if ros2 is not None and (out is not None or formats != FORMATS):
        cause = "--ros2 writes a package alone, with its own files"
        raise DraftError(cause, "omit --out and --format, or run 'draft export' a second time")
    resolved, clock = open_design(reference, design, values)
    folder = None
    if resolved.accepted:
        from draft.model.export import export, export_ros2

        model = resolved.build()
        clock.lap("build")
        if ros2 is not None:
            folder = export_ros2(model, ros2)
        else:
            folder = export(model, out if out is not None else default_folder(resolved), formats)
        clock.lap("save")
    if json:
        print(record(resolved, clock, folder))
        return 0 if resolved.accepted else 1
    print_verdict(resolved)
    if folder is not None:
        written = (path for path in sorted(Path(folder).rglob("*")) if path.is_file())
        print("\n".join(map(str, written)))
    return 0 if resolved.accepted else 1
