"""`draft surface`: what bodies over a plane of two numbers can do with a trained policy."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from draft.cli import explore_options as x
from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import (
    DesignArgument,
    DesignName,
    DeviceOption,
    EngineOption,
    LearnedPolicy,
    Values,
    check_folder,
    parse_values,
)
from draft.cli.spelling import spelt
from draft.errors import counted
from draft.metrics.learned import REPLICAS, SECONDS

if TYPE_CHECKING:
    from draft.learn.measuring.surface import Surface

POINTS = 20
DEFAULTS = {"points": POINTS, "replicas": REPLICAS, "seconds": SECONDS, "seed": 0}


def main(
    reference: DesignArgument,
    /,
    vary: x.Vary = (),
    policy: LearnedPolicy = None,
    points: Annotated[
        int,
        tyro.conf.arg(
            metavar="N",
            help="Points along each range; 20 x 20 designs take about 5 min on two idle cores.",
        ),
    ] = POINTS,
    replicas: Annotated[
        int, tyro.conf.arg(metavar="N", help="Roll-outs of each design at each speed and kick.")
    ] = REPLICAS,
    seconds: Annotated[
        float,
        tyro.conf.arg(metavar="S", help="Length of a roll-out, whose last third is measured [s]."),
    ] = SECONDS,
    design: DesignName = None,
    values: Values = (),
    seed: x.Seed = 0,
    device: DeviceOption = "auto",
    engine: EngineOption = "auto",
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
    from draft.learn.measuring.policies import open_source

    source = open_source(policy)
    print(spelt(source.line), flush=True)
    robot = find_design(reference, design).resolve(parse_values(values))
    with if_interrupted(NOTHING), x.bar("surface", at_once=True) as progress:
        found = surfaces.surface(
            robot,
            vary,
            source,
            points=points,
            replicas=replicas,
            seconds=seconds,
            seed=seed,
            device=device,
            engine=engine,
            progress=progress,
        )
    folder = Path(out or f"out/{found.robot.replace(':', '-')}-surface")
    robot_words = [reference, *(("--design", design) if design else ())]
    settings = {"points": points, "replicas": replicas, "seconds": seconds, "seed": seed}
    command = ["draft", "surface", *robot_words, "--vary", *vary]
    command += ["--set", *values] if values else []
    command += ["--policy", policy] if policy else []
    for name, value in settings.items():
        if value != DEFAULTS[name]:
            command += [f"--{name}", str(value).removesuffix(".0")]
    studio = ["draft", "studio", *robot_words, "--walk", *(["--policy", policy] if policy else [])]
    walks = not policy or Path(policy).suffix == ".onnx"  # The studio takes no runs.
    record: dict[str, object] = {
        "robot": found.robot,
        "set": list(values),
        "policy": source.name,
        "vary": list(vary),
        **settings,
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
