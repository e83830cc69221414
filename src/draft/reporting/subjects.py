"""Designs of a report, with their models and metrics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from draft.browser.engine import MOST as MOST_LIVE
from draft.browser.engine import available
from draft.design import Design
from draft.design.report import report
from draft.errors import DraftError, ModelError
from draft.explore.comparison import DesignComparison, compare, titles
from draft.metrics import of_design, of_model
from draft.model import Model
from draft.model.model import preview
from draft.plotting import COLORS
from draft.values import plain, scalar

if TYPE_CHECKING:
    from draft.browser.robots import PageRobot
    from draft.learn.policy.gait import Gait
    from draft.learn.policy.reduced import AnyPolicy

MOST = 12


@dataclass(frozen=True, eq=False)
class Subject:
    """One design of a report.

    Attributes:
        design: the design.
        title: its title, unique in the report.
        color: its colour, as "#rrggbb".
        model: its model, unchecked if the filter refuses the design; None if MuJoCo rejects it.
        record: its report as plain data.
        metrics: metrics by name; those of a model only if the design is accepted.
        gait: its recorded gait, or why it has none; None where the report shows no gaits.
        live: what a page with live physics knows of it; None where the report has none.
    """

    design: Design
    title: str
    color: str
    model: Model | None
    record: dict[str, Any]
    metrics: dict[str, float]
    gait: Gait | None = None
    live: PageRobot | None = None


def subjects(
    designs: Sequence[Design], walk: bool = False, policies: Sequence[AnyPolicy] = ()
) -> list[Subject]:
    """Compile and measure designs for a report.

    Args:
        designs: 1 to 12 single designs.
        walk: whether to record a gait of each that has a model, and to take what live physics
            needs where the extra `page` is installed and they are few enough.
        policies: policies to walk with before those that ship.

    Raises:
        DraftError: there are none or too many, or one of them is N designs.
    """
    if not 1 <= len(designs) <= MOST:
        cause = f"a report is about 1 to {MOST} designs, not {len(designs)}"
        raise DraftError(cause, "use `draft.sweep` for many")
    if any(design.count is not None for design in designs):
        raise DraftError("a report is about single designs", "select one: design[0]")
    models = [one.build() if one.accepted else _preview(one) for one in designs]
    if policies:
        from draft.learn.policy.validity import check_used  # reports without gaits do not need it

        check_used([model for model in models if model is not None], policies)
    found: list[Subject] = []
    few = walk and len(designs) <= MOST_LIVE and available()
    for i, (model, title) in enumerate(zip(models, titles(designs), strict=True)):
        design = designs[i]
        values = of_model(model) if model is not None and design.accepted else of_design(design)
        metrics = {name: scalar(value) for name, value in values.items()}
        record = plain(report(design))
        gait = _gait(model, policies) if walk and model is not None else None
        color = COLORS[i % len(COLORS)]
        live = _live(model, title, color, policies) if few and model is not None else None
        found.append(Subject(design, title, color, model, record, metrics, gait, live))
    return found


def _gait(model: Model, policies: Sequence[AnyPolicy]) -> Gait:
    from draft.learn.policy.gait import record  # reports without gaits do not need it

    return record(model, policies=policies)


def _live(model: Model, title: str, color: str, policies: Sequence[AnyPolicy]) -> PageRobot:
    from draft.browser.robots import driven, robot

    return robot(model, title, color, driven([model], "walk", policies))


def _preview(design: Design) -> Model | None:
    try:
        return preview(design)
    except ModelError:
        return None


def comparison(found: Sequence[Subject]) -> DesignComparison | None:
    """Comparison of the designs with the first; None for a single one."""
    names = [one.title for one in found]
    return compare([one.design for one in found], names=names) if len(found) > 1 else None


def table(found: Sequence[Subject], compared: DesignComparison | None) -> dict[str, Any]:
    """Reports and metrics of the designs by title, and their comparison; NaN becomes None."""
    return {
        **({} if compared is None else {"comparison": compared.record()}),
        "designs": {one.title: one.record for one in found},
        "metrics": {
            one.title: {n: v if math.isfinite(v) else None for n, v in one.metrics.items()}
            for one in found
        },
    }
