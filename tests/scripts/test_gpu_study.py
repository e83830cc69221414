"""The script that trains on a machine without a network: what it packs, and how it goes on."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "gpu_study.sh"

pytestmark = pytest.mark.skipif(
    shutil.which("bash") is None or shutil.which("split") is None, reason="needs bash and coreutils"
)

# Learns in slices: three make a run of the giraffe, one of any other; the bear's fails.
DRAFT = """#!/bin/bash
set -eu
echo "$*" >>"$CALLS"
command=$1; shift
if [[ $command == play ]]; then exit "${PLAY:-0}"; fi
design=$1; out=
while [[ $# -gt 0 ]]; do [[ $1 == --out ]] && out=$2; shift; done
[[ $design == bear ]] && { echo "error: no" >&2; exit 1; }
mkdir -p "$out"
last=1; [[ $design == giraffe ]] && last=3
n=$(cat "$out/count" 2>/dev/null || echo 0)
if [[ $n -ge $last ]]; then echo "$out: $n of $last iterations are done"; exit; fi
n=$((n + 1)); echo $n >"$out/count"; echo "weights $n" >"$out/model_$((n * 9)).pt"
echo state >"$out/resume.pt"
echo "iteration 1/3, all but done"
if [[ $n -ge $last ]]; then echo "done: $n iterations; see it with: draft play $out"
else echo "stopped after $n of $last iterations; the same command goes on"; fi
"""


def study(*arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run the script."""
    return subprocess.run(
        ["bash", str(SCRIPT), *map(str, arguments)],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        check=False,
    )


class Machine:
    """A folder to train in, with a command `draft` that only pretends."""

    def __init__(self, folder: Path) -> None:
        self.out, self.calls_file = folder / "out", folder / "calls"
        self.bin = folder / "bin"
        self.bin.mkdir()
        (self.bin / "draft").write_text(DRAFT)
        (self.bin / "draft").chmod(0o755)

    def run(self, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
        path = f"{self.bin}:{os.environ['PATH']}"
        environment |= {"PATH": path, "CALLS": str(self.calls_file)}
        return study("run", self.out, *arguments, **environment)

    def calls(self) -> list[str]:
        """Commands since the last look, without the minutes, which depend on the clock."""
        text = self.calls_file.read_text() if self.calls_file.exists() else ""
        self.calls_file.unlink(missing_ok=True)
        return [re.sub(r" --minutes [0-9.]+$", "", line) for line in text.splitlines()]


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_unfinished_runs_go_on_and_finished_ones_are_left_alone(machine: Machine) -> None:
    arguments = ("--designs", "cheetah giraffe")
    out = machine.out
    cheetah = f"train cheetah --stage base --seed 0 --out {out}/cheetah-base-0"
    giraffe = f"train giraffe --stage base --seed 0 --out {out}/giraffe-base-0"
    first = machine.run(*arguments)
    assert first.returncode == 0
    assert "1 to go on with: call again" in first.stderr
    assert machine.calls() == [cheetah, f"play {out}/cheetah-base-0 --video", giraffe]
    machine.run(*arguments)
    assert machine.calls() == [giraffe]
    last = machine.run(*arguments)
    assert "all is done" in last.stderr
    assert machine.calls() == [giraffe, f"play {out}/giraffe-base-0 --video"]
    assert "all is done" in machine.run(*arguments).stderr
    assert machine.calls() == []


def test_a_run_that_was_done_elsewhere_is_not_begun_again(machine: Machine) -> None:
    machine.run("--designs", "cheetah")
    (machine.out / "cheetah-base-0.done").unlink()
    machine.calls()
    assert "all is done" in machine.run("--designs", "cheetah").stderr
    assert len(machine.calls()) == 1
    assert (machine.out / "cheetah-base-0" / "count").read_text() == "1\n"


def test_stages_and_seeds_are_run_in_order_and_wait_for_their_base(machine: Machine) -> None:
    arguments = ("--designs", "cheetah giraffe", "--stages", "base push", "--seeds", "0 1")
    done = machine.run(*arguments, "--envs", "64")
    words = [call.split() for call in machine.calls() if call.startswith("train")]
    assert [(w[1], w[3], w[5]) for w in words] == [
        ("cheetah", "base", "0"),
        ("giraffe", "base", "0"),
        ("cheetah", "base", "1"),
        ("giraffe", "base", "1"),
        ("cheetah", "push", "0"),
        ("cheetah", "push", "1"),
    ]
    assert all("--envs 64" in " ".join(w) for w in words)
    assert "giraffe-push-1 waits for its base policy" in done.stderr
    assert "4 to go on with" in done.stderr


def test_no_slice_begins_without_time_for_it(machine: Machine) -> None:
    done = machine.run("--minutes", "0.1")
    assert machine.calls() == []
    assert "3 to go on with" in done.stderr


def test_a_run_gets_the_minutes_that_are_left(machine: Machine) -> None:
    machine.run("--designs", "giraffe", "--minutes", "7.5")
    minutes = float(machine.calls_file.read_text().split("--minutes ")[1])
    assert 6.0 < minutes <= 7.5


def test_a_failure_is_told_and_the_others_go_on(machine: Machine) -> None:
    done = machine.run("--designs", "bear cheetah")
    assert done.returncode == 1
    assert "bear-base-0: failed" in done.stderr
    assert "error: no" in (machine.out / "bear-base-0.log").read_text()
    assert (machine.out / "cheetah-base-0.done").exists()


def test_a_machine_that_cannot_render_trains_all_the_same(machine: Machine) -> None:
    done = machine.run("--designs", "cheetah", PLAY="1")
    assert done.returncode == 0
    assert "cheetah-base-0: no video" in done.stderr


def test_results_go_on_elsewhere_with_the_newest_checkpoint(
    machine: Machine, tmp_path: Path
) -> None:
    for _ in range(2):
        machine.run("--designs", "giraffe")
    machine.calls()
    there = tmp_path / "there"
    done = study("unpack", machine.out / "results", there)
    assert done.returncode == 0, done.stderr
    run = there / "giraffe-base-0"
    assert sorted(p.name for p in run.iterdir()) == ["count", "model_18.pt", "resume.pt"]
    assert not list(there.glob("joined*"))
    machine.out = there
    assert "all is done" in machine.run("--designs", "giraffe").stderr
    assert (run / "count").read_text() == "3\n"


@pytest.mark.parametrize("harm", ["change", "remove"])
def test_damaged_parts_are_refused_before_anything_is_unpacked(
    machine: Machine, tmp_path: Path, harm: str
) -> None:
    machine.run("--designs", "cheetah")
    (part,) = (machine.out / "results").glob("*.part-*")
    if harm == "change":
        part.write_bytes(part.read_bytes()[:-1] + b"?")
    else:
        part.unlink()
    done = study("unpack", machine.out / "results", tmp_path / "there")
    assert done.returncode == 2
    assert "missing or damaged" in done.stderr
    assert list((tmp_path / "there").iterdir()) == []


def test_a_folder_is_split_into_parts_below_the_limit_and_joined_again(
    machine: Machine, tmp_path: Path
) -> None:
    machine.run("--designs", "cheetah")
    noise = os.urandom(30_000_000)
    (machine.out / "cheetah-base-0" / "video.mp4").write_bytes(noise)
    machine.run("--designs", "cheetah")
    parts = list((machine.out / "results").glob("*.part-*"))
    assert len(parts) == 3
    assert all(part.stat().st_size < 15 * 2**20 for part in parts)
    assert study("unpack", machine.out / "results", tmp_path / "there").returncode == 0
    assert (tmp_path / "there" / "cheetah-base-0" / "video.mp4").read_bytes() == noise


@pytest.mark.skipif(shutil.which("uv") is None, reason="needs uv to read the lock")
def test_packages_are_those_of_the_lock_without_pytorch() -> None:
    locked = {
        f"{one['name']}=={one['version']}"
        for one in tomllib.loads((ROOT / "uv.lock").read_text())["package"]
    }
    done = study("pack", "--dry-run")
    packages = done.stdout.split()
    assert done.returncode == 0, done.stderr
    assert set(packages) <= locked
    names = [one.partition("==")[0] for one in packages]
    assert {"mjlab", "mujoco-warp", "warp-lang", "rsl-rl-lib", "numpy", "tyro"} <= set(names)
    assert len(names) == len(set(names))
    theirs = re.compile(r"torch|torchvision|triton|nvidia-.*|cuda-.*|colorama|pytest|draft")
    assert [name for name in names if theirs.fullmatch(name)] == []


@pytest.mark.skipif(shutil.which("uv") is None, reason="needs uv to read the lock")
def test_packages_that_the_machine_has_can_be_left_out() -> None:
    done = study("pack", "--dry-run", "--without", "scipy onnx")
    assert done.returncode == 0, done.stderr
    assert not re.search(r"^(scipy|onnx)==", done.stdout, re.MULTILINE)
    assert re.search(r"^onnxscript==", done.stdout, re.MULTILINE)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((), "gpu_study.sh pack"),
        (("fly",), "there is no 'fly'"),
        (("run", "--minutes"), "--minutes needs a value"),
        (("run", "--minutes", "soon"), "--minutes takes a number, not 'soon'"),
        (("run", "--stages", "base jump"), "there is no stage 'jump'"),
        (("run", "--speed", "3"), "run has no option --speed"),
        (("run", "--draft", "/no/such/draft"), "needs '/no/such/draft'"),
        (("run", "a", "b"), "run takes one folder, not 'a' and 'b'"),
        (("pack", "--python", "three"), "--python takes a version such as 3.12"),
        (("pack", "--glibc", "old"), "--glibc takes N"),
        (("install", "--quickly"), "install has no option --quickly"),
        (("unpack", "a"), "unpack takes DIR and INTO"),
        (("unpack", "/no/such", "{}"), "there is no SHA256SUMS"),
    ],
)
def test_wrong_arguments_are_told(tmp_path: Path, arguments: tuple[str, ...], words: str) -> None:
    done = study(*(one.format(tmp_path) for one in arguments))
    assert done.returncode == 2
    assert words in done.stderr


def test_help_names_every_mode() -> None:
    done = study("--help")
    assert done.returncode == 0
    for mode in ("pack", "install", "run", "unpack"):
        assert f"gpu_study.sh {mode}" in done.stdout
