"""What the author of an extension needs: the decorators, and the types of what they take.

An extension is a module that uses these decorators. A script that does so has what it adds at once;
an installed package names its module in the entry-point group `draft.extensions`, so that every
command has it. docs/howto/extend.md is an introduction, `examples/extension` a whole package::

    from draft.extend import Design, Value, metric

    @metric(unit="kg/m", formula="m / L", source="my own", better="less")
    def mass_per_leg(design: Design) -> Value:
        \"\"\"Mass of the robot over its leg length [kg/m].\"\"\"
        return design.mass / design.leg_length
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.lazy import on_first_use

if TYPE_CHECKING:
    from draft.design import Design, Finding
    from draft.design.checks import check
    from draft.design.findings import note
    from draft.errors import DraftError
    from draft.geometry import Vector
    from draft.laws.actuators import Laws, actuator_laws, laws, read_laws
    from draft.laws.law import Law
    from draft.laws.structure import Population, population, read_population, structure_laws
    from draft.learn.task.constants import Scaled
    from draft.learn.task.terms import event, number, reward, stage, termination
    from draft.metrics import metric
    from draft.model import Model
    from draft.model.exporters import exporter
    from draft.spec.evaluate import Evaluator
    from draft.spec.field_types import Model as Fields
    from draft.spec.field_types import Name, Number, NumberVector
    from draft.spec.load import robots
    from draft.spec.primitives import primitive
    from draft.spec.primitives.base import End, Geom, Written, stated_mass
    from draft.spec.primitives.basic import LinkBase
    from draft.values import Mask, Value

_MODULES = {
    # Decorators, and the function that adds robots.
    "actuator_laws": "draft.laws.actuators",
    "check": "draft.design.checks",
    "event": "draft.learn.task.terms",
    "exporter": "draft.model.exporters",
    "metric": "draft.metrics",
    "primitive": "draft.spec.primitives",
    "reward": "draft.learn.task.terms",
    "robots": "draft.spec.load",
    "stage": "draft.learn.task.terms",
    "structure_laws": "draft.laws.structure",
    "termination": "draft.learn.task.terms",
    # What they take and give.
    "Design": "draft.design",
    "DraftError": "draft.errors",
    "End": "draft.spec.primitives.base",
    "Evaluator": "draft.spec.evaluate",
    "Fields": "draft.spec.field_types:Model",
    "Finding": "draft.design",
    "Geom": "draft.spec.primitives.base",
    "Law": "draft.laws.law",
    "Laws": "draft.laws.actuators",
    "LinkBase": "draft.spec.primitives.basic",
    "Mask": "draft.values",
    "Model": "draft.model",
    "Name": "draft.spec.field_types",
    "Number": "draft.spec.field_types",
    "NumberVector": "draft.spec.field_types",
    "Population": "draft.laws.structure",
    "Scaled": "draft.learn.task.constants",
    "Value": "draft.values",
    "Vector": "draft.geometry",
    "Written": "draft.spec.primitives.base",
    "laws": "draft.laws.actuators",
    "note": "draft.design.findings",
    "number": "draft.learn.task.terms",
    "population": "draft.laws.structure",
    "read_laws": "draft.laws.actuators",
    "read_population": "draft.laws.structure",
    "stated_mass": "draft.spec.primitives.base",
}

__all__ = [
    "Design",
    "DraftError",
    "End",
    "Evaluator",
    "Fields",
    "Finding",
    "Geom",
    "Law",
    "Laws",
    "LinkBase",
    "Mask",
    "Model",
    "Name",
    "Number",
    "NumberVector",
    "Population",
    "Scaled",
    "Value",
    "Vector",
    "Written",
    "actuator_laws",
    "check",
    "event",
    "exporter",
    "laws",
    "metric",
    "note",
    "number",
    "population",
    "primitive",
    "read_laws",
    "read_population",
    "reward",
    "robots",
    "stage",
    "stated_mass",
    "structure_laws",
    "termination",
]

# An extension loads only what it needs.
__getattr__ = on_first_use(__name__, _MODULES)


def __dir__() -> list[str]:
    return sorted(__all__)
