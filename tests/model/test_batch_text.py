"""Fields of N models from their texts are those of the texts compiled one by one."""

from __future__ import annotations

import copy
import re
from typing import Any

import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

import draft
from draft.errors import DraftError
from draft.model.batch_text import FIELDS, read_fields
from draft.model.mjcf import robot_texts
from draft.model.texts import Text, of_template, with_template
from draft.model.xml import parse
from tests.model.test_batch import MIXED, SHIPPED, TOLERANCE, error, inertias, mixed, values_of

COUNT = 5


def texts_of(name: str, count: int = COUNT) -> list[str]:
    """Texts of the first accepted designs of some that are drawn at random."""
    spec = mixed() if name == MIXED else draft.load(name)
    design = spec.resolve(values_of(spec, 40 * count, 0.2))
    return [design[row].build().xml for row in np.flatnonzero(design.accepted)[:count]]


def names_of(texts: list[str]) -> list[str]:
    return [f"body {i}" for i in range(len(texts))]


def read(texts: list[str]) -> tuple[mujoco.MjModel, dict[str, NDArray[Any]]]:
    return read_fields(with_template([Text(text) for text in texts]), names_of(texts))


def assert_same(texts: list[str]) -> None:
    """Fields of all texts, and those that are not returned are those of the first."""
    first, fields = read(texts)
    solid = first.geom_type != mujoco.mjtGeom.mjGEOM_MESH
    for row, text in enumerate(texts):
        alone = mujoco.MjModel.from_xml_string(text)
        found = copy.copy(first)
        for name, values in fields.items():
            getattr(found, name)[:] = values[row]
        for one, other in zip(inertias(alone)[1:], inertias(found)[1:], strict=True):
            assert error(one, other) <= TOLERANCE, row
        for name in set(FIELDS) - {"body_iquat"}:
            held, own = getattr(found, name), getattr(alone, name)
            if name.startswith("geom_"):
                held, own = held[solid], own[solid]
            assert error(own, held) <= TOLERANCE, (row, name)


@pytest.mark.parametrize("name", [*SHIPPED, MIXED])
def test_fields_of_texts_are_those_of_the_models(name: str) -> None:
    assert_same(texts_of(name))


def test_texts_are_one_template_and_their_numbers() -> None:
    design = draft.load("quadruped").resolve(values_of(draft.load("quadruped"), 200, 0.2))
    texts = robot_texts(design, np.flatnonzero(design.accepted)[:COUNT])
    template, numbers = texts[0].template, np.stack([text.numbers for text in texts])
    assert {text.template for text in texts} == {template}
    assert len(set(numbers[:, 0])) > 1
    written = [design[row].build().xml for row in np.flatnonzero(design.accepted)[:COUNT]]
    assert [str(text) for text in texts] == written
    assert of_template(template, numbers[:2]) == texts[:2]
    with pytest.raises(ValueError, match="have a place"):
        of_template(template, numbers[:, 1:])
    packed = with_template([Text(text) for text in written])
    assert {one.template for one in packed} == {packed[0].template}
    assert packed == texts


def test_texts_that_differ_in_more_than_numbers_have_no_template() -> None:
    first, second = texts_of("hopper", 2)
    for odd in (second.replace("<worldbody>", "<worldbody >"), second.replace("body_", "corpus_")):
        assert odd != second
        assert with_template([Text(first), Text(odd)])[1].template == odd
    named = first.replace('model="hopper"', 'model="%.10g"')
    other = named.replace('pos="0 0', 'pos="1 0')
    assert [str(one) for one in with_template([Text(named), Text(other)])] == [named, other]


def test_a_text_reads_back_as_it_was_written() -> None:
    for text in texts_of(MIXED, 1):
        root = parse(text)
        assert root.text() == text


@pytest.mark.parametrize(
    "text", ["", "<a>", "<a/><b/>", "<a/>\n<b/>", "<a>\n</b>", "<a>\n  <b/>", "word", "<a x/>"]
)
def test_what_is_no_element_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="element"):
        parse(text)


def test_a_text_of_another_form_is_compiled_alone() -> None:
    texts = texts_of("quadruped", 3)
    # The same model, written otherwise; and a frame that the first has no attribute for.
    texts[1] = texts[1].replace("\n", " ")
    texts[2] = texts[2].replace('<site name="imu"', '<site pos="0.01 0 0" name="imu"')
    assert_same(texts)


def test_all_may_be_of_another_form() -> None:
    assert_same([text.replace("\n", " ") for text in texts_of("quadruped", 3)])


def test_a_text_that_differs_in_more_than_numbers_is_refused() -> None:
    first, second = texts_of("quadruped", 2)
    longer = re.sub(r'type="sphere"(.*)size="(\S+)"', r'type="capsule"\1size="\2 0.01"', second)
    renamed = second.replace('"imu"', '"other"')
    for text, what in ((longer, "geom_type"), (renamed, "names")):
        assert text != second
        with pytest.raises(DraftError, match=rf"body 1 differs from body 0 in .*{what}"):
            read([first, text])


def test_a_text_that_mujoco_refuses_is_named() -> None:
    first, second = texts_of("quadruped", 2)
    with pytest.raises(DraftError, match="MuJoCo does not accept the model of body 1"):
        read([first, second.replace("<worldbody>", "<elsewhere>")])
