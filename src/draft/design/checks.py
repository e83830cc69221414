"""Kinds of findings of the design filter, and the checks that extensions add by `@check`."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from draft.errors import DraftError
from draft.extensions import ExtensionWarning, Registry, reason

if TYPE_CHECKING:
    from draft.design.design import Design
    from draft.design.findings import Finding

Find = Callable[["Design"], Iterable["Finding"]]

# Meaning by id. Those in ERRORS refuse a design unless the spec allows them.
KINDS: dict[str, str] = {
    "torque": "peak torque beyond every catalogue module of a fitting reduction",
    "torque_density": "peak torque per mass beyond every catalogue module of a fitting reduction",
    "power_density": "peak power per mass beyond every catalogue module of a fitting reduction",
    "actuator_overlap": "two consecutive actuators occupy the same space at every joint angle",
    "wrong_unit": "a stated value far outside what was built, which another unit explains",
    "cannot_stand": "standing in the home pose needs more than the peak torque of a joint",
    "cannot_hold": "holding a fixed base's home pose needs more than the peak torque of a joint",
    "no_legs": "no limb reaches the ground: the structure trends are those of robots with legs",
    "coupled_leg": "a joint of a leg follows another: its loads are not judged",
    "not_physical": "an invalid number: not finite, a length of zero, outside its bounds",
    "aspect_ratio": "length over diameter outside the catalogue's",
    "stated_value": "a stated value outside what was built by more than a factor of 3",
    "joint_range": "a joint with a range of more than two turns",
    "gear_ratio": "reduction far from what modules of this speed have",
    "heavy_link": "a stated structural mass above twice the trend's",
    "actuator_share": "share of actuators in the mass outside the middle 80 % of the population",
    "total_mass": "total mass outside the 95 % band of robots of this size",
    "limb_overlap": "two limbs overlap in the neutral pose",
    "uneven_feet": "feet at different heights in the home pose",
    "outside_data": "a trend is used outside the range of its data",
    "thermal": "standing in or holding the home pose needs more than the rated torque of a joint",
    "below_floor": "a part below the feet in the home pose, or of a fixed base below the floor",
    "off_tip": "links drawn longer than the distance between their joints, which counts",
    "off_part": "a part of your own that ends far from the tip of its link",
    "trunk_section": "a section of the trunk beside the others by more than its own width",
    "unused_class": "an actuator class that no joint uses",
    # Of a simulation: `draft check --simulate`.
    "start_penetration": "parts inside the floor or each other in the start pose of a simulation",
    "unstable_servo": "a servo that swings, or with which the simulation diverges",
    "weak_servo": "a servo whose joint leaves the home pose under the robot's own weight",
    "falls": "the robot falls while its servos hold the home pose on a floor",
}
ERRORS = frozenset(
    (
        *("torque", "torque_density", "power_density", "actuator_overlap", "not_physical"),
        *("wrong_unit", "cannot_stand", "cannot_hold", "unstable_servo"),
    )
)


@dataclass(frozen=True, slots=True)
class Check:
    """A check of an extension.

    Attributes:
        doc: meaning of its findings.
        error: whether they refuse a design, unless the spec allows them.
        function: function from a Design to findings, all of the kind of its name.
    """

    doc: str
    error: bool
    function: Find


CHECKS: Registry[Check] = Registry("check")


def check(*, error: bool = False) -> Callable[[Find], Find]:
    """Register a function that yields findings as a check of the design filter.

    The name of the function is the kind of the findings, and the first line of its docstring their
    meaning. It is called with one design or with N, whose numbers are arrays of shape (N,):

        @check()
        def top_heavy(design: Design) -> Iterator[Finding]:
            \"\"\"The trunk is heavier than all the rest.\"\"\"
            limit = design.mass / 2
            text = "the trunk weighs {value}, more than half of the robot, {limit}"
            mask = design.base_mass > limit
            yield from note(
                "top_heavy", "trunk", mask, text, "a rule of ours", design.base_mass, limit, "kg"
            )

    Args:
        error: whether its findings refuse a design, unless the spec allows them.

    Raises:
        DraftError: a check of this name exists already.
    """

    def register(function: Find) -> Find:
        name, origin = function.__name__, function.__module__
        if name in KINDS:
            cause = f"the check '{name}' of {origin} exists already in draft.design.checks"
            raise DraftError(cause, "rename the check")
        doc = (inspect.getdoc(function) or "").partition("\n")[0].removesuffix(".")
        CHECKS.add(name, Check(doc, error, function), origin)
        return function

    return register


def kinds() -> dict[str, str]:
    """Meaning of each kind of finding, those of Draft first."""
    return KINDS | {name: one.doc for name, one in CHECKS.items()}


def is_error(kind: str) -> bool:
    """Whether a kind of finding refuses a design."""
    return kind in ERRORS or (kind not in KINDS and kind in CHECKS and CHECKS[kind].error)


def extended(design: Design) -> Iterator[Finding]:
    """Findings of the checks of extensions; of one that fails none, with a warning."""
    for name, one in CHECKS.items():
        try:
            found = [*one.function(design)]
            for finding in found:
                if finding.id != name:
                    raise ValueError(f"it yields a finding of the kind '{finding.id}'")
                if (finding.severity == "error") != one.error:
                    raise ValueError(f"it yields a finding of severity '{finding.severity}'")
                if np.shape(finding.mask) not in ((), (design.count,)):
                    raise ValueError(f"it yields a mask of shape {np.shape(finding.mask)}")
        except Exception as error:
            cause = f"the check '{name}' of {CHECKS.origin(name)} is left out: {reason(error)}"
            warnings.warn(cause, ExtensionWarning, stacklevel=2)
            continue
        yield from found
