"""A vendor's URDF or MJCF as a spec of three files: read, reduced, written, checked."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from draft.description.read import describe
from draft.errors import DraftError, Location, Problem, ResolveError, SpecError, suggest
from draft.files import new_folder
from draft.imports import limits, names, sides, trunk, write
from draft.imports.anatomy import analyse, population_of
from draft.imports.formatting import Parameters
from draft.imports.meshes import Meshes
from draft.imports.motors import motors
from draft.imports.reduce import Reduced, reduce, require_hinge, tidy
from draft.imports.shapes import Shapes
from draft.imports.spec_tree import Writer
from draft.spec import Spec, load
from draft.spec.jsonschema import write_schemas
from draft.spec.load import shipped
from draft.spec.new import SCHEMA_FOLDER

REPORT = "import.json"
OVERLAP = "the maker nests its units"
BEYOND = "as the maker declares it"
POPULATIONS = ("humanoid", "quadruped")


@dataclass(frozen=True, slots=True, repr=False)
class Imported:
    """What came of an import.

    Attributes:
        folder: where the spec was written.
        spec: the spec.
        joints: name in the spec by the vendor's joint name.
        ignored: how many things of a kind were left out.
        notes: warnings, with file and line.
    """

    folder: Path
    spec: Spec
    joints: dict[str, str]
    ignored: dict[str, int]
    notes: tuple[Problem, ...]

    def __repr__(self) -> str:
        counts = f"{len(self.joints)} joints, {len(self.notes)} notes"
        return f"Imported('{self.folder}', {self.spec.population}, {counts})"


@dataclass(frozen=True, slots=True)
class Files:
    """Text of the files by name, and what was met while they were written.

    Attributes:
        texts: text by file name.
        joints: name of every joint in the spec, by the vendor's.
        reduced: the vendor's robot, with roles and classes.
        shapes: its shapes.
        population: "humanoid" or "quadruped".
    """

    texts: dict[str, str]
    joints: dict[str, str]
    reduced: Reduced
    shapes: Shapes
    population: str


def import_robot(
    file: str | Path, out: str | Path | None = None, *, population: str | None = None
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
        file: URDF or MJCF file, its meshes beside it.
        out: folder to make; None for the file's name in the current folder.
        population: "humanoid" or "quadruped", the population whose structure trends apply; None
            for that of the survey, or as names and limbs suggest.

    Returns:
        The spec, the names of its joints, and what was not imported.

    Raises:
        DescriptionError: the file cannot be used; the message names the line.
        DraftError: the population is unknown, the folder exists or cannot be written, or the spec
            does not load.
    """
    check_population(population)
    path = Path(file)
    folder = Path(out) if out is not None else Path(names.valid(path.stem, "robot"))
    for name in (str(path), str(folder)):
        if not name.isprintable() or any("\ud800" <= letter <= "\udfff" for letter in name):
            raise DraftError(Problem(f"{name!a} is no name in UTF-8", None, "rename it"))
    if os.path.lexists(folder) or folder.name == "..":
        raise DraftError(Problem(f"'{folder}' exists; it is kept", None, "choose another --out"))
    files = translate(path, names.valid(folder.name, "robot"), population)
    _make(folder, files)
    reduced = files.reduced
    return Imported(folder, load(folder), files.joints, dict(reduced.counts), tuple(reduced.notes))


def check_population(population: str | None) -> None:
    """Refuse an unknown population.

    Raises:
        DraftError: it is none of `POPULATIONS`.
    """
    if population is not None and population not in POPULATIONS:
        cause = f"there is no population '{population}'"
        raise DraftError(Problem(cause, None, suggest(population, POPULATIONS, "populations")))


def translate(path: Path, name: str, people: str | None = None, shown: str | None = None) -> Files:
    """Text of the three files for a description, nothing written.

    Raises:
        DescriptionError: the file cannot be used; the message names the line.
    """
    description = describe(path, shown)
    doubts = limits.check(description)
    key = path.stem
    people = people or population_of(description, key)
    reduced = reduce(description, key, people)
    reduced.notes += doubts
    analyse(reduced, key, people)
    require_hinge(description, reduced.root)
    tidy(reduced)
    meshes = Meshes(path.parent)
    shapes = Shapes(reduced, meshes)
    unique = names.Unique()
    bodies = reduced.root.all()[1:]
    classes = motors(bodies, people, reduced.notes, unique)
    guessed = [motor.name for motor in classes if not motor.declared]
    if guessed:
        cause = f"no usable speeds are declared: {len(guessed)} of {len(classes)} classes have the "
        cause += "speed of surveyed robots' joints of such a torque"
        remedy = "state no_load_speed: reduction and armature follow from it"
        reduced.notes.append(Problem(cause, Location(description.file), remedy))
    parameters = Parameters(unique)
    apart = trunk.fixed_head(reduced) if people == "humanoid" else []
    axis, sections = trunk.sections(reduced, apart, shapes, parameters, people)
    head = trunk.head(reduced, apart, shapes, parameters) if apart else None
    tree = Writer(reduced, shapes, people, key, classes, parameters).write()
    if head is not None:
        tree.children.append(head)
    _count(reduced, meshes)
    reduced.notes += sides.notes(parameters.deviations, Location(description.file))
    where = Location(description.file)
    reduced.notes += _few(meshes.notes, where, "meshes were not read")
    reduced.notes += _few(shapes.notes, where, "meshes are likewise not in metres")
    doc = f"{description.name or path.stem}, imported from {path.name}."
    name = f"{name}_robot" if name in shipped() else name
    texts = {
        "parameters.yaml": write.parameters_text(
            name, doc[:390], people, parameters, classes, {"actuator_overlap": OVERLAP}
        ),
        "tree.yaml": write.tree_text(trunk.trunk_name(reduced), tree),
        "root.yaml": write.root_text(axis, sections),
    }
    return Files(texts, tree.joints, reduced, shapes, people)


def spec_of(files: Files) -> Spec:
    """The spec that the files make; nothing is left on the disk."""
    with tempfile.TemporaryDirectory(prefix="draft-twin-") as folder:
        _fill(Path(folder), files)
        return load(folder)


def _make(folder: Path, files: Files) -> None:
    """Make the folder all at once, or nothing: it is filled beside the first folder that exists.

    Raises:
        DraftError: it cannot be made here, or the spec does not load.
    """
    try:
        with new_folder(folder, "choose another place", replace=False) as temporary:
            _fill(temporary, files)
    except (SpecError, ResolveError) as error:
        # The files that the error names are gone: what a person can mend is the description.
        where = Location(files.reduced.description.file)
        found = error.problems[:3]
        gone = re.compile(rf"\S*\.{re.escape(folder.name)}-[^/]*/")
        raise DraftError(
            [
                Problem(f"no spec comes of it: {one.cause}", where, gone.sub("", one.remedy))
                for one in found
            ]
        ) from None


def _fill(folder: Path, files: Files) -> None:
    """Write a spec's folder, and let the filter's errors that are the maker's own pass."""
    write_schemas(folder / SCHEMA_FOLDER)
    for name, text in files.texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    design = load(folder).resolve()
    beyond = [
        f"{finding.id}:{finding.where}"
        for finding in design.findings
        if finding.severity == "error"
    ]
    if beyond:
        lines = "".join(f"  - {item} # {BEYOND}\n" for item in beyond)
        text = files.texts["parameters.yaml"] + lines
        (folder / "parameters.yaml").write_text(text, encoding="utf-8")
        load(folder).resolve()
    report = {
        "file": Path(files.reduced.description.file).name,
        "joints": files.joints,
        "ignored": dict(files.reduced.counts),
        "notes": [str(note) for note in files.reduced.notes],
    }
    text = json.dumps(report, indent=1, ensure_ascii=False) + "\n"
    (folder / REPORT).write_text(text, encoding="utf-8")


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


def _few(notes: list[Problem], where: Location, rest: str) -> list[Problem]:
    """The first notes on meshes, and how many more there are."""
    if len(notes) <= 3:
        return notes
    return [*notes[:2], Problem(f"{len(notes) - 2} more {rest}", where)]
