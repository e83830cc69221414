"""A run's checkpoint in a browser."""

from draft.learn.silence import start_mjlab

start_mjlab()
