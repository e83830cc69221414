"""Environments of the four stages, for one quadruped or for several of one topology.

Stage `base` walks on gently uneven ground at a commanded velocity, with pushes. The other stages
start from its policy, and each raises one thing: the commanded speed, the height of the ground, or
the size of the pushes. Numbers and their sources are in `draft.learn.config`.
"""

from draft.learn.lab.env_cfg.environment import environment
from draft.learn.lab.env_cfg.task import GroundKind, Task

__all__ = ["GroundKind", "Task", "environment"]
