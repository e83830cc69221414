"""The crouch of legs whose hip pitch slants, as on humanoids with motors in the pelvis."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.design.legs import crouch

BIPED = Path(draft.__file__).parent / "robots/biped"


def slanting(degrees: float, folder: Path) -> Path:
    """The shipped biped with hip pitch, roll and yaw in this order, and the pitch's axis slanting.

    Args:
        degrees: angle from the axis of the knee, in the plane of both hips [deg].
        folder: folder of its files.
    """
    shutil.copytree(BIPED, folder, dirs_exist_ok=True)
    y, z = math.cos(math.radians(degrees)), -math.sin(math.radians(degrees))
    file = folder / "tree.yaml"
    text = file.read_text(encoding="utf-8")
    for old, new in (
        ("hip_yaw, axis: z, range: [-1, 1]", f"first, axis: [0, {y}, {z}], range: [-2, 2]"),
        ("hip_pitch, axis: y, range: [-2, 1.2]", "last, axis: z, range: [-2, 2]"),
        (", home: -knee_bend / 2", ""),
        (", home: knee_bend", ""),
    ):
        assert old in text
        text = text.replace(old, new)
    file.write_text(text, encoding="utf-8")
    return folder


@pytest.mark.parametrize("degrees", [0, 20, 30, 45, 55])
def test_feet_are_level_and_below_slanting_hips(degrees: float, tmp_path: Path) -> None:
    """Up to 18 degrees an axis counts as parallel, and the feet turn aside by that much."""
    design = draft.load(slanting(degrees, tmp_path)).resolve()
    model = mujoco.MjModel.from_xml_string(design.build().xml)
    data = mujoco.MjData(model)
    data.qpos[3] = 1.0
    for name, angle in crouch(design).items():
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    for side, out in (("left", 1.0), ("right", -1.0)):
        knee, ankle = (data.joint(f"{side}_{name}") for name in ("knee", "ankle_pitch"))
        np.testing.assert_allclose(knee.xaxis, (0.0, 1.0, 0.0), atol=1e-9)
        foot = data.body(f"{side}_foot").xmat.reshape(3, 3)
        np.testing.assert_allclose(foot, np.eye(3), atol=1e-9)
        hip = data.joint(f"{side}_first").xanchor
        assert abs(ankle.xanchor[0] - hip[0]) < 0.03
        assert out * ankle.xanchor[1] > 0
        assert hip[2] > knee.xanchor[2] > ankle.xanchor[2]


def test_many_designs_crouch_as_each_alone(tmp_path: Path) -> None:
    """Also where some hips slant and others count as parallel."""
    file = slanting(0, tmp_path) / "tree.yaml"
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace("[0, 1.0, -0.0]", "[0, 1, -slope]"), encoding="utf-8")
    file = tmp_path / "parameters.yaml"
    text, old = file.read_text(encoding="utf-8"), "  # derived"
    new = "  slope: {value: 0, unit: 1, range: [0, 2], doc: Of the hip pitch's axis.}\n" + old
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    spec, slopes = draft.load(tmp_path), np.array([0.0, 0.2, 0.6, 1.4])
    together = crouch(spec.resolve({"slope": slopes}))
    for i, slope in enumerate(slopes):
        alone = crouch(spec.resolve({"slope": slope}))
        for name, angle in together.items():
            assert np.broadcast_to(angle, len(slopes))[i] == pytest.approx(alone[name], abs=1e-12)
    assert np.ptp(together["left_hip_roll"]) > 0.05


def test_a_knee_whose_range_is_symmetric_moves_toward_the_toes(tmp_path: Path) -> None:
    """As on robots whose descriptions limit no joint; the axis may point either way."""
    for axis, sign in (("y", 1), ("[0, -1, 0]", -1)):
        folder = tmp_path / str(sign)
        shutil.copytree(BIPED, folder)
        file = folder / "tree.yaml"
        text = file.read_text(encoding="utf-8")
        old = "knee, axis: y, range: [0, 2.5]"
        assert old in text
        file.write_text(text.replace(old, f"knee, axis: {axis}, range: [-3, 3]"), encoding="utf-8")
        angles = crouch(draft.load(folder).resolve())
        assert sign * angles["left_knee"] > 0.5
        assert sign * angles["right_knee"] > 0.5
