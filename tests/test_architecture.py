"""Imports run one way, light commands stay light, and nothing runs a user's text."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from graphlib import TopologicalSorter
from itertools import pairwise
from pathlib import Path

import pytest

import draft

SOURCE = Path(draft.__file__).parent
FILES = sorted(SOURCE.rglob("*.py"))
GROUND = {
    "errors",
    "values",
    "geometry",
    "files",
    "extras",
    "lazy",
    "meshes",
    "extensions",
    "offscreen",
    "mujoco_log",
    "parallel",
    "plotting",
    "settings",
    "webpage",
    "drawing",
}
# What each part of the house may import, besides itself and the ground it stands on.
BELOW: dict[str, set[str]] = {
    **{name: set() for name in GROUND},
    # core
    "laws": set(),
    "spec": {"laws"},
    "design": {"laws", "spec"},
    "model": {"laws", "spec", "design"},
    # robots
    "description": set(),
    "fitting": {"laws", "description"},
    "imports": {"laws", "spec", "design", "model", "description"},
    "twins": {"laws", "spec", "design", "model", "description", "fitting", "imports"},
    "serving": set(),
    # what designs can do
    "metrics": {"laws", "spec", "design", "model"},
    "variation": {"laws", "spec"},
    "learn": {"laws", "spec", "design", "model", "metrics", "variation", "serving"},
    "explore": {"laws", "spec", "design", "model", "metrics", "variation", "learn"},
    "browser": {
        *("laws", "spec", "design", "model", "metrics", "variation", "explore", "learn"),
        "serving",
    },
    "reporting": {
        *("laws", "spec", "design", "model", "fitting", "metrics", "explore", "learn"),
        "browser",
    },
    "deployment": {"laws", "spec", "design", "model", "metrics", "variation", "learn"},
    "studio": {
        *("laws", "spec", "design", "model", "metrics", "explore", "learn"),
        *("reporting", "serving"),
    },
    "validation": {
        *("laws", "spec", "design", "model", "description", "fitting", "imports", "twins"),
        *("metrics", "learn"),
    },
    "study": {"laws", "spec", "design", "model", "metrics", "explore", "learn"},
    "assistant": {"laws", "spec", "design", "model", "metrics", "variation", "explore", "learn"},
    "doctor": {"learn"},
    "cli": {
        *("laws", "spec", "design", "model", "description", "fitting", "imports", "twins"),
        *(
            "metrics",
            "variation",
            "explore",
            "reporting",
            "browser",
            "deployment",
            "studio",
            "learn",
            "study",
            "serving",
            "validation",
        ),
        "doctor",
        "assistant",
    },
    # The face for extensions: names by their modules, like those of the package itself.
    "extend": {"errors"},
    # `import draft` alone brings the errors; the nouns come on first use, by their names.
    "__init__": set(),
    "__main__": {"cli"},
}
HEAVY = (
    *("mujoco", "pydantic", "yaml", "numpy", "torch", "mjlab", "trimesh"),
    *("scipy", "pyarrow", "optuna", "ray"),
)


@dataclass(frozen=True)
class Import:
    """An import of a part of Draft: in which file and function, of which module.

    Attributes:
        by_verb: whether the function is marked as a `draft.lazy.verb`.
    """

    file: str
    function: str
    module: str
    by_verb: bool

    @property
    def part(self) -> str:
        return [*self.module.split("."), ""][1]

    @property
    def importer(self) -> str:
        return self.file.split("/")[0].removesuffix(".py")


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module", autouse=True)
def trees() -> Iterator[None]:
    """Forget the trees, which are large, when the tests of this file have read them."""
    yield
    _tree.cache_clear()


@cache
def _imports(path: Path) -> tuple[Import, ...]:
    """Imports of Draft that run: those for type checkers are left out."""
    file = path.relative_to(SOURCE).as_posix()

    def walk(node: ast.AST, scope: tuple[str, ...], verb: bool) -> Iterator[Import]:
        for child in ast.iter_child_nodes(node):
            inner, marked = scope, verb
            if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                inner = (*scope, child.name)
                marked = "verb" in map(ast.unparse, child.decorator_list)
            if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                for other in child.orelse:
                    yield from walk(other, scope, verb)
                continue
            for module in _modules(child):
                if module.split(".")[0] == "draft":
                    yield Import(file, ".".join(scope), module, verb)
            yield from walk(child, inner, marked)

    return tuple(walk(_tree(path), (), False))


def _modules(node: ast.AST) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    assert node.level == 0, "imports are written out in full"
    return [f"{node.module}.{alias.name}" for alias in node.names]


def _part_of(name: str) -> str:
    """Part of the house that a name of the package itself comes from."""
    return (draft._MODULES.get(name) or f"draft.{name}").split(".")[1]


def test_imports_run_one_way() -> None:
    for item in (item for path in FILES for item in _imports(path)):
        allowed = GROUND if item.importer in GROUND else BELOW[item.importer] | GROUND
        assert item.by_verb or _part_of(item.part) in allowed | {item.importer}, item


def test_a_verb_hands_on_to_one_later_package_and_needs_its_mark() -> None:
    up: dict[tuple[str, str], set[str]] = {}
    for item in (item for path in FILES for item in _imports(path) if item.by_verb):
        later = up.setdefault((item.file, item.function), set())
        if item.part not in BELOW[item.importer] | GROUND | {item.importer}:
            assert item.importer in BELOW[item.part]
            later.add(item.part)
    assert up
    assert all(len(later) == 1 for later in up.values()), up


def test_only_packages_offer_names_that_are_imported_on_first_use() -> None:
    offer = {
        path.relative_to(SOURCE).as_posix()
        for path in FILES
        if re.search(r"^__getattr__ = on_first_use", path.read_text(encoding="utf-8"), re.M)
    }
    assert {file for file in offer if not file.endswith("__init__.py")} == {"extend.py"}


def _starts_of_the_command_line(tree: ast.AST) -> list[int]:
    """Lines that name the command line in a string: imports that the tests above cannot see."""
    found = []
    for node in ast.walk(tree):
        named = False
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            named = "draft.cli" in node.value or "draft.__main__" in node.value
        elif isinstance(node, (ast.List, ast.Tuple)):
            named = ("-m", "draft") in pairwise(_words(node))
        elif isinstance(node, ast.Call) and node.args:
            named = _words(node.args[0])[:1] == ["draft"]
        if named:
            found.append(getattr(node, "lineno", 0))
    return found


def _words(node: ast.AST) -> list[object]:
    """Entries of a list or tuple, None for what is no constant."""
    entries = node.elts if isinstance(node, (ast.List, ast.Tuple)) else []
    return [one.value if isinstance(one, ast.Constant) else None for one in entries]


def _found(lines: Callable[[ast.AST], list[int]], *but: str) -> dict[str, list[int]]:
    """Lines that are found in files, except those below some names."""
    names = {path: path.relative_to(SOURCE) for path in FILES}
    read = [path for path in FILES if names[path].parts[0] not in but]
    return {names[path].as_posix(): found for path in read if (found := lines(_tree(path)))}


def test_nothing_below_starts_the_command_line_by_its_name() -> None:
    assert _found(_starts_of_the_command_line, "cli", "__main__.py") == {}


def test_what_starts_the_command_line_by_its_name_is_found() -> None:
    for text in (
        "importlib.import_module('draft.cli')",
        'PROGRAM = (sys.executable, "-m", "draft.cli.worker")',
        'run([sys.executable, "-m", "draft", "train"])',
        'run(["draft", "train"])',
    ):
        assert _starts_of_the_command_line(ast.parse(text)) == [1]
    other = ast.parse('run([sys.executable, "-m", "draft.learn.x"])')
    assert _starts_of_the_command_line(other) == []


OPTION = re.compile(r"(?<![\w-])--[a-z]+(?:-[a-z]+)*(?![\w-])")


def _options(tree: ast.AST) -> list[int]:
    """Lines that spell an option in a string; a word of a list is an argument of a process."""
    words = {id(one) for node in ast.walk(tree) if isinstance(node, ast.List) for one in node.elts}
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):  # an option whose name is filled in
            parts = [one.value if isinstance(one, ast.Constant) else None for one in node.values]
            named = any(one is None and str(before)[-2:] == "--" for before, one in pairwise(parts))
        else:
            text = node.value if isinstance(node, ast.Constant) else None
            named = isinstance(text, str) and bool(OPTION.search(text)) and id(node) not in words
        if named:
            found.append(getattr(node, "lineno", 0))
    return found


def test_only_the_command_line_spells_options() -> None:
    assert _found(_options, "cli") == {}


def test_what_spells_an_option_is_found() -> None:
    for text in (
        'raise DraftError(cause, "omit --out")',
        'f"--knee-drive {place}"',
        'f"--{name}"',
        '"""As `--json` prints it."""',
    ):
        assert _options(ast.parse(text)) == [1]
    for text in ('run(["uv", "sync", "--no-dev"])', '"--"', '"`Spec --resolve--> Design`"'):
        assert _options(ast.parse(text)) == []


def _loaded_after(code: str, modules: Sequence[str] = HEAVY, cwd: Path | None = None) -> set[str]:
    """Which of some modules are there in a fresh process after some code."""
    report = f"{code}\nimport sys\nprint('LOADED', *[m for m in {modules!r} if m in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", report], capture_output=True, text=True, check=True, cwd=cwd
    )
    return set(done.stdout.split("LOADED")[-1].split())


def test_importing_draft_alone_is_light() -> None:
    assert _loaded_after("import draft") == set()
    assert _loaded_after("import draft; draft.load") >= {"yaml", "pydantic"}


def test_asking_for_help_is_light() -> None:
    assert _loaded_after("from draft.cli import main") == set()
    help_ = "from draft.cli import main\ntry: main(['--help'])\nexcept SystemExit: pass"
    assert _loaded_after(help_) == set()


def test_loading_and_resolving_need_no_mujoco() -> None:
    assert "mujoco" not in _loaded_after("import draft; draft.load('quadruped').resolve('bear')")


def test_the_text_of_a_model_its_verdict_and_messages_need_neither_mujoco_nor_a_terminal() -> None:
    absent = ("mujoco", "rich", "tyro", "trimesh", "collada")
    code = f"""import sys
for name in {absent}:
    sys.modules[name] = None
import draft
from draft.model.mjcf import robot_xml
arm = draft.load("arm").resolve()
weak = draft.load("quadruped").resolve({{"actuators.leg.peak_torque": 1}})
assert robot_xml(arm).startswith("<mujoco ") and arm.accepted and not weak.accepted
assert all(finding.message for finding in weak.findings)
try:
    draft.load("quadruped").resolve({{"thigh": 1}})
except draft.DraftError as error:
    assert "thigh_length" in str(error)"""
    assert _loaded_after(code) == {"numpy", "pydantic", "yaml"} | {"mujoco", "trimesh"}


def test_building_a_robot_needs_the_laws_and_nothing_that_fits_or_draws(tmp_path: Path) -> None:
    build = "from draft.cli import main\nmain(['build', 'quadruped', '--out', 'model'])"
    wanted = ("draft.laws", "draft.fitting", "draft.description", "draft.plotting")
    loaded = _loaded_after(build, (*wanted, "scipy", "matplotlib", "mujoco"), tmp_path)
    assert (tmp_path / "model" / "robot.xml").is_file()
    assert loaded == {"draft.laws", "mujoco"}


def test_exploring_brings_its_libraries_only_when_it_works() -> None:
    modules = "engines, front, goals, job, optimise, parquet_parts, screen, sweep"
    loaded = _loaded_after(f"from draft.explore import {modules}")
    assert not loaded & {"scipy", "pyarrow", "optuna", "ray", "mujoco"}


@pytest.mark.slow
def test_showing_the_numbers_of_learning_brings_neither_torch_nor_mjlab() -> None:
    # Where there may be a GPU PyTorch has to be asked for it.
    setup = "import os\nos.environ['CUDA_VISIBLE_DEVICES'] = ''\nfrom draft.cli import main\n"
    for words in (["learn", "show"], ["learn", "show", "bear", "--json"]):
        loaded = _loaded_after(f"{setup}main({words!r})")
        assert not loaded & {"torch", "mjlab", "scipy"}


def test_a_shipped_policy_needs_numpy_alone_and_to_watch_it_mujoco() -> None:
    act = "import draft, numpy\ndraft.policy('cheetah', 'run')(numpy.zeros(48))"
    assert _loaded_after(act) == {"numpy"}
    step = (
        "p = Playback(policy('cheetah'), load('quadruped').resolve('cheetah'), Scenario((0, 0, 0)))"
    )
    names = (
        "from draft import load, policy\nfrom draft.learn.policy.playback import Playback, Scenario"
    )
    loaded = _loaded_after(f"{names}\n{step}\np.step()")
    assert "mujoco" in loaded
    assert not loaded & {"torch", "mjlab", "scipy", "pyarrow"}


# Packages of `learn`: each may import those before it, besides what loads mjlab.
LEARN = ("bodies", "task", "engine", "policy", "training", "measuring", "watching")


@pytest.mark.parametrize("room", LEARN)
def test_a_package_of_learn_imports_only_those_before_it(room: str) -> None:
    allowed = {*LEARN[: LEARN.index(room) + 1], "silence"}
    for path in (SOURCE / "learn" / room).rglob("*.py"):
        for item in _imports(path):
            if item.part == "learn":
                assert item.module.split(".")[2] in allowed, item


def test_a_policy_meets_no_training() -> None:
    rooms = [f"draft.learn.{room}" for room in LEARN]
    played = _loaded_after("import draft.learn.policy.playback", [*rooms, "torch", "mjlab"])
    assert played == {"draft.learn.bodies", "draft.learn.task", "draft.learn.policy"}


def test_no_module_imports_itself_by_way_of_others() -> None:
    known = {_module(path): path for path in FILES}
    graph: dict[str, set[str]] = {name: set() for name in known}
    for name, path in known.items():
        for item in _imports(path):
            module = item.module if item.module in known else item.module.rpartition(".")[0]
            if module in known and not item.function:
                graph[name].add(module)
    TopologicalSorter(graph).prepare()


def _module(path: Path) -> str:
    parts = ("draft", *path.relative_to(SOURCE).with_suffix("").parts)
    return ".".join(parts).removesuffix(".__init__")


def test_no_two_files_below_a_package_have_one_name() -> None:
    places = [path.relative_to(SOURCE) for path in FILES if path.name != "__init__.py"]
    names = Counter((place.parts[0], place.name) for place in places if len(place.parts) > 1)
    assert [name for name, count in names.items() if count > 1] == []


FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "execfile"}
FORBIDDEN_MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}
FORBIDDEN_METHODS = {"yaml.load", "yaml.unsafe_load", "yaml.full_load", "os.system"}


def _forbidden(tree: ast.AST) -> list[int]:
    """Lines that can run or unpickle a user's text, or start a shell."""
    found = []
    for node in ast.walk(tree):
        bad = False
        if isinstance(node, ast.Call):
            bad = ast.unparse(node.func) in FORBIDDEN_CALLS | FORBIDDEN_METHODS
        elif isinstance(node, (ast.Import, ast.ImportFrom)):
            bad = any(module.split(".")[0] in FORBIDDEN_MODULES for module in _modules(node))
        elif isinstance(node, ast.keyword) and node.arg == "shell":
            bad = ast.unparse(node.value) != "False"
        if bad:
            found.append(getattr(node, "lineno", 0))
    return found


def test_no_file_can_run_or_unpickle_a_users_text() -> None:
    assert _found(_forbidden) == {}


def test_what_can_run_a_users_text_is_found() -> None:
    for text in ("eval(text)", "from pickle import loads", "yaml.load(a)", "run(a, shell=True)"):
        assert _forbidden(ast.parse(text)) == [1]
    assert _forbidden(ast.parse("run(a, shell=False)\nyaml.safe_load(a)")) == []
