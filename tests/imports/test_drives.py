"""Torques of an import: declared, replaced where they are implausible, assumed, or stated."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from draft.description.xmlfile import DescriptionError
from draft.errors import DraftError
from draft.imports.importer import Files
from draft.imports.options import Options
from draft.imports.stated import parse
from tests.commands import line, printed
from tests.imports.biped import TORQUES, biped
from tests.imports.written import (
    CUBE,
    imported,
    joint,
    link,
    notes,
    quadruped,
    translated,
    written,
)


def stating(*values: str, strict: bool = False) -> Options:
    return Options(torque=parse(values, "--torque", "N m"), strict=strict)


def sources(files: Files) -> dict[str, str]:
    """Where each joint's torque is from."""
    return {name: one.torque_from for name, one in files.drives.items()}


# Torques by role, and where all of them are then from.
ALL = {
    "those of the maker": ({}, "declared"),
    "weak wrists of a robot with usual torques": ({"elbow": 0.6}, "declared"),
    "far too low": (dict.fromkeys(TORQUES, 0.5), "replaced"),
    "one for all that suits some": (dict.fromkeys(TORQUES, 300.0), "replaced"),
    "none": (dict.fromkeys(TORQUES, None), "assumed"),
    "zeros": (dict.fromkeys(TORQUES, 0.0), "assumed"),
}


@pytest.mark.parametrize("name", ALL)
def test_torques_are_believed_replaced_or_assumed(name: str) -> None:
    efforts, source = ALL[name]
    files = translated(biped(efforts))
    assert set(sources(files).values()) == {source}
    assert bool(notes(files, "implausible")) == (source == "replaced")


def test_a_placeholder_is_replaced_and_the_drives_are_named() -> None:
    text = biped(dict.fromkeys(TORQUES, 1000.0))
    found = imported(text, out="a")
    assert set(sources(found.files).values()) == {"replaced"}
    knees = [one for name, one in found.files.drives.items() if "knee" in name]
    assert all(40 < one.torque < 130 for one in knees)
    words = notes(translated(text), "1000 N m is implausible")
    assert any("left_knee_joint, right_knee_joint" in one for one in words)
    assert len(words) == len(TORQUES)
    masses = [one.spec.resolve().mass for one in (found, imported(biped(), out="b"))]
    assert float(masses[0]) < 1.6 * float(masses[1])


@pytest.mark.parametrize("declared", ['effort="1000" ', ""])
def test_a_guessed_torque_is_that_of_no_drive_wider_than_its_limb(declared: str) -> None:
    """Legs 30 mm wide hold small motors only; those of 120 mm hold the usual ones."""
    written(CUBE, "rod.obj")
    text = re.sub('effort="[0-9]+" ', declared, quadruped())
    found: dict[float, Files] = {}
    for width in (0.03, 0.12):
        scale = f"{width / 0.6} {width / 0.2} 2"
        shape = f'<visual><geometry><mesh filename="rod.obj" scale="{scale}"/></geometry></visual>'
        legs = re.sub('(_(?:hip|thigh|calf)".*?)</link>', rf"\1{shape}</link>", text)
        found[width] = translated(legs)
    thin, thick = (found[width].drives["FL_knee"] for width in (0.03, 0.12))
    assert thin.torque < 0.2 * thick.torque
    assert (thin.slim, thick.slim) == (True, False)
    assert thick.torque == translated(text).drives["FL_knee"].torque
    assert not declared or notes(found[0.03], "the most of a drive no wider than the limb")


def test_one_placeholder_among_plausible_torques_is_replaced_alone() -> None:
    found = sources(translated(biped({"ankle": 1000.0})))
    replaced = {name for name, source in found.items() if source == "replaced"}
    assert replaced == {"left_ankle_pitch_joint", "right_ankle_pitch_joint"}


def test_strict_refuses_and_names_the_joint() -> None:
    text = biped({"ankle": 1000.0})
    with pytest.raises(DescriptionError, match="'left_ankle_pitch_joint' declares 1000 N m"):
        translated(text, stating(strict=True))
    files = translated(text, stating("ankle=30", strict=True))
    assert files.drives["left_ankle_pitch_joint"].torque == 30


def test_a_file_without_torques_gets_those_of_surveyed_joints() -> None:
    files = translated(biped(dict.fromkeys(TORQUES, None)))
    torques = {name: one.torque for name, one in files.drives.items()}
    assert len(torques) == 16
    assert torques["left_knee_joint"] == torques["right_knee_joint"]
    assert torques["left_knee_joint"] > torques["left_elbow_joint"]
    assert len(notes(files, "16 of 16 drives declare no torque")) == 1
    assert "peak_torque: 97 # not declared" in files.texts["parameters.yaml"]


def test_larger_robots_get_stronger_joints() -> None:
    small, large = (
        translated(biped(dict.fromkeys(TORQUES, None), height=height)).drives
        for height in (0.8, 1.6)
    )
    assert all(large[name].torque > small[name].torque for name in small)


def test_a_guess_for_legs_longer_than_any_surveyed_is_less_certain() -> None:
    usual, long = (
        translated(biped(dict.fromkeys(TORQUES, None), height=height)).drives["left_knee_joint"]
        for height in (1.0, 3.0)
    )
    assert long.sigma > usual.sigma + 0.1


def test_one_joint_of_a_known_role_without_a_torque_is_driven() -> None:
    found = sources(translated(biped({"elbow": None})))
    assert (found["left_elbow_joint"], found["left_knee_joint"]) == ("assumed", "declared")


def test_a_torque_is_stated_for_all_that_lack_one() -> None:
    files = translated(biped({"elbow": None}), stating("17"))
    assert files.drives["left_elbow_joint"].torque == 17
    assert files.drives["left_knee_joint"].torque == TORQUES["knee"]


def test_torques_are_stated_by_role_by_words_and_by_joint() -> None:
    options = stating("hip=20", "hip_roll=25", "left_knee_joint=30")
    drives = translated(biped(), options).drives
    assert drives["left_hip_yaw_joint"].torque == 20
    assert drives["right_hip_roll_joint"].torque == 25
    assert drives["left_knee_joint"].torque == 30
    assert drives["right_knee_joint"].torque == TORQUES["knee"]
    assert drives["left_knee_joint"].torque_from == "stated"


def test_a_quadrupeds_roles_can_be_stated() -> None:
    drives = translated(quadruped(), stating("abduction=22")).drives
    assert drives["FL_roll"].torque == 22
    assert drives["FL_pitch"].torque == 30


def test_a_stated_joint_without_an_effort_is_driven() -> None:
    tail = link("tail") + joint("wag", "body", "tail", (-0.3, 0, 0), limit='effort="0"')
    assert "wag" not in translated(quadruped(tail)).drives
    assert translated(quadruped(tail), stating("wag=3")).drives["wag"].torque == 3


@pytest.mark.parametrize(
    ("values", "words"),
    [
        (("much",), "--torque 'much' is neither a number above 0 nor NAME=NUMBER"),
        (("-3",), "--torque '-3' is neither"),
        (("hip=nan",), "--torque 'hip=nan' is neither"),
        (("=3",), "--torque '=3' is neither"),
        (("3", "4"), "--torque has two numbers without a name, 3 and 4"),
    ],
)
def test_what_is_no_torque_is_refused(values: tuple[str, ...], words: str) -> None:
    with pytest.raises(DraftError, match=words):
        stating(*values)


def test_a_name_that_no_joint_has_is_refused_with_those_there_are() -> None:
    with pytest.raises(DraftError, match=r"tail=\.\.\. means no driven joint") as caught:
        translated(biped(), stating("tail=3"))
    assert "hip" in str(caught.value)


MJCF = """<mujoco model="walker"><worldbody><body name="torso"><freejoint/>
<geom type="box" size="0.1 0.1 0.2" mass="5"/>
<body name="left_thigh" pos="0 0.1 -0.2"><joint name="left_hip" axis="0 1 0" range="-60 60"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3" mass="1"/>
<body name="left_shank" pos="0 0 -0.3"><joint name="left_knee" axis="0 1 0" range="0 120"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3" mass="1"/></body></body>
<body name="right_thigh" pos="0 -0.1 -0.2"><joint name="right_hip" axis="0 1 0" range="-60 60"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3" mass="1"/>
<body name="right_shank" pos="0 0 -0.3"><joint name="right_knee" axis="0 1 0" range="0 120"/>
<geom type="capsule" size="0.03" fromto="0 0 0 0 0 -0.3" mass="1"/></body></body>
<body name="mast" pos="0 0 0.2"><joint name="antenna" axis="1 0 0" range="-10 10"/>
<geom type="capsule" size="0.01" fromto="0 0 0 0 0 0.3" mass="0.1"/></body>
</body></worldbody><actuator>{}</actuator></mujoco>"""


LEGS = ("left_hip", "left_knee", "right_hip", "right_knee")


def driven(actuator: str) -> Files:
    """The MJCF biped with an actuator on each joint of its legs."""
    text = MJCF.format("".join(actuator.format(name) for name in LEGS))
    return translated(text, file="walker.xml", population="humanoid")


def test_an_mjcf_actuator_without_a_force_range_drives_its_joint() -> None:
    files = driven('<position name="{0}" joint="{0}" kp="50"/>')
    assert set(files.drives) >= set(LEGS)
    assert set(sources(files).values()) == {"assumed"}


def test_an_mjcf_joint_without_an_actuator_beside_driven_ones_is_passive() -> None:
    assert set(driven('<motor name="{0}" joint="{0}" ctrlrange="-40 40"/>').drives) == set(LEGS)


def test_nothing_is_allowed_without_a_word() -> None:
    found = imported(biped({"knee": 150.0}).replace('velocity="12"', 'velocity="60"'))
    (told,) = (note.cause for note in found.notes if "allows " in note.cause)
    first, *others = found.spec.allow
    assert told.startswith(f"allows {first}: ")
    assert all(key in told for key in others[:3])
    assert len(others) == 4
    assert "and 1 more, each with its reason in parameters.yaml" in told


def test_a_robot_that_breaks_no_rule_allows_nothing() -> None:
    weak = quadruped().replace('effort="30"', 'effort="5"').replace('effort="45"', 'effort="6"')
    wide = weak.replace('xyz="0 0.08 0"', 'xyz="0 0.2 0"').replace('"0 -0.08 0"', '"0 -0.2 0"')
    found = imported(wide)
    assert not found.spec.allow
    assert "allow" not in (found.folder / "parameters.yaml").read_text("utf-8")


def advice(text: str) -> dict[str, list[str]]:
    """Values by option that messages advise to state."""
    found: dict[str, list[str]] = {"--torque": [], "--speed": []}
    for option, values in re.findall(r"(--torque|--speed)((?: [a-z_]\w*=\d+)+)", text):
        found[option] += values.split()
    return found


@pytest.mark.parametrize("walker", [biped, quadruped])
def test_what_is_advised_can_be_stated(walker: Callable[[], str]) -> None:
    written(re.sub('effort="[0-9]+" velocity="[0-9]+"', "", walker()))
    advised = advice(line(printed("import", "beast.urdf", "--out", "first", "--no-preview")))
    assert all(advised.values())
    options = [item for option, values in advised.items() for item in (option, *values)]
    printed("import", "beast.urdf", "--out", "second", *options)


@pytest.mark.parametrize("kind", ["fixed", "prismatic", "floating"])
def test_a_robot_without_hinges_is_not_told_to_state_torques(kind: str) -> None:
    text = link("drone") + link("rotor") + joint("arm", "drone", "rotor", (0, 0.1, 0), kind=kind)
    with pytest.raises(DescriptionError, match="it has no hinges") as refused:
        translated(f'<robot name="drone">{text}</robot>')
    assert "torque`" not in str(refused.value)


def test_a_robot_of_passive_hinges_is_told_their_names() -> None:
    text = (
        '<mujoco><worldbody><body name="cart"><joint name="rail" type="slide" range="0 1"/>'
        '<geom size=".1"/><body name="pole"><joint name="pivot" axis="0 1 0"/><geom size=".1"/>'
        '</body></body></worldbody><actuator><motor joint="rail"/></actuator></mujoco>'
    )
    with pytest.raises(DescriptionError, match=r"NAME=VALUE; hinges: pivot$"):
        translated(text, file="pendulum.xml")
    assert translated(text, stating("pivot=2"), "pendulum.xml").drives["pivot"].torque == 2
