"""A run's checkpoint in a browser."""

from draft.learn.engine.silence import start_mjlab

start_mjlab()
