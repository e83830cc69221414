"""`draft build`: compile a robot and write its folder."""

from __future__ import annotations

import json as json_
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.display.record import record
from draft.cli.display.verdict import print_verdict
from draft.cli.options import (
    DesignArgument,
    DesignName,
    JsonOutput,
    Payload,
    Values,
    check_folder,
    open_design,
)
from draft.design import Design
from draft.errors import DraftError


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder of the model.",
            help_behavior_hint="(default: out/ROBOT or out/ROBOT-DESIGN)",
        ),
    ] = None,
    report: Annotated[
        bool, tyro.conf.arg(help="Write report.html too; see 'draft report'.")
    ] = False,
    json: JsonOutput = False,
) -> int:
    """Compile a robot to a checked MuJoCo model and write its folder."""
    check_folder(out)
    resolved, clock = open_design(reference, design, values, payload)
    folder = None
    if resolved.accepted:
        model = resolved.build()
        clock.lap("build")
        target = Path(out) if out is not None else own_folder(resolved)
        folder = model.save(target, more={"report.html": _page(resolved)} if report else None)
        clock.lap("save")
    if json:
        print(record(resolved, clock, folder))
    else:
        print_verdict(resolved)
        if folder is not None:
            parts = ", ".join(f"{name} {ms:.1f}" for name, ms in clock.laps.items())
            print(f"written to {folder} in {sum(clock.laps.values()):.0f} ms ({parts})")
    return 0 if resolved.accepted else 1


def default_folder(design: Design) -> Path:
    """Return the default folder of a model."""
    suffix = "" if design.label == "default" else f"-{design.label}"
    return Path("out") / f"{design.name}{suffix}"


def own_folder(design: Design) -> Path:
    """Return the default folder of a model, unless it holds that of another robot of this name.

    Raises:
        DraftError: it does: a copied robot still has the name of the one it was copied from.
    """
    folder = default_folder(design)
    try:
        found = json_.loads((folder / "report.json").read_text(encoding="utf-8"))
        other = found.get("folder") if isinstance(found, dict) else None
    except (OSError, ValueError):
        return folder
    own = design.spec.origin
    if isinstance(other, str) and other != own:
        cause = f"{folder} holds the model of the robot in '{other}', which is also '{design.name}'"
        remedy = f"change 'name' in {own}/parameters.yaml, or give --out"
        raise DraftError(cause, remedy)
    return folder


def _page(design: Design) -> str:
    from draft.reporting.page import page
    from draft.reporting.subjects import subjects

    return page(subjects([design]))
