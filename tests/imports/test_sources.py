"""Robots by name: from packages of robots, and from xacro; one clear line where there is none."""

from __future__ import annotations

import builtins
import importlib
import sys
from importlib import metadata
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from draft.__main__ import main
from draft.errors import DraftError
from draft.extras import remedy
from draft.imports.importer import import_robot
from draft.imports.sources import find_source
from tests.imports.written import quadruped


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def installed(package: str) -> bool:
    """Whether a distribution is installed."""
    return any(True for _ in metadata.distributions(name=package))


with_data = pytest.mark.skipif(
    not installed("example-robot-data"), reason="example-robot-data is not installed"
)


@with_data
def test_a_robot_of_example_robot_data_is_imported_by_its_name() -> None:
    found = import_robot("example-robot-data:anymal_c")
    assert str(found.folder) == "anymal_c"
    assert (found.spec.population, len(found.joints)) == ("quadruped", 12)
    assert found.ignored["meshes read for their size"] > 0


@with_data
@pytest.mark.parametrize(
    ("name", "file"),
    [
        ("talos", "talos_full_v2.urdf"),
        ("talos_full_v2", "talos_full_v2.urdf"),
        ("go2", "go2.urdf"),
        ("b1-z1", "b1-z1.urdf"),
        ("solo12", "solo12.urdf"),
        ("anymal_b", "anymal.urdf"),
    ],
)
def test_a_folder_or_a_file_of_example_robot_data_is_a_name(name: str, file: str) -> None:
    assert find_source(f"example-robot-data:{name}").path.name == file


@with_data
def test_a_name_that_a_package_lacks_is_met_with_the_nearest(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["import", "example-robot-data:anymal_d"]) == 2
    words = "error: example-robot-data has no robot 'anymal_d'\n  did you mean 'anymal_"
    assert capsys.readouterr().err.startswith(words)


def test_a_package_that_is_not_installed_is_named_with_the_remedy(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing(name: str) -> metadata.Distribution:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "distribution", missing)
    for package in ("mujoco_menagerie", "robot_descriptions", "xacrodoc"):
        monkeypatch.setitem(sys.modules, package, None)
    Path("r.urdf.xacro").write_text("<robot/>")
    for file, words in {
        "example-robot-data:anymal_c": "example-robot-data is not installed",
        "menagerie:unitree_go2": "mujoco_menagerie is not installed",
        "robot_descriptions:go2_description": "robot_descriptions is not installed",
        "r.urdf.xacro": "xacrodoc is not installed",
    }.items():
        assert main(["import", file]) == 2
        assert capsys.readouterr().err == f"error: {words}\n  {remedy('robots')}\n"


class Menagerie(ModuleType):
    """mujoco-menagerie as it is without a network, or with its files here."""

    def __init__(self, file: Path | None) -> None:
        super().__init__("mujoco_menagerie")
        self.file = file
        self.default_model = "robot"

    def names(self) -> list[str]:
        return ["unitree_go2", "unitree_g1"]

    def get(self, name: str) -> Menagerie:
        assert name == "unitree_go2"
        return self

    def xml(self, entry: str) -> Path:
        assert entry == "robot"
        if self.file is None:
            raise OSError("<urlopen error [Errno -2] Name or service not known>")
        return self.file


def test_without_a_network_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", Menagerie(None))
    assert main(["import", "menagerie:unitree_go2"]) == 2
    assert capsys.readouterr().err == (
        "error: cannot download menagerie:unitree_go2: <urlopen error [Errno -2] Name or service "
        "not known>\n  is there a network? or import a file of that robot by its path\n"
    )


def test_the_model_of_the_menagerie_is_taken_without_its_scene(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    Path("go2.xml").write_text(quadruped())
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", Menagerie(Path("go2.xml")))
    assert find_source("menagerie:unitree_go2").path == Path("go2.xml")
    assert str(import_robot("menagerie:unitree_go2").folder) == "unitree_go2"


def test_a_clone_in_the_cache_of_robot_descriptions_needs_no_network(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The package's own code runs, with a repository in its cache that no network knows."""
    pytest.importorskip("robot_descriptions")
    git = pytest.importorskip("git")
    place = Path("robots/go2_description/urdf/go2_description.urdf")
    made = tmp_path / "made"
    (made / place).parent.mkdir(parents=True)
    (made / place).write_text(quadruped())
    repository = git.Repo.init(made)
    repository.index.add([str(place)])
    author = git.Actor("a", "a@example.org")
    commit = repository.index.commit("a", author=author, committer=author).hexsha
    repository.close()
    clone = tmp_path / "cache" / f"unitree_ros-{commit}" / "unitree_ros"
    clone.parent.mkdir(parents=True)
    made.rename(clone)
    monkeypatch.setenv("ROBOT_DESCRIPTIONS_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("ROBOT_DESCRIPTION_COMMIT", commit)
    monkeypatch.delitem(sys.modules, "robot_descriptions.go2_description", raising=False)
    assert find_source("robot_descriptions:go2_description").path == clone / place
    found = import_robot("robot_descriptions:go2_description")
    assert (str(found.folder), len(found.joints)) == ("go2", 12)
    monkeypatch.delitem(sys.modules, "robot_descriptions.go2_description", raising=False)


def test_a_module_of_robot_descriptions_that_cannot_clone_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("robot_descriptions")
    plain = importlib.import_module

    def offline(name: str, *rest: Any) -> ModuleType:
        if name == "robot_descriptions.go2_description":
            print("Cloning https://example.org/go2.git...")
            print("0it [00:00, ?it/s]", end="", file=sys.stderr)
            raise RuntimeError("git\n  stderr: 'fatal: unable to access the repository'")
        return plain(name, *rest)

    monkeypatch.setattr(importlib, "import_module", offline)
    assert main(["import", "robot_descriptions:go2_description"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err == (
        "Cloning https://example.org/go2.git...\n"
        "error: cannot download robot_descriptions:go2_description: fatal: unable to access the "
        "repository\n  is there a network? or import a file of that robot by its path\n"
    )
    with pytest.raises(DraftError, match="robot_descriptions has no robot 'os'"):
        find_source("robot_descriptions:os")


def test_a_name_without_a_robot_says_what_one_is() -> None:
    with pytest.raises(DraftError, match="names no robot\n  such as menagerie:unitree_go2"):
        find_source("menagerie:")


def test_a_file_with_a_colon_in_its_name_is_a_file() -> None:
    Path("menagerie:a.urdf").write_text(quadruped())
    assert find_source("menagerie:a.urdf").path == Path("menagerie:a.urdf")


def test_a_xacro_is_expanded() -> None:
    pytest.importorskip("xacrodoc")
    text = quadruped().replace('<robot name="beast">', '<robot name="beast" xmlns:xacro="x">')
    text = text.replace('xmlns:xacro="x"', 'xmlns:xacro="http://www.ros.org/wiki/xacro"')
    text = text.replace("\n", '\n<xacro:property name="gap" value="0.2"/>\n', 1)
    Path("beast.urdf.xacro").write_text(text.replace('xyz="0.2 0.1 0"', 'xyz="${gap} 0.1 0"'))
    found = import_robot("beast.urdf.xacro")
    assert (str(found.folder), len(found.joints)) == ("beast", 12)
    assert found.geometry.joints == 12


def test_a_xacro_that_cannot_be_expanded_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("xacrodoc")
    Path("bad.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n<link name="${nothing}"/></robot>'
    )
    assert main(["import", "bad.xacro"]) == 2
    err = capsys.readouterr().err
    assert err.startswith("error: bad.xacro: the xacro cannot be expanded: ")
    assert "xacro FILE > robot.urdf" in err
    assert main(["import", "gone.xacro"]) == 2
    assert capsys.readouterr().err == "error: gone.xacro: file not found\n"


def test_no_package_of_robots_is_imported_for_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("r.urdf").write_text(quadruped())
    plain = builtins.__import__

    def watched(name: str, *rest: Any) -> ModuleType:
        assert name.split(".", maxsplit=1)[0] not in (
            "mujoco_menagerie",
            "robot_descriptions",
            "xacrodoc",
        )
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", watched)
    assert find_source("r.urdf").text is None
