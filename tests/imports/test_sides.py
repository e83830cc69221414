"""Sides that differ by millimetres share their lengths; sides that truly differ are named."""

from __future__ import annotations

import re

import pytest

from draft.design import Design
from tests.imports.biped import biped
from tests.imports.written import imported, notes, quadruped


def places(design: Design, names: list[str], axis: int) -> list[float]:
    """Coordinates of bodies in their parents' frames [m]."""
    at = {body.name: body.position for body in design.bodies}
    return [float(at[name][axis]) for name in names]


def feet(design: Design) -> tuple[float, float]:
    """Heights of the left and the right foot in the trunk's frame, zero pose [m]."""
    frames = {body.name: frame for body, frame in zip(design.bodies, design.frames(), strict=True)}
    left, right = (frames[f"{side}_ankle_pitch_link"][0][2] for side in ("left", "right"))
    return float(left), float(right)


def test_legs_that_differ_by_millimetres_answer_to_one_length() -> None:
    found = imported(biped(right_thigh=0.2529))
    assert "thigh_length" in found.spec.parameters
    assert "thigh_length_2" not in found.spec.parameters
    (told,) = notes(found, "differ in")
    assert "right_thigh_length_offset = +2.9 mm" in told
    left, right = feet(found.spec.resolve())
    assert left - right == pytest.approx(0.0029, abs=1e-6)
    longer = found.spec.resolve({"thigh_length": 0.30})
    assert feet(longer) == pytest.approx((left - 0.05, right - 0.05), abs=1e-6)
    assert float(longer.parameters["right_thigh_length_offset"]) == pytest.approx(0.0029)


def test_hips_that_differ_by_millimetres_move_together() -> None:
    wider = imported(biped(right_hip=-0.081)).spec.resolve({"leg_y": 0.1})
    hips = [f"{side}_hip_yaw_link_housing" for side in ("left", "right")]
    assert places(wider, hips, 1) == pytest.approx([0.1, -0.101])


def test_sides_that_truly_differ_are_named_and_an_edit_of_one_is_warned_of() -> None:
    found = imported(biped(right_thigh=0.28))
    assert {"thigh_length", "right_thigh_length"} <= set(found.spec.parameters)
    told = notes(found, "differ in")[0]
    assert "right_thigh_length" in told
    assert "edit both" in told
    edited = found.spec.resolve({"thigh_length": 0.35})
    (warned,) = (one for one in edited.findings if one.id == "uneven_feet")
    assert warned.severity == "warning"
    assert "70 mm" in warned.message


def test_even_feet_are_not_warned_of() -> None:
    design = imported(biped()).spec.resolve({"thigh_length": 0.35})
    assert not [one for one in design.findings if one.id == "uneven_feet"]


def test_hind_legs_that_are_no_mirror_image_of_the_front_ones_share_their_distance() -> None:
    """All knees bend the same way, so that only the places of the legs are mirrored."""
    text = quadruped().replace('xyz="0 0.08 0"', 'xyz="0.05 0.08 0"')
    found = imported(text.replace('xyz="0 -0.08 0"', 'xyz="0.05 -0.08 0"'))
    assert not notes(found, "differ")
    hips = [f"{leg}_hip_housing" for leg in ("FL", "FR", "RL", "RR")]
    wider = found.spec.resolve({"leg_x": 0.25})
    assert places(wider, hips, 0) == pytest.approx([0.25, 0.25, -0.25, -0.25])


def test_four_legs_with_one_of_another_length_answer_to_one_length() -> None:
    text = quadruped().replace('xyz="0 0 -0.22"', 'xyz="0 0 -0.2225"', 1)
    found = imported(text)
    lengths = {name for name in found.spec.parameters if name.endswith("thigh_length")}
    assert lengths == {"thigh_length"}
    offsets = [name for name in found.spec.parameters if name.endswith("thigh_length_offset")]
    assert len(offsets) == 1
    assert found.spec.resolve({"thigh_length": 0.3}).mass > found.spec.resolve().mass


@pytest.mark.parametrize("axis", ["1 1 0", "1 -1 0"])
def test_axes_that_a_mirror_turns_by_90_degrees_are_the_makers(axis: str) -> None:
    """The ankles of Gym's ant: the reflection of such an axis lies on neither of its sides."""
    other = "1 -1 0" if axis == "1 1 0" else "1 1 0"
    text = re.sub(r'(name="F[LR]_knee".*?<axis xyz=)"0 1 0"', rf'\1"{axis}"', quadruped())
    text = re.sub(r'(name="R[LR]_knee".*?<axis xyz=)"0 1 0"', rf'\1"{other}"', text)
    assert imported(text).geometry.joints == 12
