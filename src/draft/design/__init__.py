"""Spec + parameters + trends -> numbers: actuators, links, loft, packing, design filter."""

from draft.design.design import Design
from draft.design.findings import Finding
from draft.design.resolve import resolve

__all__ = ["Design", "Finding", "resolve"]
