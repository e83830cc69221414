"""Laws of several terms: fits find them, and their signs make them monotone."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.fitting.actuators import catalogue_refit as refit
from draft.fitting.actuators.recipes import SETS as RECIPES
from draft.fitting.actuators.recipes import Recipe, least_squares
from draft.fitting.forms import Form
from draft.laws.actuators import SETS, laws, read_laws
from draft.laws.law import Term, evaluate

seeds = st.integers(0, 2**32 - 1)
DRAFT = laws("draft").trends
# How each quantity moves with its inputs.
SIGNS = {
    "mass": {"peak_torque": 1},
    "volume": {"peak_torque": 1, "gear_ratio": -1},
    "aspect_ratio": {"gear_ratio": 1},
    "gear_ratio": {"no_load_speed": -1},
    "rotor_inertia": {"mass": 1, "radius": 1, "gear_ratio": -1},
}
positive = st.floats(1e-2, 1e4)


@given(
    seeds, st.floats(0.05, 20), st.floats(0.05, 20), st.booleans(), st.sampled_from([False, True])
)
def test_a_known_law_of_two_terms_is_recovered(
    seed: int, first: float, second: float, reciprocal: bool, robust: bool
) -> None:
    x = np.random.default_rng(seed).uniform(-3, 3, size=(40, 1))
    terms = (Term(first, (0.5,)), Term(second, (1.5,)))
    y = np.log(evaluate(terms, reciprocal, [np.exp(x[:, 0])]))
    form = Form(((0.5,), (1.5,)), (1.0, 1.0), reciprocal, robust)
    fitted = form.fit(x, y)
    assert [t.factor for t in fitted] == pytest.approx([first, second], rel=1e-6)


@given(seeds, st.floats(-3, 3), st.floats(0.1, 10))
def test_an_open_exponent_is_recovered_in_spite_of_a_few_wild_rows(
    seed: int, exponent: float, factor: float
) -> None:
    random = np.random.default_rng(seed)
    x = random.uniform(-3, 3, size=(60, 1))
    y = math.log(factor) + exponent * x[:, 0]
    wild = y.copy()
    wild[:4] += random.choice([-1, 1], 4) * 5
    (term,) = Form(((None,),), (1.0, 0.0)).fit(x, wild)
    assert term.exponents[0] == pytest.approx(exponent, abs=0.06)
    assert term.factor == pytest.approx(factor, rel=0.12)


@given(st.sampled_from(sorted(SIGNS)), st.data())
def test_drafts_laws_are_monotone_in_every_input(quantity: str, data: st.DataObject) -> None:
    law = DRAFT[quantity]
    assert dict.fromkeys(law.inputs) == dict.fromkeys(SIGNS[quantity])
    at = [data.draw(positive) for _ in law.inputs]
    which = data.draw(st.integers(0, len(at) - 1))
    more = list(at)
    more[which] *= data.draw(st.floats(1.001, 100))
    assume(more[which] < 1e6)
    assert (law(*more) - law(*at)) * SIGNS[quantity][law.inputs[which]] > 0


def test_drafts_laws_have_the_right_limits() -> None:
    # A module without torque weighs nothing; mass grows like torque in the end.
    assert DRAFT["mass"](1e-12) < 1e-4
    assert DRAFT["mass"](2e9) / DRAFT["mass"](1e9) == pytest.approx(2.0, rel=1e-3)
    # At a very high reduction the motor vanishes and the gears stay.
    assert DRAFT["volume"](100.0, 1e12) == pytest.approx(DRAFT["volume"](100.0, 1e14), rel=1e-3)
    # Length over diameter stays finite, and positive.
    assert 0 < DRAFT["aspect_ratio"](1.0) < DRAFT["aspect_ratio"](1e12) < 1.2
    # No rotor is harder to turn than a ring of the whole module's mass at its radius.
    assert DRAFT["rotor_inertia"](1.0, 1.0, 1.0) < 0.5


def test_no_law_takes_a_vendor_or_a_family() -> None:
    allowed = {"peak_torque", "no_load_speed", "gear_ratio", "mass", "radius"}
    for name in SETS:
        assert {x for law in laws(name).trends.values() for x in law.inputs} <= allowed


@pytest.mark.slow
def test_a_refitted_file_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    refit.write(path)
    mine = read_laws(path)
    assert mine.name == "mine.json"
    assert mine.trends["mass"](50.0) == pytest.approx(DRAFT["mass"](50.0), rel=1e-8)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("text", ["", "{}", "[]", "3", json.dumps({"draft": {"laws": {}}})])
def test_a_file_that_holds_no_trends_is_named(tmp_path: Path, text: str) -> None:
    path = tmp_path / "mine.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DraftError, match=r"mine.json: holds no actuator trends"):
        read_laws(path)
    with pytest.raises(DraftError, match="cannot be read"):
        read_laws(tmp_path / "none.json")


@pytest.mark.slow
def test_a_law_of_an_existing_shape_is_added_by_one_recipe(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The recipe of CONTRIBUTING."""
    speed = Recipe("no_load_speed", ("peak_torque", "mass"), least_squares)
    monkeypatch.setitem(RECIPES, "draft", (*RECIPES["draft"], speed))
    path = tmp_path / "mine.json"
    refit.write(path)
    law = read_laws(path).trends["no_load_speed"]
    assert (law.inputs, law.input_units, law.n) == (("peak_torque", "mass"), ("N m", "kg"), 103)
    assert set(law.held_out) == {"row", "vendor", "family"}
    assert law.band(0.9) > law.band(0.5) > 1.0
    assert 1.0 < law(50.0, 1.0) < 100.0
