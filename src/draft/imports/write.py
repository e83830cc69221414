"""The three files of an imported robot as YAML that a person can read and edit."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Mapping, Sequence

from draft.imports.ends import Node
from draft.imports.formatting import Parameters, Value
from draft.imports.motors import Motor
from draft.imports.spec_tree import Tree
from draft.imports.trunk import Trunk
from draft.laws.catalogue import MODULE
from draft.spec.new import SCHEMA_FOLDER

_PLAIN = re.compile(r"(-(?=[A-Za-z0-9(]))?[A-Za-z0-9_(][A-Za-z0-9_ .*/+()'-]*")
_WORDS = {"y", "n", "yes", "no", "on", "off", "true", "false", "null", "~"}
# Axis names are read as text by Draft's reader, whatever YAML 1.1 makes of `y`.
_AXES = {"x", "y", "z", "-x", "-y", "-z"}
WIDTH = 98
LONGEST_DOC = 390
TORQUE_SOURCES = {
    "stated": " # stated at the import",
    "assumed": " # not declared: usual for surveyed joints of such a role and size",
    "replaced": " # declared one implausible: usual for surveyed joints of such a role and size",
}
SPEED_SOURCES = {
    "stated": " # stated at the import",
    "assumed": " # not declared: usual for surveyed joints of such a torque",
    "replaced": " # declared one implausible: usual for surveyed joints of such a torque",
}


def flow(value: Value) -> str:
    """A value in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return f"{value:.10g}"
    if value in _AXES:
        return value
    if _PLAIN.fullmatch(value) and value.lower() not in _WORDS and not value.endswith(" "):
        return value if not re.fullmatch(r"[\d.eE+-]+", value) else json.dumps(value)
    return json.dumps(value, ensure_ascii=False)


def parameters_text(
    name: str,
    doc: str,
    population: str,
    parameters: Parameters,
    motors: Sequence[Motor],
) -> str:
    """Text of parameters.yaml, without findings to allow."""
    lines = [
        f"# yaml-language-server: $schema={SCHEMA_FOLDER}/parameters.json",
        f"name: {name}",
        f"doc: {flow(doc)}",
        f"population: {population}",
        "",
        "# Sizes of the robot; lengths are in the directions that members have in its zero pose.",
        "parameters:",
    ]
    for key, item in parameters.table.items():
        low, high = item.range
        table: Node = {
            "value": item.value,
            "unit": item.unit,
            "range": [low, high],
            "doc": item.doc,
        }
        lines.append(f"  {key}: {flow(table)}")
    lines += [
        "",
        "# One class for each pair of torque and speed; trends give mass, size and rotor inertia.",
        "actuators:",
    ]
    for motor in motors:
        lines += _motor_lines(motor)
    return "\n".join(lines) + "\n"


def allow_text(allowed: Mapping[str, str]) -> str:
    """Text at the end of parameters.yaml: findings to let pass, each with why."""
    head = "\n# Rules of the design filter that the robot breaks, and why that passes.\nallow:\n"
    return head + "".join(
        f"  # {textwrap.fill(why, WIDTH - 4, subsequent_indent='  # ')}\n  - {flow(key)}\n"
        for key, why in allowed.items()
    )


def _motor_lines(motor: Motor) -> list[str]:
    joints = ", ".join(motor.joints[:4]) + (" and more" if len(motor.joints) > 4 else "")
    return [
        f"  {motor.name}:",
        f"    doc: {flow(f'Drives {joints}.'[:LONGEST_DOC])}",
        *([f"    kind: {motor.kind}"] if motor.kind != MODULE else []),
        f"    peak_torque: {motor.torque:g}{TORQUE_SOURCES.get(motor.torque_from, '')}",
        f"    no_load_speed: {motor.speed:g}{SPEED_SOURCES.get(motor.speed_from, '')}",
    ]


def tree_text(trunk: str, tree: Tree, base: Node | None = None) -> str:
    """Text of tree.yaml; `base` has the keys of a fixed base, None for a trunk."""
    lines = [
        f"# yaml-language-server: $schema={SCHEMA_FOLDER}/tree.json",
        "",
        "# All frames have the trunk's axes in the zero pose. A link starts at the tip of the one",
        "# before it; a motor drives the next joint of its class.",
        "chains:",
    ]
    for name, nodes in tree.chains.items():
        lines.append(f"  {name}:")
        for node in nodes:
            lines += _node(node, 4)
        lines.append("")
    lines += ["tree:", f"  name: {trunk}", f"  type: {'root' if base is None else 'fixed'}"]
    lines += [f"  {key}: {flow(item)}" for key, item in (base or {}).items()]
    lines.append("  children:")
    for node in tree.children:
        lines += _node(node, 4)
    return "\n".join(lines) + "\n"


def _node(node: Node, indent: int) -> list[str]:
    """A link or the use of a chain as an item of a list."""
    children = node.get("children")
    plain: Node = {key: item for key, item in node.items() if key != "children"}
    pad = " " * indent
    if "chain" in node and len(pad + flow(plain)) <= WIDTH:
        return [f"{pad}- {flow(plain)}"]
    lines: list[str] = []
    for key, item in plain.items():
        head = f"{pad}{'- ' if not lines else '  '}{key}: "
        if key == "joints" and isinstance(item, dict):
            lines.append(head.rstrip())
            lines += [f"{pad}    {name}: {flow(change)}" for name, change in item.items()]
        else:
            lines.append(head + flow(item))
    if isinstance(children, list):
        lines.append(f"{pad}  children:")
        for child in children:
            assert isinstance(child, dict)
            lines += _node(child, indent + 4)
    return lines


def with_leg_length(root: str, leg: float) -> str:
    """Text of root.yaml that states the leg length [m] for the law of the trunk's density."""
    line = (
        f"leg_length: {flow(leg)} # thigh + shank of the robot that it came from, for its density"
    )
    return re.sub(r"^density: .*$", rf"\g<0>\n{line}", root, count=1, flags=re.MULTILINE)


def root_text(trunk: Trunk, density: float | None = None) -> str:
    """Text of root.yaml; `density` [kg/m3], None for that of the population."""
    slim = " # by volume, as links of any size: it is slimmer than surveyed robots"
    lines = [
        f"# yaml-language-server: $schema={SCHEMA_FOLDER}/root.json",
        "",
        "# Sections fitted to the robot's trunk; it weighs its volume times the density.",
        f"axis: {trunk.axis}",
        "density: population" if density is None else f"density: {density:.4g}{slim}",
        "sections:",
        *(f"  - {flow(section)}" for section in trunk.sections),
    ]
    return "\n".join(lines) + "\n"
