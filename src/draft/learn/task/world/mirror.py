"""Left-right mirror images of observations and actions.

A quadruped and its mirror image about the xz plane move alike: the mirrored robot's observation is
the mirror image of the robot's. `draft.learn.training.ppo.symmetry` has networks that use this.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import torch

from draft.errors import DraftError, suggest
from draft.learn.task.world.access import ground_of, robot_of

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.task.world.ground import HeightMapCfg


class Flip(NamedTuple):
    """A mirror image: entry i is `sign[i]` times entry `source[i]`.

    Attributes:
        source: index of the mirrored entry, shape (entries,).
        sign: +1 or -1, shape (entries,).
    """

    source: torch.Tensor
    sign: torch.Tensor

    def __call__(self, values: torch.Tensor) -> torch.Tensor:
        """Return the mirror image of values, shape (..., entries)."""
        return values[..., self.source] * self.sign


# A velocity or a force mirrors to minus y, an angular velocity to minus x and z.
_POLAR, _AXIAL = (1.0, -1.0, 1.0), (-1.0, 1.0, -1.0)
_COMMAND = (1.0, -1.0, -1.0)  # vx, vy, wz
_ACTIONS = "actions"
_WITHOUT = "set `learning.mirror` to false"

Piece = list[tuple[int, float]]  # For each entry of a term: index of the mirrored one, and sign.


def flips(env: ManagerBasedRlEnv) -> dict[str, Flip]:
    """Mirror images of the groups of observations by name, and of the actions as `actions`.

    Raises:
        DraftError: the mirror image of an observation is not known, or members of a family differ
            in theirs.
    """
    _check_members(robot_of(env).cfg.members)
    manager, parts = env.observation_manager, _parts(env)
    images = {_ACTIONS: _joined([parts["actions"]], env.device)}
    for group, names in manager.active_terms.items():
        pieces = []
        for name, dims in zip(names, manager.group_obs_term_dim[group], strict=True):
            piece = _part(parts, name)
            past = manager.get_term_cfg(group, name).history_length or 1
            piece = [(len(piece) * k + i, sign) for k in range(past) for i, sign in piece]
            if dims != (len(piece),):
                raise _unknown(name, f"it has shape {tuple(dims)}, not ({len(piece)},)", [])
            pieces.append(piece)
        images[group] = _joined(pieces, env.device)
    return images


def _check_members(members: tuple[LeggedRobot, ...]) -> None:
    """Check that joints of all members mirror alike."""
    first = members[0]
    for other in members[1:]:
        for what in ("leg_mirror", "mirror", "mirror_sign"):
            if getattr(other, what) != getattr(first, what):
                cause = f"joints of {other.name} mirror differently from those of {first.name}"
                raise DraftError(cause, _WITHOUT)


def _parts(env: ManagerBasedRlEnv) -> dict[str, Piece]:
    """Mirror images of all known terms."""
    robot = robot_of(env)
    member = robot.cfg.members[0]
    polar, axial = list(enumerate(_POLAR)), list(enumerate(_AXIAL))
    joints = list(zip(member.mirror, member.mirror_sign, strict=True))
    at = {joint: i for i, joint in enumerate(member.turned)}
    turned = [(at[other], sign) for j, (other, sign) in enumerate(joints) if j in at]
    feet = [(other, 1.0) for other in member.leg_mirror]
    return {
        "base_lin_vel": polar,
        "base_ang_vel": axial,
        "projected_gravity": polar,
        "joint_pos": turned,
        "joint_vel": joints,
        "actions": joints,
        "command": list(enumerate(_COMMAND)),
        "height_scan": _scan(ground_of(env).cfg),
        "design": [(i, 1.0) for i in range(robot.design.shape[1])],
        "foot_height": feet,
        "foot_air_time": feet,
        "foot_contact": feet,
        # In the world's axes: the image is about the world's xz plane.
        "foot_contact_forces": [
            (3 * other + axis, sign) for other, _ in feet for axis, sign in polar
        ],
    }


def _scan(cfg: HeightMapCfg) -> Piece:
    """Mirror image of the rows of points, which run from right to left; see `HeightMap.scan`."""
    along, across = (round(side / cfg.grid) + 1 for side in cfg.size)
    return [(row * along + i, 1.0) for row in reversed(range(across)) for i in range(along)]


def _part(parts: dict[str, Piece], name: str) -> Piece:
    if name not in parts:
        raise _unknown(name, "no rule tells which entries change sides or signs", list(parts))
    return parts[name]


def _joined(pieces: list[Piece], device: str) -> Flip:
    """Mirror image of concatenated terms."""
    index, sign, start = [], [], 0
    for piece in pieces:
        index += [start + i for i, _ in piece]
        sign += [s for _, s in piece]
        start += len(piece)
    return Flip(torch.tensor(index, device=device), torch.tensor(sign, device=device))


def _unknown(name: str, cause: str, known: list[str]) -> DraftError:
    remedy = f"{suggest(name, known, 'observations')}; or {_WITHOUT}" if known else _WITHOUT
    problem = f"the mirror image of the observation '{name}' is not known: {cause}"
    return DraftError(problem, remedy)
