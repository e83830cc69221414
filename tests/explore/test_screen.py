"""Screens: the rows of a resolve, in a file that no stop and no kill spoils."""

from __future__ import annotations

import dataclasses
import errno
import json
import os
import shlex
import shutil
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.design.checks import KINDS
from draft.design.findings import note
from draft.explore.engines import LocalEngine
from draft.explore.job import opened
from draft.explore.parquet_parts import Parts, about
from draft.explore.rows import verdict
from draft.explore.screen import CHUNK, run_screen
from draft.laws import actuators
from draft.spec.load import ROBOTS
from tests.commands import Command
from tests.explore.small import HERE, VARY, StopError, Stops, job, metric, paused, pq, rows

SPEC = draft.load("quadruped")
GRID = ("thigh_length=0.2:0.5", "shank_length=0.2:0.5")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Screens that were never stopped; each is computed once."""
    folder = tmp_path_factory.mktemp("screens")

    @cache
    def screened(**changes: Any) -> Path:
        out = folder / f"{len(list(folder.iterdir()))}.parquet"
        run_screen(job(SPEC, **changes), out, HERE)
        return out

    return screened


def test_the_rows_are_those_of_one_resolve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    metric(monkeypatch)
    one = job(SPEC, metrics=None, vary=VARY)
    summary = run_screen(one, tmp_path / "s.parquet", HERE)
    design = SPEC.resolve(one.draw(0, one.n))
    table = pq.read_table(tmp_path / "s.parquet")
    assert table["index"].to_pylist() == list(range(1000))
    np.testing.assert_array_equal(table["weight"], 10 * np.asarray(design.mass))
    np.testing.assert_array_equal(table["accepted"], design.accepted)
    assert summary["accepted"] == np.count_nonzero(design.accepted)
    for finding in design.findings:
        bit = 1 << list(KINDS).index(finding.id)
        assert np.all(table["findings"].to_numpy()[finding.mask] & bit)
    for accepted, refused_by in zip(table["accepted"], table["refused_by"], strict=True):
        assert accepted.as_py() == (refused_by.as_py() is None)


@pytest.mark.parametrize("share", [0.9, 0.5, 0.05, 0.0])
def test_rows_that_are_kept_are_those_of_a_screen_that_keeps_all(
    tmp_path: Path, share: float, finished: Callable[..., Path]
) -> None:
    """Whether few or many are kept, which are measured in two ways."""
    everything = pq.read_table(finished(metrics=None))
    limit = float(np.quantile(everything["mass"], share))
    some = job(SPEC, metrics=None, where=f"mass < {limit!r}")
    summary = run_screen(some, tmp_path / "some.parquet", HERE)
    found = pq.read_table(tmp_path / "some.parquet")
    kept = everything.filter(everything["mass"].to_numpy() < limit)
    assert found.num_rows == kept.num_rows == summary["rows"] < everything.num_rows
    assert bool(found.num_rows) == bool(share)
    assert summary["rows"] + summary["dropped"] == summary["designs"] == 1000
    assert summary["accepted"] == np.count_nonzero(found["accepted"])
    for name in everything.column_names:
        np.testing.assert_array_equal(found[name], kept[name], name)


def test_the_file_says_what_it_is_and_is_not_computed_again(tmp_path: Path) -> None:
    out = tmp_path / "s.parquet"
    summary = run_screen(job(SPEC, where="accepted"), out, HERE)
    again = run_screen(job(SPEC, where="accepted"), out, Stops(0))
    assert (again["computed"], again["rows"]) == (0, summary["rows"])
    meta = about(out)
    assert meta["manifest"]["vary"]["thigh_length"] == "0.2:0.5"
    assert meta["manifest"]["where"] == "accepted"
    assert meta["findings"] == list(KINDS)
    assert meta["summary"].items() <= summary.items()
    assert not (tmp_path / "s.parquet.parts").exists()


@pytest.mark.slow
@given(after=st.integers(0, 9))
def test_a_run_that_goes_on_gives_the_rows_of_one_never_stopped(
    tmp_path_factory: pytest.TempPathFactory, after: int, finished: Callable[..., Path]
) -> None:
    folder = tmp_path_factory.mktemp("run")
    one = job(SPEC, where="accepted")
    with pytest.raises(StopError):
        run_screen(one, folder / "s.parquet", Stops(after))
    assert not (folder / "s.parquet").exists()
    summary = run_screen(one, folder / "s.parquet", HERE)
    assert summary["computed"] == 1000 - 100 * after
    assert (folder / "s.parquet").read_bytes() == finished(where="accepted").read_bytes()


@pytest.mark.slow
def test_processes_give_the_rows_of_one_process(
    tmp_path: Path, finished: Callable[..., Path]
) -> None:
    run_screen(job(SPEC), tmp_path / "two.parquet", LocalEngine(2))
    assert (tmp_path / "two.parquet").read_bytes() == finished().read_bytes()


def test_a_job_holds_the_files_of_its_spec(tmp_path: Path) -> None:
    folder = tmp_path / "mine"
    shutil.copytree(ROBOTS / "hopper", folder)
    laws = json.loads(actuators.FILE.read_text(encoding="utf-8"))
    laws["draft"]["laws"]["mass"]["terms"][0]["factor"] *= 2
    (folder / "mine.json").write_text(json.dumps(laws), encoding="utf-8")
    parameters = folder / "parameters.yaml"
    text = parameters.read_text(encoding="utf-8") + "\ntrends: mine.json\n"
    parameters.write_text(text, encoding="utf-8")
    on_disk = draft.load(folder)
    one = job(on_disk, vary=["thigh_length=0.2:0.5"])
    here = one.resolve(one.draw(0, 4)).mass
    heavy = on_disk.resolve().actuator_mass
    assert heavy > 1.5 * draft.load("hopper").resolve().actuator_mass
    shutil.rmtree(folder)
    opened.cache_clear()
    np.testing.assert_array_equal(one.resolve(one.draw(0, 4)).mass, here)
    in_memory = draft.Spec.parse(dict(one.files))
    assert in_memory.resolve().actuator_mass == heavy
    assert job(in_memory, vary=["thigh_length=0.2:0.5"]).manifest() == one.manifest()


def test_a_spec_whose_files_are_gone_makes_no_job(tmp_path: Path) -> None:
    shutil.copytree(ROBOTS / "hopper", tmp_path / "mine")
    spec = draft.load(tmp_path / "mine")
    shutil.rmtree(tmp_path / "mine")
    with pytest.raises(draft.DraftError, match="cannot read"):
        job(spec, vary=["thigh_length=0.2:0.5"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n": 2000}, r"belongs to another run: n \(1000 there, 2000 requested\) differs"),
        ({"seed": 1}, r"seed \(0 there, 1 requested\) differs"),
        ({"where": "accepted"}, r"where \('' there, 'accepted' requested\) differs"),
        ({"vary": VARY[:1]}, "vary differs"),
        ({"values": {"crouch": 0.5}}, "values differs"),
        ({"sampler": "random", "seed": 2}, r"sampler \(.*\), seed \(.*\) differ"),
        ({"spec": "cat"}, "spec differs"),
    ],
)
@pytest.mark.parametrize("complete", [True, False])
def test_another_run_is_refused_and_not_mixed(
    tmp_path: Path,
    change: dict[str, Any],
    message: str,
    complete: bool,
    finished: Callable[..., Path],
) -> None:
    out = tmp_path / "s.parquet"
    if complete:
        shutil.copy(finished(), out)
    else:
        with pytest.raises(StopError):
            run_screen(job(SPEC), out, Stops(3))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*.parquet")}
    edited = "spec" in change
    spec = draft.load(_edited(tmp_path)) if edited else SPEC
    change = {} if edited else change
    with pytest.raises(draft.DraftError, match=message):
        run_screen(job(spec, **change), out, HERE)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*.parquet")} == before


def _edited(folder: Path) -> Path:
    """The same robot with another default."""
    (folder / "cat").mkdir()
    for name, file in SPEC.files.items():
        text = file.read_bytes().decode()
        (folder / "cat" / name).write_text(text.replace("value: 0.23,", "value: 0.24,"))
    return folder / "cat"


def test_a_part_that_is_broken_is_made_again(tmp_path: Path) -> None:
    out, one = tmp_path / "s.parquet", job(SPEC)
    with pytest.raises(StopError):
        run_screen(one, out, Stops(4))
    folder = tmp_path / "s.parquet.parts"
    (folder / "part-000002.parquet").write_bytes(b"PAR1 torn")
    (folder / ".part-000004.parquet.tmp77").write_bytes(b"left by a kill")
    assert run_screen(one, out, HERE)["computed"] == 700
    assert [row["index"] for row in rows(out)] == list(range(1000))


def test_two_processes_do_not_write_to_one_place(tmp_path: Path) -> None:
    one = job(SPEC)
    with (
        Parts(tmp_path / "s.parquet.parts", one.manifest(), one.parts).held(),
        pytest.raises(draft.DraftError, match="another screen is running in"),
    ):
        run_screen(one, tmp_path / "s.parquet", HERE)


def test_a_full_disk_is_said_and_the_parts_stay(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = os.replace

    def full(source: Any, target: Any) -> None:
        if "000003" in str(target):
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(draft.DraftError) as raised:
        run_screen(job(SPEC), tmp_path / "s.parquet", HERE)
    assert "no space left on device" in str(raised.value)
    assert "3 of 10 parts are kept in" in str(raised.value)
    monkeypatch.setattr(os, "replace", replace)
    assert run_screen(job(SPEC), tmp_path / "s.parquet", HERE)["computed"] == 700


@pytest.mark.slow
def test_a_killed_process_leaves_whole_parts_and_no_workers(tmp_path: Path) -> None:
    n = 5 * CHUNK
    arguments = ["screen", "quadruped", "--vary", *VARY, "--n", str(n), "--where", "accepted"]
    out = tmp_path / "s.parquet"
    process = paused(2, *arguments, "--workers", "2", "--out", str(out))
    process.kill()
    process.communicate()  # Ends when the last worker, which holds its pipes too, has ended.
    assert process.returncode == -signal.SIGKILL
    left = list((tmp_path / "s.parquet.parts").glob("part-*"))
    assert len(left) == 2
    for path in left:
        assert pq.read_table(path).num_rows > 0
    assert main([*arguments, "--out", str(out), "--workers", "1"]) == 0
    assert main([*arguments, "--out", str(tmp_path / "whole.parquet")]) == 0
    assert out.read_bytes() == (tmp_path / "whole.parquet").read_bytes()


@pytest.mark.usefixtures("here")
def test_the_command_prints_one_object_or_says_what_a_grid_became(command: Command) -> None:
    words = "screen robot --vary thigh_length=0.2:0.5 --n 1e3"
    found = command.json(f"{words} --out s.parquet --workers 1")
    assert (found["out"], found["designs"], found["rows"]) == ("s.parquet", 1000, 1000)
    said = command("screen robot --n 1000 --sampler grid --out g.parquet", "--vary", *GRID)
    assert said.err == "a grid of 961 designs (asked for 1,000)\n"
    assert "961 designs, 961 kept" in said.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("screen --n 0", "--n 0 is not a whole number of at least 1"),
        ("screen --n 1e12", "1e+12 designs take up to "),
        ("screen --n 1e12 --where accepted", "and a run has at most 1e+10"),
        ("screen --seed -1", "--seed -1 is not a whole number from 0 to 2**63 - 1"),
        ("screen --workers 0", "--workers 0 is not a whole number from 1 to 1024"),
        ("screen --metrics masss_", "there is no metric 'masss_'"),
        ("screen --out robot", "--out 'robot' is a folder"),
        ("screen --out robot/tree.yaml", "--out 'robot/tree.yaml' does not end in .parquet"),
        ("screen --out robot/own.parquet", "was not written by 'draft screen'; it is kept"),
        ("screen --set thigh_length=0.3", "is given by --set and by --vary"),
        ("screen --set shank_length=9", "shank_length = 9 m is outside its range [0.1, 0.6]"),
        ("screen --design lang", "did you mean 'long'?"),
        ("screen --vary thigh_lenght=1:2", "did you mean 'thigh_length'?"),
        ("screen --where acepted", "--where:1:1: unknown name 'acepted'"),
        ("sweep --address a:1", "--address is for a Ray cluster"),
        ("sweep --out ''", "--out names no folder"),
        ("sweep --out robot", "'robot' is not a folder of a Draft run; it is kept"),
        ("sweep --out robot/tree.yaml", "exists and is not a folder"),
    ],
)
@pytest.mark.usefixtures("here")
def test_every_mistake_is_said_and_nothing_is_written(
    words: str, message: str, command: Command
) -> None:
    Path("robot/own.parquet").touch()
    before = sorted(Path().rglob("*"))
    word, *more = shlex.split(words)
    given_ = f"{word} robot --vary thigh_length=0.2:0.5 --out s.parquet"
    assert message in command.refuses(given_, *more)
    assert sorted(Path().rglob("*")) == before


def test_every_kind_of_finding_has_its_bit(tmp_path: Path) -> None:
    """More kinds than bits would end a screen of designs that have the last one."""
    design = draft.load("hopper").resolve({}, {"thigh_length": np.array([0.2, 0.3])})
    mask = np.array([False, True])
    found = [f for kind in KINDS for f in note(kind, "here", mask, "text", "a test")]
    columns = verdict(dataclasses.replace(design, findings=tuple(found)), np.arange(2))
    assert columns["findings"].tolist() == [0, 2 ** len(KINDS) - 1]


def test_a_screen_that_fails_leaves_no_parts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    class Broken:
        def run(self, tasks: Any, work: Any) -> Any:
            raise draft.DraftError(draft.Problem("no cluster answers"))

    with pytest.raises(draft.DraftError, match="no cluster"):
        run_screen(job(SPEC, n=10), Path("a/b.parquet"), Broken())
    assert list(tmp_path.iterdir()) == []
