"""Reading YAML: with positions, in YAML 1.2's core schema, and safe against any file."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.errors import Location, SpecError
from draft.spec.reader import MAX_DEPTH, MAX_NODES, read_file, read_text
from tests.written import write_robot

TEXT = """\
# a remark
name: leg
sizes: [1, 2.5, "3 * x"]
joint: {axis: x, range: [-1, 1]}
links:
  - name: thigh
    length: 0.3
  - name: shank
"""


def refusal(text: str) -> str:
    """The message about a text that is not a spec file."""
    with pytest.raises(SpecError) as caught:
        read_text(text, "f.yaml")
    return str(caught.value)


def test_data_are_plain_values() -> None:
    assert read_text(TEXT, "f.yaml").data == {
        "name": "leg",
        "sizes": [1, 2.5, "3 * x"],
        "joint": {"axis": "x", "range": [-1, 1]},
        "links": [{"name": "thigh", "length": 0.3}, {"name": "shank"}],
    }


@pytest.mark.parametrize(
    ("path", "line", "column"),
    [
        (("name",), 2, 7),
        (("sizes",), 3, 8),
        (("sizes", 1), 3, 12),
        (("joint", "axis"), 4, 15),
        (("joint", "range", 0), 4, 26),
        (("links", 0), 6, 5),
        (("links", 0, "length"), 7, 13),
        (("links", 1, "name"), 8, 11),
    ],
)
def test_a_value_has_its_line_and_column(path: tuple, line: int, column: int) -> None:
    assert read_text(TEXT, "f.yaml").at(path) == Location("f.yaml", line, column)


def test_a_quoted_value_stands_at_its_first_character() -> None:
    assert read_text(TEXT, "f.yaml").at(("sizes", 2)) == Location("f.yaml", 3, 18)


@pytest.mark.parametrize(
    ("path", "line", "column"),
    [(("name",), 2, 1), (("joint", "range"), 4, 18), (("links", 0, "length"), 7, 5)],
)
def test_a_key_has_its_line_and_column(path: tuple, line: int, column: int) -> None:
    assert read_text(TEXT, "f.yaml").at(path, key=True) == Location("f.yaml", line, column)


def test_what_is_not_there_has_the_place_of_what_is_around_it() -> None:
    source = read_text(TEXT, "f.yaml")
    assert source.at(("links", 0, "motor", "axis")) == Location("f.yaml", 6, 5)
    assert source.at(("tree",)) == Location("f.yaml", 2, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("12", 12),
        ("-3", -3),
        ("010", 10),
        ("1e3", 1000.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("1_000", "1_000"),
        ("0x10", "0x10"),
        ("0o7", "0o7"),
        ("1:30", "1:30"),
        ("yes", "yes"),
        ("on", "on"),
        ("no", "no"),
        ("true", True),
        ("False", False),
        ("null", None),
        ("~", None),
        ("", None),
        (".inf", ".inf"),
        (".nan", ".nan"),
        ("2024-01-01", "2024-01-01"),
        ("'12'", "12"),
        ('"true"', "true"),
        ("9" * 30, 1e30),
    ],
)
def test_scalars_follow_the_core_schema(text: str, expected: object) -> None:
    value = read_text(f"a: {text}", "f.yaml").data["a"]
    assert value == expected
    assert type(value) is type(expected)


@pytest.mark.parametrize(
    ("text", "where", "words"),
    [
        ("a: 1\nb: 2\na: 3", "3:1", "duplicate key 'a'"),
        ("a: {b: 1, b: 2}", "1:11", "duplicate key 'b'"),
        ("a: &n 1\nb: *n", "2:4", "alias '*n'"),
        ("a: !!python/object:os.system {}", "1:4", "the tag '!!python/object"),
        ("a: !!int 3", "1:4", "the tag '!!int'"),
        ("a: !mine 3", "1:4", "tag '!mine'"),
        ("a: 1\n---\nb: 2", "2:1", "a second document"),
        ("a: 1e400", "1:4", "1e400 is too large a number"),
        ("{a: 1}: 2", "1:1", "a mapping or list cannot be a key"),
        ("? [1, 2]\n: 3", "1:3", "a mapping or list cannot be a key"),
        ("a: [1, 2\nb: 3", "2:2", "not valid YAML: did not find expected ',' or ']'"),
        ("a: 1\nb: [1, 2\nc: 3", "3:2", "parsing a flow sequence that begins at 2:4"),
        ("a: 1\n b: 2", "2:3", "not valid YAML"),
        ("a:\n\t- 1", "2:1", "not valid YAML"),
        ("a: %x", "1:4", "not valid YAML"),
    ],
)
def test_a_file_that_is_not_plain_yaml_is_refused_at_its_place(
    text: str, where: str, words: str
) -> None:
    message = refusal(text)
    assert message.startswith(f"f.yaml:{where}: ")
    assert words in message


def test_nesting_is_bounded() -> None:
    assert read_text("[" * MAX_DEPTH + "]" * MAX_DEPTH, "f.yaml").data
    message = refusal("[" * 10_000 + "]" * 10_000)
    assert message.startswith(f"f.yaml:1:{MAX_DEPTH + 1}: nested too deeply")


def test_nesting_by_indentation_is_bounded() -> None:
    deep = "\n".join(" " * i + "a:" for i in range(1000))
    assert "nested too deeply" in refusal(deep)


def test_the_number_of_entries_is_bounded() -> None:
    assert "too many entries" in refusal("- 1\n" * (MAX_NODES + 1))


def test_a_byte_order_mark_is_no_part_of_the_first_key(tmp_path: Path) -> None:
    path = tmp_path / "tree.yaml"
    path.write_bytes(b"\xef\xbb\xbfname: leg")
    assert read_file(path).data == {"name": "leg"}


def test_a_link_inside_the_folder_is_followed(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    (robot / "tree.yaml").rename(robot / "other.yaml")
    (robot / "tree.yaml").symlink_to("other.yaml")
    assert draft.load(robot).name == "monoped"


def test_a_robot_may_be_reached_through_a_link(tmp_path: Path) -> None:
    robot = write_robot(tmp_path / "robot")
    (tmp_path / "mine").symlink_to(robot)
    assert draft.load(tmp_path / "mine").name == "monoped"


@given(st.text(max_size=80))
def test_any_text_is_data_or_a_spec_error(text: str) -> None:
    try:
        places = [read_text(text, "f.yaml").at(())]
    except SpecError as error:
        places = [problem.where for problem in error.problems]
    assert [place.file for place in places if place] == ["f.yaml"]
