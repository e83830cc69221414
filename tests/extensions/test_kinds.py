"""What extensions add: metrics, checks, exporters, robots, laws and link primitives."""

from __future__ import annotations

import inspect
import json
import runpy
import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import draft
from draft import extensions
from draft.design.checks import kinds
from draft.extensions import ExtensionWarning
from draft.extras import DISTRIBUTION
from draft.metrics import of_design, of_model
from draft.spec.jsonschema import SCHEMAS, schema_text
from draft.spec.primitives import LINKS
from draft.spec.schema import ROOTS
from tests.extensions.packages import EXAMPLE, HOPPER, METRIC, Install, left

CHECK = '''
from draft.extend import check, note

@check(error={error})
def too_heavy(design):
    """The robot is heavier than a hand can lift."""
    mask, mass = {mask}, design.mass
    yield from note("{kind}", "body", mask, "{{value}} > {{limit}}", "a test", mass, 2.0, "kg")
'''
# The example's own tests.
OWN = runpy.run_path(str(EXAMPLE / "tests" / "test_example.py"))

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
        "the robot 'arm' of ext_named exists already in draft.robots",
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
    own = ("arm", "biped", "hand", "hexapod", "hopper", "humanoid", "quadruped", "wheeled")
    assert draft.shipped() == tuple(sorted((*own, "pogo")))
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
        assert len(children) == len(LINKS) + len(ROOTS)
        assert all("#/$defs/PadLink" in json.dumps(one) for one in children)
    finally:
        for registry in extensions._REGISTRIES:
            registry.drop("draft_example", ())
        for name in [name for name in sys.modules if name.startswith("draft_example")]:
            del sys.modules[name]
    with pytest.raises(draft.SpecError, match="unknown value 'pad'"):
        draft.Spec.parse({**files, "tree.yaml": tree})
    assert schema_text("tree") == (SCHEMAS / "tree.json").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in OWN if name.startswith("test_")])
def test_the_example_passes_its_own_tests(name: str, install: Install, tmp_path: Path) -> None:
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    (entry,) = project["entry-points"]["draft.extensions"].values()
    assert project["dependencies"] == [DISTRIBUTION]
    shutil.copytree(EXAMPLE / entry, tmp_path / "site" / entry)
    install("installed", "", entry)
    takes = {"tmp_path": tmp_path} if "tmp_path" in inspect.signature(OWN[name]).parameters else {}
    OWN[name](**takes)
