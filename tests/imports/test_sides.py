"""Sides that differ by millimetres share their lengths; sides that truly differ are named."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from draft.design import Design
from draft.imports.importer import Imported, import_robot
from tests.imports.biped import biped
from tests.imports.written import quadruped


def imported(folder: Path, text: str) -> Imported:
    path = folder / "walker.urdf"
    path.write_text(text, encoding="utf-8")
    return import_robot(path, folder / "mine")


def feet(design: Design) -> tuple[float, float]:
    """Heights of the left and the right foot in the trunk's frame, zero pose [m]."""
    frames = {body.name: frame for body, frame in zip(design.bodies, design.frames(), strict=True)}
    left, right = (frames[f"{side}_ankle_pitch_link"][0][2] for side in ("left", "right"))
    return float(left), float(right)


def test_legs_that_differ_by_millimetres_answer_to_one_length(tmp_path: Path) -> None:
    found = imported(tmp_path, biped(right_thigh=0.2529))
    names = found.spec.parameters
    assert "thigh_length" in names
    assert "thigh_length_2" not in names
    left, right = feet(found.spec.resolve())
    assert left - right == pytest.approx(0.0029, abs=1e-6)
    longer = found.spec.resolve({"thigh_length": 0.30})
    assert feet(longer)[0] == pytest.approx(left - 0.05, abs=1e-6)
    assert feet(longer)[1] == pytest.approx(right - 0.05, abs=1e-6)
    assert float(longer.parameters["right_thigh_length_offset"]) == pytest.approx(0.0029)


def test_the_import_says_which_lengths_it_shares(tmp_path: Path) -> None:
    found = imported(tmp_path, biped(right_thigh=0.2529))
    notes = [str(note) for note in found.notes if "differ in" in str(note)]
    assert len(notes) == 1
    assert "right_thigh_length_offset = +2.9 mm" in notes[0]


def test_hips_that_differ_by_millimetres_move_together(tmp_path: Path) -> None:
    found = imported(tmp_path, biped(right_hip=-0.081))
    wider = found.spec.resolve({"leg_y": 0.1})
    at = {body.name: body.position for body in wider.bodies}
    assert float(at["left_hip_yaw_link_housing"][1]) == pytest.approx(0.1)
    assert float(at["right_hip_yaw_link_housing"][1]) == pytest.approx(-0.101)


def test_sides_that_truly_differ_are_named_and_an_edit_of_one_is_warned_of(tmp_path: Path) -> None:
    found = imported(tmp_path, biped(right_thigh=0.28))
    assert {"thigh_length", "right_thigh_length"} <= set(found.spec.parameters)
    notes = [str(note) for note in found.notes if "differ in" in str(note)]
    assert "right_thigh_length" in notes[0]
    assert "edit both" in notes[0]
    edited = found.spec.resolve({"thigh_length": 0.35})
    warned = [one for one in edited.findings if one.id == "uneven_feet"]
    assert len(warned) == 1
    assert warned[0].severity == "warning"
    assert "70 mm" in warned[0].message


def test_even_feet_are_not_warned_of(tmp_path: Path) -> None:
    design = imported(tmp_path, biped()).spec.resolve({"thigh_length": 0.35})
    assert not [one for one in design.findings if one.id == "uneven_feet"]


def test_hind_legs_that_are_no_mirror_image_of_the_front_ones_share_their_distance(
    tmp_path: Path,
) -> None:
    """All knees bend the same way, so that only the places of the legs are mirrored."""
    text = quadruped().replace('xyz="0 0.08 0"', 'xyz="0.05 0.08 0"')
    found = imported(tmp_path, text.replace('xyz="0 -0.08 0"', 'xyz="0.05 -0.08 0"'))
    assert not [note for note in found.notes if "differ" in str(note)]
    wider = found.spec.resolve({"leg_x": 0.25})
    at = {body.name: body.position for body in wider.bodies}
    places = [float(at[f"{leg}_hip_housing"][0]) for leg in ("FL", "FR", "RL", "RR")]
    assert places == pytest.approx([0.25, 0.25, -0.25, -0.25])


def test_four_legs_with_one_of_another_length_answer_to_one_length(tmp_path: Path) -> None:
    text = quadruped().replace('xyz="0 0 -0.22"', 'xyz="0 0 -0.2225"', 1)
    found = imported(tmp_path, text)
    lengths = {name for name in found.spec.parameters if name.endswith("thigh_length")}
    assert lengths == {"thigh_length"}
    offsets = [name for name in found.spec.parameters if name.endswith("thigh_length_offset")]
    assert len(offsets) == 1
    low = min(found.spec.resolve({"thigh_length": 0.3}).mass, 1e9)
    assert low > found.spec.resolve().mass


@pytest.mark.parametrize("axis", ["1 1 0", "1 -1 0"])
def test_axes_that_a_mirror_turns_by_90_degrees_are_the_makers(tmp_path: Path, axis: str) -> None:
    """The ankles of Gym's ant: the reflection of such an axis lies on neither of its sides."""
    other = "1 -1 0" if axis == "1 1 0" else "1 1 0"
    text = re.sub(r'(name="F[LR]_knee".*?<axis xyz=)"0 1 0"', rf'\1"{axis}"', quadruped())
    text = re.sub(r'(name="R[LR]_knee".*?<axis xyz=)"0 1 0"', rf'\1"{other}"', text)
    (tmp_path / "ant.urdf").write_text(text, encoding="utf-8")
    assert import_robot(tmp_path / "ant.urdf", tmp_path / "ant").geometry.joints == 12
