"""What a person writes: three files, typed and checked, expressions compiled once."""

from draft.spec.load import load, shipped
from draft.spec.spec import Spec

__all__ = ["Spec", "load", "shipped"]
