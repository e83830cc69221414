"""Tools of an assistant, called in this process: their records, and what they refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest

pytest.importorskip("mcp")

from mcp.types import CallToolResult, TextContent

import draft
from draft.assistant.folder import Folder
from draft.assistant.server import LARGEST, Assistant
from draft.assistant.tool import TOOLS
from draft.errors import DraftError
from tests.commands import Command
from tests.written import append, write_robot


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that is served and current, with a robot of its own."""
    folder = tmp_path / "served"
    folder.mkdir()
    monkeypatch.chdir(folder)
    write_robot(folder / "monoped")
    return folder


def answered(name: str, training: bool = False, /, **given: Any) -> CallToolResult:
    return Assistant(Folder(Path()), training).answer(name, given)


def told(name: str, /, **given: Any) -> Any:
    """Record of a call that succeeds."""
    found = answered(name, **given)
    assert not found.is_error, found
    assert isinstance(found.content[0], TextContent)
    assert json.loads(found.content[0].text) == found.structured_content
    jsonschema.validate(found.structured_content, TOOLS[name].results or {})
    return found.structured_content


def refused(name: str, training: bool = False, /, **given: Any) -> str:
    """Message of a call that is refused."""
    found = answered(name, training, **given)
    assert found.is_error
    assert found.structured_content is None
    (content,) = found.content
    assert isinstance(content, TextContent)
    assert "Traceback" not in content.text
    return content.text


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_and_each_of_its_arguments_are_described(name: str) -> None:
    assert (TOOLS[name].function.__doc__ or "")[0].isupper()
    schema = TOOLS[name].arguments.model_json_schema()
    assert schema["additionalProperties"] is False
    assert all(one["description"] for one in schema.get("properties", {}).values())


@pytest.mark.parametrize(
    ("name", "given", "command"),
    [
        ("metrics", {}, "metrics"),
        ("metrics", {"design": "bear"}, "metrics bear"),
        ("check", {"design": "monoped:long"}, "check monoped:long"),
        (
            "check",
            {"design": "bear", "values": {"thigh_length": "*1.1"}},
            "show bear --set 'thigh_length=*1.1'",
        ),
        (
            "sensitivity",
            {"design": "bear", "metrics": ["mass"], "by": "thigh_length"},
            "sensitivity bear --of mass --by thigh_length",
        ),
        ("compare", {"designs": ["cheetah", "bear"]}, "compare cheetah bear"),
        ("solve", {"design": "bear", "conditions": ["mass < 1e9"]}, 'solve bear "mass < 1e9"'),
    ],
)
@pytest.mark.usefixtures("here")
def test_a_record_is_that_of_the_command(name: str, given: dict[str, Any], command: str) -> None:
    printed = Command().json(command)
    found = told(name, **given)
    if isinstance(printed, list):
        printed = {"metrics": printed}
    for key in ("timings_ms", "out"):
        printed.pop(key, None)
    assert found == printed


@pytest.mark.usefixtures("here")
def test_robots_are_listed_by_references_that_name_them(here: Path) -> None:
    write_robot(here / "broken")
    append(here / "broken", "parameters.yaml", "wrong: 1\n")
    found = told("list_robots")
    assert Command().json("list").items() <= found.items()
    assert found.pop("broken")["problem"].startswith("broken/parameters.yaml:")
    assert {"monoped", "monoped:long", "quadruped:bear"} <= found.keys()
    for reference, row in found.items():
        assert told("check", design=reference)["mass_kg"] == row["mass_kg"]
    assert "." in Folder(here / "monoped").robots()
    told("new_robot", name="pets/dog", like="quadruped")
    assert "pets/dog" in told("list_robots")


@pytest.mark.usefixtures("here")
def test_lists_and_objects_may_be_texts_of_json() -> None:
    values = {"thigh_length": 0.35, "actuators.leg.gear_ratio": None}
    found = told("check", design="monoped", values=values)
    assert found == told("check", design="monoped", values=json.dumps(values))
    names = ["mass", "reach"]
    found = told("sensitivity", design="bear", metrics=names, by="thigh_length")
    asked = {"metrics": json.dumps(names), "by": '["thigh_length"]'}
    assert found == told("sensitivity", design="bear", **asked)
    assert "no metric '[mass'" in refused("sensitivity", design="bear", metrics="[mass")


def test_a_design_is_saved_as_a_named_one_of_its_robot(here: Path) -> None:
    about = "Heavy: and 'long'"
    given = {"design": "monoped:long", "values": {"shank_length": "*1.1"}, "about": about}
    assert told("save_design", name="longer", **given) == {"file": "monoped/designs/longer.yaml"}
    spec = draft.load(here / "monoped")
    assert spec.designs["longer"].doc == about
    expected = spec.resolve("long", {"shank_length": "*1.1"})
    assert spec.resolve("longer").mass == pytest.approx(expected.mass)
    found = told("save_design", name="copy", design="monoped", values=None, about="As it is.")
    assert found == {"file": "monoped/designs/copy.yaml"}
    assert "longer.yaml' exists" in refused("save_design", name="longer", **given)


@pytest.mark.slow
def test_a_screen_is_shown_in_any_order_without_computing_it_again(here: Path) -> None:
    pytest.importorskip("pyarrow")
    given = {"design": "monoped", "vary": "thigh_length=0.2:0.4", "out": "a.parquet", "n": 500}
    first = told("screen", **given)
    assert (first["rows"], first["computed"], len(first["table"])) == (500, 500, 10)
    assert first["table"][0]["index"] == 0
    assert (here / "a.parquet").is_file()
    again = told("screen", order_by="-mass", rows=500, **given)
    masses = [row["mass"] for row in again["table"]]
    assert (again["computed"], len(masses)) == (0, 500)
    assert masses == sorted(masses, reverse=True)
    assert "'weight' is no column" in refused("screen", order_by="weight", **given)


@pytest.mark.usefixtures("here")
def test_an_answer_of_more_than_a_megabyte_is_refused_and_says_what_to_ask_for() -> None:
    pytest.importorskip("pyarrow")
    given = {"design": "monoped", "vary": ["thigh_length=0.2:0.4"], "out": "a.parquet", "n": 5000}
    message = refused("screen", rows=5000, **given)
    assert "MB is larger than 1 MB\n  lower `rows`" in message
    found = answered("screen", rows=100, **given)
    assert len(found.model_dump_json()) < LARGEST


def test_nothing_outside_the_folder_is_read_or_written(here: Path, tmp_path: Path) -> None:
    outside = write_robot(tmp_path / "outside")
    (here / "link").symlink_to(outside)
    (here / "linked").mkdir()
    for name in ("tree.yaml", "root.yaml"):
        (here / "linked" / name).write_text((outside / name).read_text())
    (here / "linked" / "parameters.yaml").symlink_to(outside / "parameters.yaml")
    (here / "monoped" / "designs" / "away.yaml").symlink_to(tmp_path / "away.yaml")
    write_robot(here / "other")
    (here / "other" / "designs" / "long.yaml").unlink()
    (here / "other" / "designs").rmdir()
    (here / "other" / "designs").symlink_to(tmp_path)
    built = here / "built"
    draft.load(outside).resolve().build().save(built)
    record = json.loads((built / "report.json").read_text()) | {"name": str(outside)}
    (built / "report.json").write_text(json.dumps(record))
    before = sorted(tmp_path.rglob("*"))
    names = ("../outside", str(outside), "link", "monoped/../../outside", "built", "a\0b")
    designs = (*names, f"monoped:{outside}/designs/long.yaml", "bear:../outside/designs/long.yaml")
    for name in designs:
        assert "is outside the folder that is served" in refused("check", design=name)
        assert "is outside" in refused("compare", designs=["bear", name])
    for name in names:
        if name != "built":
            assert "is outside" in refused("new_robot", name=f"{name}/new", like="hopper")
            given = {"design": "bear", "vary": ["thigh_length=0.2:0.4"]}
            assert "is outside" in refused("screen", out=f"{name}/a.parquet", **given)
    assert "leads out of the robot's folder" in refused("check", design="linked")
    saved = {"name": "new", "values": {}, "about": "None."}
    assert "is outside" in refused("save_design", design="other", **saved)
    assert "link" not in told("list_robots")
    assert "leads out of the robot's folder" in refused("check", design="monoped")
    assert sorted(tmp_path.rglob("*")) == before
    (here / "monoped" / "designs" / "away.yaml").unlink()
    # An absolute path below the folder is one of its own.
    assert told("check", design=str(here / "monoped"))["name"] == "monoped"


@pytest.mark.usefixtures("here")
def test_shipped_robots_are_not_changed() -> None:
    package = Path(draft.__file__).parent / "robots"
    before = sorted(package.rglob("*"))
    given = {"design": "quadruped:bear", "conditions": ["mass < 100"], "save_as": "light"}
    copy = "copy it first, by the tool `new_robot`"
    assert copy in refused("solve", **given)
    assert copy in refused("save_design", design="bear", name="a", values={}, about="None.")
    # Nor where the package itself is served.
    found = Assistant(Folder(package), False)
    saved = {"design": "./quadruped", "name": "a", "values": {}, "about": "None."}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(package)
        assert found.answer("save_design", saved).is_error
    assert sorted(package.rglob("*")) == before


@pytest.mark.usefixtures("here")
def test_a_solution_that_changes_nothing_or_is_none_writes_nothing(here: Path) -> None:
    given = {"design": "monoped", "save_as": "new"}
    found = told("solve", conditions="mass < 1e9", **given)
    assert (found["met"], found["moved"], found["file"]) == (True, [], None)
    found = told("solve", conditions=["mass < 1", "leg_length > 0.5"], **given)
    assert (found["met"], found["file"]) == (False, None)
    assert found["excluded_together"]
    assert [path.stem for path in (here / "monoped" / "designs").iterdir()] == ["long"]


@pytest.mark.parametrize(
    ("name", "given", "message"),
    [
        ("chek", {}, "there is no tool 'chek'\n  did you mean 'check'?"),
        ("check", {}, "`design` is missing"),
        ("check", {"design": 3}, "`design` 3 is not text"),
        ("check", {"design": ["bear"]}, "`design` [bear] is not text"),
        ("check", {"design": "bear", "payload": 3}, "there is no setting 'payload'"),
        ("check", {"design": "bare"}, "'bare' names no robot or design\n  did you mean 'bear'?"),
        ("check", {"design": ""}, "no robot is named"),
        ("check", {"design": "bear", "simulate": "yes"}, "`simulate` 'yes' is not true or false"),
        ("check", {"design": "bear", "values": "a=1"}, "`values` 'a=1' is not an object of"),
        ("check", {"design": "bear", "values": {"thigh_length": True}}, "is not an object of"),
        ("check", {"design": "bear", "values": {"thigh_length": [0.3]}}, "is not an object of"),
        (
            "check",
            {"design": "bear", "values": {"thigh_lenght": 0.3}},
            "did you mean 'thigh_length'?",
        ),
        ("metrics", {"design": 1.5}, "`design` 1.5 is not text"),
        ("sensitivity", {"design": "bear", "metrics": ["weight"]}, "there is no metric 'weight'"),
        ("sensitivity", {"design": "bear", "seed": -1}, "`seed` -1 is not a whole number of"),
        ("solve", {"design": "bear", "conditions": []}, "there is no condition"),
        ("solve", {"design": "bear", "conditions": [3]}, "is not a list of texts"),
        ("solve", {"design": "bear", "conditions": ["mass <"]}, "`subject_to`:1:"),
        (
            "solve",
            {"design": "bear", "conditions": ["mass < 3", "mass > 4"]},
            "`mass < 3` and `mass > 4` exclude each other",
        ),
        ("compare", {"designs": ["bear"]}, "there is nothing to compare"),
        (
            "screen",
            {"design": "bear", "vary": [], "out": "a.parquet"},
            "nothing is varied",
        ),
        (
            "screen",
            {"design": "bear", "vary": ["hip_offset=1"], "out": "a.parquet", "n": 2.5},
            "`n` 2.5 is not a whole number from 1 to 1000000",
        ),
        ("screen", {"design": "bear", "vary": ["hip_offset=1"], "out": "monoped"}, "is a folder"),
        ("new_robot", {"name": "a-b"}, "'a-b' is not a robot's name"),
        ("new_robot", {"name": "monoped"}, "'monoped' exists; it is kept"),
        ("new_robot", {"name": "mine", "like": "dog"}, "there is no shipped robot 'dog'"),
        (
            "save_design",
            {"design": "monoped", "name": "a/b", "values": {}, "about": "None."},
            "'a/b' is not a design's name",
        ),
        (
            "save_design",
            {"design": "monoped", "name": "new", "values": {}, "about": ""},
            "`about` '' is not a sentence",
        ),
        ("picture", {"designs": []}, "there is no design to draw"),
        ("picture", {"designs": ["bear"], "width": 9000}, "from 64 to 2000"),
        ("train", {"design": "cheetah", "out": "runs/a"}, "'train' is not allowed"),
    ],
)
def test_bad_input_is_one_message_of_draft(
    name: str, given: dict[str, Any], message: str, here: Path
) -> None:
    before = sorted(here.rglob("*"))
    assert message in refused(name, **given)
    assert sorted(here.rglob("*")) == before


@pytest.mark.usefixtures("here")
def test_a_fault_of_draft_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_: object) -> list[dict[str, str]]:
        raise KeyError("nothing")

    monkeypatch.setattr("draft.assistant.tools.descriptions", lambda: fails(0))
    assert refused("metrics").startswith("this is a fault of Draft: KeyError: 'nothing'")


@pytest.mark.usefixtures("here")
def test_training_is_refused_where_it_is_allowed_too_if_it_cannot_be() -> None:
    given = {"design": "cheetah", "out": "runs/a"}
    assert "did you mean 'base'?" in refused("train", True, stage="bas", **given)
    assert "`minutes` 0 is not" in refused("train", True, minutes=0, **given)
    assert "is outside" in refused("train", True, **given | {"out": "../a"})


def test_a_folder_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match=r"there is no folder '.*nowhere'\n  make it"):
        Folder(tmp_path / "nowhere")
