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
from draft.lazy import on_first_use

if TYPE_CHECKING:
    from draft import extend, metrics, study
    from draft.browser.page import page
    from draft.deployment.deploy import deploy
    from draft.design import Design, Finding
    from draft.explore.comparison import compare
    from draft.explore.optimise import optimise
    from draft.explore.screen import screen
    from draft.explore.sensitivity import sensitivity
    from draft.explore.solve import solve
    from draft.explore.sweep import sweep
    from draft.imports.importer import import_robot
    from draft.learn.measuring.evaluation import evaluate
    from draft.learn.measuring.surface import surface
    from draft.learn.policy.chosen import policy
    from draft.learn.policy.playback import play
    from draft.learn.training.train import train
    from draft.model import Model
    from draft.model.export import export, export_ros2
    from draft.reporting.report import report
    from draft.spec import Spec, load, shipped
    from draft.twins.compare import compare_twin
    from draft.validation.compare import real_robot

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
    "compare",
    "compare_twin",
    "deploy",
    "evaluate",
    "export",
    "export_ros2",
    "extend",
    "import_robot",
    "load",
    "metrics",
    "optimise",
    "page",
    "play",
    "policy",
    "real_robot",
    "report",
    "screen",
    "sensitivity",
    "shipped",
    "solve",
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
    "compare": "draft.explore.comparison",
    "compare_twin": "draft.twins.compare",
    "deploy": "draft.deployment.deploy",
    "evaluate": "draft.learn.measuring.evaluation",
    "export": "draft.model.export",
    "export_ros2": "draft.model.export",
    "extend": "",
    "import_robot": "draft.imports.importer",
    "load": "draft.spec",
    "metrics": "",
    "optimise": "draft.explore.optimise",
    "page": "draft.browser.page",
    "play": "draft.learn.policy.playback",
    "policy": "draft.learn.policy.chosen",
    "real_robot": "draft.validation.compare",
    "report": "draft.reporting.report",
    "screen": "draft.explore.screen",
    "sensitivity": "draft.explore.sensitivity",
    "shipped": "draft.spec",
    "solve": "draft.explore.solve",
    "study": "",
    "surface": "draft.learn.measuring.surface",
    "sweep": "draft.explore.sweep",
    "train": "draft.learn.training.train",
}


__getattr__ = on_first_use(__name__, _MODULES)


def __dir__() -> list[str]:
    return sorted(__all__)
