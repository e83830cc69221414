"""The JSON Schemas that ship with Draft, and keys that no file knows."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

import draft
from draft.errors import DraftError, SpecError
from draft.spec.jsonschema import FILES, SCHEMAS, schema_text, write_schemas
from draft.spec.load import ROBOTS
from draft.spec.reader import read_file
from tests.written import edit, write_robot

SHIPPED = sorted(ROBOTS.rglob("*.yaml"))
MODELINE = re.compile(r"# yaml-language-server: \$schema=(\S+)")


def schema_of(path: Path) -> Path:
    """Schema that a file's first line names."""
    found = MODELINE.fullmatch(path.read_text(encoding="utf-8").splitlines()[0])
    assert found, f"{path} does not begin with a schema line"
    return path.parent / found[1]


def label(path: Path) -> str:
    return str(path.relative_to(ROBOTS))


def test_some_robots_are_shipped() -> None:
    assert len(SHIPPED) >= 6


@pytest.mark.parametrize("name", FILES)
def test_a_shipped_schema_is_what_the_models_say(name: str) -> None:
    shipped = (SCHEMAS / f"{name}.json").read_text(encoding="utf-8")
    assert shipped == schema_text(name), "run: python -m draft.spec.jsonschema"


def test_no_schema_is_shipped_beside_those() -> None:
    assert {path.stem for path in SCHEMAS.iterdir()} == set(FILES)


@pytest.mark.parametrize("path", SHIPPED, ids=label)
def test_a_shipped_file_names_its_schema(path: Path) -> None:
    kind = "design" if path.parent.name == "designs" else path.stem
    assert schema_of(path).resolve() == SCHEMAS / f"{kind}.json"


@pytest.mark.parametrize("path", SHIPPED, ids=label)
def test_a_shipped_file_follows_its_schema(path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads(schema_of(path).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    errors = jsonschema.Draft202012Validator(schema).iter_errors(read_file(path).data)
    assert [f"{error.json_path}: {error.message}" for error in errors] == []


def spoiled(data: Any, step: tuple[str | int, ...], key: str, value: object) -> Any:
    """Data with one key changed in the mapping at a path."""
    here = data
    for part in step:
        here = here[part]
    here[key] = value
    return data


@pytest.mark.parametrize(
    ("step", "key", "value"),
    [
        ((), "tre", {}),
        (("tree",), "type", "basic"),
        (("chains", "leg", 1), "join", {}),
        (("chains", "leg", 1, "joint"), "axis", "w"),
        (("chains", "leg", 1, "joint"), "axis", [1, 2]),
        (("chains", "leg", 1, "joint"), "range", 3),
        (("chains", "leg", 1, "link"), "segment", "leg"),
        (("chains", "leg", 2), "type", "basic"),
        (("chains", "leg", 2, "sphere"), "radius", None),
        (("tree", "children", 0), "mirror", "z"),
        (("tree", "children", 0), "chain", 3),
    ],
)
def test_the_schema_and_the_reader_refuse_the_same(
    tmp_path: Path, step: tuple[str | int, ...], key: str, value: object
) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    robot = write_robot(tmp_path / "robot")
    data = spoiled(read_file(robot / "tree.yaml").data, step, key, value)
    (robot / "tree.yaml").write_text(yaml.safe_dump(data), encoding="utf-8")
    assert not jsonschema.Draft202012Validator(json.loads(schema_text("tree"))).is_valid(data)
    with pytest.raises(SpecError):
        draft.load(robot)


# Each puts an unknown key beside a known one: file, known text, what stands there instead.
UNKNOWN = {
    "parameters file": ("parameters.yaml", "name: mono", "nmae: 1\nname: mono", "1:1"),
    "parameter": ("parameters.yaml", "{value: 0.40", "{valeu: 1, value: 0.40", "7:18"),
    "actuator": ("parameters.yaml", "    gear_ratio", "    gear_rato: 1\n    gear_ratio", "13:5"),
    "tree file": ("tree.yaml", "tree:\n", "tre: 1\ntree:\n", "14:1"),
    "trunk": ("tree.yaml", "  type: root", "  tpye: root\n  type: root", "16:3"),
    "chain use": ("tree.yaml", "{chain: leg,", "{prefx: a, chain: leg,", "18:8"),
    "basic link": ("tree.yaml", "- name: housing", "- nmae: a\n      name: housing", "3:7"),
    "sphere link": ("tree.yaml", "type: sphere", "type: sphere\n      jiont: 1", "11:7"),
    "joint": ("tree.yaml", "{name: knee,", "{nmae: a, name: knee,", "11:15"),
    "member": ("tree.yaml", "length: thigh_length", "length: 1, lenght: 2", "7:35"),
    "motor": ("tree.yaml", "{actuator: leg, axis: x}", "{actuator: leg, axis: x, axs: y}", "4:39"),
    "sphere": ("tree.yaml", "{radius: foot", "{raduis: 1, radius: foot", "13:16"),
    "root file": ("root.yaml", "axis: x", "axs: x\naxis: x", "1:1"),
    "section": ("root.yaml", "{at: trunk", "{chamfr: 0.1, at: trunk", "4:6"),
    "design": ("designs/long.yaml", "values:", "value: 1\nvalues:", "2:1"),
}


@pytest.mark.parametrize(("file", "old", "new", "where"), UNKNOWN.values(), ids=UNKNOWN)
def test_an_unknown_key_is_an_error_at_every_level(
    tmp_path: Path, file: str, old: str, new: str, where: str
) -> None:
    robot = write_robot(tmp_path / "robot")
    edit(robot, file, old, new)
    with pytest.raises(SpecError) as caught:
        draft.load(robot)
    (problem,) = caught.value.problems
    assert problem.cause.startswith("unknown key '")
    assert problem.remedy.startswith("did you mean '")
    assert str(problem.where) == f"{robot / file}:{where}"


def test_unknown_keys_of_plates_and_pulleys_are_errors_too(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    edit(robot, "tree.yaml", "type: sphere", "type: foot\n      pulley: {raduis: 1}")
    edit(robot, "tree.yaml", "sphere: {radius: foot_radius", "plate: {lenght: 1")
    with pytest.raises(SpecError) as caught:
        draft.load(robot)
    assert [problem.cause for problem in caught.value.problems] == [
        "unknown key 'raduis' in chains.leg[2].pulley",
        "unknown key 'lenght' in chains.leg[2].plate",
    ]


def test_schemas_are_written_to_a_folder(tmp_path: Path) -> None:
    paths = write_schemas(tmp_path / "new" / "folder")
    assert {path.name for path in paths} == {f"{name}.json" for name in FILES}
    assert all(json.loads(path.read_text())["additionalProperties"] is False for path in paths)


def test_schemas_are_not_written_over_a_file(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with pytest.raises(DraftError, match="cannot write"):
        write_schemas(tmp_path / "file")
    assert (tmp_path / "file").read_text() == "kept"
