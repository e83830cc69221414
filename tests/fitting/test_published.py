"""Every printed figure of the actuator trends comes out of the shipped tables."""

from __future__ import annotations

import pytest

from draft.fitting.actuators.catalogue_published import figures
from draft.fitting.printed import Figure

FIGURES = figures()
PRINTED = [figure for figure in FIGURES if figure.printed is not None]
# What the paper prints, and what its authors say of it.
PINNED = {
    ("gear_ratio", "coefficient"): "327",
    ("gear_ratio", "exponent of speed"): "-1.066",
    ("gear_ratio", "speed's coefficient"): "228.5",
    ("gear_ratio", "speed's exponent of reduction"): "-0.938",
    ("gear_ratio", "R2"): "0.89",
    ("gear_ratio", "error, row held out"): "1.33",
    ("mass", "coefficient"): "0.0653",
    ("mass", "exponent of peak torque"): "0.666",
    ("mass", "R2"): "0.90",
    ("mass", "error, row held out"): "1.28",
    ("mass", "error, vendor held out"): "1.31",
    ("volume", "one over the coefficient"): "23948",
    ("volume", "exponent of peak torque"): "0.700",
    ("volume", "exponent of gear ratio"): "-0.167",
    ("volume", "stress: coefficient"): "11974",
    ("volume", "stress: exponent of torque"): "0.300",
    ("volume", "stress: exponent of reduction"): "-0.833",
    ("volume", "R2"): "0.87",
    ("volume", "error, row held out"): "1.30",
    ("radius", "error, row held out"): "1.12",
    ("length", "error, row held out"): "1.14",
    ("rotor_inertia", "rows"): "88",
    ("rotor_inertia", "coefficient"): "27.2",
    ("rotor_inertia", "exponent if it is free"): "4.02",
    ("rotor_inertia", "error, row held out"): "1.56",
    ("rotor_inertia", "error at own sizes, row held out"): "1.44",
    ("aspect_ratio", "coefficient"): "0.401",
    ("aspect_ratio", "exponent of peak torque"): "-0.098",
    ("aspect_ratio", "exponent of gear ratio"): "0.316",
    ("aspect_ratio", "R2"): "0.64",
    ("aspect_ratio", "error, row held out"): "1.19",
}


@pytest.mark.parametrize("key", PINNED, ids=": ".join)
def test_a_figure_is_the_printed_one(key: tuple[str, str]) -> None:
    (figure,) = [f for f in FIGURES if (f.quantity, f.name) == key]
    assert figure.printed == PINNED[key]
    assert figure.ours == PINNED[key]


def test_only_the_rotors_variance_differs_from_the_print() -> None:
    assert [f.quantity + " " + f.name for f in PRINTED if not f.same] == ["rotor_inertia R2"]


def test_the_rotors_variance_is_told_for_both_radii_and_not_called_the_same() -> None:
    (figure,) = [f for f in PRINTED if (f.quantity, f.name) == ("rotor_inertia", "R2")]
    through = next(f for f in FIGURES if f.name == "R2 through the predicted radius")
    assert (figure.printed, figure.ours, figure.same) == ("0.84", "0.87", False)
    assert through.value == pytest.approx(0.837, abs=5e-4)
    assert through.source == "ours"
    assert "0.837" in figure.note


def test_the_dozen_actuator_figures_with_more_digits_than_the_text_are_labelled() -> None:
    released = {(f.quantity, f.name) for f in FIGURES if f.source == "released data"}
    exponents = {key for key in PINNED if "exponent" in key[1] and key[0] != "rotor_inertia"}
    long = {("gear_ratio", "speed's coefficient"), ("volume", "one over the coefficient")}
    assert released == exponents | long | {("volume", "stress: coefficient")}
    assert len(released) == 12
    assert {f.source for f in FIGURES if f.printed is None} == {"ours"}
    assert {f.source for f in PRINTED} == {"paper", "released data"}


@pytest.mark.parametrize(
    ("published", "value", "same"),
    [
        ("1.28", 1.2769, True),
        ("1.28", 1.2744, False),
        ("-0.938", -0.93812, True),
        ("-0.938", -0.9386, False),
        ("0.84-0.87", 0.8724, True),
        ("0.84-0.87", 0.881, False),
        ("103", 103.0, True),
        (None, 5.0, True),
        ("1.28", None, False),
        (None, None, True),
    ],
)
def test_a_figure_is_the_same_where_it_rounds_to_the_printed_digits(
    published: str | None, value: float | None, same: bool
) -> None:
    assert Figure("mass", "R2", published, value).same is same


@pytest.mark.parametrize("how", ["vendor", "family"])
def test_drafts_forms_err_less_than_the_published_on_every_quantity(how: str) -> None:
    scores = [f for f in FIGURES if f.name == f"error, {how} held out"]
    assert len(scores) == 7
    for figure in scores:
        assert figure.draft is not None
        assert figure.value is not None
        assert figure.draft < figure.value, figure.quantity
