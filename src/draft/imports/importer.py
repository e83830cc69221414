"""A vendor's URDF or MJCF as a spec of three files: read, reduced, written, checked."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from draft.description.read import describe, read_root
from draft.design import Design
from draft.design.structure_law import leg_of_trunk
from draft.design.widened import KEY, REPORT
from draft.errors import (
    DraftError,
    Location,
    Problem,
    ResolveError,
    SpecError,
    counted,
    suggest,
)
from draft.files import new_folder
from draft.imports import names, notes, parts, plausibility, sides, summary, trunk, write
from draft.imports.anatomy import analyse
from draft.imports.base import families, name_fingers, pedestal
from draft.imports.drives import Drive, drives, example
from draft.imports.expected import doubts, expected_mass
from draft.imports.formatting import Deviation, Parameters
from draft.imports.geometry_check import GeometryCheck, check_geometry
from draft.imports.knees import Knees, knee_drives
from draft.imports.limbs import Limbs, find_limbs, upright
from draft.imports.loops import open_loops
from draft.imports.mesh_masses import weighed
from draft.imports.meshes import Meshes
from draft.imports.motors import Motor, motors
from draft.imports.options import Options
from draft.imports.reduce import Reduced, reduce, require_hinge
from draft.imports.rounding import tidy
from draft.imports.shapes import Shapes
from draft.imports.sources import Source, find_source
from draft.imports.spec_tree import Writer
from draft.imports.volumes import Volumes
from draft.model.model import preview
from draft.spec import Spec, load
from draft.spec.jsonschema import write_schemas
from draft.spec.load import shipped
from draft.spec.new import SCHEMA_FOLDER
from draft.values import scalar

LISTED = 3
POPULATIONS = ("humanoid", "quadruped")
DEFAULTS = Options()


@dataclass(frozen=True, slots=True, repr=False)
class Imported:
    """Result of an import.

    Attributes:
        folder: where the spec was written.
        spec: the spec.
        joints: name in the spec by the vendor's joint name.
        ignored: how many things of a kind were left out.
        notes: warnings, with file and line.
        geometry: joints held against MuJoCo's own compile of the file.
        limbs: its legs and arms, the population and why.
        files: the import itself, with what its numbers are from.
    """

    folder: Path
    spec: Spec
    joints: dict[str, str]
    ignored: dict[str, int]
    notes: tuple[Problem, ...]
    geometry: GeometryCheck
    limbs: Limbs
    files: Files

    def __repr__(self) -> str:
        counts = f"{counted(len(self.joints), 'joint')}, {counted(len(self.notes), 'note')}"
        return f"Imported('{self.folder}', {self.spec.population}, {counts})"


@dataclass(frozen=True, slots=True)
class Files:
    """Text of the files by name, and what was met while they were written.

    Attributes:
        texts: text by file name.
        joints: name of every joint in the spec, by the vendor's.
        reduced: the vendor's robot, with roles and classes.
        shapes: its shapes.
        limbs: its legs and arms, the population and why.
        source: the vendor's file.
        drives: torque and speed of every driven hinge, by the vendor's name.
        knees: where the knees' motors sit.
        trunk: what the trunk's size is from; "" for a machine on a fixed base.
        guessed: actuator classes of the spec whose torques are those of surveyed joints.
        deviations: dimensions in which limbs differ from their counterparts.
        mirrored: number of uses of chains beyond their first.
    """

    texts: dict[str, str]
    joints: dict[str, str]
    reduced: Reduced
    shapes: Shapes
    limbs: Limbs
    source: Source
    drives: dict[str, Drive]
    knees: Knees
    trunk: str
    guessed: frozenset[str]
    deviations: tuple[Deviation, ...]
    mirrored: int

    @property
    def fixed(self) -> bool:
        """Whether the spec has a fixed base instead of a trunk."""
        return not self.trunk

    @property
    def population(self) -> str:
        """Population whose structure trends apply: "humanoid" or "quadruped"."""
        return self.limbs.population


def import_robot(
    file: str | Path,
    out: str | Path | None = None,
    *,
    population: str | None = None,
    options: Options = DEFAULTS,
) -> Imported:
    """Import a robot's URDF or MJCF file as a spec of three files.

    Joint axes, ranges, peak torques, speeds and lengths are the vendor's. Masses and inertias are
    not read: Draft predicts them.

        >>> vendor = draft.export(draft.load("quadruped").resolve(), "vendor") / "robot.urdf"
        >>> found = draft.import_robot(vendor, out="mine")
        >>> found.spec.population, len(found.joints)
        ('quadruped', 12)
        >>> found.spec.resolve().accepted
        True

    Args:
        file: URDF, MJCF or xacro file, its meshes beside it, or the name of a robot, such as
            `menagerie:unitree_go2`, `robot_descriptions:go2_description` or
            `example-robot-data:anymal_c`.
        out: folder to make; None for the robot's name in the current folder.
        population: "humanoid" or "quadruped", the population whose structure trends apply; None
            for the one that its limbs imply.
        options: torques, speeds and other decisions that overrule the import's.

    Returns:
        The spec, the names of its joints, and what was not imported.

    Raises:
        DescriptionError: the file cannot be used; the message names the line.
        DraftError: the population is unknown, the folder exists or cannot be written, or the spec
            does not load.
    """
    check_population(population)
    source = find_source(file)
    folder = Path(out) if out is not None else Path(names.valid(source.name, "robot"))
    for name in (str(source.path), str(folder)):
        if not name.isprintable() or any("\ud800" <= letter <= "\udfff" for letter in name):
            raise DraftError(f"{name!a} is no name in UTF-8", "rename it")
    if os.path.lexists(folder) or folder.name == "..":
        raise DraftError(f"'{folder}' exists; it is kept", "choose another `out`")
    files = translate(source, names.valid(folder.name, "robot"), population, options=options)
    geometry = _make(folder, files)
    reduced = files.reduced
    return Imported(
        folder,
        load(folder),
        files.joints,
        dict(reduced.counts),
        tuple(reduced.notes),
        geometry,
        files.limbs,
        files,
    )


def check_population(population: str | None) -> None:
    """Refuse an unknown population.

    Raises:
        DraftError: it is none of `POPULATIONS`.
    """
    if population is not None and population not in POPULATIONS:
        cause = f"there is no population '{population}'"
        raise DraftError(cause, suggest(population, POPULATIONS, "populations"))


def translate(
    source: Source | Path,
    name: str,
    population: str | None = None,
    shown: str | None = None,
    key: str = "",
    options: Options = DEFAULTS,
) -> Files:
    """Text of the three files for a description, nothing written.

    Args:
        source: URDF or MJCF file; its name decides nothing.
        name: name of the spec.
        population: "humanoid" or "quadruped"; default by its limbs.
        shown: the file's name in messages; default its path.
        key: key of the robot in the survey, whose rules for its joints then hold; "" for none.
        options: torques, speeds and other decisions that overrule the import's.

    Raises:
        DescriptionError: the file cannot be used; the message names the line.
    """
    source = source if isinstance(source, Source) else Source(source, source.stem)
    path = source.path
    meshes = Meshes(path.parent)
    description = weighed(describe(path, shown, source.text, options.root), meshes)
    doubts = plausibility.check(description)
    description, axis = upright(description)
    if axis:
        cause = f"its {axis}: it is turned so that z points up and x forward"
        remedy = "poses of its base in its maker's software differ by that turn"
        doubts.append(Problem(cause, Location(description.file), remedy))
    wanted, limbs = population, find_limbs(description, population)
    population = limbs.population
    opened = open_loops(description, limbs.ends)
    description = opened.description
    reduced = reduce(
        description, key, population, options.torque, opened.linkage, fingers=not limbs.legs
    )
    plausibility.check_depth(reduced.root)
    kept = {body.joint.name for body in reduced.root.all() if body.joint}
    reduced.notes += [*opened.notes(kept), *doubts]
    analyse(reduced, key, limbs)
    require_hinge(description, reduced.root)
    tidy(reduced)
    shapes = Shapes(reduced, meshes)
    unique = names.Unique()
    bodies = reduced.root.all()[1:]
    driven = drives(reduced, population, options, shapes)
    name_fingers(reduced, limbs, stated=wanted is not None)
    classes, links = families(
        motors(bodies, driven, unique), reduced, limbs, stated=wanted is not None
    )
    _note_speeds(classes, reduced)
    knees = knee_drives(reduced, shapes, driven, population, options, opened.carried)
    parameters = Parameters(unique, digits=reduced.digits)
    apart = trunk.fixed_head(reduced) if population == "humanoid" else []
    carried = parts.carried(reduced, apart, shapes)
    without = [*apart, *(name for part in carried for name in part)]
    volumes = Volumes(reduced, shapes, driven)
    middle = None if links else trunk.trunk(reduced, without, shapes, parameters, population)
    head = trunk.head(reduced, apart, shapes, parameters) if apart else None
    tree = Writer(
        reduced, shapes, population, knees, classes, parameters, volumes, opened.cranks, links
    ).write()
    if head is not None:
        tree.children.append(head)
    tree.children += parts.boxes(carried, shapes, parameters, population)
    _count(reduced, meshes)
    where = Location(description.file)
    reduced.notes += [
        *sides.notes(parameters.deviations, where),
        *notes.of_shapes(meshes.notes, middle, description.links[reduced.root.name].where),
        *shapes.notes,
        *notes.of_wheels(reduced),
    ]
    doc = f"{description.name or path.stem}, imported from {path.name}."
    name = f"{name}_robot" if name in shipped() else name
    texts = {
        "parameters.yaml": write.parameters_text(name, doc[:390], population, parameters, classes),
        "tree.yaml": write.tree_text(
            trunk.trunk_name(reduced), tree, pedestal(reduced, shapes) if links else None
        ),
    }
    if middle is not None:
        density = volumes.trunk_density(middle.slices, population, limbs.legs)
        texts["root.yaml"] = write.root_text(middle, density)
    return Files(
        texts,
        tree.joints,
        reduced,
        shapes,
        limbs,
        source,
        driven,
        knees,
        "" if middle is None else middle.source,
        frozenset(one.name for one in classes if one.guessed),
        tuple(parameters.deviations),
        tree.copies,
    )


def spec_of(files: Files) -> Spec:
    """The spec that the files make; nothing is left on the disk.

    Raises:
        DraftError: the spec does not load.
    """
    try:
        return _complete(files)[0].spec
    except (SpecError, ResolveError) as error:
        raise _no_spec(error, files) from None


def _make(folder: Path, files: Files) -> GeometryCheck:
    """Make the folder all at once, or nothing: it is filled beside the first folder that exists.

    Raises:
        DraftError: it cannot be made here, or the spec does not load.
    """
    try:
        with new_folder(folder, "choose another place", replace=False) as temporary:
            design, geometry = _complete(files)
            write_schemas(temporary / SCHEMA_FOLDER)
            for name, file in design.spec.files.items():
                (temporary / name).write_bytes(file.read_bytes())
            files.reduced.notes[:] = notes.merged(files.reduced.notes)
            text = json.dumps(_report(design, files), indent=1, ensure_ascii=False) + "\n"
            (temporary / REPORT).write_text(text, encoding="utf-8")
            return geometry
    except (SpecError, ResolveError) as error:
        raise _no_spec(error, files) from None


def _no_spec(error: SpecError | ResolveError, files: Files) -> DraftError:
    """Error that names the description: the files that the spec's errors name are gone."""
    where = Location(files.reduced.description.file)
    found: list[Problem] = []
    for one in error.problems[:LISTED]:
        inside = ".yaml" in one.remedy or not one.remedy
        remedy = "this is a defect of the import: report it with the file" if inside else one.remedy
        found.append(Problem(f"no spec comes of it: {one.cause}", where, remedy))
    return DraftError(found)


def _report(design: Design, files: Files) -> dict[str, object]:
    """Data of `import.json`: what was found, and what the band of the mass follows from."""
    return {
        "file": Path(files.reduced.description.file).name,
        **summary.record(files, expected_mass(design, files)),
        KEY: doubts(files, design).record(),
        "joints": files.joints,
        "ignored": dict(files.reduced.counts),
        "notes": [str(note) for note in files.reduced.notes],
    }


def _complete(files: Files) -> tuple[Design, GeometryCheck]:
    """Design of the spec that the texts make, once the filter passes what is the maker's own.

    Raises:
        DescriptionError: a joint of the spec is elsewhere than in MuJoCo's compile of the file.
    """
    texts = dict(files.texts)
    design = Spec.parse(texts).resolve()
    leg = None if design.lofted is None else leg_of_trunk(design, design.lofted)
    if leg is not None:
        texts["root.yaml"] = write.with_leg_length(texts["root.yaml"], scalar(leg))
        design = Spec.parse(texts).resolve()
    allowed = allowance(design)
    if allowed:
        texts["parameters.yaml"] += write.allow_text(allowed)
        design = Spec.parse(texts).resolve()
        where = Location(files.reduced.description.file)
        note = notes.of_allowed(allowed, where)
        if note not in files.reduced.notes:
            files.reduced.notes.append(note)
    model = preview(design) or design.build()
    source = files.source
    file = files.reduced.description.file
    root = read_root(source.path, file, source.text)
    geometry = check_geometry(root, files.reduced, files.joints, model.mujoco)
    if geometry.skipped:
        cause = f"its joints were not compared with MuJoCo's: {geometry.skipped}"
        files.reduced.notes.append(Problem(cause, Location(file), "look at the robot's picture"))
    return design, geometry


def _note_speeds(classes: Sequence[Motor], reduced: Reduced) -> None:
    """Note how many classes have speeds that no file declares."""
    silent = [motor.name for motor in classes if motor.speed_from == "assumed"]
    if silent:
        cause = f"no usable speeds are declared: {len(silent)} of {len(classes)} classes have the "
        cause += "speed of surveyed robots' joints of such a torque"
        joints = [
            name for motor in classes if motor.speed_from == "assumed" for name in motor.joints
        ]
        remedy = f"state them, {example('`speed`', 12, reduced, joints)}: reduction and armature "
        remedy += "follow"
        reduced.notes.append(Problem(cause, Location(reduced.description.file), remedy))


def allowance(design: Design) -> dict[str, str]:
    """Entries of `allow` that let a design pass as its maker has it, each with why."""
    found: dict[str, str] = {}
    errors = [one for one in design.findings if one.severity == "error"]
    nested = [one.where for one in errors if one.id == "actuator_overlap"]
    if nested:
        pairs = "pair" if len(nested) == 1 else "pairs"
        why = f"{len(nested)} {pairs} of drives share space, such as {nested[0]}"
        found["actuator_overlap"] = f"{why}: the maker nests its units, or has smaller ones"
    for one in errors:
        if one.id != "actuator_overlap":
            found[f"{one.id}:{one.where}"] = f"{one.message}; it is as the maker declares it"
    return found


def _count(reduced: Reduced, meshes: Meshes) -> None:
    """Count what a spec has no place for."""
    description = reduced.description
    found: Counter[str] = reduced.counts
    found["fixed joints merged"] += sum(not joint.moves for joint in description.joints.values())
    shapes = [shape for link in description.links.values() for shape in link.geometries]
    found["meshes read for their size"] += meshes.count
    found["meshes not opened"] += len({s.mesh for s in shapes if s.mesh}) - meshes.count
    for name in [name for name, count in found.items() if count <= 0]:
        del found[name]
