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

from draft.errors import DraftError
from draft.extras import remedy
from draft.imports.importer import import_robot
from draft.imports.sources import find_source
from tests.commands import refusal
from tests.imports.written import quadruped

with_data = pytest.mark.skipif(
    not any(metadata.distributions(name="example-robot-data")),
    reason="example-robot-data is not installed",
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
def test_a_name_that_a_package_lacks_is_met_with_the_nearest() -> None:
    words = "example-robot-data has no robot 'anymal_d'\n  did you mean 'anymal_"
    assert refusal("import", "example-robot-data:anymal_d").startswith(words)


@pytest.mark.parametrize(
    ("file", "package"),
    [
        ("example-robot-data:anymal_c", "example-robot-data"),
        ("menagerie:unitree_go2", "mujoco_menagerie"),
        ("robot_descriptions:go2_description", "robot_descriptions"),
        ("r.urdf.xacro", "xacrodoc"),
    ],
)
def test_a_package_that_is_not_installed_is_named_with_the_remedy(
    file: str, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing(name: str) -> metadata.Distribution:
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "distribution", missing)
    monkeypatch.setitem(sys.modules, package, None)
    Path("r.urdf.xacro").write_text("<robot/>")
    assert refusal("import", file) == f"{package} is not installed\n  {remedy('robots')}\n"


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


NETWORK = "  is there a network? or import a file of that robot by its path\n"


def test_without_a_network_one_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", Menagerie(None))
    words = "menagerie:unitree_go2: <urlopen error [Errno -2] Name or service not known>\n"
    assert refusal("import", "menagerie:unitree_go2") == f"cannot download {words}{NETWORK}"


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


CLONING = "Cloning https://example.org/go2.git...\n"


def test_a_module_of_robot_descriptions_that_cannot_clone_is_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("robot_descriptions")
    plain = importlib.import_module

    def offline(name: str, *rest: Any) -> ModuleType:
        if name == "robot_descriptions.go2_description":
            print(CLONING, end="")
            print("0it [00:00, ?it/s]", end="", file=sys.stderr)
            raise RuntimeError("git\n  stderr: 'fatal: unable to access the repository'")
        return plain(name, *rest)

    monkeypatch.setattr(importlib, "import_module", offline)
    words = "robot_descriptions:go2_description: fatal: unable to access the repository\n"
    assert refusal("import", "robot_descriptions:go2_description", first=CLONING) == (
        f"cannot download {words}{NETWORK}"
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


def test_a_xacro_that_cannot_be_expanded_is_one_line() -> None:
    pytest.importorskip("xacrodoc")
    Path("bad.xacro").write_text(
        '<robot xmlns:xacro="http://www.ros.org/wiki/xacro">\n<link name="${nothing}"/></robot>'
    )
    error = refusal("import", "bad.xacro")
    assert error.startswith("bad.xacro: the xacro cannot be expanded: ")
    assert "xacro FILE > robot.urdf" in error
    assert refusal("import", "gone.xacro").startswith(
        "gone.xacro: file not found\n  name a maker's"
    )


def test_no_package_of_robots_is_imported_for_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    Path("r.urdf").write_text(quadruped())
    plain = builtins.__import__

    def watched(name: str, *rest: Any) -> ModuleType:
        packages = ("mujoco_menagerie", "robot_descriptions", "xacrodoc")
        assert name.split(".", maxsplit=1)[0] not in packages
        return plain(name, *rest)

    monkeypatch.setattr(builtins, "__import__", watched)
    assert find_source("r.urdf").text is None
