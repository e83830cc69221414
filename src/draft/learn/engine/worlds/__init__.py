"""Worlds of mjlab on either physics engine, and designs that they change."""

from draft.learn.silence import start_mjlab

start_mjlab()
