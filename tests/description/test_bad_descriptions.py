"""Whatever is wrong with a description is named with file and line, and stops nothing else."""

from __future__ import annotations

import gc
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from draft.cli import main
from draft.description import mjcf, xmlfile
from draft.description import urdf as urdf_reader
from draft.description.read import describe
from draft.description.segments import segments
from draft.description.xmlfile import DescriptionError
from draft.fitting.structure.parse import parse
from tests.description import written
from tests.description.test_readers import MODEL
from tests.description.written import joint, link, urdf

TWICE = "keep one of these joints"
BAD = {
    "not well-formed": ("<robot>\n<link", "r.urdf:2:1: not well-formed XML: unclosed token"),
    "a spec": ("name: robot\n", "r.urdf:1:1: not well-formed XML: syntax error"),
    "another root": (
        "<sdf/>",
        "r.urdf:1: the root element is <sdf>; a URDF has <robot>, an MJCF model",
    ),
    "entities": (
        '<!DOCTYPE r [<!ENTITY a "b">]>\n<robot>&a;</robot>',
        "r.urdf:1: it has a DOCTYPE\n  remove it: a description needs no entities",
    ),
    "a fetched entity": (
        '<!DOCTYPE r SYSTEM "http://example.org/x.dtd">\n<robot/>',
        "r.urdf:1: it has a DOCTYPE",
    ),
    "no links": ("<robot/>", "r.urdf: it has no links"),
    "two robots that share a link": (
        urdf(
            "\n".join((link("a"), link("b"), link("c"), joint("x", "a", "c"), joint("y", "b", "c")))
        ),
        "r.urdf:7: link 'c' is the child of joints 'x' and 'y' of separate trees\n  " + TWICE,
    ),
    "cyclic links": (
        urdf("\n".join((link("a"), link("b"), joint("x", "a", "b"), joint("y", "b", "a")))),
        "r.urdf:5: cyclic links: every link has a parent (b <- a <- b)",
    ),
    "a ring beside the tree": (
        urdf(
            "\n".join((link("r"), link("a"), link("b"), joint("x", "a", "b"), joint("y", "b", "a")))
        ),
        "r.urdf:7: cyclic links (a <- b <- a)",
    ),
    "two roots": (
        urdf("\n".join((link("a"), link("b")))),
        "r.urdf:4: 2 links have no parent: a, b",
    ),
    "a missing link": (
        urdf("\n".join((link("a"), joint("x", "a", "b")))),
        "r.urdf:4: joint 'x' names link 'b', which does not exist",
    ),
    "a mass that is no number": (
        urdf('<link name="a"><inertial>\n<mass value="heavy"/></inertial></link>'),
        'r.urdf:4: value="heavy" of <mass> is not a finite number',
    ),
    "an infinite mass": (
        urdf('<link name="a"><inertial><mass value="1e999"/></inertial></link>'),
        'r.urdf:3: value="1e999" of <mass> is not a finite number',
    ),
    "a mass below zero": (
        urdf('<link name="a"><inertial><mass value="-1"/></inertial></link>'),
        "r.urdf:3: mass -1 kg is below zero",
    ),
    "an include": (
        '<mujoco>\n<include file="x.xml"/>\n<worldbody/></mujoco>',
        "r.urdf:2: it includes 'x.xml', which does not exist\n  copy the file beside the model",
    ),
    "an unknown class": (
        '<mujoco><worldbody>\n<body name="a"><joint class="x"/></body></worldbody></mujoco>',
        "r.urdf:2: default class 'x' does not exist\n  classes: main",
    ),
}


@pytest.mark.parametrize("what", BAD)
def test_a_bad_description_is_refused_with_file_and_line(what: str, tmp_path: Path) -> None:
    text, message = BAD[what]
    path = tmp_path / "r.urdf"
    path.write_text(text)
    with pytest.raises(DescriptionError) as caught:
        describe(path, "r.urdf")
    assert str(caught.value).startswith(message)


def test_a_file_of_100_megabytes_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "r.urdf"
    with path.open("wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(DescriptionError) as caught:
        describe(path, "r.urdf")
    assert str(caught.value) == "r.urdf: file of 100.0 MB\n  a description may have up to 50 MB"


def test_deep_nesting_is_refused() -> None:
    with pytest.raises(DescriptionError, match="nested too deeply"):
        xmlfile.read_text("<a>" * 1000 + "</a>" * 1000, "r.xml")


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


def _folder(tmp_path: Path) -> Path:
    """A manifest of one good robot among bad ones."""
    (tmp_path / "good.urdf").write_text(written.leg())
    (tmp_path / "strong.urdf").write_text(written.leg().replace('effort="20"', 'effort="1e9"', 1))
    (tmp_path / "odd.urdf").write_text(written.leg().replace('"hip"', '"joint_7"'))
    (tmp_path / "massless.urdf").write_text(urdf(link("a", None)))
    (tmp_path / "broken.urdf").write_text("<robot")
    rows = ["key,population,used_in_fit,exclusion_reason,file"]
    rows += [f"{key},humanoid,true,,{key}.urdf" for key in ("good", "strong", "odd", "massless")]
    rows += ["broken,humanoid,true,,broken.urdf", "gone,humanoid,true,,gone.urdf"]
    rows += ["old,humanoid,false,older generation (before 2023),good.urdf"]
    manifest = tmp_path / "manifest.csv"
    manifest.write_text("\n".join(rows) + "\n")
    return manifest


def test_the_rest_of_the_survey_goes_on(tmp_path: Path) -> None:
    survey = parse(_folder(tmp_path))
    assert [one.robot.key for one in survey.used] == ["good", "strong", "odd"]
    assert [robot.key for robot, _ in survey.failed] == ["massless", "broken", "gone"]
    messages = [str(error) for _, error in survey.failed]
    assert "it has no inertials: nothing in it has a mass" in messages[0]
    assert "not well-formed XML" in messages[1]
    assert "file not found" in messages[2]


def test_an_effort_of_a_billion_is_named_and_not_priced(tmp_path: Path) -> None:
    strong = next(one for one in parse(_folder(tmp_path)).used if one.robot.key == "strong")
    assert str(strong.notes[0]).endswith(
        "strong.urdf:7: joint 'hip' declares an effort of 1e+09 N m: it is not priced\n"
        "  usable: above 0, at most 1000 N m"
    )


def test_a_joint_that_no_rule_names_is_listed_not_guessed(tmp_path: Path) -> None:
    odd = next(one for one in parse(_folder(tmp_path)).used if one.robot.key == "odd")
    assert "joint 'joint_7' has no role: it is not priced" in str(odd.notes[0])
    assert [row.kind for row in odd.rows] == ["base", "", "shank", "foot"]


def test_the_summary_counts_what_was_left_out_and_why(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "segments.csv"
    code = main(["survey", "parse", str(_folder(tmp_path)), "--out", str(table)])
    out = capsys.readouterr().out
    assert code == 1
    assert "read 4, used 3 (3 humanoids), omitted 1, refused 3" in out
    assert "omitted old older generation (before 2023)" in out
    assert "refused broken" in out
    assert table.read_text().startswith("robot,population,segment,parent,class")


def test_an_exclusion_without_a_reason_is_refused(tmp_path: Path) -> None:
    manifest = tmp_path / "manifest.csv"
    manifest.write_text("key,population,used_in_fit,exclusion_reason,file\na,humanoid,false,,a\n")
    with pytest.raises(DescriptionError, match=r"csv:2: 'a' is excluded without a reason"):
        parse(manifest)


def test_a_table_of_one_robot_is_too_few_to_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tmp_path / "segments.csv"
    main(["survey", "parse", str(_folder(tmp_path)), "--out", str(table)])
    assert main(["survey", "fit", "--rows", str(table)]) == 2
    assert "3 humanoids are too few to fit\n  at least 5" in capsys.readouterr().err


def test_fetching_an_unknown_robot_names_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["survey", "fetch", "h11"]) == 2
    assert "did you mean 'h1'?" in capsys.readouterr().err


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
