"""Designs: every number of a spec resolved from parameters and trends, and the design filter."""

from draft.design.design import Design
from draft.design.findings import Finding
from draft.design.resolve import resolve

__all__ = ["Design", "Finding", "resolve"]
