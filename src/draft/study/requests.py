"""Requests to the processes that run a study's jobs, as plain data that travels as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from draft.errors import DraftError
from draft.learn.measuring.evaluation_options import Options
from draft.learn.training.options import SliceOptions
from draft.settings import Settings


class _OfRun(Settings):
    """Request about a run."""

    run: str
    """Folder of the run."""


class TrainRequest(SliceOptions, _OfRun):
    """Train an existing run; see `draft.learn.train`."""

    kind: ClassVar = "train"


class EvaluateRequest(Options, _OfRun):
    """Evaluate a run; see `draft.evaluate`."""

    kind: ClassVar = "evaluate"


class ReportRequest(Settings):
    """Write the report of a study; see `draft.study.write_report`."""

    kind: ClassVar = "report"
    study: str
    """Folder of the study."""


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
    if kind is None:
        cause = f"not a request of a study: {str(dict(data))[:200]}"
        raise DraftError(cause, f"requests: {', '.join(_KINDS)}")
    return kind.of(given)


def title(request: Request) -> str:
    """Return a request in one line, for a log."""
    values = (f"{name} {value}" for name, value in _values(request).items())
    return f"{request.kind}: {', '.join(values)}"


def _values(request: Request) -> dict[str, Any]:
    return request.model_dump(mode="json", exclude_defaults=True)
