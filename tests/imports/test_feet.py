"""Size of a sole without shapes: that of the foot's inertia, unless it is a placeholder."""

from __future__ import annotations

import re

import pytest

from tests.imports.biped import biped
from tests.imports.written import imported


def sole(moments: str) -> tuple[float, ...]:
    """Length, width and height of the feet of a biped of whose feet these are the moments [m]."""
    inertia = f'\\1<inertia {moments} ixy="0" ixz="0" iyz="0"/>'
    made = imported(re.sub(r"(ankle_pitch_link.*?)<inertia .*?/>", inertia, biped()))
    parameters = made.spec.resolve().parameters
    return tuple(float(parameters[f"foot_{size}"]) for size in ("length", "width", "height"))


def test_a_sole_is_as_large_as_the_box_with_the_inertia_of_the_foot() -> None:
    """A box of 0.25 x 0.1 x 0.06 m of 1 kg."""
    moments = 'ixx="0.00113333" iyy="0.00550833" izz="0.00604167"'
    assert sole(moments) == pytest.approx((0.25, 0.1, 0.06), abs=2e-4)


def test_a_foot_whose_moments_are_equal_has_a_usual_sole() -> None:
    """They are a placeholder: as a cube of 1 kg, it would be 0.35 m high."""
    assert sole('ixx="0.02" iyy="0.02" izz="0.02"') == pytest.approx((0.2, 0.08, 0.05))
