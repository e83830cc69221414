"""Write the controller of a policy for a robot, in C++ and in Python."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from draft.deployment import observations
from draft.deployment.header import sources
from draft.deployment.numbers import Number, numbers
from draft.deployment.observations import TERMS
from draft.deployment.readme import readme
from draft.design import Design
from draft.design.references import open_design
from draft.errors import DraftError
from draft.learn.bodies.legged import legged_robot
from draft.learn.policy import policy as shipped
from draft.learn.policy.policy import Policy
from draft.learn.policy.reduced import AnyPolicy, open_any
from draft.learn.policy.validity import Fit, check_drives, fit
from draft.model import Model
from draft.model.folder import check_target, records, write_folder

_COPIED = ("controller.py", "CMakeLists.txt")
_WRITTEN = ("controller.hpp", "main.cpp", "policy.npz", "README.md", "design.yaml", "report.json")
_LEAST_DELAY = 0.005  # Greatest delay in training below which a policy knows none [s].


@dataclass(frozen=True)
class Deployed:
    """A controller that was written.

    Attributes:
        folder: its folder.
        design: name of its robot.
        policy: its policy, with the joints and motors of the robot.
        estimated: inputs that no sensor gives, so that the robot must estimate them.
        doubts: sentences that whoever runs it must know; also in its README.
    """

    folder: Path
    design: str
    policy: Policy
    estimated: tuple[str, ...]
    doubts: tuple[str, ...]


def deploy(
    design: Design | str | Path,
    out: str | Path,
    skill: str | None = None,
    policy: str | Path | None = None,
) -> Deployed:
    """Write the controller of a policy for a robot: plain C++, the same in Python, and a README.

        >>> found = draft.deploy("cheetah", "controller", skill="run")
        >>> sorted(path.name for path in found.folder.iterdir())[:4]
        ['CMakeLists.txt', 'README.md', 'controller.hpp', 'controller.py']
        >>> found.estimated
        ('estimated_base_lin_vel',)
        >>> draft.deploy("cheetah", "controller").estimated
        ()

    Args:
        design: the robot, its name, or the ONNX file of a policy, whose robot is the one that it
            was trained with.
        out: folder of the controller, written atomically; a controller that Draft wrote there
            before is replaced.
        skill: "walk", "run", "push" or "machine" of the policies that ship; None for "machine",
            which observes no velocity, or for "walk" where that does not drive the robot.
        policy: ONNX file of a policy of one's own; None for one that ships.

    Returns:
        What was written.

    Raises:
        RefusedError: the design filter found errors.
        DraftError: there is no such robot, skill or file, no policy drives the robot, a robot
            cannot have its observations, or the folder holds files that Draft did not write, or
            cannot be written.
    """
    folder = Path(out)
    own = [] if policy is None else [open_any(policy)]
    if isinstance(design, (str, Path)) and Path(design).suffix == ".onnx":
        if own:
            cause = f"'{design}' is a policy, and `policy` names another one"
            raise DraftError(cause, "name the robot, or omit `policy`")
        own = [open_any(design)]
        design = _robot_of(own[0])
    if skill is not None:
        shipped.check_skill(skill)
        if own:
            raise DraftError("`skill` is for the policies that ship", "omit `skill`, or `policy`")
    check_target(folder, {*_COPIED, *_WRITTEN}, "controller")
    model = open_design(design).build()
    check_drives(own, model)
    found = _fitted(model, skill, own)
    terms = [name for name, _ in found.policy.terms]
    observations.check(terms)
    member = legged_robot(model.design, model)
    table = numbers(found.policy, member)
    doubts = _doubts(found.policy, found.warning)
    here = Path(__file__)
    files: dict[str, str | bytes] = {
        **{name: here.with_name(name).read_text(encoding="utf-8") for name in _COPIED},
        **sources(table, found.policy),
        "policy.npz": _archive(table, found.policy),
        "README.md": readme(found, member, model, table, doubts, folder.resolve().name),
    }
    write_folder(folder, files | records(model))
    estimated = tuple(TERMS[name].estimated for name in terms if TERMS[name].estimated)
    return Deployed(folder, model.design.reference, found.policy, estimated, tuple(doubts))


def _fitted(model: Model, skill: str | None, own: list[AnyPolicy]) -> Fit:
    """Policy for a robot: of those that ship rather one that needs no velocity.

    Raises:
        DraftError: none drives it.
    """
    if skill is None and not own:
        try:
            return fit(model, "machine")
        except DraftError:
            skill = "walk"
    return fit(model, skill or "walk", own)


def _robot_of(policy: AnyPolicy) -> str:
    """Name of the robot that a policy was trained with.

    Raises:
        DraftError: it was trained with none, or with one that is not known by name.
    """
    if isinstance(policy, Policy):
        try:
            open_design(policy.design)
        except DraftError as error:
            cause = (
                f"{policy.file} was trained with {policy.design}, which is no robot that is known "
                f"here: {error.problems[0].cause}"
            )
        else:
            return policy.design
    else:
        cause = f"{policy.file} is a policy of all legs"
    remedy = f"name the robot: `draft.deploy(ROBOT, policy={str(policy.file)!r})`"
    raise DraftError(cause, remedy)


def _doubts(policy: Policy, outside: str) -> list[str]:
    """Sentences that whoever runs a policy must know."""
    found = [f"The robot is {outside}."] if outside else []
    if policy.delay[1] < _LEAST_DELAY:
        found.append(
            "This policy was trained without a delay from a measurement to its torque: measure "
            "that of the machine, and let it walk with as much in simulation first."
        )
    else:
        low, high = (f"{1e3 * x:g}" for x in policy.delay)
        found.append(f"This policy was trained with targets that arrive {low} to {high} ms late.")
    return found


def _archive(table: dict[str, Number], policy: Policy) -> bytes:
    """Content of `policy.npz`."""
    buffer = io.BytesIO()
    values = {name: np.asarray(number.value) for name, number in table.items()}
    values |= {
        "terms": np.array([name for name, _ in policy.terms]),
        "history": np.array(policy.history),
    }
    np.savez_compressed(buffer, allow_pickle=False, **values)
    return buffer.getvalue()
