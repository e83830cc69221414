"""Draft: parametric robot design exploration.

`Spec --resolve--> Design --build--> Model`:

    spec = draft.load("quadruped")
    design = spec.resolve({"thigh_length": 0.30})
    model = design.build()
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.errors import (
    DraftError,
    Location,
    ModelError,
    Problem,
    RefusedError,
    ResolveError,
    SpecError,
)

if TYPE_CHECKING:
    from draft.design import Design, Finding
    from draft.learn.policy import policy
    from draft.model import Model
    from draft.spec import Spec, load, shipped

__all__ = [
    "Design",
    "DraftError",
    "Finding",
    "Location",
    "Model",
    "ModelError",
    "Problem",
    "RefusedError",
    "ResolveError",
    "Spec",
    "SpecError",
    "load",
    "policy",
    "shipped",
]

_HOMES = {
    "Design": "draft.design",
    "Finding": "draft.design",
    "Model": "draft.model",
    "Spec": "draft.spec",
    "load": "draft.spec",
    "policy": "draft.learn.policy",
    "shipped": "draft.spec",
}


def __getattr__(name: str) -> object:
    """Import the nouns on first use, so that `import draft` stays light."""
    if name not in _HOMES:
        raise AttributeError(f"module 'draft' has no attribute '{name}'")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
