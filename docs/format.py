"""Writes docs/format.md, the reference of the files, from the models that check them.

`python -m docs.format`; a test holds the file against this code.
"""

from __future__ import annotations

import types
import typing
from pathlib import Path

import pydantic

from draft.design.checks import ERRORS, KINDS
from draft.laws.quantities import QUANTITIES
from draft.spec import schema
from draft.spec.expressions import CONSTANTS, FUNCTIONS
from draft.spec.field_types import Model
from draft.spec.primitives import LINKS, basic, fixed, root, shape, wheel
from draft.spec.primitives.basic import LinkBase

FILE = Path(__file__).parent / "format.md"
INTRODUCTION = """\
# The files of a robot

<!-- Written by `python -m docs.format`; edit the docstrings below draft/spec instead. -->

A robot is a folder with `parameters.yaml`, `tree.yaml`, `root.yaml` unless its base is fixed, and,
if it has named designs, `designs/NAME.yaml`. Numbers are SI; angles are radians. Frames are
right-handed, x forward, y left, z up. Unknown keys are errors. YAML anchors, aliases and tags are
not used.

## Expressions

Wherever a *number* is expected, a string is an expression: `+ - * / % **`, comparisons, `and or
not`, `a if c else b`, the functions
{functions},
and {constants}. Parameters are available by name, and the values of an actuator class as
`class.quantity`:
{readable}.

A value that replaces another, from `--set`, a named design or Python, may read what it replaces
under its own name: `thigh_length=1.2*thigh_length`, or short `thigh_length=*1.2` and `/2`;
`actuators.leg.peak_torque=1.5*leg.peak_torque`, or `*1.5`. That is the value of the named design
that is changed, else that of `parameters.yaml`, an expression included; of a quantity that no file
states it is what the trends give without such values of the class.

## How a robot is put together

- The origin of a link is the tip of its parent, unless `at` states another point (in the frame of
  the parent). Its tip is the far end of its member.
- A link without a joint is fixed to its parent. A link with a joint and the links fixed to it are
  one rigid segment: its structural mass follows from its class and its joint-to-joint length. The
  mass of the end sphere or plate is subtracted, and the rest is distributed over the members by
  length.
- A motor is at the tip of its link and drives the next joint down the tree that uses its class.
- A mirrored chain is reflected with its attachment, but keeps its joint axes and ranges: one
  sign means the same motion on every copy. An axis that is not along x, y or z is reflected to the
  side of the original. Hinges and slides follow the same rule: a slide along y moves both sides to
  the left. `joints` changes the range, the home position or the direction of motion of a joint of
  one copy.
- A joint of `type: slide` moves its link along its axis, in metres. It has no actuator.
- A joint that `follows` another moves with it by a fixed ratio, as the last joint of many fingers
  does: it has no `range`, no `home` and no actuator of its own. MJCF holds the two together by an
  equality, URDF by `mimic`. `ratio` counts each motion about its own axis.

      joint: {{name: bend_3, axis: y, follows: {{joint: bend_2, ratio: 0.9}}}}

- A `transmission` is between an actuator and its joint: torque grows by the ratio and the
  efficiency, speed falls by the ratio, and the inertia of the rotor grows by its square. The
  actuator may be anywhere between the base and the joint: `motor` names its link.

      joint: {{name: bend_1, axis: y, range: [0, 1.6], actuator: servo,
              transmission: {{motor: palm_servo_1, ratio: 1.5, efficiency: 0.8}}}}

- The joint of a link of `type: wheel` turns without end: it has no `type`, no `range` and no
  `home`. With an actuator it is driven: a servo holds its speed, where those of other joints hold
  their angles. Without one it rolls freely, as a caster.

      - {{name: axle, motor: {{actuator: drive, axis: y}}}}
      - name: wheel
        type: wheel
        joint: {{name: roll, axis: y, actuator: drive}}
        wheel: {{radius: 0.08, width: 0.04, axis: y, mass: 0.5, site: foot}}

- The root of the tree is a trunk, `type: root`, which floats and whose solid is in root.yaml; or a
  base that is bolted to the world, `type: fixed`, as of an arm or a hand. A fixed base is at `at`
  in the world, turned by `rpy`, and may have a `pedestal` that stands on its origin. Its robot has
  no feet, no battery and no payload on a trunk. With joints on one of its children it is called an
  arm, on several a hand.

      tree:
        name: base
        type: fixed
        pedestal: {{size: [0.2, 0.2, 0.1], mass: 4}}
        children:
          - {{chain: arm, at: [0, 0, 0.1]}}

- A link of `type: box` is carried: a payload, a battery, a computer, a gripper. Its mass is stated,
  and is not structure: it has no segment class, does not lengthen a segment, and is not a foot. Its
  edges are along the axes of the link, which `rpy` rotates. The trunk density of the population
  includes the contents of surveyed trunks, such as batteries and computers: state a lower `density`
  in root.yaml for a trunk whose battery is a box.

      - {{name: battery, type: box, at: [0, 0, -0.05], box: {{size: [0.3, 0.12, 0.08], mass: 4.5}}}}
      - name: gripper
        type: box
        joint: {{name: wrist_roll, axis: x, range: [-3, 3]}}
        box: {{size: [0.12, 0.08, 0.06], density: 900, shift: [0.06, 0, 0], site: grasp}}

- A `shape` is a part of your own, a mesh or STEP, in place of a member, of the solid of a trunk, or
  of the actuators of a class, in the frame of the link or of the actuator. Its mass is stated by
  `mass`, by `density` or with `moments`; without any the laws keep it, spread over the part.

      - name: thigh
        joint: {{name: hip_pitch, axis: y, range: [-2, 2], actuator: leg}}
        link: {{axis: -z, length: thigh_length, segment: thigh}}
        shape: {{file: parts/thigh.stl, unit: mm, density: 2700}}
"""
FINDINGS = """
## Findings

Findings of the design filter. An error refuses the design unless `allow` lists it, as `id` or
`id:where`.

| id | | meaning |
|---|---|---|
"""
# Words of what links end in.
ENDS: list[type[Model]] = [
    typing.cast(type[Model], link.model_fields[link.end.key].annotation)
    for link in LINKS.values()
    if link.end is not None
]
SECTIONS: tuple[tuple[str, tuple[type[Model], ...]], ...] = (
    (
        "parameters.yaml",
        (
            *(schema.ParametersFile, schema.Parameter, schema.ActuatorClass, schema.Battery),
            shape.Shape,
        ),
    ),
    (
        "tree.yaml",
        (
            schema.tree_file(),
            root.Trunk,
            fixed.FixedBase,
            fixed.Pedestal,
            LinkBase,
            *LINKS.values(),
            schema.ChainUse,
            schema.JointChange,
            basic.Joint,
            wheel.WheelJoint,
            basic.Member,
            basic.Motor,
            basic.Pulley,
            *ENDS,
            shape.LinkShape,
        ),
    ),
    ("root.yaml", (root.RootFile, root.Section)),
    ("designs/NAME.yaml", (schema.DesignFile,)),
)


def text() -> str:
    """Give the whole reference as Markdown."""
    parts = [
        INTRODUCTION.format(
            functions=", ".join(f"`{name}`" for name in FUNCTIONS),
            constants=", ".join(f"`{name}`" for name in CONSTANTS),
            readable=", ".join(f"`{name}`" for name in QUANTITIES),
        )
    ]
    for heading, models in SECTIONS:
        parts.append(f"\n## {heading}\n")
        parts += [_model(model) for model in models]
    parts.append(FINDINGS)
    for name, meaning in KINDS.items():
        parts.append(f"| `{name}` | {'error' if name in ERRORS else 'warning'} | {meaning} |\n")
    return "".join(parts)


def _model(model: type[Model]) -> str:
    inherited = LinkBase.model_fields if model is not LinkBase else {}
    summary = " ".join((model.__doc__ or "").split())
    lines = [f"\n### {_title(model)}\n\n{summary}\n\n| key | value | meaning |\n|---|---|---|\n"]
    for key, field in model.model_fields.items():
        if key in inherited and issubclass(model, LinkBase):
            continue
        meaning = " ".join((field.description or "").split())
        lines.append(f"| `{key}` | {_value(field)} | {meaning} |\n")
    return "".join(lines)


def _title(model: type[Model]) -> str:
    words = "".join(f" {c.lower()}" if c.isupper() else c for c in model.__name__)
    return words.strip() if model is not LinkBase else "link"


def _value(field: pydantic.fields.FieldInfo) -> str:
    """Words for what a key takes, and its default."""
    words = _words(field.annotation)
    if field.is_required():
        return words + ", required"
    if field.default not in (None, [], {}, ""):
        return f"{words}, default {field.default}"
    return words


_NAMES: dict[object, str] = {str: "text", float: "number", int: "integer", bool: "true or false"}


def _words(annotation: object) -> str:
    if annotation in _NAMES:
        return _NAMES[annotation]
    if annotation == schema.Node:
        return " or ".join(map(_title, (schema.ChainUse, *LINKS.values())))
    origin, arguments = typing.get_origin(annotation), typing.get_args(annotation)
    if origin is typing.Annotated:
        return _words(arguments[0])
    if origin is typing.Literal:
        return " \\| ".join(str(argument) for argument in arguments)
    if origin is list:
        return f"list of {_words(arguments[0])}"
    if origin is dict:
        return f"mapping to {_words(arguments[1])}"
    if origin in (typing.Union, types.UnionType):
        options = dict.fromkeys(_words(a) for a in arguments if a is not type(None))
        if set(options) == {"number", "text"}:
            return "*number*"
        return " or ".join(options)
    if isinstance(annotation, type) and issubclass(annotation, Model):
        return _title(annotation)
    return "value"


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
