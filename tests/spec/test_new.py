"""A robot of one's own, started from a shipped one."""

from __future__ import annotations

from pathlib import Path

import pytest

import draft
from draft.errors import DraftError, SpecError
from draft.spec import shipped
from draft.spec.jsonschema import SCHEMAS
from draft.spec.new import new_robot
from tests.spec.test_schema import schema_of
from tests.written import files_below


@pytest.mark.parametrize("like", shipped())
def test_a_new_robot_is_the_shipped_one_under_its_own_name(tmp_path: Path, like: str) -> None:
    folder = new_robot(tmp_path / "mine", like)
    spec, origin = draft.load(folder), draft.load(like)
    assert spec.name == "mine"
    assert spec.designs == {}
    assert not (folder / "designs").exists()
    for laws in ("population", "trends", "structure"):
        assert getattr(spec, laws) == getattr(origin, laws), laws
    assert (list(spec.allow), list(spec.battery)) == (list(origin.allow), list(origin.battery))


@pytest.mark.parametrize("like", shipped())
def test_a_new_robot_weighs_what_the_shipped_one_does_with_the_values_of_every_design(
    tmp_path: Path, like: str
) -> None:
    copy, origin = draft.load(new_robot(tmp_path / "mine", like)), draft.load(like)
    for name in (None, *origin.designs):
        values = {} if name is None else origin.designs[name].values
        both = mine, shipped_one = copy.resolve(values), origin.resolve(name)
        assert mine.body_masses() == shipped_one.body_masses(), name
        assert mine.mass_band() == shipped_one.mass_band(), name
        assert mine.frames(home=True) == shipped_one.frames(home=True), name
        found = [[(one.id, one.severity, one.value) for one in of.findings] for of in both]
        assert found[0] == found[1], name


def test_a_new_robot_builds(tmp_path: Path) -> None:
    model = draft.load(new_robot(tmp_path / "mine", "quadruped")).resolve().build()
    assert 'model="mine"' in model.xml


def test_every_file_of_a_new_robot_names_a_schema_in_its_own_folder(tmp_path: Path) -> None:
    folder = new_robot(tmp_path / "mine", "quadruped")
    files = sorted(folder.rglob("*.yaml"))
    assert {"parameters.yaml", "root.yaml", "tree.yaml"} == {path.name for path in files}
    for path in files:
        schema = schema_of(path).resolve()
        assert schema.is_relative_to(folder.resolve())
        assert schema.read_text() == (SCHEMAS / schema.name).read_text()


def test_a_new_robot_may_be_made_in_a_folder_that_does_not_exist(tmp_path: Path) -> None:
    assert draft.load(new_robot(tmp_path / "a" / "b" / "mine", "quadruped")).name == "mine"


def test_a_folder_that_exists_is_kept(tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "work.txt").write_text("precious")
    with pytest.raises(DraftError, match="mine' exists; it is kept"):
        new_robot(tmp_path / "mine", "quadruped")
    assert files_below(tmp_path) == {"mine", "mine/work.txt"}


@pytest.mark.parametrize("name", ["my-robot", "2legs", "a b", "robot.v2", "..", "név"])
def test_a_name_that_cannot_be_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(SpecError, match=r"is not a robot's name\n  a name has letters"):
        new_robot(tmp_path / name, "quadruped")
    assert files_below(tmp_path) == set()


def test_an_interrupt_leaves_nothing_behind(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("draft.spec.new.os.rename", interrupt)
    with pytest.raises(KeyboardInterrupt):
        new_robot(tmp_path / "mine", "quadruped")
    assert files_below(tmp_path) == set()


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DraftError, match=r"cannot write .*mine.*\n  choose another place"):
        new_robot(tmp_path / "file" / "mine", "quadruped")


def test_a_robot_in_the_current_folder_comes_before_a_shipped_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "biped").mkdir()
    assert draft.load("biped").folder != Path("biped")  # An empty folder is no robot.
    (tmp_path / "biped").rmdir()
    new_robot(tmp_path / "mine", "hand").rename("biped")
    assert draft.load("biped").folder == Path("biped")
    assert not draft.load("biped").floating
    assert draft.load("hand").folder != Path("hand")
