"""Metrics of designs that are measured with a policy: `LEARNED` of `draft.metrics`, by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import ParamSpec, Protocol

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.learn.measuring.evaluation_options import BodyRollOuts
from draft.metrics.registry import LEARNED, find, misfit
from draft.settings import by_keyword
from draft.values import Array, Value

P = ParamSpec("P")


class _OfPolicy(Protocol[P]):
    """Type of `of_policy`, with the numbers of roll-outs as keyword arguments."""

    def __call__(
        self,
        design: Design,
        names: Iterable[str] | None = None,
        policy: str | Path | None = None,
        known: str = "",
        rows: NDArray[np.intp] | None = None,
        outside: bool = False,
        *args: P.args,
        **rollouts: P.kwargs,
    ) -> dict[str, Value]: ...


def _with_rollouts(
    record: Callable[P, BodyRollOuts],
) -> Callable[[Callable[..., dict[str, Value]]], _OfPolicy[P]]:
    return by_keyword(record)


@_with_rollouts(BodyRollOuts)
def of_policy(
    design: Design,
    names: Iterable[str] | None = None,
    policy: str | Path | None = None,
    *,
    known: str = "",
    rows: NDArray[np.intp] | None = None,
    outside: bool = False,
    rollouts: BodyRollOuts,
) -> dict[str, Value]:
    """Metrics of behaviour of one design or of N, by name.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> draft.metrics.of_policy(design, ["learned.top_speed"])  # doctest: +SKIP
        {'learned.top_speed': 5.131}

    Args:
        design: one design, or N.
        names: names of metrics in `LEARNED`; None for all.
        policy: folder of a run or ONNX file; None for the policy that ships for its legs.
        known: digest that the policy has to have, see `digest`; "" for any.
        rows: which of N designs, increasing; None for all that the filter accepts.
        outside: whether designs outside the policy's region of validity have values too.
        rollouts: fields of `BodyRollOuts`, by keyword.

    Returns:
        A float per metric, or an array of shape (N,) for N designs; NaN outside the policy's region
        of validity, unless `outside`, and for designs that are refused, not in `rows`, or that
        cannot walk. There `learned.inside` is 0.0; it is 1.0 and another is NaN where the roll-outs
        give none, as of a robot that falls.

    Raises:
        DraftError: an unknown metric, the policy cannot be read or does not drive the robot, or the
            extra `learn` is not installed.
    """
    from draft.learn.measuring.learned_metrics import of_designs
    from draft.learn.measuring.policies import source_for

    chosen = [find(name) for name in (LEARNED if names is None else names)]
    for metric in chosen:
        if metric.needs != "policy":
            cause = f"'{metric.name}' needs no policy"
            raise DraftError(cause, "use draft.metrics.of_model")
        if (problem := misfit(metric.name, design.spec)) is not None:
            raise DraftError(problem)
    source = source_for(policy, design)
    if known and source.digest != known:
        cause = f"the policy of {source.name} has changed since this began"
        remedy = "give a file, which 'draft play' writes of a run: `policy=FILE`"
        raise DraftError(cause, remedy)
    found, _ = of_designs(source, design, rollouts, rows)
    shown = replace(found, inside=np.ones_like(found.inside)) if outside else found
    values: dict[str, Array] = {
        one.name: np.asarray(one.function(found if one.unit == "bool" else shown), np.float64)
        for one in chosen
    }
    if design.count is None:
        return {name: float(value[0]) for name, value in values.items()}
    return dict(values)


def digest(policy: str, design: Design) -> str:
    """Digest of a policy: equal digests give equal metrics.

    Args:
        policy: folder of a run or ONNX file; "" for the policy that ships.
        design: a design that it is to drive; the filter may have refused it.

    Raises:
        DraftError: it cannot be read, does not observe its design or does not drive this one.
    """
    from draft.learn.bodies.legged import legged_robot
    from draft.learn.measuring.policies import source_for
    from draft.model.model import preview

    source = source_for(policy or None, design)
    source.drive.check(legged_robot(design, preview(design)))
    return source.digest
