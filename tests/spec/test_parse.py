"""Specs of files in memory are those of the same files in a folder, with the same errors."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import draft
from draft.spec.load import ROBOTS
from tests.helpers import BOX
from tests.model.shipped import built

PARAMETERS = "name: crate\npopulation: quadruped\nparameters: {}\nactuators: {}\n"
TREE = {"tree": {"name": "trunk", "type": "root"}}
CRATE = {"parameters.yaml": PARAMETERS, "tree.yaml": TREE, "root.yaml": BOX}


def texts(folder: Path) -> dict[str, str]:
    """Texts of the files of a robot's folder by name."""
    files = [*folder.glob("*.yaml"), *folder.glob("designs/*.yaml")]
    return {f.relative_to(folder).as_posix(): f.read_text(encoding="utf-8") for f in files}


def causes(files: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Places and causes of the problems of files in memory."""
    with pytest.raises(draft.SpecError) as caught:
        draft.Spec.parse(files)
    return [(str(one.where), one.cause) for one in caught.value.problems]


@pytest.mark.parametrize("name", draft.shipped())
def test_texts_and_mappings_give_the_spec_of_the_folder(name: str) -> None:
    folder = draft.load(name)
    written = texts(ROBOTS / name)
    mapped = {file: yaml.safe_load(text) for file, text in written.items()}
    for files in (written, mapped):
        spec = draft.Spec.parse(files)
        assert spec.folder is None
        assert list(spec.designs) == list(folder.designs)
        for design in (None, *spec.designs):
            mine, theirs = spec.resolve(design), built(name, design)
            assert mine.build().xml == theirs.xml
            assert [str(f) for f in mine.findings] == [str(f) for f in theirs.design.findings]


def test_an_error_in_a_text_has_the_line_that_it_has_in_the_folder(tmp_path: Path) -> None:
    broken = texts(ROBOTS / "hopper")
    for name, old, new in (
        ("parameters.yaml", "population:", "populace:"),
        ("tree.yaml", "length: thigh_length", "length: 2*thigh_lenth"),
    ):
        assert old in broken[name]
        files = broken | {name: broken[name].replace(old, new, 1)}
        for file, text in files.items():
            (tmp_path / file).parent.mkdir(exist_ok=True)
            (tmp_path / file).write_text(text, encoding="utf-8")
        with pytest.raises(draft.SpecError) as caught:
            draft.load(tmp_path)
        expected = str(caught.value).replace(f"{tmp_path}/", "")
        with pytest.raises(draft.SpecError) as caught:
            draft.Spec.parse(files)
        assert str(caught.value) == expected


def test_an_error_in_a_mapping_has_the_keys_that_lead_to_it() -> None:
    thigh = {"name": "rod", "link": {"axis": "-z", "length": "lenth", "mass": 1}}
    tree = {"tree": {**TREE["tree"], "children": [thigh]}}
    ((where, cause),) = causes(CRATE | {"tree.yaml": tree})
    assert where == "tree.yaml[tree][children][0][link][length]"
    assert "lenth" in cause


def test_mappings_may_hold_numbers_of_numpy_and_tuples() -> None:
    sections = tuple(
        {"at": at, "rectangle": np.array([0.2, 0.1])} for at in np.linspace(-0.2, 0.2, 2)
    )
    spec = draft.Spec.parse(CRATE | {"root.yaml": {"axis": "x", "sections": sections}})
    assert spec.resolve().mass == draft.Spec.parse(CRATE).resolve().mass


@pytest.mark.parametrize(
    ("files", "problem"),
    [
        ({"tree.yml": "", "parameters.yaml": ""}, ("tree.yaml", "file not found")),
        (CRATE | {"designs/big.yml": "values: {}"}, ("designs/big.yml", "has no such file")),
        (CRATE | {"tree.yaml": {"tree": {1, 2}}}, ("tree.yaml", "a value of type set")),
        (CRATE | {"tree.yaml": {"tree": float("nan")}}, ("tree.yaml", "is not plain data")),
        (CRATE | {"tree.yaml": b"\xff"}, ("tree.yaml", "byte 0 is not UTF-8")),
        (CRATE | {"tree.yaml": "a: 1\nb: *a"}, ("tree.yaml:2:4", "alias '*a' is not allowed")),
        (
            CRATE | {"parameters.yaml": f"{PARAMETERS}trends: mine.json"},
            ("mine.json", "file not found"),
        ),
    ],
)
def test_what_is_no_robot_is_refused(files: dict[str, Any], problem: tuple[str, str]) -> None:
    place, cause = causes(files)[0]
    assert place == problem[0]
    assert problem[1] in cause


def test_a_mapping_that_holds_itself_is_refused() -> None:
    tree: dict[str, Any] = {}
    tree["tree"] = tree
    ((where, cause),) = causes(CRATE | {"tree.yaml": tree})
    assert (where, "not plain data" in cause) == ("tree.yaml", True)
