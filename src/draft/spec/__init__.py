"""Specs: the three files of a robot, typed and checked, with expressions compiled once."""

from draft.spec.load import load, shipped
from draft.spec.spec import Spec

__all__ = ["Spec", "load", "shipped"]
