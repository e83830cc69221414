"""Evaluation by roll-outs in mjlab."""

from draft.learn.engine.silence import start_mjlab

start_mjlab()
