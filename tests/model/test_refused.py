"""What MuJoCo refuses is explained with the link at fault; what it need not refuse is built."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.errors import ModelError
from draft.model.batch import follows_mujoco
from draft.model.model import at_fault
from tests.written import edit, write_robot


@pytest.mark.parametrize(
    ("old", "new", "name"),
    [
        ('<body name="thigh"', '<body name="thigh" gravcomp="many"', "thigh"),
        ('<joint name="knee"', '<joint name="knee" group="many"', "knee"),
        ('<joint name="knee"', '<geom size="many"/>\n<joint name="knee"', "shank"),
    ],
)
def test_a_refusal_that_gives_a_line_names_the_element_or_its_body(
    tmp_path: Path, old: str, new: str, name: str
) -> None:
    xml = draft.load(write_robot(tmp_path / "robot")).resolve().build().xml
    assert old in xml
    spoilt = xml.replace(old, new, 1)
    with pytest.raises(ValueError, match="line") as refused:
        mujoco.MjModel.from_xml_string(spoilt)
    assert at_fault(" ".join(str(refused.value).split()), spoilt) == name


def test_a_message_without_a_line_names_nothing() -> None:
    assert at_fault("out of memory", "<mujoco/>") == ""
    assert at_fault("Element 'size', line 1", "<mujoco/>") == ""


def test_a_trunk_that_encloses_too_little_is_named(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    text = (robot / "root.yaml").read_text(encoding="utf-8")
    thin = text.replace("rectangle: [0.2, 0.1]", "rectangle: [1e-8, 1e-8]")
    (robot / "root.yaml").write_text(thin, encoding="utf-8")
    with pytest.raises(ModelError, match="'trunk'"):
        draft.load(robot).resolve().build()


def test_feet_above_the_trunk_are_a_finding_and_no_refusal(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    edit(robot, "tree.yaml", "at: [0, 0, -0.2]", "at: [0, 0, 3]")
    design = draft.load(robot).resolve()
    assert "below_floor" in {finding.id for finding in design.findings}
    assert design.build().scene().stat.extent > 0


def test_a_section_at_almost_nothing_is_at_zero(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    edit(robot, "root.yaml", "at: -trunk_length / 2", "at: 1e-300")
    spec = draft.load(robot)
    assert spec.resolve().build().mujoco.nmesh == 1
    if follows_mujoco():
        batch = spec.resolve({"trunk_length": np.array([0.4, 0.5])})
        assert batch.build_batch() is not None
