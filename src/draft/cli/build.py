"""`draft build`: compile a robot and write its folder."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import tyro

from draft.cli.options import DesignName, Robot, Values, resolve
from draft.cli.verdict import print_findings, verdict
from draft.design import Design
from draft.model.folder import plain
from draft.spec import load


def main(
    spec: Robot,
    /,
    design: DesignName = None,
    values: Values = (),
    out: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="DIR",
            help="The model's folder.",
            help_behavior_hint="(default: out/ROBOT or out/ROBOT-DESIGN)",
        ),
    ] = None,
    json: Annotated[bool, tyro.conf.arg(help="Print one JSON object and nothing else.")] = False,
) -> int:
    """Compile a robot to a checked MuJoCo model and write its folder."""
    clock = Clock()
    robot = load(spec)
    clock.lap("load")
    resolved = resolve(robot, design, values)
    clock.lap("resolve")
    if not resolved.accepted:
        if json:
            print(record(resolved, clock.laps, None))
        else:
            print_findings(resolved)
            print(verdict(resolved))
        return 1
    model = resolved.build()
    clock.lap("build")
    folder = model.save(out if out is not None else default_folder(resolved))
    clock.lap("save")
    if json:
        print(record(resolved, clock.laps, folder))
        return 0
    print_findings(resolved)
    print(verdict(resolved))
    total = sum(clock.laps.values())
    parts = ", ".join(f"{name} {ms:.1f}" for name, ms in clock.laps.items())
    print(f"written to {folder} in {total:.0f} ms ({parts})")
    return 0


class Clock:
    """Milliseconds of each step."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """Note the time since the last lap."""
        now = time.perf_counter()
        self.laps[name] = (now - self._last) * 1e3
        self._last = now


def default_folder(design: Design) -> Path:
    """Folder of a model where none is asked for."""
    suffix = "" if design.label == "default" else f"-{design.label}"
    return Path("out") / f"{design.name}{suffix}"


def record(design: Design, timings: dict[str, float], out: Path | None) -> str:
    """One JSON object about a build; scripts rely on its keys."""
    actuators: dict[str, Any] = {
        name: {
            key: getattr(actuator, key)
            for key in (
                "like",
                "peak_torque",
                "no_load_speed",
                "gear_ratio",
                "peak_power",
                "aspect_ratio",
                "mass",
                "volume",
                "radius",
                "length",
                "rotor_inertia",
                "armature",
            )
        }
        for name, actuator in design.actuators.items()
    }
    return json.dumps(
        plain(
            {
                "name": design.name,
                "design": design.label,
                "mass_kg": design.mass,
                "n_joints": len(design.joints),
                "accepted": design.accepted,
                "findings": [finding.record() for finding in design.findings],
                "actuators": actuators,
                "bodies": design.body_masses(),
                "timings_ms": {name: round(ms, 3) for name, ms in timings.items()},
                "out": str(out) if out is not None else None,
            }
        ),
        indent=2,
    )
