"""What a twin's report says of a large error of M(q), and of the knees' motors."""

from __future__ import annotations

import pytest

from draft.imports.options import Options
from draft.imports.stated import Stated
from draft.twins.compare import Comparison, compare_twin
from tests.commands import line, printed
from tests.imports.biped import biped
from tests.imports.written import LEGS, link, quadruped, written

BOX = '<collision><origin xyz="{}"/><geometry><box size="{}"/></geometry></collision>'


def twin(text: str) -> Comparison:
    return compare_twin(written(text), poses=20)


def heavy(group: str) -> str:
    """A quadruped of which the links of a group weigh 25 kg each."""
    text = quadruped()
    for leg in LEGS:
        text = text.replace(link(f"{leg}_{group}", 1.0), link(f"{leg}_{group}", 25.0))
    return text


@pytest.mark.parametrize(("group", "kind"), [("calf", "shank"), ("thigh", "thigh")])
def test_a_large_error_is_blamed_on_the_group_that_causes_it(group: str, kind: str) -> None:
    found = twin(heavy(group))
    assert found.inertia.median > 40
    worst = found.causes[0]
    assert worst.group == kind
    assert set(worst.links) == {f"{leg}_{group}" for leg in LEGS}


def test_the_causes_of_a_robot_hung_on_its_torso_are_its_own_bodies() -> None:
    elbow = "left_elbow_link"
    found = twin(biped().replace(link(elbow), link(elbow, 40.0)))
    assert elbow in found.causes[0].links


def knee_boxes(size: str) -> str:
    text = quadruped()
    for leg in LEGS:
        plain = link(f"{leg}_thigh")
        box = BOX.format("0 0 -0.22", size)
        text = text.replace(plain, plain.replace("</link>", f"{box}</link>"))
    return text


def test_a_knee_wide_enough_for_a_motor_has_one() -> None:
    found = twin(knee_boxes("0.12 0.08 0.12"))
    assert found.files.knees.place == "knee"
    assert found.other_knees is not None
    assert found.other_knees.place == "hip"
    assert found.other_knees.change > 10


def test_a_slim_knee_is_driven_from_the_hip() -> None:
    assert twin(knee_boxes("0.03 0.03 0.03")).files.knees.place == "hip"


def test_a_knee_beside_its_hip_is_no_sign_of_a_motor_there() -> None:
    """Seventy millimetres beside, without shapes: most surveyed robots drive it from the hip."""
    found = twin(quadruped().replace('xyz="0 0 -0.22"', 'xyz="0 0.07 -0.22"'))
    assert found.files.knees.place == "hip"
    assert "70 mm beside its hip" in found.files.knees.why


def test_the_knees_motors_may_be_stated() -> None:
    path = written(quadruped())
    for place in ("hip", "knee"):
        found = compare_twin(path, options=Options(knee_drive=place, torque=Stated()), poses=20)
        assert found.files.knees.place == place
        assert found.other_knees is not None
        assert found.other_knees.place != place


def test_the_report_shows_both_places_and_the_group_behind_a_large_error() -> None:
    out = line(printed("twin", written(heavy("calf")), "--poses", "20"))
    assert "knees driven at the hip" in out
    assert "--knee-drive knee, M(q) moves by" in out
    assert "M(q) is off by more than 40 %, mostly by the group 'shank' (FL_calf" in out
