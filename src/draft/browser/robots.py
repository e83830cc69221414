"""What a page knows of a robot: its model, its policy as numbers, and what Draft says of it."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.learn.policy.controller import start_offsets
from draft.learn.policy.policy import Policy
from draft.learn.policy.reduced import AnyPolicy
from draft.learn.policy.validity import Fit, fits
from draft.learn.policy.walk import FALL, FLOOR, plane_xml, start_position
from draft.model import Model
from draft.model.model import preview
from draft.model.scene import home, home_position
from draft.values import Array

# Terms that the page computes (`robot.js`); the ground is a plane, so none sees heights.
TERMS = frozenset(
    {
        *("base_lin_vel", "base_ang_vel", "projected_gravity", "joint_pos", "joint_vel"),
        *("actions", "command", "design"),
    }
)
# Numbers of a policy that differ from body to body.
OF_BODY = (
    *("sign", "home", "action_scale", "stiffness", "damping"),
    *("peak_torque", "stall_torque", "no_load_speed", "features"),
)


@dataclass(frozen=True)
class PageRobot:
    """A robot of a page.

    Attributes:
        fit: policy that drives it; None for a robot that stands.
        plain: what the page reads, without the network.
    """

    fit: Fit | None
    plain: dict[str, Any]


@dataclass(frozen=True)
class Driven:
    """The policy that drives some robots.

    Attributes:
        fits: the policy for each of them; empty where they stand.
        why: why they stand; "" if they are driven.
    """

    fits: Sequence[Fit]
    why: str


def driven(models: Sequence[Model], skill: str, policies: Sequence[AnyPolicy]) -> Driven:
    """One policy for some robots, else why there is none that a page can run.

    Args:
        models: the robots; the filter may have refused them.
        skill: "walk", "run" or "push".
        policies: policies to walk with before those that ship.
    """
    try:
        found = fits(models, skill, policies)
    except DraftError as error:
        return Driven((), error.problems[0].cause)
    unknown = [name for name, _ in found[0].policy.terms if name not in TERMS]
    if unknown:
        return Driven((), f"its policy observes {', '.join(unknown)}, which no page computes")
    if max(found[0].policy.history) > 1:
        return Driven((), "its policy observes past steps, which no page remembers")
    return Driven(found, "")


def compiled(design: Design) -> Model:
    """Model of a design, unchecked if the filter refuses it.

    Raises:
        ModelError: MuJoCo does not accept the robot.
    """
    return design.build() if design.accepted else preview(design)


def robot(model: Model, title: str, color: str, by: Driven) -> PageRobot:
    """What a page knows of a robot.

    Args:
        model: the robot.
        title: what the page calls it.
        color: colour of its trunk, as "#rrggbb".
        by: the policy that drives it alone or before others.
    """
    design = model.design
    chosen = by.fits[0] if by.fits else None
    low, high = _room(model)
    plain = {
        "title": title,
        "color": color,
        "xml": plane_xml(model),
        "floor": FLOOR,
        "trunk": design.bodies[0].name,
        "size": float(np.linalg.norm(high - low)),
        "width": float(high[1] - low[1]),
        "height": float(high[2] + low[2]) / 2,
        "why": by.why,
        "policy": None,
        "numbers": {"home_position": home_position(design).tolist()},
        "bodies": {body.name: int(model.mujoco.body(body.name).id) for body in design.bodies},
        "said": said(design, chosen),
    }
    if chosen is not None:
        plain["policy"] = _policy(chosen.policy)
        plain["numbers"] = body_numbers(model, chosen)
    return PageRobot(chosen, plain)


def said(design: Design, chosen: Fit | None) -> dict[str, Any]:
    """What Draft says of a design and of the policy that drives it."""
    return {
        "accepted": bool(design.accepted),
        "findings": [[one.severity, one.id, one.message] for one in design.findings],
        "outside": "" if chosen is None else chosen.warning,
    }


def body_numbers(model: Model, chosen: Fit) -> dict[str, list[float]]:
    """Numbers of a body that its start and its policy need, by name."""
    policy = chosen.policy
    numbers = {name: getattr(policy, name).astype(float).tolist() for name in OF_BODY}
    return {
        "home_position": start_position(model, chosen).tolist(),
        "forward": [policy.forward],
        "trim": policy.trim.numbers(),
        **numbers,
    }


def network_part(policy: Policy) -> tuple[str, bytes]:
    """Name of a policy's network by its content, and its numbers in single precision."""
    content = network_numbers(policy).astype("<f4").tobytes()
    return f"policy-{hashlib.sha256(content).hexdigest()[:12]}", content


def network_numbers(policy: Policy) -> NDArray[np.float32]:
    """Numbers of a policy's network in one row: mean, divisor, then the layers, shape (n,)."""
    mean, divisor, layers = policy.network.layers()
    parts = [mean, divisor, *(part for layer in layers for part in layer)]
    return np.concatenate([np.asarray(part, np.float32).ravel() for part in parts])


def _room(model: Model) -> tuple[Array, Array]:
    """Corners of the room that a robot takes at home [m], each of shape (3,)."""
    data = home(model.design, model.mujoco)
    reach = model.mujoco.geom_rbound[:, None]
    return (data.geom_xpos - reach).min(axis=0), (data.geom_xpos + reach).max(axis=0)


def _policy(policy: Policy) -> dict[str, Any]:
    """What the page reads of a policy, without the numbers of its body."""
    layers = policy.network.layers()[2]
    return {
        "joints": list(policy.joints),
        "terms": [list(term) for term in policy.terms],
        "rolls": policy.rolls.tolist(),
        "period": policy.control_period,
        "timestep": policy.timestep,
        "fall": {"low": FALL.low, "tilt": FALL.tilt},
        "offsets": start_offsets(policy, 0).tolist(),
        "sizes": [policy.network.size, *(len(bias) for _, bias in layers)],
    }
