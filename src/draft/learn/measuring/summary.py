"""Request and summary of an evaluation: what summary.json and the results of a study hold."""

from __future__ import annotations

import json
from typing import Any, Literal, Self

from pydantic import AliasChoices, BaseModel, ConfigDict, Field, ValidationError, model_validator

from draft.laws.residuals import ErrorSource
from draft.learn.measuring.evaluation_options import Extras, Protocol
from draft.learn.measuring.scalars import Curve
from draft.learn.measuring.utilisation import Limiting

FORMAT = 2
Arm = Literal["nominal", "perturbed"]
ARMS: tuple[Arm, ...] = ("nominal", "perturbed")
PROTOCOLS: tuple[Protocol, ...] = ("walking", "published")
Number = float | None  # None where roll-outs cannot give one.


class Request(Extras):
    """Everything that determines a result.

    The attributes of `Extras` are two of them.

    Attributes:
        iteration: iterations of the checkpoint.
        checkpoint: hash of its file.
        robots: hash of the designs.
        arm: robots as they were trained, or with inertia errors.
        errors: source of the inertia errors of the perturbed arm, see
            `draft.learn.bodies.inertia.extents`; None in the nominal arm.
        protocol: "walking" or "published".
        replicas: roll-outs of each level, divided among the designs.
        seconds: duration of a roll-out [s].
        settle: time at its start that is not measured [s].
        evaluation_seed: seed of everything random.
        levels: levels by skill test.
    """

    iteration: int
    checkpoint: str
    robots: str
    arm: Arm
    errors: ErrorSource | None
    protocol: Protocol
    replicas: int
    seconds: float
    settle: float
    evaluation_seed: int
    levels: dict[str, list[float]]

    def extras(self) -> dict[str, Any]:
        """Those of the `Extras` that differ from their defaults."""
        return self.model_dump(include={*Extras.model_fields}, exclude_defaults=True)

    def as_dict(self) -> dict[str, Any]:
        """Return plain data, without extras that are not asked for."""
        return self.model_dump(exclude={*Extras.model_fields}) | self.extras()


class _Record(BaseModel):
    """Part of a summary; unknown keys, and numbers that are not finite, are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Supply(_Record):
    """Battery and electronics of a design.

    Attributes:
        energy_wh: energy [Wh].
        band_of_energy_wh: ends of its 90 % band [Wh].
        origin: whether the design states it.
        electronics_w: power of computers, sensors and idle drives [W]; 0 where an older Draft left
            it out.
        electronics_origin: whether the design states it.
    """

    energy_wh: float
    band_of_energy_wh: tuple[float, float]
    origin: str
    electronics_w: float = 0.0
    electronics_origin: str = ""


class Measured(_Record):
    """Numbers, curves and scalars of one design, or of all designs of a family.

    Attributes:
        leg_length: thigh plus shank [m]; None for several designs, as the next three.
        mass: total mass [kg].
        top_speed_estimate: top speed that the motors allow, estimated before [m/s].
        supply: battery; None if an older Draft measured none.
        tests: curves by skill test.
        scalars: capabilities by name, see `draft.learn.measuring.scalars`.
        reasons: reason for each scalar that is None.
        utilisation: 95th percentiles by skill test, joint class and quantity, as shares of limits.
        utilisation_level: level at which they are taken, by test.
        limiting: joint class nearest its limit, by test; None if there is none.
    """

    leg_length: Number = None
    mass: Number = None
    top_speed_estimate: Number = None
    supply: Supply | None = None
    # An older Draft wrote them as `batteries`.
    tests: dict[str, Curve] = Field(
        default_factory=dict, validation_alias=AliasChoices("tests", "batteries")
    )
    scalars: dict[str, Number] = Field(default_factory=dict)
    reasons: dict[str, str] = Field(default_factory=dict)
    utilisation: dict[str, dict[str, dict[str, Number]]] = Field(default_factory=dict)
    utilisation_level: dict[str, float] = Field(default_factory=dict)
    limiting: dict[str, Limiting | None] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check_curves(self) -> Self:
        for test, curve in self.tests.items():
            for quantity, values in curve.items():
                if isinstance(values, list) and len(values) != len(curve["levels"]):
                    what = f"{quantity} of {test} does not have one value for each level"
                    raise ValueError(what)
        return self


class _Head(Extras):
    """What was measured, on what; in a file before the numbers."""

    format: Literal[2]
    design: str = ""
    members: tuple[str, ...] = ()
    stage: str = ""
    seed: int = 0
    iteration: int | None = None
    checkpoint: str = ""
    robots: str | None = None
    arm: Arm
    errors: ErrorSource | None = None
    protocol: Protocol
    replicas: int | None = None
    seconds: Number = None
    settle: Number = None
    evaluation_seed: int = 0
    asked: Request | None = None
    versions: dict[str, str] = Field(default_factory=dict)
    device: str | None = None
    engine: str | None = None
    took_s: Number = None


class Summary(Measured, _Head):
    """Summary of an evaluation.

    The attributes of a `Request` are repeated, but for the levels, which those of the curves are.

    Attributes:
        format: version of this record.
        design: name of the design; of several, that of the run.
        members: names of the designs.
        stage: stage of training.
        seed: seed of the training.
        asked: the request; None in the results of a study, which keep only what they print.
        versions: versions of the packages.
        device: device that it ran on.
        engine: physics engine.
        took_s: duration of the evaluation [s].
        flags: remarks on the numbers.
        by_member: numbers of each design of a family.
    """

    flags: tuple[str, ...] = ()
    by_member: dict[str, Measured] = Field(default_factory=dict)

    def text(self) -> str:
        """JSON of summary.json."""
        return json.dumps(self.record(), indent=1, allow_nan=False) + "\n"

    def record(self, without: frozenset[str] = frozenset()) -> dict[str, Any]:
        """Plain data, without keys that were never set.

        Args:
            without: names of attributes to omit.
        """
        return self.model_dump(mode="json", exclude=set(without), exclude_unset=True)


def parse(text: str) -> Summary:
    """Read the JSON of a summary.

    Raises:
        ValueError: the text is not the summary of an evaluation; the message says where.
    """
    try:
        return Summary.model_validate_json(text)
    except ValidationError as error:
        errors = error.errors(include_url=False)
        if errors[0]["loc"] == ("format",) or (errors[0]["type"], errors[0]["loc"]) == (
            "model_type",
            (),
        ):
            raise ValueError("it is not a summary of this version") from None
        raise ValueError(first_error(error)) from None


def first_error(error: ValidationError) -> str:
    """First error of a validation, with its place."""
    first = error.errors(include_url=False)[0]
    where = ".".join(map(str, first["loc"]))
    return f"{where}: {first['msg']}" if where else first["msg"]
