"""Whatever is wrong with a description is named with file and line, and stops nothing else.

Each message is pinned. `pytest --force-regen` accepts changed words.
"""

from __future__ import annotations

import gc
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pytest_regressions.file_regression import FileRegressionFixture

from draft.description import mjcf, xmlfile
from draft.description import urdf as urdf_reader
from draft.description.read import describe
from draft.description.segments import segments
from draft.description.xmlfile import DescriptionError
from draft.fitting.structure.parse import parse
from tests.commands import printed, refusal
from tests.description import written
from tests.description.test_readers import MODEL
from tests.description.written import joint, link, urdf


def tree(links: str, *joints: tuple[str, str, str]) -> str:
    """A URDF of links, one letter each, and of joints, one element a line."""
    return urdf("\n".join([*map(link, links), *(joint(*one) for one in joints)]))


def weighing(mass: str) -> str:
    return urdf(f'<link name="a"><inertial>\n<mass value="{mass}"/></inertial></link>')


BAD = {
    "not well-formed": "<robot>\n<link",
    "a spec": "name: robot\n",
    "another root": "<sdf/>",
    "entities": '<!DOCTYPE r [<!ENTITY a "b">]>\n<robot>&a;</robot>',
    "a fetched entity": '<!DOCTYPE r SYSTEM "http://example.org/x.dtd">\n<robot/>',
    "no links": "<robot/>",
    "two robots that share a link": tree("abc", ("x", "a", "c"), ("y", "b", "c")),
    "cyclic links": tree("ab", ("x", "a", "b"), ("y", "b", "a")),
    "a ring beside the tree": tree("rab", ("x", "a", "b"), ("y", "b", "a")),
    "two roots": tree("ab"),
    "a missing link": tree("a", ("x", "a", "b")),
    "a mass that is no number": weighing("heavy"),
    "an infinite mass": weighing("1e999"),
    "a mass below zero": weighing("-1"),
    "an include": '<mujoco>\n<include file="x.xml"/>\n<worldbody/></mujoco>',
    "an unknown class": (
        '<mujoco><worldbody>\n<body name="a"><joint class="x"/></body></worldbody></mujoco>'
    ),
    "deep nesting": "<a>" * 1000 + "</a>" * 1000,
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_description_is_refused_with_file_and_line(
    what: str, tmp_path: Path, file_regression: FileRegressionFixture
) -> None:
    path = tmp_path / "r.urdf"
    path.write_text(BAD[what])
    with pytest.raises(DescriptionError) as caught:
        describe(path, "r.urdf")
    file_regression.check(f"{caught.value}\n", basename=what.replace(" ", "_"))


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["star", "chain", "ring"])
def test_four_times_the_links_take_about_four_times_the_reading(shape: str, tmp_path: Path) -> None:
    # A reader that looked every link up in a list would take sixteen times as long. The shortest of
    # three readings is the one that other work on the machine disturbed least.
    few, many = (
        min(_reading(shape, n, tmp_path / f"{n}.urdf") for _ in range(3)) for n in (8_000, 32_000)
    )
    assert many < 9 * few


def _reading(shape: str, n: int, path: Path) -> float:
    """CPU seconds to read a description of so many links in a star, a chain or a ring."""
    links = "".join(f'<link name="{i}"/>' for i in range(n))
    joints = "".join(
        f'<joint name="{i}" type="fixed"><parent link="{0 if shape == "star" else i - 1}"/>'
        f'<child link="{i}"/></joint>'
        for i in range(1, n)
    )
    if shape == "ring":
        joints += f'<joint name="0" type="fixed"><parent link="{n - 1}"/><child link="0"/></joint>'
    path.write_text(urdf(links + joints))
    gc.disable()  # a collector that runs more often with more objects is not the reader's doing
    try:
        start = time.process_time()
        if shape == "ring":
            with pytest.raises(DescriptionError, match="cyclic links"):
                describe(path)
        else:
            assert len(describe(path).links) == n
        return time.process_time() - start
    finally:
        gc.enable()


@pytest.fixture
def manifest(tmp_path: Path) -> Path:
    """A manifest of one good robot among bad ones."""
    texts = {
        "good": written.leg(),
        "strong": written.leg().replace('effort="20"', 'effort="1e9"', 1),
        "odd": written.leg().replace('"hip"', '"joint_7"'),
        "massless": urdf(link("a", None)),
        "broken": "<robot",
    }
    for key, text in texts.items():
        (tmp_path / f"{key}.urdf").write_text(text)
    rows = ["key,population,used_in_fit,exclusion_reason,file"]
    rows += [f"{key},humanoid,true,,{key}.urdf" for key in (*texts, "gone")]
    rows += ["old,humanoid,false,older generation (before 2023),good.urdf"]
    path = tmp_path / "manifest.csv"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_the_rest_of_the_survey_goes_on(manifest: Path) -> None:
    survey = parse(manifest)
    used = {one.robot.key: one for one in survey.used}
    assert [*used] == ["good", "strong", "odd"]
    assert str(used["strong"].notes[0]).endswith(
        "strong.urdf:7: joint 'hip' declares an effort of 1e+09 N m: it is not priced\n"
        "  usable: above 0, at most 1000 N m"
    )
    # A joint that no rule names is listed, not guessed.
    assert "joint 'joint_7' has no role: it is not priced" in str(used["odd"].notes[0])
    assert [row.kind for row in used["odd"].rows] == ["base", "", "shank", "foot"]
    words = (
        "it has no inertials: nothing in it has a mass",
        "not well-formed XML",
        "file not found",
    )
    assert [robot.key for robot, _ in survey.failed] == ["massless", "broken", "gone"]
    for (_, error), said in zip(survey.failed, words, strict=True):
        assert said in str(error)


def test_the_summary_counts_what_was_left_out_and_the_rest_is_too_few_to_fit(
    manifest: Path, tmp_path: Path
) -> None:
    table = tmp_path / "segments.csv"
    out = printed("survey", "parse", manifest, "--out", table, code=1, progress=True)
    assert "read 4, used 3 (3 humanoids), omitted 1, refused 3" in out
    assert "omitted old older generation (before 2023)" in out
    assert "refused broken" in out
    assert table.read_text().startswith("robot,population,segment,parent,class")
    error = refusal("survey", "fit", "--rows", table)
    assert "3 humanoids are too few to fit\n  at least 5" in error


def test_an_exclusion_without_a_reason_is_refused(tmp_path: Path) -> None:
    manifest = tmp_path / "manifest.csv"
    manifest.write_text("key,population,used_in_fit,exclusion_reason,file\na,humanoid,false,,a\n")
    with pytest.raises(DescriptionError, match=r"csv:2: 'a' is excluded without a reason"):
        parse(manifest)


WORDS = ("", "nan", "inf", "1e999", "-1", "0 0", "0 0 0", "hip", "\x00", "<", '"', "/>", "true")


@settings(max_examples=200)
@given(st.booleans(), st.integers(0, 10_000), st.integers(0, 12), st.sampled_from(WORDS))
def test_a_damaged_description_is_read_or_refused_but_never_a_crash(
    as_urdf: bool, at: int, cut: int, put: str
) -> None:
    text = written.leg() if as_urdf else MODEL
    at %= len(text)
    damaged = text[:at] + put + text[at + cut :]
    read = urdf_reader.from_xml if as_urdf else mjcf.from_xml
    message, robot = "r.xml", None
    try:
        robot = read(xmlfile.read_text(damaged, "r.xml"))
    except DescriptionError as error:
        message = str(error)
    assert "r.xml" in message
    if robot is not None:
        assert sum(one.mass for one in segments(robot)) == pytest.approx(robot.mass)
