"""PPO on mjlab: its agent, networks, checkpoints and log."""

from draft.learn.silence import start_mjlab

start_mjlab()
