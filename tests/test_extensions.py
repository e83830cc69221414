"""Extensions: loaded when a registry is read, undone where they fail, and a line for each fault."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import threading
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import draft
from draft import doctor, extensions
from draft.design.checks import CHECKS, kinds
from draft.extensions import ExtensionWarning, Registry, load
from draft.extras import DISTRIBUTION
from draft.laws.actuators import ACTUATOR_LAWS
from draft.metrics import METRICS, of_design, of_model
from draft.model.exporters import EXPORTERS
from draft.spec.jsonschema import SCHEMAS, schema_text
from draft.spec.primitives import LINKS

EXAMPLE = Path(__file__).resolve().parents[1] / "examples" / "extension"
HOPPER = Path(draft.__file__).parent / "robots" / "hopper"
METRIC = '''
from draft.extend import metric

@metric(unit="kg", formula="m", source="a test", better="less")
def {name}(design):
    """A mass [kg]."""
    {body}
'''
CHECK = '''
from draft.extend import check, note

@check(error={error})
def too_heavy(design):
    """The robot is heavier than a hand can lift."""
    mask, mass = {mask}, design.mass
    yield from note("{kind}", "body", mask, "{{value}} > {{limit}}", "a test", mass, 2.0, "kg")
'''
Install = Callable[..., None]


def write(folder: Path, package: str, text: str, entry: str = "") -> None:
    """Write an installed package of one module, as an installer leaves it."""
    (folder / f"{package}.py").write_text(text, encoding="utf-8")
    record = folder / f"{package}-2.5.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 2.5\n")
    points = f"[draft.extensions]\nof_{package} = {entry or package}\n"
    (record / "entry_points.txt").write_text(points)


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Function that installs an extension; what it adds is gone after the test."""
    monkeypatch.setattr(extensions, "_LOADED", [])
    monkeypatch.setattr(extensions, "_BEGUN", threading.Event())
    monkeypatch.setattr(extensions, "_DONE", threading.Event())
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    names = []

    def add(package: str, text: str, entry: str = "") -> None:
        names.append(package)
        write(site, package, text, entry)

    yield add
    for name in (*names, "tests"):
        sys.modules.pop(name if name != "tests" else "", None)
        for registry in extensions._REGISTRIES:
            registry.drop(name, ())


def left() -> list[str]:
    """Everything that is no item of Draft."""
    registries = (METRICS, LINKS, CHECKS, EXPORTERS, ACTUATOR_LAWS)
    return [name for one in registries for name in one if one.origin(name)]


# --- loading ---------------------------------------------------------------------------------


def test_an_extension_is_loaded_once_when_a_registry_is_read(
    install: Install, tmp_path: Path
) -> None:
    count = tmp_path / "count"
    text = f"with open({str(count)!r}, 'a') as file:\n    file.write('x')\n"
    install("ext_once", text + METRIC.format(name="once", body="return 2 * design.mass"))
    assert not count.exists()
    assert "once" in METRICS
    design = draft.load("hopper").resolve()
    assert of_design(design)["once"] == 2 * design.mass
    assert count.read_text() == "x"
    assert METRICS.origin("once") == "ext_once"
    (found,) = load()
    assert (found.package, found.version, found.problem) == ("ext_once", "2.5", "")
    assert extensions.added(found) == {"metric": ["once"]}


def test_an_extension_may_read_registries_while_it_is_loaded(install: Install) -> None:
    text = "from draft.metrics import METRICS\nassert 'mass' in METRICS\n"
    install("ext_reads", text + METRIC.format(name="reads", body="return len(METRICS)"))
    assert "reads" in METRICS


BROKEN = {
    "exit": ("raise SystemExit(3)", "SystemExit: 3"),
    "import": ("import no_such_library", "ModuleNotFoundError: No module named 'no_such_library'"),
    "fault": ("1 / 0", "ZeroDivisionError: division by zero"),
    "lines": ("raise ValueError('one\\n  two')", "ValueError: one two"),
    "syntax": ("def", "SyntaxError: invalid syntax"),
}


@pytest.mark.parametrize(("end", "says"), BROKEN.values(), ids=BROKEN)
def test_an_extension_that_fails_is_undone_and_told_in_a_line(
    install: Install, end: str, says: str
) -> None:
    install("ext_broken", METRIC.format(name="lost", body="return 1.0") + end)
    install("ext_sound", METRIC.format(name="kept", body="return 1.0"))
    with pytest.warns(ExtensionWarning) as caught:
        assert left() == ["kept"]
    (line,) = (str(one.message) for one in caught)
    assert line.startswith(f"extension 'of_ext_broken' of ext_broken is not used: {says}")
    assert "\n" not in line
    assert "ext_broken" not in sys.modules
    assert [bool(one.problem) for one in load()] == [True, False]


def test_an_entry_point_to_no_module_is_told(install: Install) -> None:
    install("ext_gone", "", "ext_gone.nowhere:thing")
    with pytest.warns(ExtensionWarning, match="'of_ext_gone' of ext_gone is not used: Module"):
        assert left() == []


def test_an_entry_point_that_names_no_module_is_told(install: Install) -> None:
    install("ext_dash", "", "ext-dash")
    with pytest.warns(ExtensionWarning, match=r"extension '\w+' of .* is not used"):
        assert "mass" in METRICS


def test_a_metric_that_fails_is_left_out_of_a_run_that_names_none(
    install: Install, tmp_path: Path
) -> None:
    pytest.importorskip("pyarrow")
    install("ext_fails", METRIC.format(name="fails", body="raise KeyError('x')"))
    vary = {"thigh_length": (0.2, 0.25)}
    with pytest.warns(ExtensionWarning, match="the metric 'fails' of ext_fails fails: KeyError"):
        rows = draft.sweep("hopper", vary=vary, n=2, out=tmp_path / "all")
    assert rows.accepted == 2
    with pytest.raises(draft.DraftError, match="the metric 'fails' of ext_fails fails"):
        draft.sweep("hopper", vary=vary, n=2, metrics=["fails"], out=tmp_path / "named")
    assert not (tmp_path / "named").exists()


def test_of_two_extensions_with_one_name_the_second_is_left_out(install: Install) -> None:
    install("ext_a", METRIC.format(name="same", body="return 1.0"))
    install("ext_b", METRIC.format(name="own", body="1") + METRIC.format(name="same", body="2"))
    says = "the metric 'same' of ext_b exists already in ext_a rename the metric"
    with pytest.warns(ExtensionWarning, match=says):
        assert left() == ["same"]
    assert METRICS.origin("same") == "ext_a"


def test_a_package_of_two_extensions_keeps_the_sound_one(install: Install, tmp_path: Path) -> None:
    site = tmp_path / "site"
    install("ext_two", "", "ext_two_bad")
    points = site / "ext_two-2.5.dist-info" / "entry_points.txt"
    shutil.rmtree(site / "ext_two", ignore_errors=True)
    (site / "ext_two.py").unlink()
    (site / "ext_two").mkdir()
    (site / "ext_two" / "__init__.py").touch()
    (site / "ext_two" / "good.py").write_text(METRIC.format(name="good", body="return 1.0"))
    (site / "ext_two" / "bad.py").write_text("from ext_two import good\nimport nothing_here\n")
    points.write_text("[draft.extensions]\na = ext_two.bad\nb = ext_two.good\n")
    with pytest.warns(ExtensionWarning, match="extension 'a' of ext_two is not used"):
        assert left() == ["good"]
    for name in ("ext_two.good", "ext_two.bad"):
        sys.modules.pop(name, None)


def test_a_cell_that_runs_again_replaces_its_item_and_a_module_does_not() -> None:
    registry: Registry[int] = Registry("number")
    registry.add("one", 1, "__main__")
    registry.add("one", 2, "__main__")
    assert registry["one"] == 2
    with pytest.raises(
        draft.DraftError, match=r"the number 'one' of a\.b exists already in __main_"
    ):
        registry.add("one", 3, "a.b")
    extensions._REGISTRIES.remove(registry)


def test_the_doctor_lists_extensions(install: Install) -> None:
    install("ext_fine", METRIC.format(name="fine", body="return 1.0"))
    install("ext_ill", "import no_such_library")
    with pytest.warns(ExtensionWarning):
        fine, ill = doctor._extensions()
    assert (fine.item, fine.text) == ("extension of_ext_fine", "ext_fine 2.5, metric fine")
    assert ill.text.startswith("ext_ill 2.5, not used: ModuleNotFoundError")
    assert fine.record["added"] == {"metric": ["fine"]}


# --- what extensions add ---------------------------------------------------------------------

FAULTS = {
    "raises": ("return 1 / 0", "ZeroDivisionError: division by zero"),
    "shape": ("import numpy; return numpy.ones(7)", r"an array of shape \(7,\), not one number"),
    "kind": ("return 'heavy'", "could not convert string to float"),
    "none": ("return None", "TypeError: it gives None"),
}


@pytest.mark.parametrize(("body", "says"), FAULTS.values(), ids=FAULTS)
def test_a_metric_that_fails_is_told_with_its_module(
    install: Install, body: str, says: str
) -> None:
    install("ext_metric", METRIC.format(name="ill", body=body))
    design = draft.load("hopper").resolve()
    cause = f"the metric 'ill' of ext_metric fails: .*{says}"
    with pytest.raises(draft.DraftError, match=cause):
        of_design(design, ["ill"])
    with pytest.warns(ExtensionWarning, match=cause):
        found = of_design(design)
    assert np.isnan(found["ill"])
    assert found["mass"] > 0
    with pytest.warns(ExtensionWarning, match=cause):
        of_model(design.build())


def test_a_check_refuses_designs_one_by_one_unless_allowed(install: Install) -> None:
    install("ext_check", CHECK.format(error=True, mask="design.mass > 5", kind="too_heavy"))
    spec = draft.load("hopper")
    many = spec.resolve({"thigh_length": np.array([0.15, 0.3])})
    assert np.array_equal(many.accepted, np.asarray(many.mass) <= 5)
    assert kinds()["too_heavy"] == "The robot is heavier than a hand can lift"
    files = {name: file.read_bytes() for name, file in spec.files.items()}
    files["parameters.yaml"] += b"\nallow: [too_heavy]\n"
    allowed = draft.Spec.parse(files).resolve({"thigh_length": np.array([0.15, 0.3])})
    assert np.all(allowed.accepted)
    assert "too_heavy" in {finding.id for finding in allowed.findings}


def test_screens_have_a_bit_for_each_check(install: Install, tmp_path: Path) -> None:
    pq = pytest.importorskip("pyarrow.parquet")
    install("ext_check", CHECK.format(error=True, mask="design.mass > 0", kind="too_heavy"))
    out = tmp_path / "out.parquet"
    draft.screen("hopper", vary={"thigh_length": (0.15, 0.3)}, n=8, out=out, workers=1)
    table = pq.read_table(out)
    assert set(table["refused_by"].to_pylist()) == {"too_heavy"}
    bit = 1 << [*kinds()].index("too_heavy")
    assert all(value & bit for value in table["findings"].to_pylist())


ILL_CHECKS = {
    "raises": ("1 / 0", "too_heavy", "ZeroDivisionError"),
    "kind": ("True", "torque", "it yields a finding of the kind 'torque'"),
    "shape": ("__import__('numpy').ones(7, bool)", "too_heavy", r"it yields a mask of shape \(7,"),
}


@pytest.mark.parametrize(("mask", "kind", "says"), ILL_CHECKS.values(), ids=ILL_CHECKS)
def test_a_check_that_fails_is_left_out(install: Install, mask: str, kind: str, says: str) -> None:
    install("ext_check", CHECK.format(error=True, mask=mask, kind=kind))
    spec = draft.load("hopper")
    with pytest.warns(ExtensionWarning, match=f"the check 'too_heavy' of ext_check is .*{says}"):
        assert spec.resolve().accepted


REFUSED = {
    "check like a finding": (
        CHECK.format(error=False, mask=True, kind="x").replace("def too_heavy", "def torque"),
        "the check 'torque' of ext_named exists already in draft.design.checks",
    ),
    "exporter of a foreign file": (
        "from draft.extend import exporter\n@exporter('robot.xml')\ndef mine(model): ...",
        "the exporter 'mine' of ext_named cannot write 'robot.xml'",
    ),
    "exporter out of the folder": (
        "from draft.extend import exporter\n@exporter('../x')\ndef mine(model): ...",
        "the exporter 'mine' of ext_named cannot write '../x'",
    ),
    "primitive like a primitive": (
        "from typing import Literal\nfrom draft.extend import LinkBase, primitive\n"
        "@primitive\nclass Mine(LinkBase):\n    type: Literal['box']",
        "the link primitive 'box' of ext_named exists already in draft.spec.primitives.box",
    ),
    "primitive without a type": (
        "from draft.extend import LinkBase, primitive\n@primitive\nclass Mine(LinkBase): ...",
        "the link primitive Mine of ext_named has no 'type",
    ),
    "primitive of another class": (
        "from draft.extend import primitive\n@primitive\nclass Mine: ...",
        "the link primitive Mine of ext_named is no subclass of LinkBase",
    ),
    "no robots": (
        "from draft.extend import robots\nrobots('/nowhere', __name__)",
        "there is no robot in '/nowhere', of ext_named",
    ),
    "robot like a robot": (
        f"from draft.extend import robots\nrobots({str(HOPPER.parent)!r}, __name__)",
        "the robot 'hopper' of ext_named exists already in draft.robots",
    ),
    "laws like laws": (
        "from draft.extend import actuator_laws\n@actuator_laws\ndef paper(): ...",
        "the set of actuator laws 'paper' of ext_named exists already in draft.laws.actuators",
    ),
}


@pytest.mark.parametrize(("text", "says"), REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_added_is_told(install: Install, text: str, says: str) -> None:
    install("ext_named", text)
    with pytest.warns(ExtensionWarning) as caught:
        assert left() == []
    assert f"is not used: {says}" in str(caught[0].message)


ILL_EXPORTERS = {
    "raises": ("1 / 0", "ZeroDivisionError"),
    "path": ("return {'other.txt': ''}", "it writes 'other.txt', which it does not name"),
    "content": ("return {'mine.txt': 3}", "'mine.txt' is neither text nor bytes"),
    "nothing": ("pass", "AttributeError"),
}


@pytest.mark.parametrize(("body", "says"), ILL_EXPORTERS.values(), ids=ILL_EXPORTERS)
def test_an_exporter_that_fails_writes_nothing(
    install: Install, tmp_path: Path, body: str, says: str
) -> None:
    text = f"from draft.extend import exporter\n@exporter('mine.txt')\ndef mine(model):\n    {body}"
    install("ext_export", text)
    design = draft.load("hopper").resolve()
    with pytest.raises(
        draft.DraftError, match=f"the exporter 'mine' of ext_export fails: .*{says}"
    ):
        draft.export(design, tmp_path / "out", ["mine"])
    assert not (tmp_path / "out").exists()


def test_a_robot_of_an_extension_is_known_by_name(install: Install, tmp_path: Path) -> None:
    shutil.copytree(HOPPER, tmp_path / "robots" / "pogo")
    folder = str(tmp_path / "robots")
    install("ext_robots", f"from draft.extend import robots\nrobots({folder!r}, __name__)")
    assert draft.shipped() == ("hopper", "humanoid", "pogo", "quadruped")
    assert draft.load("pogo").resolve().mass == draft.load("hopper").resolve().mass
    with pytest.raises(draft.SpecError, match="did you mean 'pogo'"):
        draft.load("poggo")


LAWS = """
from dataclasses import replace
from draft.extend import actuator_laws, laws, population, structure_laws

@actuator_laws
def light():
    trends = dict(laws("draft").trends)
    return replace(laws("draft"), trends=trends | {"mass": trends["mass"].scaled(0.5)})

@structure_laws
def printed(name):
    usual = population(name)
    return replace(usual, segments={k: one.scaled(2) for k, one in usual.segments.items()})

@actuator_laws
def ill():
    return {}
"""


def with_laws(**names: str) -> draft.Design:
    files = {name: file.read_bytes() for name, file in draft.load("hopper").files.items()}
    more = "".join(f"\n{key}: {name}\n" for key, name in names.items())
    files["parameters.yaml"] += more.encode()
    return draft.Spec.parse(files).resolve()


def test_a_robot_uses_the_laws_of_an_extension(install: Install) -> None:
    install("ext_laws", LAWS)
    usual = draft.load("hopper").resolve()
    light, printed = with_laws(trends="light"), with_laws(structure="printed")
    assert light.actuators["leg"].mass == pytest.approx(usual.actuators["leg"].mass / 2)
    assert light.actuators["leg"].laws.name == "light"
    assert printed.segments[-1].mass == pytest.approx(2 * usual.segments[-1].mass)
    with pytest.raises(draft.DraftError, match="actuator laws 'ill' of ext_laws fails: TypeError"):
        with_laws(trends="ill")
    with pytest.raises(draft.SpecError, match="expected draft, paper, light, ill or the name of a"):
        with_laws(trends="heavy")


def test_a_script_adds_a_primitive_after_a_robot_was_read(
    install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    draft.load("hopper")
    monkeypatch.syspath_prepend(str(EXAMPLE))
    from draft_example import pad  # type: ignore[import-not-found]

    files = {name: (HOPPER / name).read_text() for name in ("parameters.yaml", "root.yaml")}
    tree = (HOPPER / "tree.yaml").read_text().replace("type: sphere", "type: pad")
    tree = tree.replace("sphere: {radius: foot_radius", "pad: {radius: 0.05, thickness: 0.02")
    try:
        design = draft.Spec.parse({**files, "tree.yaml": tree}).resolve()
        assert design.bodies[-1].link.end is not None
        assert isinstance(design.bodies[-1].link.end, pad.PadPart)
        # Below every other link too.
        models = json.loads(schema_text("tree"))["$defs"]
        children = [
            one["properties"]["children"]
            for one in models.values()
            if "name" in one.get("properties", {}) and "children" in one["properties"]
        ]
        assert len(children) == len(LINKS) + 1
        assert all("#/$defs/PadLink" in json.dumps(one) for one in children)
    finally:
        for registry in extensions._REGISTRIES:
            registry.drop("draft_example", ())
        for name in [name for name in sys.modules if name.startswith("draft_example")]:
            del sys.modules[name]
    with pytest.raises(draft.SpecError, match="unknown value 'pad'"):
        draft.Spec.parse({**files, "tree.yaml": tree})
    assert schema_text("tree") == (SCHEMAS / "tree.json").read_text()


# --- in processes of their own ---------------------------------------------------------------


def ran(site: Path, *words: str, code: int = 0) -> tuple[str, str]:
    """What a command prints, with the packages of a folder installed."""
    done = subprocess.run(
        [sys.executable, *words],
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code, done.stderr
    return done.stdout, done.stderr


@pytest.mark.slow
def test_a_command_tells_of_a_broken_extension_and_goes_on(tmp_path: Path) -> None:
    write(tmp_path, "ext_broken", "raise SystemExit(3)")
    write(tmp_path, "ext_sound", METRIC.format(name="sound", body="return 1.0"))
    out, err = ran(tmp_path, "-m", "draft", "metrics", "hopper", "--json")
    assert json.loads(out)["metrics"]["sound"] == 1.0
    said = "warning: extension 'of_ext_broken' of ext_broken is not used: SystemExit: 3\n"
    assert err == said
    assert ran(tmp_path, "-m", "draft", "--help")[1] == ""


@pytest.mark.slow
def test_a_fault_of_an_extension_is_no_fault_of_draft(tmp_path: Path) -> None:
    body = "import warnings; design.no_such"
    text = METRIC.format(name="x", body=body).replace("@metric", "0 and metric")
    law = "\nfrom draft.extend import structure_laws, population\nfrom dataclasses import replace\n"
    law += "class Ill(dict):\n    def get(self, *_): return self.nothing\n"
    law += "@structure_laws\ndef ill(name): return replace(population(name), centres=Ill())\n"
    write(tmp_path, "ext_ill", text + law)
    shutil.copytree(HOPPER, tmp_path / "mine")
    with (tmp_path / "mine" / "parameters.yaml").open("a") as file:
        file.write("\nstructure: ill\n")
    _, err = ran(tmp_path, "-m", "draft", "check", str(tmp_path / "mine"), code=2)
    assert err.startswith("error: the extension 'of_ext_ill' of ext_ill 2.5 fails: AttributeError")
    assert "DRAFT_TRACEBACK=1 shows where" in err


@pytest.mark.slow
def test_worker_processes_have_the_extension(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    write(tmp_path, "ext_sound", METRIC.format(name="sound", body="return 3 * design.mass"))
    write(tmp_path, "ext_ill", "import no_such_library")
    words = ("--vary", "thigh_length=0.15:0.3", "--n", "64", "--workers", "2")
    out = tmp_path / "out"
    more = ("--metrics", "sound", "mass", "--where", "sound > 0", "--out", str(out), "--json")
    _, err = ran(tmp_path, "-m", "draft", "sweep", "hopper", *words, *more)
    assert err.count("no_such_library") == 1
    import pyarrow.dataset as ds

    table = ds.dataset(out, format="parquet").to_table()
    assert table.num_rows == 64
    assert table["sound"].to_pylist() == pytest.approx([3 * x for x in table["mass"].to_pylist()])


@pytest.mark.slow
def test_the_example_passes_its_own_tests(tmp_path: Path) -> None:
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    (entry,) = project["entry-points"]["draft.extensions"].values()
    assert project["dependencies"] == [DISTRIBUTION]
    shutil.copytree(EXAMPLE / entry, tmp_path / entry)
    write(tmp_path, "installed", "", entry)
    tests = str(EXAMPLE / "tests")
    out, _ = ran(tmp_path, "-m", "pytest", "-q", "-c", os.devnull, "--rootdir", tests, tests)
    assert " passed" in out
