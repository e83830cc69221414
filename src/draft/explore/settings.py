"""Settings of screens, sweeps and searches, each declared once, for Python and the command line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, PlainValidator, SkipValidation

from draft.learn.measuring.evaluation_options import LearnedMetrics, SeeingPolicy
from draft.settings import Settings, Shown
from draft.variation.axes import Vary, ranges
from draft.variation.sampling import Sampler

Number = Annotated[float | str | None, SkipValidation]
Progress = Callable[[int, int], object]
_Names = BeforeValidator(lambda given: (given,) if isinstance(given, str) else given)
OptunaSampler = Literal["nsga2", "tpe"]
_COUNT = Field(ge=1, description="Number of designs to draw; a grid rounds it.")


class Varied(Settings):
    """Settings of all runs over many designs of a robot."""

    vary: Annotated[Vary, PlainValidator(ranges)]
    """Ranges by parameter or `actuators.CLASS.QUANTITY`, in the unit of that number: (low, high),
    (low, high, "log") for an even spread of the logarithm, or a list of values; or words of the
    command, such as ["thigh_length=0.2:0.4"]."""
    values: Annotated[Mapping[str, Number] | None, Shown(expects="values by name")] = None
    """Values that hold for all designs, by name; they override those of the robot."""
    seed: Annotated[
        int,
        Field(ge=0, lt=1 << 63),
        Shown("N", expects="a whole number from 0 to 2**63 - 1"),
    ] = 0
    """Seed of the sampler."""
    progress: Annotated[Progress | None, Field(exclude=True)] = None
    """Called with the designs done so far and in all."""

    def watch(self, total: int) -> Callable[[int], object]:
        """Return the function that reports the designs done of `total`."""
        progress = self.progress
        return lambda done: progress(done, total) if progress else None


class Sampled(Varied):
    """Settings of runs that draw designs by a sampler and keep some of them."""

    n: Annotated[int, _COUNT, Shown("N|1e6")]
    sampler: Sampler = "sobol"
    """Method by which designs are drawn."""
    where: Annotated[str | None, Shown("CONDITION", "all")] = None
    """Condition on the rows to keep, such as "accepted and leg.mass < 1"."""
    metrics: Annotated[Sequence[str] | None, _Names, Shown("NAME ...", "all that apply")] = None
    """Metrics to compute, one column each."""
    workers: Annotated[int, Field(ge=1, le=1024), Shown("N")] = 1
    """Number of processes."""


class ScreenSettings(Sampled):
    """Settings of a screen."""

    out: Annotated[str | Path, Shown("FILE")]
    """Parquet file of the rows."""
    n: Annotated[int, _COUNT, Shown("N|1e6")] = 100_000


class SweepSettings(LearnedMetrics, Sampled):
    """Settings of a sweep."""

    out: Annotated[str | Path, Shown("DIR")]
    """Folder of the Parquet parts."""
    n: Annotated[int, _COUNT, Shown("N|1e6")] = 1000
    engine: Literal["local", "ray"] = "local"
    """Processes of this machine, or a Ray cluster."""
    address: Annotated[str | None, Shown("HOST:PORT", "this machine's")] = None
    """Address of the Ray cluster."""


class SearchSettings(LearnedMetrics, Varied):
    """Settings of a search."""

    out: Annotated[str | Path, Shown("DIR")]
    """Folder of the study and the front: `front.csv`, `front.json` and `designs`."""
    minimise: Annotated[Sequence[str], _Names, Shown("METRIC ...", "none; one goal is needed")] = ()
    """Metrics or expressions to minimise."""
    maximise: Annotated[Sequence[str], _Names, Shown("METRIC ...", "none; one goal is needed")] = ()
    """Metrics or expressions to maximise."""
    subject_to: Annotated[Sequence[str], _Names, Shown("CONDITION ...", "none")] = ()
    """Conditions that designs must meet, such as accepted "leg.mass < 1"."""
    trials: Annotated[int, Field(ge=1, le=10**6), Shown("N")] = 2000
    """Designs to try, including those of earlier calls."""
    sampler: OptunaSampler = "nsga2"
    """Sampler of Optuna."""
    storage: Annotated[str | None, Shown("URL", "DIR/study.db")] = None
    """Database, which several processes may share."""
    figure: bool = False
    """Draw the front over all trials: front.png and front.pdf."""


class EffectSettings(SeeingPolicy):
    """Settings of learned metrics of bodies that are compared with each other."""

    replicas: Annotated[int, Field(ge=4, le=1000), Shown("N")] = 12
    """Roll-outs of each body at each speed and kick, for learned metrics."""
    progress: Annotated[Progress | None, Field(exclude=True)] = None
    """Called with the bodies rolled out and their number."""


class TargetSettings(EffectSettings):
    """Settings of learned metrics in a search for the nearest design."""

    replicas: Annotated[int, Field(ge=4, le=1000), Shown("N")] = 6
    """Roll-outs of each body at each speed and kick, for learned metrics; a search has about 120
    bodies."""
