"""Draft: parametric robot design exploration.

`Spec --resolve--> Design --build--> Model`:

    spec = draft.load("quadruped")
    design = spec.resolve({"thigh_length": 0.30})
    model = design.build()

`dir(draft)` lists the public names, `help(draft.screen)` shows arguments, units and an example, and
docs/python.md is an introduction. All names but the errors are imported on first use.
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
    from draft import extend, metrics, study
    from draft.design import Design, Finding
    from draft.explore.optimise import optimise
    from draft.explore.screen import screen
    from draft.explore.sweep import sweep
    from draft.imports.importer import import_robot
    from draft.learn.measuring.evaluation import evaluate
    from draft.learn.measuring.surface import surface
    from draft.learn.policy.playback import play
    from draft.learn.policy.policy import policy
    from draft.learn.training.train import train
    from draft.model import Model
    from draft.model.export import export
    from draft.reporting.report import report
    from draft.spec import Spec, load, shipped
    from draft.twins.compare import compare_twin

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
    "compare_twin",
    "evaluate",
    "export",
    "extend",
    "import_robot",
    "load",
    "metrics",
    "optimise",
    "play",
    "policy",
    "report",
    "screen",
    "shipped",
    "study",
    "surface",
    "sweep",
    "train",
]

_MODULES = {
    "Design": "draft.design",
    "Finding": "draft.design",
    "Model": "draft.model",
    "Spec": "draft.spec",
    "compare_twin": "draft.twins.compare",
    "evaluate": "draft.learn.measuring.evaluation",
    "export": "draft.model.export",
    "import_robot": "draft.imports.importer",
    "load": "draft.spec",
    "optimise": "draft.explore.optimise",
    "play": "draft.learn.policy.playback",
    "policy": "draft.learn.policy.policy",
    "report": "draft.reporting.report",
    "screen": "draft.explore.screen",
    "shipped": "draft.spec",
    "surface": "draft.learn.measuring.surface",
    "sweep": "draft.explore.sweep",
    "train": "draft.learn.training.train",
}


def __dir__() -> list[str]:
    return sorted(__all__)


def __getattr__(name: str) -> object:
    """Import a public name on first use, so that `import draft` is fast."""
    import importlib

    if name in ("extend", "metrics", "study"):  # modules: importing one sets the attribute
        return importlib.import_module(f"draft.{name}")
    if name not in _MODULES:
        raise AttributeError(f"module 'draft' has no attribute '{name}'")
    return getattr(importlib.import_module(_MODULES[name]), name)
