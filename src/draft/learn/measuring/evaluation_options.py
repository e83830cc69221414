"""Options of an evaluation: what Python, the command, the jobs of a study and workers state.

Their types, ranges, defaults and descriptions are here only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from draft.laws.residuals import ErrorSource
from draft.learn.engine.machine import EngineName
from draft.settings import Settings, Shown
from draft.spec.payload import HEAVIEST

Protocol = Literal["walking", "published"]
Word = Literal["walk", "speed", "stairs", "push"]
Report = Callable[[str, int, int], None]


class Extras(BaseModel):
    """Options that few evaluations have; by default the result is that of a study.

    Keys of a study's jobs, names of folders and summaries hold those that differ from the default,
    so that an option that is added here leaves older results valid.
    """

    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    payload: Annotated[float, Field(ge=0, le=HEAVIEST), Shown("KG", "none", unit="kg")] = 0.0
    """Mass of a block on the trunk, 500 kg/m3; the policy was trained without it [kg]."""
    regeneration: Annotated[float, Field(ge=0, le=1), Shown("SHARE", "none")] = 0.0
    """Share of the power of braking joints that returns to the battery, 0 to 1."""
    timestep: Annotated[
        float | None, Field(gt=0, le=0.02), Shown("S", "that of the training", unit="s")
    ] = None
    """Physics step [s], a part of the control period."""
    friction: Annotated[
        float | None, Field(gt=0, le=10), Shown("N", "drawn as in the training")
    ] = None
    """Friction of the feet."""
    contact_time: Annotated[
        float | None, Field(gt=0, le=0.2), Shown("S", "that of the training", unit="s")
    ] = None
    """Time constant of the contacts of the feet [s]; at least two physics steps act."""
    delay: Annotated[
        float | None, Field(ge=0, le=0.1), Shown("S", "that of the training", unit="s")
    ] = None
    """Delay of the joint targets [s], at most a control period."""
    noise: Annotated[float, Field(ge=0, le=10), Shown("N", "1")] = 1.0
    """Noise of the observations, per that of the training; 0 for none."""
    all_collide: bool = False
    """Let every part of the robot collide with the ground, not only feet and thighs."""


class OnDevice(Settings):
    """Where roll-outs run."""

    device: Annotated[str, Shown("DEVICE")] = "auto"
    """Device: auto, cpu, cuda or cuda:1."""
    engine: EngineName = "auto"


class RollOuts(Settings):
    """Numbers of roll-outs, also in a study's file."""

    replicas: Annotated[int, Field(ge=1, le=10**6), Shown("N")] = 256
    """Roll-outs of each level, shared among a family."""
    seconds: Annotated[float, Field(ge=0.5, le=3600), Shown("S", unit="s")] = 12.0
    """Length of a roll-out [s]; its first sixth is not counted, of speeds the first third, and
    kicks come every quarter."""
    seed: Annotated[int, Field(ge=0, le=2**31 - 1), Shown("N")] = 0
    """Seed of everything random."""


class BodyRollOuts(RollOuts):
    """Numbers of roll-outs that measure each of many bodies."""

    replicas: Annotated[int, Field(ge=1, le=1000), Shown("N")] = 3
    """Roll-outs of each design at each speed and kick."""
    seconds: Annotated[float, Field(ge=1, le=1000), Shown("S", unit="s")] = 6.0
    """Length of a roll-out, whose last third is measured [s]."""


class SeeingPolicy(Settings):
    """Policy that measures many bodies."""

    policy: Annotated[
        str | Path | None, Shown("RUN|FILE.onnx", "the policy that ships for its legs")
    ] = None
    """Policy of learned metrics, which observes its design: a run, or an exported one."""


class LearnedMetrics(SeeingPolicy):
    """Settings of metrics that are measured with a policy, such as `learned.top_speed`."""

    outside: bool = False
    """Measure learned metrics outside the policy's region of validity too, as of imports; it may
    fail there, and `learned.inside` tells them apart."""


class SurfaceSettings(OnDevice, BodyRollOuts):
    """Settings of a surface."""

    points: Annotated[int, Field(ge=2, le=100), Shown("N")] = 20
    """Points along each range; 20 x 20 designs take about 5 min on two idle cores."""
    progress: Annotated[Callable[[int, int], object] | None, Field(exclude=True)] = None
    """Called with the designs done and their number."""


class Target(Settings):
    """What is measured."""

    test: Annotated[
        Sequence[Word] | None,
        Field(min_length=1),
        Shown(
            "NAMES",
            "all of the run's stage; of a design: walk, speed, push",
            expects="names among walk, speed, stairs and push",
        ),
    ] = None
    """Skill tests of walk, speed, stairs and push, such as speed,stairs; each run takes those of
    its stage."""
    levels: Annotated[
        int | Sequence[float] | None,
        Shown("N|VALUES", "all", expects="a number of levels, or levels above 0"),
    ] = None
    """Number of levels, spread over each grid, or a list of the levels of one test:
    0.4,1.0,2.0."""
    policy: Annotated[
        str | Path | None, Shown("RUN|FILE.onnx", "the policy that ships for its legs")
    ] = None
    """Policy of the designs: that of a run, or an exported one."""
    checkpoint: Annotated[int | None, Shown("N", "last")] = None
    """Iterations of the checkpoint."""


class Options(OnDevice, Extras, RollOuts, Target):
    """Options of an evaluation."""

    errors: Annotated[ErrorSource | None, Shown("{twins,survey,paper}", "none")] = None
    """Source of the inertia errors: twins of Go2 and B2, all surveyed quadrupeds held out of the
    trends, or the published ranges."""
    protocol: Protocol = "walking"
    """Protocol: "walking", or "published", in which one robot in ten stands."""
    out: Annotated[
        str | Path | None, Shown("DIR", "RUN/evaluation, or out/DESIGN-POLICY/evaluation")
    ] = None
    """Write to DIR/RUN, or DIR/DESIGN-POLICY."""
    again: bool = False
    """Repeat evaluations that exist."""
    progress: Annotated[Report | None, Field(exclude=True)] = None
    """Called after every step with the tests' names, steps done and total steps."""
