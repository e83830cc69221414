"""Terms of an observation on a robot: what each is, where it comes from, and its code in C++."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from draft.errors import DraftError


@dataclass(frozen=True)
class Term:
    """A term of an observation.

    Attributes:
        meaning: what it is, with its frame and its source on a robot.
        unit: its unit.
        code: statement of C++ that writes it with `put`.
        estimated: field of `Sensors` for what no sensor gives; "" for others.
    """

    meaning: str
    unit: str
    code: str
    estimated: str = ""


def _each(code: str, condition: str = "") -> str:
    """Loop over the joints."""
    return f"for (std::size_t i = 0; i < JOINTS; ++i) {condition}put({code});"


TERMS = {
    "base_lin_vel": Term(
        "velocity of the trunk's origin, in the trunk's frame. No sensor gives it: the robot must "
        "estimate it, as from the inertial sensor and the legs on the ground",
        "m/s",
        "for (double x : s.estimated_base_lin_vel) put(x);",
        "estimated_base_lin_vel",
    ),
    "base_ang_vel": Term(
        "angular velocity of the trunk, in the trunk's frame: the gyro",
        "rad/s",
        "for (double x : s.base_ang_vel) put(x);",
    ),
    "projected_gravity": Term(
        "unit vector of gravity in the trunk's frame, (0, 0, -1) for a level trunk: `gravity` of "
        "the orientation that the inertial sensor estimates",
        "1",
        "for (double x : s.projected_gravity) put(x);",
    ),
    "joint_pos": Term(
        "sign times angle less the home pose, of each joint but driven wheels: encoders at the "
        "joints' outputs",
        "rad",
        _each("SIGN[i] * (s.joint_pos[i] - HOME[i])", "if (!ROLLS[i]) "),
    ),
    "joint_vel": Term(
        "sign times speed of each joint: encoders", "rad/s", _each("SIGN[i] * s.joint_vel[i]")
    ),
    "actions": Term(
        "last output of the policy, before signs and scale; zero at the start",
        "1",
        _each("action_[i]"),
    ),
    "command": Term(
        "vx, vy and wz that are asked for, in the trunk's frame",
        "m/s, m/s, rad/s",
        "for (double x : command) put(x);",
    ),
    "design": Term(
        "features of the body, which are constants: nothing to measure",
        "1",
        "for (double x : DESIGN) put(x);",
    ),
}
_REFUSED = {
    "height_scan": "heights of the ground around the robot, for which it would need a map of it"
}


def check(terms: Sequence[str]) -> None:
    """Check that a robot can have the observations of a policy.

    Args:
        terms: names of the terms.

    Raises:
        DraftError: it cannot.
    """
    for name in terms:
        if name not in TERMS:
            why = _REFUSED.get(name, "which a controller cannot compute")
            cause = f"the policy observes {name}: {why}"
            remedy = f"deploy a policy that observes only {', '.join(TERMS)}"
            if name in _REFUSED:
                remedy += "; of those that ship, walk, run, push and machine do"
            raise DraftError(cause, remedy)
