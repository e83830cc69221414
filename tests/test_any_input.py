"""Whatever stands anywhere in the files: a design, a refusal or a message, never a traceback."""

from __future__ import annotations

import copy
import json
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from draft.cli import main
from tests.mutations import FILES, PLACES, Place, spoiled


def check(data: dict[str, Any]) -> tuple[int, str, str]:
    """Exit code, output and errors of `draft check`."""
    with tempfile.TemporaryDirectory() as folder:
        for file, content in data.items():
            text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
            (Path(folder) / file).write_text(text, encoding="utf-8")
        with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
            code = main(["check", folder])
    return code, out.getvalue(), err.getvalue()


EXTREMES = [
    (("tree.yaml", "chains", "leg", 2, "sphere", "radius"), 1e-300),
    (("parameters.yaml", "actuators", "leg", "gear_ratio"), 1e-300),
    (("parameters.yaml", "actuators", "leg", "no_load_speed"), 1e300),
    (("root.yaml", "sections", 1, "rectangle", 1), 1e300),
]


@pytest.mark.parametrize(("place", "value"), EXTREMES)
def test_an_extreme_number_is_answered(place: Place, value: float) -> None:
    check_in_words(spoiled(place, value))


COUNTS = st.sampled_from([0, 1, 2, 63, 64, 65, 199, 200, 201, 499, 500, 501, 1500])
NAMES = [
    "a", "floor", "world", "imu", "trunk", "trunk_trunk", "thigh", "thigh_link", "thigh_link_far",
    "shank_end", "floating_base", "home", "foot", "hip", "_", "é", "a" * 64, "a" * 65,
]  # fmt: skip


def shaped(shape: str, count: int) -> dict[str, Any]:
    """The sound robot with one thing very often."""
    data: Any = copy.deepcopy(FILES)
    parameters, tree = data["parameters.yaml"], data["tree.yaml"]
    chains, children = tree["chains"], tree["tree"]["children"]
    if shape == "chains in chains":
        for i in range(count):
            chains[f"c{i}"] = [{"chain": f"c{i + 1}" if i + 1 < count else "leg"}]
        children[0]["chain"] = "c0" if count else "leg"
    elif shape == "links in a row":
        chains["leg"] = [{"name": f"n{i}"} for i in range(count)] + chains["leg"]
    elif shape == "children of the trunk":
        children += [{"name": f"n{i}", "at": [0.01 * i, 0, 0]} for i in range(count)]
    elif shape == "copies":
        children += [{"chain": "leg", "prefix": f"p{i}_", "mirror": "y"} for i in range(count // 9)]
    elif shape == "children of children":
        here = children
        for i in range(min(count, 201)):
            here.append({"name": f"n{i}", "children": []})
            here = here[-1]["children"]
    elif shape == "parameters in a row":
        for i in range(count):
            value = f"p{i - 1}" if i else 1
            declared = {"value": value, "unit": "m", "range": [0, 2], "doc": "One of many."}
            parameters["parameters"][f"p{i}"] = declared
    elif shape == "actuators":
        for i in range(count):
            parameters["actuators"][f"a{i}"] = parameters["actuators"]["leg"]
    return data


SHAPES = [
    "chains in chains", "links in a row", "children of the trunk", "copies",
    "children of children", "parameters in a row", "actuators",
]  # fmt: skip


def check_in_words(data: dict[str, Any]) -> int:
    """Check data whose dictionaries stand in several places, written out in each."""
    code, out, err = check(json.loads(json.dumps(data)))
    assert code in (0, 1, 2)
    assert (code == 2) == err.startswith("error: ")
    assert (code == 2) == (out == "")
    return code


@pytest.mark.slow
@settings(max_examples=30)
@given(shape=st.sampled_from(SHAPES), count=COUNTS)
@example("chains in chains", 1500)
@example("links in a row", 1200)
@example("children of children", 201)
def test_any_size_of_a_tree_is_answered(shape: str, count: int) -> None:
    check_in_words(shaped(shape, count))


@given(place=st.sampled_from([p for p in PLACES if p[-1] in ("name", "site")]), data=st.data())
def test_any_names_that_meet_are_answered(place: Place, data: st.DataObject) -> None:
    spoilt = spoiled(place, data.draw(st.sampled_from(NAMES)))
    spoilt["tree.yaml"]["tree"]["name"] = data.draw(st.sampled_from(NAMES))
    check_in_words(spoilt)
