"""Reading of the folder of a robot into a Spec."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import pydantic

from draft.errors import DraftError, Location, Problem, SpecError, suggest
from draft.extensions import Registry
from draft.files import Content, Readable
from draft.spec import schema
from draft.spec.check import check_spec, design_problems
from draft.spec.expressions import Expression, parse
from draft.spec.field_types import NAME_PATTERN, Model
from draft.spec.links import Link
from draft.spec.part_files import read_parts
from draft.spec.primitives.base import compile_part
from draft.spec.primitives.root import RootFile, Trunk, WrittenRoot, read_root
from draft.spec.problems import NAME_RULE, first_few, translate
from draft.spec.reader import Source, read_file, read_mapping, read_text
from draft.spec.schema import STATED, asks_for_trend
from draft.spec.spec import ActuatorClass, NamedDesign, Parameter, Spec
from draft.spec.tree import expand

MISSING = (
    "a robot is a folder with parameters.yaml, tree.yaml and root.yaml; 'draft new NAME' makes one"
)
FILES = ("parameters.yaml", "tree.yaml")
# Of the trunk; a robot on a fixed base has none.
ROOT_FILE = "root.yaml"
ROBOTS = Path(__file__).resolve().parent.parent / "robots"
_NAME = re.compile(NAME_PATTERN)
_DESIGN = re.compile(r"designs/[^/]+\.yaml")
_File = TypeVar("_File", bound=Model)


# Folders of the robots that are known by name.
FOLDERS: Registry[Path] = Registry("robot")


def robots(folder: str | Path, origin: str) -> None:
    """Let robots be known by name, as the shipped ones are.

        robots(Path(__file__).with_name("robots"), __name__)

    Args:
        folder: folder of the robots; the folder of each has its name.
        origin: name of the module that calls this.

    Raises:
        DraftError: it holds no robot, or a robot of this name exists already.
    """
    found = sorted(path.parent for path in Path(folder).glob("*/parameters.yaml"))
    if not found:
        raise DraftError(f"there is no robot in '{folder}', of {origin}", MISSING)
    for path in found:
        FOLDERS.add(path.name, path.resolve(), origin)


robots(ROBOTS, "draft.robots")


def shipped() -> tuple[str, ...]:
    """Names of the robots that Draft and its extensions ship.

    >>> draft.shipped()
    ('arm', 'biped', 'hand', 'hexapod', 'hopper', 'humanoid', 'quadruped', 'wheeled')
    """
    return tuple(sorted(FOLDERS))


def find(robot: str | Path) -> Path:
    """Folder of a robot, by the name of a shipped one or by its path.

    A robot in a folder of the current one comes before a shipped one of that name.

    Raises:
        SpecError: it is neither a shipped robot nor a folder.
    """
    folder = Path(robot)
    if isinstance(robot, str) and robot in FOLDERS and not os.path.isfile(folder / FILES[0]):
        return FOLDERS[robot]
    if not str(robot).strip():
        remedy = suggest("", shipped(), "shipped robots") + "; '.' is the current folder"
        raise SpecError("no robot is named", remedy)
    # pathlib raises for a name that is too long or a folder without permission; os.path does not.
    if not os.path.isdir(folder):
        what = "is neither a shipped robot nor a folder"
        remedy = suggest(str(robot), shipped(), "shipped robots")
        if os.path.exists(folder):
            what, remedy = (
                "is a file",
                f"give its folder, or a shipped robot: {', '.join(shipped())}",
            )
        raise SpecError(f"'{robot}' {what}", remedy)
    return folder


def load(robot: str | Path) -> Spec:
    """Read a robot into a Spec.

        >>> draft.load("quadruped")
        Spec('quadruped', 14 parameters, 1 actuator class, 12 joints, 3 named designs)

    Args:
        robot: path of a folder with `parameters.yaml`, `tree.yaml` and, unless its base is fixed,
            `root.yaml`, or name of a shipped robot. A folder of that name comes first.

    Raises:
        SpecError: listing every problem found, each with file, line and column.
    """
    folder = find(robot)
    designs = sorted(f"designs/{path.name}" for path in (folder / "designs").glob("*.yaml"))
    file = partial(_inside, folder)
    has_root = os.path.lexists(folder / ROOT_FILE)
    return _spec(file, lambda name: read_file(file(name), MISSING), has_root, designs, folder)


def from_files(files: Mapping[str, str | bytes | Mapping[str, object]]) -> Spec:
    """Make a Spec of files in memory; see `Spec.parse`."""
    content: dict[str, Content] = {}
    for name, given in files.items():
        text = _json(name, given) if isinstance(given, Mapping) else given
        content[name] = Content(name, text.encode() if isinstance(text, str) else text)

    def file(name: str) -> Content:
        if name not in content:
            remedy = suggest(name, content, "files")
            raise SpecError(Problem("file not found", Location(name), remedy))
        return content[name]

    def read(name: str) -> Source:
        how = read_mapping if isinstance(files.get(name), Mapping) else read_text
        return how(file(name).data, name)

    designs = sorted(filter(_DESIGN.fullmatch, content))
    spec = _spec(file, read, ROOT_FILE in content, designs, None)
    if unused := content.keys() - spec.files.keys() - set(designs):
        name = min(unused)
        remedy = suggest(name, [*spec.files, "designs/NAME.yaml"], "files")
        raise SpecError(Problem("a robot has no such file", Location(name), remedy))
    return spec


def _json(name: str, mapping: Mapping[str, object]) -> str:
    """Text of a mapping in memory, which YAML reads too; numbers of NumPy are plain ones."""
    try:
        return json.dumps(mapping, ensure_ascii=False, allow_nan=False, default=_plain)
    except (TypeError, ValueError, RecursionError) as error:
        remedy = "use mappings, lists, texts, numbers, booleans and None"
        raise SpecError(Problem(f"is not plain data: {error}", Location(name), remedy)) from None


def _plain(value: object) -> object:
    """Plain data of what JSON does not know."""
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    raise TypeError(f"it has a value of type {type(value).__name__}")


def _spec(
    file: Callable[[str], Readable],
    read: Callable[[str], Source],
    has_root: bool,
    designs: Iterable[str],
    folder: Path | None,
) -> Spec:
    """Read the files of a robot into a Spec.

    Args:
        file: gives a file by its name in the folder.
        read: reads a YAML file by that name.
        has_root: whether there is a root.yaml.
        designs: names of the files of designs, such as "designs/bear.yaml".
        folder: where they are; None for files in memory.
    """
    parameters_source, tree_source = map(read, FILES)
    parameters_file = validate(schema.ParametersFile, parameters_source)
    tree_file = validate(schema.tree_file(), tree_source)
    names, root = FILES, None
    if isinstance(tree_file.tree, Trunk):
        names = (*FILES, ROOT_FILE)
        root_source = read(ROOT_FILE)
        root = read_root(validate(RootFile, root_source), root_source)
    elif has_root:
        cause = f"a base that is fixed, beside the {ROOT_FILE} of a trunk, which floats"
        remedy = f"delete {ROOT_FILE}, or write 'type: root'"
        raise SpecError(Problem(cause, tree_source.at(("tree", "type")), remedy))
    trends, structure = parameters_file.trends, parameters_file.structure
    further = [name for name in (trends, structure) if name.endswith(".json")]
    further += [parameters_file.catalogue] if parameters_file.catalogue else []
    files = {name: file(name) for name in (*names, *further)}
    actuators = _actuators(parameters_file, parameters_source)
    bodies = expand(tree_file, tree_source)
    parts, meshes = read_parts(bodies, actuators, file)
    _check_trunk(bodies[0].link, root)
    spec = Spec(
        name=parameters_file.name,
        doc=parameters_file.doc or "",
        folder=folder,
        files=files | parts,
        population=parameters_file.population,
        trends=files.get(trends, trends),
        structure=files.get(structure, structure),
        catalogue=files.get(parameters_file.catalogue or ""),
        parameters=_parameters(parameters_file, parameters_source),
        actuators=actuators,
        bodies=bodies,
        root=root,
        designs={Path(name).stem: _design(read(name)) for name in designs},
        allow={
            item: parameters_source.at(("allow", i)) for i, item in enumerate(parameters_file.allow)
        },
        battery=_battery(parameters_file, parameters_source),
        electronics_power=_electronics_power(parameters_file, parameters_source),
        meshes=meshes,
    )
    check_spec(spec)
    return spec


def validate(model: type[_File], source: Source) -> _File:
    """Validate the content of a file against a model.

    Raises:
        SpecError: the problems, each at its place in the file.
    """
    try:
        return model.model_validate(source.data)
    except pydantic.ValidationError as error:
        raise SpecError(translate(error, source)) from None


def read_design(spec: Spec, design: str | Path) -> NamedDesign:
    """Find a named design of a spec, or read a design file.

    Raises:
        SpecError: there is no such design or file, or it has keys that the spec does not define.
    """
    if isinstance(design, str) and design in spec.designs:
        return spec.designs[design]
    if isinstance(design, Path) or design.endswith((".yaml", ".yml")):
        named = _design(read_file(Path(design)))
        problems = first_few(design_problems(spec, named))
        if problems:
            raise SpecError(problems)
        return named
    remedy = suggest(design, spec.designs, "designs") + "; or give the path of a .yaml file"
    raise SpecError(f"'{spec.name}' has no design '{design}'", remedy)


def _inside(folder: Path, name: str) -> Path:
    """Path of a file of a robot; refuse a symbolic link that leads out of its folder."""
    path = folder / name
    if not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder)):
        raise SpecError(
            Problem(
                "this symbolic link leads out of the robot's folder",
                Location(str(path)),
                "copy the file into the folder",
            )
        )
    return path


def _parameters(file: schema.ParametersFile, source: Source) -> dict[str, Parameter]:
    result = {}
    for name, item in file.parameters.items():
        path = ("parameters", name)
        bounds = (item.range[0], item.range[1]) if item.range else None
        value = parse(item.value, source.at((*path, "value")))
        where = source.at(path, key=True)
        result[name] = Parameter(name, value, item.unit, bounds, item.doc, where)
    return result


def _actuators(file: schema.ParametersFile, source: Source) -> dict[str, ActuatorClass]:
    result = {}
    for name, item in file.actuators.items():
        path = ("actuators", name)
        stated: dict[str, Expression] = {}
        for quantity in STATED:
            value = getattr(item, quantity)
            if value is not None and not asks_for_trend(quantity, value):
                stated[quantity] = parse(value, source.at((*path, quantity)))
        by_trend = frozenset(q for q in STATED if asks_for_trend(q, getattr(item, q)))
        where = source.at(path, key=True)
        like_where = source.at((*path, "like"))
        shape = item.shape and compile_part(item.shape, (*path, "shape"), source)
        result[name] = ActuatorClass(
            name, item.doc or "", item.like, stated, where, like_where, by_trend, item.kind, shape
        )
    return result


def _check_trunk(link: Link, root: WrittenRoot | None) -> None:
    """Refuse a trunk whose mass is stated by its density and by its part."""
    part, density = link.shape, root.density if root else None
    if part is not None and part.fields.weighs and density is not None:
        cause = "a 'density' of the trunk, and tree.yaml states the mass of its shape"
        raise SpecError(Problem(cause, density.where, "remove one of them"))


def _battery(file: schema.ParametersFile, source: Source) -> dict[str, Expression]:
    """Numbers of the battery that are stated."""
    if file.battery is None:
        return {}
    return {
        name: parse(value, source.at(("battery", name)))
        for name in type(file.battery).model_fields
        if (value := getattr(file.battery, name)) is not None
    }


def _electronics_power(file: schema.ParametersFile, source: Source) -> Expression | None:
    if file.electronics_power is None:
        return None
    return parse(file.electronics_power, source.at(("electronics_power",)))


def _design(source: Source) -> NamedDesign:
    name = Path(source.file).stem
    if not _NAME.fullmatch(name):
        cause = f"'{name}' is not a design's name"
        raise SpecError(Problem(cause, Location(source.file), NAME_RULE))
    file = validate(schema.DesignFile, source)
    keys = {name: source.at(("values", name), key=True) for name in file.values}
    places = {name: source.at(("values", name)) for name in file.values}
    return NamedDesign(name, file.doc, dict(file.values), keys, places)
