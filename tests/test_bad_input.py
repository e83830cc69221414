"""What Draft says to every mistake: each message is pinned, so that a change of words is seen.

Every mistake ends with exit code 2, names its file, line and column where there is a file, shows
no traceback, writes nothing and ends within a second. `pytest --force-regen` accepts changed words.
"""

from __future__ import annotations

import gc
import importlib.util
import math
import os
import re
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import trimesh
from pytest_regressions.file_regression import FileRegressionFixture

from draft.cli import main
from tests.model import own_parts
from tests.written import edit, files_below, write_robot

PARAMETERS, TREE, ROOT, LONG = "parameters.yaml", "tree.yaml", "root.yaml", "designs/long.yaml"
CHILDREN = "  children:\n"
MOST = 1.0  # seconds of this process's own work, so that a busy machine fails no test
PLACED = re.compile(r"^error: robot/\S+\.yaml:\d+:\d+: ")


@dataclass(frozen=True)
class Mistake:
    """One thing done wrong to a sound robot.

    Attributes:
        edits: file, what it says, what it says instead.
        arguments: of `draft build robot`.
        command: the whole command line, in place of that.
        placed: whether the message begins with a file, line and column.
        spoil: what else to do to the robot's folder.
    """

    edits: tuple[tuple[str, str, str], ...] = ()
    arguments: tuple[str, ...] = ()
    placed: bool = True
    spoil: Callable[[Path], object] | None = None
    command: tuple[str, ...] = ()


def said(file: str, old: str, new: str, *arguments: str) -> Mistake:
    """A file says something wrong."""
    return Mistake(((file, old, new),), arguments)


def default(expression: str) -> Mistake:
    """The default of a parameter is wrong."""
    return said(PARAMETERS, "value: 0.40", f"value: {expression}")


def block(words: str) -> Mistake:
    """A block on the trunk is wrong."""
    carried = f"    - {{name: pack, type: box, box: {{{words}}}}}\n"
    return said(TREE, CHILDREN, CHILDREN + carried)


def asked(*arguments: str) -> Mistake:
    """The command line is wrong."""
    return Mistake((), arguments, placed=False)


def done(spoil: Callable[[Path], object], placed: bool = True) -> Mistake:
    """The folder is wrong."""
    return Mistake((), (), placed, spoil)


def allow(item: str) -> Mistake:
    """A finding is let pass that cannot be."""
    return said(PARAMETERS, "actuators:", f"allow: [{item}]\nactuators:")


def battery(words: str) -> Mistake:
    """The stated battery is wrong."""
    return said(PARAMETERS, "actuators:", f"battery: {words}\nactuators:")


def bolted(
    *edits: tuple[str, str], arguments: tuple[str, ...] = (), command: tuple[str, ...] = ()
) -> Mistake:
    """Something is wrong in tree.yaml with a base that is fixed, or is asked of it."""
    tree = (("type: root", "type: fixed"), *edits)
    return Mistake(
        tuple((TREE, old, new) for old, new in tree),
        arguments,
        placed=not arguments and not command,
        spoil=lambda robot: (robot / ROOT).unlink(),
        command=command,
    )


def overwritten(file: str, text: str) -> Callable[[Path], object]:
    return lambda robot: (robot / file).write_text(text, encoding="utf-8")


def replaced(by: Callable[[Path], object]) -> Mistake:
    """Something else stands in the place of a file."""

    def spoil(robot: Path) -> None:
        (robot / TREE).unlink()
        by(robot / TREE)

    return done(spoil, placed=False)


def linked_outside(file: str) -> Callable[[Path], object]:
    def spoil(robot: Path) -> None:
        (robot / file).rename("outside.yaml")
        (robot / file).symlink_to(Path("outside.yaml").resolve())

    return spoil


SHAPE = "      link: {axis: -z, length: thigh_length, segment: thigh}\n"


def part(words: str, content: bytes = b"", name: str = "part.stl", **more: str) -> Mistake:
    """A part in place of the thigh is wrong."""

    def spoil(robot: Path) -> None:
        if content:
            (robot / name).write_bytes(content)

    shape = f"      shape: {{file: {name}{words}}}\n"
    edits = ((TREE, SHAPE, more.get("link", SHAPE) + shape),)
    return Mistake(edits, spoil=spoil)


def block_of(*shape: float, wrong: str = "") -> bytes:
    """An STL file of a box, of which a triangle may be "missing", or all are "inside out"."""
    box = trimesh.creation.box(shape or (0.05, 0.05, 0.3))
    if wrong == "missing":
        box.update_faces([False] + [True] * 11)
    elif wrong:
        box.faces[: 1 if wrong == "turned" else 12] = box.faces[: 1 if wrong == "turned" else 12][
            :, ::-1
        ]
    content = box.export(file_type="stl")
    assert isinstance(content, bytes)
    return content


def sheet() -> bytes:
    """A STEP file of a face, which encloses nothing."""
    if importlib.util.find_spec("OCP") is None:
        return b""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace  # pyright: ignore[reportAttributeAccessIssue]
    from OCP.gp import gp_Pln  # pyright: ignore[reportAttributeAccessIssue]

    return own_parts.step(BRepBuilderAPI_MakeFace(gp_Pln(), 0.0, 50.0, 0.0, 300.0).Face())


def bomb() -> str:
    lines = ["a: &a [x, x, x, x, x, x, x, x, x]"]
    for name, before in ("ba", "cb", "dc", "ed", "fe", "gf"):
        lines.append(f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]")
    return "\n".join(lines)


POLYGON = "polygon: [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1]]"
TWISTED = "polygon: [[0, 0], [0.2, 0.1], [0.2, 0], [0, 0.1]]"
CLOCKWISE = "polygon: [[0, 0.1], [0.2, 0.1], [0.2, 0], [0, 0]]"
GAP = "  gap: {value: 1, unit: m, range: [0, 2], doc: A gap.}\n"
BACK, FRONT = "{at: -trunk_length / 2, ", "{at: trunk_length / 2, "
RECTANGLE = "rectangle: [0.2, 0.1]}"
VARIED = "thigh_length=0.2:0.4"
TIP = ("site: foot", "site: tip")

WORDS = {
    # keys and types
    "unknown_key": said(TREE, "{radius: foot_radius", "{raduis: foot_radius"),
    "unknown_key_of_the_file": said(PARAMETERS, "population:", "popluation: 1\npopulation:"),
    "key_of_another_type": said(TREE, "      type: sphere\n", ""),
    "key_twice": said(TREE, "length: shank_length", "length: shank_length, length: 1"),
    "missing_key": said(PARAMETERS, "unit: m, range: [0.2, 1.0], ", "range: [0.2, 1.0], "),
    "missing_key_of_the_file": said(PARAMETERS, "population: quadruped\n", ""),
    "missing_name_of_a_link": said(TREE, "- name: shank\n      type", "- type"),
    "text_for_a_list": said(TREE, "range: [-1.0, 1.0]", "range: 1.0"),
    "list_for_a_number": said(TREE, "length: shank_length", "length: [1, 2]"),
    "truth_for_a_number": default("true"),
    "nothing_for_a_number": default(""),
    "number_for_a_mapping": said(PARAMETERS, "{value: 0.40", "0.40 #"),
    "short_vector": said(TREE, "at: [0, 0, -0.2]", "at: [0, 0]"),
    "unknown_axis": said(TREE, "axis: x, range", "axis: w, range"),
    "long_side_along_the_axis": Mistake(
        (
            (PARAMETERS, "peak_torque: 60", "kind: servo\n    peak_torque: 6"),
            (TREE, "actuator: leg, axis: y}", "actuator: leg, axis: y, long: -y}"),
        )
    ),
    "long_side_of_a_cylinder": said(
        TREE, "actuator: leg, axis: y}", "actuator: leg, axis: y, long: z}"
    ),
    "axis_without_length": said(TREE, "axis: x, range", "axis: [0, 0, 0], range"),
    "unknown_type_of_link": said(TREE, "type: sphere", "type: shpere"),
    "unknown_segment": said(TREE, "segment: thigh", "segment: tigh"),
    "unknown_unit": said(PARAMETERS, "{value: 0.40, unit: m,", "{value: 0.40, unit: mm,"),
    "unknown_population": said(PARAMETERS, "population: quadruped", "population: quadruple"),
    "unknown_mirror": said(TREE, "{chain: leg, at", "{chain: leg, mirror: z, at"),
    "name_with_a_hyphen": said(TREE, "name: housing", "name: hip-housing"),
    "parameter_name_with_a_hyphen": said(PARAMETERS, "  trunk_length: {", "  trunk-length: {"),
    "several_at_once": Mistake(
        (
            (PARAMETERS, "unit: m, range: [0.2, 1.0]", "unit: mm, range: 3"),
            (PARAMETERS, "peak_torque", "peek_torque"),
        )
    ),
    # YAML
    "not_yaml": said(TREE, "{actuator: leg, axis: x}", "{actuator: leg, axis: x"),
    "file_of_10_megabytes": done(overwritten(TREE, "# " + "x" * 10_000_000), placed=False),
    "nested_10000_deep": done(overwritten(TREE, "[" * 10_000 + "]" * 10_000)),
    "exploding_anchors": done(overwritten(TREE, bomb())),
    "python_object": default("!!python/object/apply:os.system ['true']"),
    "second_document": said(ROOT, "sections:", "---\nsections:"),
    "missing_file": done(lambda robot: (robot / TREE).unlink(), placed=False),
    "file_outside": done(linked_outside(TREE), placed=False),
    "design_outside": done(linked_outside(LONG), placed=False),
    "folder_of_designs_outside": done(linked_outside("designs"), placed=False),
    "folder_for_a_file": replaced(Path.mkdir),
    "pipe_for_a_file": replaced(lambda path: os.mkfifo(path)),  # noqa: PLW0108 - not on Windows
    "link_to_itself": replaced(lambda path: path.symlink_to(path.name)),
    "empty_file": done(overwritten(ROOT, "")),
    "not_utf8": done(lambda robot: (robot / TREE).write_bytes(b"name: M\xfcller"), placed=False),
    # expressions
    "undefined_name": said(PARAMETERS, "0.5 * leg.radius", "0.5 * shank_lenght"),
    "undefined_actuator": said(PARAMETERS, "0.5 * leg.radius", "0.5 * lge.radius"),
    "undefined_quantity": said(PARAMETERS, "0.5 * leg.radius", "0.5 * leg.raduis"),
    "class_as_a_number": said(PARAMETERS, "0.5 * leg.radius", "0.5 * leg"),
    "undefined_name_in_the_tree": said(TREE, "length: shank_length", "length: shin_length"),
    "undefined_name_in_the_root": said(ROOT, "at: -trunk_length", "at: -trunk_lenght"),
    "unknown_function": default("sqr(2)"),
    "unfinished_expression": default("0.3 +"),
    "tower_of_powers": default("9**9**9"),
    "trunk_far_from_its_origin": Mistake(
        (
            (ROOT, "at: -trunk_length", "at: 100 - trunk_length"),
            (ROOT, "at: trunk_length", "at: 100 + trunk_length"),
        )
    ),
    "trunk_beside_its_origin": Mistake(
        (
            (ROOT, "at: -trunk_length / 2,", "at: -trunk_length / 2, offset: [0, 100],"),
            (ROOT, "at: trunk_length / 2,", "at: trunk_length / 2, offset: [0, 100],"),
        )
    ),
    "comma_in_a_list": said(TREE, "at: [0, 0, -0.2]", "at: [0, 0, max(-0.2, -1)]"),
    "comma_in_a_short_list": said(TREE, "at: [0, 0, -0.2]", "at: [0, max(-0.2, -1)]"),
    "control_character": said(PARAMETERS, "value: 0.40", "value: 0.4\x010"),
    "attribute_trick": default("().__class__.__bases__"),
    "import_trick": default("\"__import__('os').system('true')\""),
    "long_expression": default("1" + " + 1" * 200),
    "deep_expression": default("(" * 250),
    "circle": said(PARAMETERS, "peak_torque: 60", "peak_torque: 2000 * foot_radius"),
    "circle_of_one": default("1 + trunk_length"),
    "circle_of_three": Mistake(
        (
            (PARAMETERS, "thigh_length: {value: 0.30", "thigh_length: {value: 2 * shank_length"),
            (PARAMETERS, "shank_length: {value: 0.25", "shank_length: {value: 2 * trunk_length"),
            (PARAMETERS, "{value: 0.40", "{value: thigh_length"),
        )
    ),
    "division_by_zero": Mistake(
        (
            (PARAMETERS, "actuators:", GAP + "actuators:"),
            (TREE, "length: shank_length", "length: 1 / (gap - 1)"),
        )
    ),
    "root_of_a_negative": said(PARAMETERS, "0.5 * leg.radius", "sqrt(leg.radius - trunk_length)"),
    "complex_power": said(PARAMETERS, "0.5 * leg.radius", "(leg.radius - 1) ** 0.5"),
    "not_a_number": said(PARAMETERS, "0.5 * leg.radius", "1e308 * 10 * (leg.radius - leg.radius)"),
    # numbers
    "default_outside_its_range": default("1.40"),
    "derived_outside_its_range": said(
        PARAMETERS, "0.5 * leg.radius, unit: m,", "0.5 * leg.radius, unit: m, range: [0, 0.01],"
    ),
    "zero_length": said(TREE, "length: shank_length", "length: 0"),
    "negative_length": said(TREE, "length: shank_length", "length: shank_length - thigh_length"),
    "negative_torque": said(PARAMETERS, "peak_torque: 60", "peak_torque: -60"),
    "empty_joint_range": said(TREE, "[-1.0, 1.0]", "[1.0, -1.0]"),
    "home_outside_its_range": said(TREE, "[-1.0, 1.0], ", "[-1.0, 1.0], home: 1.5, "),
    "free_parameter_without_range": said(PARAMETERS, "range: [0.2, 1.0], ", ""),
    "empty_range": said(PARAMETERS, "[0.2, 1.0]", "[1.0, 0.2]"),
    "reserved_parameter_name": said(
        PARAMETERS,
        "actuators:",
        "  min: {value: 1.5 * foot_radius, unit: m, doc: Gap.}\nactuators:",
    ),
    "reserved_actuator_name": said(PARAMETERS, "actuators:\n", "actuators:\n  if: {like: A}\n"),
    "segment_unknown_to_the_population": said(TREE, "segment: thigh", "segment: forearm"),
    "neither_segment_nor_mass": said(TREE, ", segment: thigh", ""),
    "sphere_without_a_segment": said(
        TREE,
        "    - name: shank\n",
        "    - name: ball\n      type: sphere\n      sphere: {radius: 0.02, mass: 0.1}\n"
        "      joint: {name: swivel, axis: x, range: [-1, 1]}\n    - name: shank\n",
    ),
    "box_without_mass_or_density": block("size: [0.2, 0.1, 0.1]"),
    "box_with_mass_and_density": block("size: [0.2, 0.1, 0.1], mass: 1, density: 900"),
    "box_of_negative_size": block("size: [0.2, -trunk_length, 0.1], mass: 1"),
    "box_of_negative_mass": block("size: [0.2, 0.1, 0.1], mass: -1"),
    "box_of_negative_density": block("size: [0.2, 0.1, 0.1], density: 1 - 2"),
    "box_of_two_sizes": block("size: [0.2, 0.1], mass: 1"),
    "box_with_an_unknown_key": block("size: [0.2, 0.1, 0.1], weight: 1"),
    "box_without_a_box": said(TREE, CHILDREN, CHILDREN + "    - {name: pack, type: box}\n"),
    "box_on_a_basic_link": said(
        TREE, CHILDREN, CHILDREN + "    - {name: pack, box: {size: [1, 1, 1], mass: 1}}\n"
    ),
    # the trunk
    "unequal_corners": said(ROOT, FRONT + RECTANGLE, FRONT + POLYGON.replace("]]", "], [-1, 0]]}")),
    "crossing_polygon": said(ROOT, BACK + RECTANGLE, BACK + TWISTED + "}"),
    "clockwise_polygon": said(ROOT, BACK + RECTANGLE, BACK + CLOCKWISE + "}"),
    "rectangle_and_polygon": said(ROOT, BACK + RECTANGLE, BACK + POLYGON + ", " + RECTANGLE),
    "sections_out_of_order": said(ROOT, FRONT, "{at: -trunk_length, "),
    "wide_chamfer": said(ROOT, FRONT, FRONT + "chamfer: 0.6, "),
    "one_section": said(ROOT, "  - " + BACK + RECTANGLE + "\n", ""),
    # the tree
    "unknown_chain": said(TREE, "{chain: leg,", "{chain: legs,"),
    "two_links_of_one_name": said(TREE, "name: shank", "name: thigh"),
    "two_joints_of_one_name": said(TREE, "name: knee", "name: hip"),
    "two_sites_of_one_name": said(TREE, "site: foot", "site: imu"),
    "trunk_with_the_name_of_a_link": said(TREE, "name: trunk", "name: shank"),
    "link_with_the_name_of_the_world": said(TREE, "name: shank", "name: world"),
    "trunk_with_the_name_of_the_world": said(TREE, "name: trunk", "name: world"),
    "joint_with_the_name_of_the_base": said(TREE, "name: knee", "name: floating_base"),
    "chain_in_itself": Mistake(
        (
            (TREE, "tree:\n", "  a:\n    - {name: one, children: [{chain: b}]}\ntree:\n"),
            (TREE, "tree:\n", "  b:\n    - {chain: a}\ntree:\n"),
            (TREE, "{chain: leg,", "{chain: a,"),
        )
    ),
    "change_of_an_unknown_joint": said(
        TREE, "{chain: leg,", "{chain: leg, joints: {hop: {reverse: true}},"
    ),
    "chain_used_twice": said(TREE, "    - {chain", "    - {chain: leg}\n    - {chain"),
    "unknown_actuator_of_a_motor": said(
        TREE, "{actuator: leg, axis: x}", "{actuator: lge, axis: x}"
    ),
    "unknown_actuator_of_a_joint": said(TREE, "1.0], actuator: leg", "1.0], actuator: hip"),
    "motor_without_a_joint": said(TREE, "1.0], actuator: leg}", "1.0]}"),
    "joint_without_a_motor": said(TREE, "      motor: {actuator: leg, axis: y}\n", ""),
    "motor_below_the_joints": said(
        TREE, "      sphere: {", "      motor: {actuator: leg, axis: y}\n      sphere: {"
    ),
    "actuator_of_a_slide": said(TREE, "{name: knee,", "{name: knee, type: slide,"),
    "home_outside_the_stroke": Mistake(
        (
            (TREE, "{name: knee, axis: y,", "{name: knee, type: slide, axis: y, home: 3,"),
            (TREE, "[-2.0, 2.0], actuator: leg}", "[-2.0, 2.0]}"),
            (TREE, "      motor: {actuator: leg, axis: y}\n", ""),
        )
    ),
    "joint_that_moves_nothing": Mistake(
        (
            (TREE, "      type: sphere\n", ""),
            (TREE, "      link: {axis: -z, length: shank_length, segment: shank}\n", ""),
            (TREE, "      sphere: {radius: foot_radius, site: foot}\n", ""),
        )
    ),
    # a fixed base
    "unknown_type_of_root": said(TREE, "type: root", "type: fxied"),
    "fixed_base_beside_a_root_file": said(TREE, "type: root", "type: fixed"),
    "fixed_base_inside_the_tree": said(TREE, "type: sphere", "type: fixed"),
    "fixed_base_on_a_foot": bolted(),
    "fixed_base_of_a_negative_mass": bolted(
        TIP, ("  name: trunk\n", "  name: trunk\n  pedestal: {size: [1, 1, 1], mass: -2}\n")
    ),
    "fixed_base_of_two_forms": bolted(
        TIP, ("  name: trunk\n", "  name: trunk\n  pedestal: {size: [1, 1, 1], radius: 1}\n")
    ),
    "fixed_base_of_nothing": bolted(
        ("  children:\n    - {chain: leg, at: [0, 0, -0.2]}\n", ""),
    ),
    "fixed_base_with_a_battery": Mistake(
        (
            (TREE, "type: root", "type: fixed"),
            (TREE, *TIP),
            (PARAMETERS, "actuators:", "battery: {energy: 5}\nactuators:"),
        ),
        spoil=lambda robot: (robot / ROOT).unlink(),
    ),
    "payload_on_a_fixed_base": bolted(TIP, arguments=("--payload", "3")),
    "training_of_a_fixed_base": bolted(TIP, command=("train", "robot")),
    "playing_of_a_fixed_base": bolted(TIP, command=("play", "robot")),
    "condition_that_no_fixed_base_has": bolted(
        TIP,
        command=(
            "screen",
            "robot",
            "--where",
            "mass < 9 and jump_height > 1",
            "--vary",
            VARIED,
            "--out",
            "out.parquet",
        ),
    ),
    "metric_that_no_fixed_base_has": bolted(
        TIP,
        command=(
            "sweep",
            "robot",
            "--metrics",
            "mass",
            "foot_force",
            "--vary",
            VARIED,
            "--out",
            "out",
        ),
    ),
    # parts of one's own
    "part_that_is_missing": part(""),
    "part_in_another_folder": part("", name="../part.stl"),
    "part_of_another_kind": part("", name="part.fbx"),
    "part_that_is_open": part("", block_of(wrong="missing")),
    "part_inside_out": part("", block_of(wrong="all")),
    "part_with_a_turned_triangle": part("", block_of(wrong="turned")),
    "part_of_1000_metres": part("", block_of(50, 50, 300)),
    "part_of_a_third_of_a_millimetre": part(", unit: mm", block_of()),
    "part_that_is_no_mesh": part("", b"solid of words"),
    "part_of_an_unknown_unit": part(", unit: ft", block_of()),
    "part_with_density_and_mass": part(", density: 2700, mass: 2", block_of()),
    "part_of_a_link_with_mass": part(
        ", density: 2700", block_of(), link=SHAPE.replace("segment: thigh", "mass: 2")
    ),
    "part_of_negative_density": part(", density: -2700", block_of()),
    "part_with_moments_alone": part(", moments: [1, 1, 1]", block_of()),
    "part_with_moments_of_no_body": part(
        ", mass: 1, com: [0, 0, 0], moments: [1, 0.1, 0.1]", block_of()
    ),
    "part_that_is_a_text": said(TREE, SHAPE, f"{SHAPE}      shape: part.stl\n"),
    "part_of_points_that_are_no_numbers": part("", block_of(math.nan, 0.05, 0.3)),
    "part_of_a_motor": said(TREE, "axis: y}", "axis: y, shape: {file: part.stl}}"),
    "part_in_the_root_file": said(ROOT, "axis: x", "axis: x\nshape: {file: part.stl}"),
    "part_that_is_a_folder": Mistake(
        ((TREE, SHAPE, f"{SHAPE}      shape: {{file: part.stl}}\n"),),
        spoil=lambda robot: (robot / "part.stl").mkdir(),
    ),
    "part_without_a_member": part("", block_of(), link=""),
    "part_of_step_without_solids": part("", sheet(), name="part.step"),
    "part_of_step_with_a_unit": part(", unit: mm", sheet(), name="part.step"),
    "part_of_a_class_with_mass_and_density": said(
        PARAMETERS, "gear_ratio: 15", "mass: 1\n    shape: {file: part.stl, density: 2700}"
    ),
    # actuators
    "one_stated_quantity": Mistake(
        ((PARAMETERS, "    no_load_speed: 20\n", ""), (PARAMETERS, "    gear_ratio: 15\n", ""))
    ),
    "corner_at_the_no_load_speed": said(
        PARAMETERS, "gear_ratio: 15", "gear_ratio: 15\n    corner_speed: 20"
    ),
    "battery_of_nothing": battery("{}"),
    "battery_of_negative_energy": battery("{energy: -5}"),
    "battery_of_an_unknown_name": battery("{energy: trunk_lenght}"),
    "unknown_part": said(PARAMETERS, "    gear_ratio", "    like: RMD-X15-P20-450\n    gear_ratio"),
    "allow_of_an_unknown_finding": said(
        PARAMETERS, "actuators:", "allow: [torque_densty:leg]\nactuators:"
    ),
    "allow_of_what_is_no_finding": allow("not_physical"),
    "allow_of_an_unknown_finding_at_a_place": allow("torq:leg"),
    "allow_at_an_unknown_place": allow("torque:lgg"),
    "allow_at_a_pair_with_an_unknown_body": allow("actuator_overlap:housing/tigh"),
    "allow_at_no_place": allow("'torque:'"),
    # designs
    "unused_design_with_an_unknown_name": said(LONG, "thigh_length", "tigh_length"),
    "unknown_name_in_a_design": said(LONG, "thigh_length", "thigh_lenght", "--design", "long"),
    "design_outside_its_range": said(LONG, "0.45", "4.5", "--design", "long"),
    "unknown_part_in_a_design": said(
        LONG, "thigh_length: 0.45", "actuators.leg.like: MIT U13", "--design", "long"
    ),
    "number_for_a_part_in_a_design": said(
        LONG, "thigh_length: 0.45", "actuators.leg.like: 12", "--design", "long"
    ),
    "list_in_a_design": said(LONG, "0.45", "[1, 2]"),
    "null_for_a_parameter": said(LONG, "0.45", "null", "--design", "long"),
    "undefined_name_in_a_design": said(LONG, "0.45", "2 * shin", "--design", "long"),
    "name_of_a_design": done(
        lambda robot: (robot / LONG).rename(robot / "designs/a b.yaml"), False
    ),
    # the command line
    "ros2_package_beside_formats": Mistake(
        placed=False, command=("export", "robot", "--ros2", "package", "--format", "glb")
    ),
    "ros2_package_without_a_folder": Mistake(
        placed=False, command=("export", "robot", "--ros2", "")
    ),
    "unknown_robot": Mistake(placed=False, command=("build", "quadropod")),
    "robot_without_a_name": Mistake(placed=False, command=("check", "")),
    "robot_with_a_long_name": Mistake(placed=False, command=("check", "a" * 300)),
    "new_robot_with_a_long_name": Mistake(placed=False, command=("new", "a" * 300)),
    "new_robot_of_a_shipped_name": Mistake(placed=False, command=("new", "quadruped")),
    "new_robot_like_an_unknown_one": Mistake(
        placed=False, command=("new", "mine", "--like", "quadropod")
    ),
    "new_robot_in_a_long_folder": Mistake(placed=False, command=("new", "a" * 300 + "/bob")),
    "robot_that_is_a_file": Mistake(placed=False, command=("build", "robot/tree.yaml")),
    "unknown_number_of_learning": Mistake(
        placed=False, command=("learn", "show", "--set", "rewards.uprigth_weight=2")
    ),
    "number_of_learning_of_another_kind": Mistake(
        placed=False, command=("learn", "show", "--set", "velocity.ramp=3")
    ),
    "learning_with_an_unknown_design": Mistake(placed=False, command=("learn", "show", "cheetha")),
    "learning_with_two_legs": Mistake(placed=False, command=("learn", "show", "robot")),
    "unknown_command": Mistake(placed=False, command=("biuld", "robot")),
    "unknown_design": asked("--design", "lang"),
    "design_above_the_folder": asked("--design", "../x"),
    "missing_design_file": asked("--design", "../x.yaml"),
    "set_of_an_unknown_parameter": asked("--set", "thigh_lenght=0.3"),
    "set_of_a_class_without_a_quantity": asked("--set", "actuators.leg=1"),
    "set_of_an_unknown_class": asked("--set", "actuators.lge.mass=1"),
    "set_of_an_unknown_quantity": asked("--set", "actuators.leg.peek_torque=1"),
    "set_without_the_word_actuators": asked("--set", "leg.peak_torque=90"),
    "set_without_equals": asked("--set", "thigh_length"),
    "set_without_value": asked("--set", "thigh_length="),
    "set_twice": asked("--set", "thigh_length=0.3", "thigh_length=0.4"),
    "set_outside_its_range": asked("--set", "thigh_length=7"),
    "set_to_nothing": asked("--set", "thigh_length=null"),
    "set_to_infinity": asked("--set", "thigh_length=inf"),
    "set_to_a_circle_through_an_actuator": asked(
        "--set", "actuators.leg.peak_torque=3000 * foot_radius"
    ),
    "set_to_an_expression_with_an_unknown_name": asked("--set", "thigh_length=2 * shnk_length"),
    "set_to_an_expression_outside_its_range": asked("--set", "thigh_length=4 * shank_length"),
    "set_to_an_unfinished_expression": asked("--set", "thigh_length=2 *"),
    "set_to_a_circle": asked("--set", "thigh_length=shank_length", "shank_length=thigh_length"),
    "set_to_no_number": asked("--set", "thigh_length=1 / (shank_length - shank_length)"),
    "set_of_a_negative_torque": asked("--set", "actuators.leg.peak_torque=-1"),
    "set_of_a_negative_corner": asked("--set", "actuators.leg.corner_speed=-1"),
    "set_to_a_misspelt_trend": asked("--set", "actuators.leg.corner_speed=trends"),
    "set_to_a_trend_that_is_none": asked("--set", "actuators.leg.mass=trend"),
    "set_of_a_rated_torque_above_the_peak": Mistake(
        arguments=("--set", "actuators.leg.rated_torque=80")
    ),
    "set_of_radius_length_and_shape": Mistake(
        arguments=(
            "--set",
            *(f"actuators.leg.{of}" for of in ("radius=0.05", "length=0.05", "aspect_ratio=1")),
        )
    ),
    "set_of_a_negative_payload": asked("--set", "payload=-1"),
    "payload_twice": asked("--payload", "10", "--set", "payload=5"),
    "set_of_an_unknown_part": asked("--set", "actuators.leg.like=MIT U13"),
    "out_with_a_long_name": asked("--out", "a" * 300),
    "out_in_a_long_folder": asked("--out", "a" * 300 + "/b"),
    "out_without_a_name": asked("--out", ""),
    "schema_out_without_a_name": Mistake(placed=False, command=("schema", "--out", "")),
    "out_is_a_file": asked("--out", "robot/tree.yaml"),
}


# Windows has no pipes in folders, and words of its own for a link to itself.
NOT_ON_WINDOWS = {"pipe_for_a_file", "link_to_itself", "part_that_is_a_folder"}


@pytest.fixture(scope="module", autouse=True)
def libraries_are_loaded() -> Iterator[None]:
    """Importing them is no part of what an input takes, nor is the garbage of earlier tests."""
    assert main(["list"]) == 0
    assert main(["check", "hopper"]) == 0
    gc.collect()
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.parametrize("name", WORDS)
def test_a_mistake_is_explained(
    name: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    file_regression: FileRegressionFixture,
) -> None:
    if sys.platform == "win32" and name in NOT_ON_WINDOWS:
        pytest.skip("needs another system")
    if "_step_without" in name:
        pytest.importorskip("OCP")
    work = tmp_path / "work"
    work.mkdir()
    monkeypatch.chdir(work)
    mistake = WORDS[name]
    robot = write_robot(Path("robot"))
    for file, old, new in mistake.edits:
        edit(robot, file, old, new)
    if mistake.spoil is not None:
        mistake.spoil(robot)
    before = files_below(work)
    begun = time.process_time()
    code = main(mistake.command or ("build", "robot", *mistake.arguments))
    took = time.process_time() - begun
    out, err = capsys.readouterr()
    file_regression.check(err, basename=name)
    assert code == 2
    assert out == ""
    assert err.startswith("error: ")
    assert "Traceback" not in err
    assert bool(PLACED.match(err)) == mistake.placed
    assert files_below(work) == before
    assert took < MOST, "a reader that hangs on bad input can be made to hang"
