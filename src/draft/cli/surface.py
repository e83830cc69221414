"""`draft surface`: what bodies over a plane of two numbers can do with a trained policy."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from draft.cli import explore_options as x
from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import DesignArgument, DesignName, Values, check_folder, parse_values
from draft.cli.settings_options import with_options
from draft.cli.spelling import spelt
from draft.errors import counted
from draft.learn.measuring.evaluation_options import (
    BodyRollOuts,
    SeeingPolicy,
    SurfaceSettings,
)

if TYPE_CHECKING:
    from draft.learn.measuring.surface import Surface


@with_options(SeeingPolicy)
@with_options(SurfaceSettings, without=("progress",))
def main(
    reference: DesignArgument,
    /,
    *,
    vary: x.Vary = (),
    chosen: SeeingPolicy,
    settings: SurfaceSettings,
    design: DesignName = None,
    values: Values = (),
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder of the page, the table and the figure.",
            help_behavior_hint="(default: out/ROBOT-surface)",
        ),
    ] = None,
) -> int:
    """Measure top speed, kick, cost of transport and limiting joint over a plane of two numbers."""
    check_folder(out)
    from draft.design.references import find_design
    from draft.learn.measuring import surface as surfaces
    from draft.learn.measuring.policies import source_for

    policy = None if chosen.policy is None else str(chosen.policy)
    robot = find_design(reference, design).resolve(parse_values(values))
    source = source_for(policy, robot)
    print(spelt(source.line), flush=True)
    with if_interrupted(NOTHING), x.bar("surface", at_once=True) as progress:
        asked = settings.model_copy(update={"progress": progress})
        found = surfaces.surface(robot, vary, source, **dict(asked))
    folder = Path(out or f"out/{found.robot.replace(':', '-')}-surface")
    robot_words = [reference, *(("--design", design) if design else ())]
    recorded = settings.model_dump(include={"points", *BodyRollOuts.model_fields})
    command = ["draft", "surface", *robot_words, "--vary", *vary]
    command += ["--set", *values] if values else []
    command += ["--policy", policy] if policy else []
    for name, value in recorded.items():
        if value != SurfaceSettings.model_fields[name].default:
            command += [f"--{name}", str(value).removesuffix(".0")]
    studio = ["draft", "studio", *robot_words, "--walk", *(["--policy", policy] if policy else [])]
    walks = not policy or Path(policy).suffix == ".onnx"  # The studio takes no runs.
    record: dict[str, object] = {
        "robot": found.robot,
        "set": list(values),
        "policy": source.name,
        "vary": list(vary),
        **recorded,
    }
    shown = shlex.join([*studio, "--set", *values]) if walks else ""
    surfaces.save(found, folder, record, shlex.join(command), shown)
    _print(found, folder)
    return 0


def _print(found: Surface, folder: Path) -> None:
    import numpy as np

    from draft.metrics.capabilities import MEASURED

    measured = np.array([not text for text in found.refusal])
    print(
        f"{counted(len(measured), 'design')}: {measured.sum()} measured, "
        f"{(~measured).sum()} refused or unable to walk, "
        f"{(measured & ~found.learned.inside).sum()} outside the policy's region of validity"
    )
    columns = found.columns()
    for name, one in MEASURED.items():
        values = getattr(found.learned, name)
        if np.isfinite(values).any():
            less = one.better == "less"
            best = int(np.nanargmin(values) if less else np.nanargmax(values))
            at = ", ".join(f"{axis} {columns[axis][best]:.4g}" for axis in found.axes)
            unit = "" if one.unit == "1" else f" {one.unit}"
            print(f"{'least' if less else 'largest'} {one.label} {values[best]:.2f}{unit} at {at}")
    print(f"written to {folder}: surface.html, surface.csv, surface.png, surface.pdf")
