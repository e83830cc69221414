"""Evaluation by roll-outs in mjlab."""

from draft.learn.silence import start_mjlab

start_mjlab()
