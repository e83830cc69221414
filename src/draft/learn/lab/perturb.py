"""Inertia errors in mjlab: a new population of robots for every evaluation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from mjlab.managers.event_manager import EventTermCfg, RecomputeLevel, requires_model_fields

from draft.learn import inertia
from draft.learn.quadruped import Quadruped

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

STREAM = 0x17E7  # of random numbers; all else a seed draws is the same without inertia errors


def events(members: Sequence[Quadruped], source: str = "twins") -> dict[str, EventTermCfg]:
    """Events that give every world's robot inertia errors of its own.

    They follow the event that gives worlds their designs, and work with shifts of the centre of
    mass before or after them.

    Args:
        members: the designs, in the order in which worlds have them.
        source: whose errors; see `draft.learn.inertia.extents`.

    Raises:
        DraftError: there is no such source, or a member has other bodies than the first.
    """
    params = {"links": inertia.links(members), "ranges": inertia.extents(source)}
    return {"inertia_errors": EventTermCfg(func=perturb, mode="startup", params=params)}


@requires_model_fields("body_mass", "body_ipos", "body_inertia", recompute=RecomputeLevel.set_const)
def perturb(
    env: ManagerBasedRlEnv, env_ids: Any, links: inertia.Links, ranges: dict[str, inertia.Extent]
) -> None:
    """Change masses, centres of mass and inertias as they are in each world.

    Args:
        env: the environment; its seed decides the population.
        env_ids: not used, errors are for all worlds and for good.
        links: of the designs.
        ranges: of the errors of each group.
    """
    sim, robot = env.sim, env.scene["robot"]
    seed = env.cfg.seed
    rng = np.random.default_rng(None if seed is None else (STREAM, seed))
    drawn = inertia.draw(ranges, env.num_envs, rng)
    found = inertia.change(links, robot.member.cpu().numpy(), drawn)
    prefix = f"{robot.root_body.name.rpartition('/')[0]}/"
    ids = torch.tensor(
        [sim.mj_model.body(prefix + name).id for name in links.names], device=env.device
    )
    mass, moments, shift = (
        torch.as_tensor(values, dtype=torch.float32, device=env.device) for values in found
    )
    model: Any = sim.model
    model.body_mass[:, ids] = model.body_mass[:, ids] * mass
    model.body_inertia[:, ids] = model.body_inertia[:, ids] * moments[..., None]
    model.body_ipos[:, ids] = model.body_ipos[:, ids] + shift
    for name in ("body_mass", "body_inertia", "body_ipos"):
        # mjlab's own randomisation starts from these.
        sim.default_model_fields[name] = getattr(model, name).clone()
        sim.per_world_default_fields.add(name)
