"""Requests to the processes that run a study's jobs, as plain data that travels as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

from draft.errors import DraftError
from draft.learn.measuring.evaluation_options import Options


@dataclass(frozen=True)
class TrainRequest:
    """Train an existing run; see `draft.learn.train`.

    Attributes:
        run: folder of the run.
        iterations: iterations in all slices.
        device: such as "cpu" or "cuda".
        engine: "auto", "native" or "warp".
        replicas: processes on a CPU; None for those of the run's state, or to choose.
        minutes: time limit [min]; None for no limit.
    """

    kind: ClassVar = "train"
    run: str
    iterations: int
    device: str
    engine: str = "auto"
    replicas: int | None = None
    minutes: float | None = None


class EvaluateRequest(Options):
    """Evaluate a run; see `draft.evaluate`."""

    kind: ClassVar = "evaluate"
    run: str
    """Folder of the run."""


@dataclass(frozen=True)
class ReportRequest:
    """Write the report of a study; see `draft.study.write_report`.

    Attributes:
        study: folder of the study.
    """

    kind: ClassVar = "report"
    study: str


Request = TrainRequest | EvaluateRequest | ReportRequest
_KINDS: dict[str, type[Request]] = {
    of.kind: of for of in (TrainRequest, EvaluateRequest, ReportRequest)
}


def to_dict(request: Request) -> dict[str, object]:
    """Return a request as plain data."""
    return {"kind": request.kind, **_values(request)}


def from_dict(data: Mapping[str, Any]) -> Request:
    """Return the request that plain data describes.

    Raises:
        DraftError: it describes none.
    """
    given = dict(data)
    kind = _KINDS.get(given.pop("kind", None))
    if kind is EvaluateRequest:
        return kind.of(given)
    if kind is None or given.keys() != {field.name for field in fields(kind)}:
        cause = f"not a request of a study: {str(dict(data))[:200]}"
        raise DraftError(cause, f"requests: {', '.join(_KINDS)}")
    return kind(**given)


def title(request: Request) -> str:
    """Return a request in one line, for a log."""
    values = (f"{name} {value}" for name, value in _values(request).items() if value is not None)
    return f"{request.kind}: {', '.join(values)}"


def _values(request: Request) -> dict[str, Any]:
    if isinstance(request, EvaluateRequest):
        return request.model_dump(mode="json", exclude_defaults=True)
    return asdict(request)
