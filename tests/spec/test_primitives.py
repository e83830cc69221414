"""Every primitive is one module and stands in the one list."""

from __future__ import annotations

import inspect
import pkgutil
from importlib import import_module
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.spec import primitives
from draft.spec.primitives import LINKS
from draft.spec.primitives.base import End
from draft.spec.primitives.basic import LinkBase
from tests.helpers import leg, robot

# A link that ends in each primitive, with its words.
ENDS = {
    "sphere": {"type": "sphere", "sphere": {"radius": 0.02, "site": "at"}},
    "foot": {
        "type": "foot",
        "plate": {"length": 0.2, "width": 0.08, "thickness": 0.02, "offset": 0.03, "site": "at"},
    },
    "box": {
        "type": "box",
        "box": {"size": [0.1, 0.2, 0.3], "mass": 1.0, "shift": [0.1, 0.2, 0.3], "site": "at"},
    },
    "wheel": {
        "type": "wheel",
        "wheel": {"radius": 0.1, "width": 0.04, "axis": "y", "density": 464.0, "site": "at"},
    },
}
TYPES = sorted(link.type_name() for link in LINKS.values() if link.end is not None)
signs = st.tuples(*[st.sampled_from([-1.0, 1.0])] * 3)


def _end(kind: str) -> tuple[draft.Design, End]:
    shank: dict[str, Any] = {"sphere": None, **ENDS[kind]}
    if kind == "wheel":
        shank["joint"] = {"name": "roll", "axis": "y", "actuator": "leg"}
    design = robot(leg(shank=shank)).resolve()
    end = design.bodies[-1].link.end
    assert end is not None
    return design, end


def test_every_link_of_the_package_is_in_the_list_once() -> None:
    found = set()
    for item in pkgutil.iter_modules(primitives.__path__):
        module = import_module(f"{primitives.__name__}.{item.name}")
        kinds = inspect.getmembers(module, inspect.isclass)
        own = [kind for _, kind in kinds if kind.__module__ == module.__name__]
        found |= {kind for kind in own if issubclass(kind, LinkBase) and kind is not LinkBase}
    assert found == set(LINKS.values())
    assert len(LINKS) == len(found)


def test_types_keys_and_suffixes_of_primitives_differ() -> None:
    ends = [link.end for link in LINKS.values() if link.end is not None]
    assert [link.type_name() for link in LINKS.values()] == [*LINKS]
    assert len({end.key for end in ends}) == len(ends)
    assert set(ENDS) == set(TYPES)


@pytest.mark.parametrize("kind", TYPES)
@given(signs=signs)
def test_two_reflections_are_none_and_one_changes_no_size(
    kind: str, signs: tuple[float, float, float]
) -> None:
    _, end = _END[kind]
    once = end.mirrored(signs)
    assert once.mirrored(signs) == end
    assert once.mass == end.mass
    here, there = end.geom((0.0, 0.0, 0.0), 1.0), once.geom((0.0, 0.0, 0.0), 1.0)
    assert there.size == here.size
    assert there.inertia == here.inertia
    assert there.volume == here.volume


@pytest.mark.parametrize("kind", TYPES)
def test_every_site_that_is_named_has_a_place_in_the_model(kind: str) -> None:
    design, end = _END[kind]
    model = design.build().mujoco
    body = design.bodies[-1]
    for suffix, place in zip(end.sites, end.site_places(body.link.tip), strict=True):
        assert model.site(f"at{suffix}").pos == pytest.approx(place)
    assert model.nsite == len(end.sites) + 1  # and the trunk's


_END = {kind: _end(kind) for kind in TYPES}
