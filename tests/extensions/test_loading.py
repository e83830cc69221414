"""Extensions are loaded when a registry is read, and undone where they fail, in one line each."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import draft
from draft import doctor, extensions
from draft.extensions import ExtensionWarning, Registry, load
from draft.metrics import METRICS, of_design
from tests.extensions.packages import HOPPER, METRIC, Install, left, write


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
    "exit": ("raise SystemExit(3)", "", "SystemExit: 3"),
    "import": ("import no_such_library", "", "ModuleNotFoundError: No module named 'no_such_li"),
    "fault": ("1 / 0", "", "ZeroDivisionError: division by zero"),
    "lines": ("raise ValueError('one\\n  two')", "", "ValueError: one two"),
    "syntax": ("def", "", "SyntaxError: invalid syntax"),
    "an entry point to no module": ("", "ext_broken.nowhere:thing", "ModuleNotFoundError: No mod"),
    "an entry point that names none": ("", "ext-broken", ""),
}


@pytest.mark.parametrize(("end", "entry", "says"), BROKEN.values(), ids=BROKEN)
def test_an_extension_that_fails_is_undone_and_told_in_a_line(
    install: Install, end: str, entry: str, says: str
) -> None:
    install("ext_broken", METRIC.format(name="lost", body="return 1.0") + end, entry)
    install("ext_sound", METRIC.format(name="kept", body="return 1.0"))
    with pytest.warns(ExtensionWarning) as caught:
        assert left() == ["kept"]
    (line,) = (str(one.message) for one in caught)
    assert line.startswith(f"extension 'of_ext_broken' of ext_broken is not used: {says}")
    assert "\n" not in line
    assert "ext_broken" not in sys.modules
    assert [bool(one.problem) for one in load()] == [True, False]


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


def test_a_metric_that_fails_is_left_out_of_a_comparison_that_names_none(install: Install) -> None:
    text = METRIC.format(name="fails", body="raise KeyError('x')")
    install("ext_fails", text.replace("@metric(", "@metric(limits=lambda design: 1 / 0, "))
    spec = draft.load("hopper")
    designs = [spec.resolve(), spec.resolve({"thigh_length": 0.25})]
    with pytest.warns(ExtensionWarning, match="the metric 'fails' of ext_fails fails"):
        found = draft.compare(designs)
    part = found.parts[0]
    assert part is not None
    assert part.shares[0, found.metrics.index("mass")] > 0
    assert "fails" not in found.limits[0]
    with pytest.raises(draft.DraftError, match="the metric 'fails' of ext_fails fails"):
        draft.compare(designs, ["fails"])


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
    (site / "ext_two.py").unlink()
    (site / "ext_two").mkdir()
    (site / "ext_two" / "__init__.py").touch()
    (site / "ext_two" / "good.py").write_text(METRIC.format(name="good", body="return 1.0"))
    (site / "ext_two" / "bad.py").write_text("from ext_two import good\nimport nothing_here\n")
    points.write_text("[draft.extensions]\na = ext_two.bad\nb = ext_two.good\n")
    with pytest.warns(ExtensionWarning, match="extension 'a' of ext_two is not used"):
        assert left() == ["good"]


def test_a_cell_that_runs_again_replaces_its_item_and_a_module_does_not() -> None:
    registry: Registry[int] = Registry("number")
    registry.add("one", 1, "__main__")
    registry.add("one", 2, "__main__")
    registry.add("two", 1, "a.b")
    assert registry["one"] == 2
    for name, first in (("one", "__main__"), ("two", "a.b")):
        with pytest.raises(draft.DraftError, match=f"'{name}' of a.b exists already in {first}"):
            registry.add(name, 3, "a.b")
    extensions._REGISTRIES.remove(registry)


def test_the_doctor_lists_extensions(install: Install) -> None:
    install("ext_fine", METRIC.format(name="fine", body="return 1.0"))
    install("ext_ill", "import no_such_library")
    with pytest.warns(ExtensionWarning):
        fine, ill = doctor._extensions()
    assert (fine.item, fine.text) == ("extension of_ext_fine", "ext_fine 2.5, metric fine")
    assert ill.text.startswith("ext_ill 2.5, not used: ModuleNotFoundError")
    assert fine.record["added"] == {"metric": ["fine"]}


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
