"""What a process is asked to do for a study, as plain data that travels as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

from draft.errors import DraftError, Problem


@dataclass(frozen=True)
class TrainRequest:
    """Train a run that is there; see `draft.learn.train`.

    Attributes:
        run: its folder.
        iterations: in all slices.
        device: such as "cpu" or "cuda".
        engine: "auto", "native" or "warp".
        replicas: processes on a CPU; None for those that the run's state is of, or to choose.
        minutes: for how long; None for no limit.
    """

    kind: ClassVar = "train"
    run: str
    iterations: int
    device: str
    engine: str = "auto"
    replicas: int | None = None
    minutes: float | None = None


@dataclass(frozen=True)
class EvaluateRequest:
    """Evaluate a run; see `draft.learn.evaluate`.

    Attributes:
        run: its folder.
        checkpoint: its iterations.
        battery: "walk", "speed", "stairs" or "push".
        levels: how many; None for all.
        replicas: roll-outs of each level.
        seconds: of a roll-out.
        seed: of everything random.
        errors: whose inertia errors the robots get; None for none.
        protocol: "walking" or "published".
        device: such as "cpu" or "cuda".
        engine: "auto", "native" or "warp".
    """

    kind: ClassVar = "evaluate"
    run: str
    checkpoint: int
    battery: str
    levels: int | None
    replicas: int
    seconds: float
    seed: int
    errors: str | None
    protocol: str
    device: str
    engine: str = "auto"


@dataclass(frozen=True)
class ReportRequest:
    """Write the report on a study; see `draft.study.write_report`.

    Attributes:
        study: its folder.
    """

    kind: ClassVar = "report"
    study: str


Request = TrainRequest | EvaluateRequest | ReportRequest
_KINDS: dict[str, type[Request]] = {
    of.kind: of for of in (TrainRequest, EvaluateRequest, ReportRequest)
}


def to_dict(request: Request) -> dict[str, Any]:
    """A request as plain data."""
    return {"kind": request.kind, **asdict(request)}


def from_dict(data: Mapping[str, Any]) -> Request:
    """The request that plain data is of.

    Raises:
        DraftError: it is none.
    """
    given = dict(data)
    kind = _KINDS.get(given.pop("kind", None))
    if kind is None or given.keys() != {field.name for field in fields(kind)}:
        cause = f"this is no request of a study: {str(dict(data))[:200]}"
        raise DraftError(Problem(cause, None, f"requests: {', '.join(_KINDS)}"))
    return kind(**given)


def title(request: Request) -> str:
    """A request in a line, for a log."""
    told = (f"{name} {value}" for name, value in asdict(request).items() if value is not None)
    return f"{request.kind}: {', '.join(told)}"
