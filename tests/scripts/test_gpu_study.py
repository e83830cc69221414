"""The script that runs a study on a machine without a network: what it packs, how it goes on."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("mjlab")  # `draft study` needs the extra `learn`.

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "scripts" / "gpu_study.sh"

pytestmark = pytest.mark.skipif(
    shutil.which("bash") is None or shutil.which("split") is None, reason="needs bash and coreutils"
)
needs_uv = pytest.mark.skipif(shutil.which("uv") is None, reason="needs uv to read the lock")

STUDY = """\
designs: [cheetah]
seeds: 1
stages: [base, push]
iterations: {base: 300, push: 100}
evaluate: {replicas: 32, perturbed: false}
"""
# `draft` whose jobs learn nothing: a training does 200 iterations a call, FAIL names a job that
# fails, PLAY is the exit code of videos.
DRAFT = f"""#!{sys.executable}
import json, os, sys
from pathlib import Path

sys.path.insert(0, {str(ROOT)!r})
arguments = sys.argv[1:]
with open(os.environ["CALLS"], "a") as calls:
    print(*arguments, file=calls)
if arguments[0] == "play":
    print("drawn by", os.environ["MUJOCO_GL"])
    (Path(arguments[1]) / "play.mp4").write_text("film")
    sys.exit(int(os.environ.get("PLAY", "0")))

from draft.cli import main
from draft.study import running
from draft.study.requests import TrainRequest
from tests.study.small import Fake, write_output

def act(name, request):
    if name == os.environ.get("FAIL"):
        return 2
    if not isinstance(request, TrainRequest):
        return None
    state = Path(request.run) / "state.json"
    done = json.loads(state.read_text())["iteration"] if state.exists() else 0
    write_output(request, min(done + 200, request.iterations))
    return 0

assert callable(running.make_workers)
running.make_workers = lambda *options: [Fake(act)]
sys.exit(main(arguments))
"""
# `draft` that only says SAID.
PARROT = """#!/bin/bash
echo "$*" >>"$CALLS"
mkdir -p "$4/runs"
echo "$SAID"
exit "${CODE:-0}"
"""
# `python3` whose pip hands out the wheels in WHEELS, and installs none.
PYTHON = f"""#!/bin/bash
[[ "$1 $2" == "-m pip" ]] || exec {sys.executable} "$@"
if [[ $3 == download ]]; then
  while [[ $1 != --dest ]]; do shift; done
  cp "$WHEELS"/*.whl "$2"
elif [[ $3 == install ]]; then
  exit 1
fi
"""


def script(
    *arguments: object, where: Path | None = None, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run the script."""
    return subprocess.run(
        ["bash", str(SCRIPT), *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=where,
        env=os.environ | environment,
        check=False,
    )


def last_line(done: subprocess.CompletedProcess[str]) -> str:
    return done.stderr.splitlines()[-1]


class Machine:
    """A folder with a study, and a command `draft` that only pretends."""

    def __init__(self, folder: Path, draft: str = DRAFT) -> None:
        self.folder, self.out, self.study = folder, folder / "out", folder / "mine.yaml"
        self.bin, self.calls_file = folder / "bin", folder / "calls"
        self.study.write_text(STUDY)
        self.bin.mkdir()
        self.command("draft", draft)

    def command(self, name: str, text: str) -> None:
        """Put a command first on PATH."""
        (self.bin / name).write_text(text)
        (self.bin / name).chmod(0o755)

    def call(self, *arguments: object, **environment: str) -> subprocess.CompletedProcess[str]:
        environment = {"MUJOCO_GL": ""} | environment
        environment |= {"PATH": f"{self.bin}:{os.environ['PATH']}", "CALLS": str(self.calls_file)}
        return script(*arguments, where=self.folder, **environment)

    def run(self, *options: object, **environment: str) -> subprocess.CompletedProcess[str]:
        return self.call("run", self.study, self.out, *options, **environment)

    def calls(self) -> list[str]:
        """Commands since the last look."""
        text = self.calls_file.read_text() if self.calls_file.exists() else ""
        self.calls_file.unlink(missing_ok=True)
        return text.splitlines()


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.fixture
def parrot(tmp_path: Path) -> Machine:
    return Machine(tmp_path, PARROT)


@pytest.fixture(scope="module")
def done_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study's folder after two calls, in which all was done."""
    machine = Machine(tmp_path_factory.mktemp("done"))
    for _ in range(2):
        assert machine.run().returncode == 0
    return machine.out


@pytest.fixture
def finished(machine: Machine, done_once: Path) -> Machine:
    """A machine with that folder."""
    shutil.copytree(done_once, machine.out)
    return machine


def test_a_study_goes_on_call_by_call_until_all_is_done(machine: Machine) -> None:
    study = f"study {machine.study} --out {machine.out} --minutes 8"
    base, push = (machine.out / "runs" / f"cheetah-{stage}-0" for stage in ("base", "push"))
    first = machine.run()
    assert first.returncode == 0, first.stderr
    assert last_line(first) == "5 of 5 jobs to go on with: call again"
    assert machine.calls() == [study, f"play {base}"]
    second = machine.run()
    assert "5 of 5 jobs are done" in second.stdout
    assert last_line(second) == "all is done"
    assert machine.calls() == [study, f"play {base}", f"play {push}"]
    assert last_line(machine.run()) == "all is done"
    assert machine.calls() == [study]


def test_no_video_begins_without_time_for_it(finished: Machine) -> None:
    for log in finished.out.glob("runs/*/*.play.log"):
        log.unlink()
    done = finished.run("--minutes", "0.3")
    assert len(finished.calls()) == 1
    assert last_line(done) == "all is done but videos, 2 of them: call again"


def test_a_video_that_was_not_whole_in_time_is_tried_again(finished: Machine) -> None:
    (log,) = finished.out.glob("runs/cheetah-push-0/*.play.log")
    log.unlink()
    (log.parent / ".play.tmp9.mp4").write_text("part of it")
    finished.command("timeout", "#!/bin/bash\nexit 124\n")
    done = finished.run()
    assert last_line(done) == "all is done but videos, 1 of them: call again"
    assert not (log.parent / ".play.tmp9.mp4").exists()
    (finished.bin / "timeout").unlink()
    assert last_line(finished.run()) == "all is done"
    assert log.read_text() == "drawn by egl\n"


def test_a_machine_that_cannot_render_is_told_once_and_goes_on(finished: Machine) -> None:
    (log,) = finished.out.glob("runs/cheetah-push-0/*.play.log")
    log.unlink()
    done = finished.run(PLAY="1", MUJOCO_GL="disabled")
    assert done.returncode == 0
    assert f"cheetah-push-0: no video, see {log}" in done.stderr
    assert log.read_text() == "drawn by disabled\n"
    assert last_line(done) == "all is done"
    finished.calls()
    finished.run(PLAY="1")
    assert len(finished.calls()) == 1


def test_jobs_that_fail_are_told_and_the_others_are_kept(machine: Machine) -> None:
    machine.run()
    done = machine.run(FAIL="cheetah-push-0")
    assert done.returncode == 1
    assert "cheetah-push-0 failed: exit code 2" in done.stderr
    assert last_line(done) == (
        f"1 failed, 1 rest on them, all else is done: see {machine.out}/logs and mend it; "
        "the same call tries them again"
    )
    assert (machine.out / "results" / "SHA256SUMS").exists()
    assert last_line(machine.run()) == "all is done"


@pytest.mark.parametrize(
    ("said", "code", "words"),
    [
        ("2 of 9 jobs are done", 0, "7 of 9 jobs to go on with: call again"),
        ("9 of 9 jobs are done", 0, "all is done"),
        (
            "2 of 9 jobs are done, 1 failed, 2 skipped",
            1,
            "1 failed, see out/mine/logs; 4 of 9 jobs to go on with: call again",
        ),
    ],
)
def test_the_last_line_says_whether_to_call_again(
    parrot: Machine, said: str, code: int, words: str
) -> None:
    done = parrot.call("run", parrot.study, SAID=said, CODE=str(code))
    assert done.returncode == code
    assert last_line(done) == words


def test_options_are_handed_to_draft_study(parrot: Machine) -> None:
    more = ("--minutes", "3", "--toy", "--device", "cpu", "--", "--workers", "2")
    parrot.call("run", parrot.study, *more, SAID="1 of 1 jobs are done")
    told = "--out out/mine-toy --minutes 3 --toy --device cpu --workers 2"
    assert parrot.calls() == [f"study {parrot.study} {told}"]


def test_the_study_that_was_packed_is_run_where_none_is_named(parrot: Machine) -> None:
    said = "1 of 1 jobs are done"
    parrot.call("run", SAID=said)
    mine = parrot.folder / "packed"
    mine.mkdir()
    shutil.copy(SCRIPT, mine)
    (mine / "published_quadrupeds.yaml").write_text(STUDY)
    environment = {"PATH": f"{parrot.bin}:{os.environ['PATH']}", "SAID": said}
    subprocess.run(
        ["bash", "packed/gpu_study.sh", "run"],
        cwd=parrot.folder,
        env=os.environ | environment | {"CALLS": str(parrot.calls_file)},
        check=True,
        capture_output=True,
    )
    rest = "--out out/published_quadrupeds --minutes 8"
    assert parrot.calls() == [
        f"study {ROOT}/examples/published_quadrupeds.yaml {rest}",
        f"study {mine}/published_quadrupeds.yaml {rest}",
    ]


def test_a_study_that_cannot_be_read_leaves_what_is_there(finished: Machine) -> None:
    (part,) = (finished.out / "results").glob("*.part-*")
    before = part.stat().st_mtime_ns
    finished.study.write_text("designs: []\n")
    done = finished.run()
    assert done.returncode == 2
    assert "error: " in done.stderr
    assert "expected at least 1 entry" in done.stderr
    assert part.stat().st_mtime_ns == before


def test_a_study_that_was_done_elsewhere_is_done(finished: Machine) -> None:
    there = finished.folder / "there"
    done = script("unpack", finished.out / "results", there)
    assert done.returncode == 0, done.stderr
    base = there / "runs" / "cheetah-base-0"
    assert [p.name for p in base.glob("*.pt")] == ["model_300.pt"]
    assert (base / "play.mp4").read_text() == "film"
    assert not [*there.glob("joined*"), *there.glob("results*"), *there.rglob(".lock")]
    shutil.rmtree(finished.out)
    finished.out = there
    done = finished.run()
    assert "5 of 5 jobs are done" in done.stdout
    assert last_line(done) == "all is done"
    assert not (there / "aside").exists()


def test_a_study_that_was_begun_elsewhere_goes_on(machine: Machine) -> None:
    machine.run()
    there = machine.folder / "there"
    script("unpack", machine.out / "results", there)
    shutil.rmtree(machine.out)
    machine.out = there
    assert last_line(machine.run()) == "all is done"
    checkpoints = sorted(p.name for p in (there / "runs" / "cheetah-base-0").glob("*.pt"))
    assert checkpoints == ["model_200.pt", "model_300.pt"]


@pytest.mark.parametrize("harm", ["change", "remove"])
def test_damaged_parts_are_refused_before_anything_is_unpacked(
    finished: Machine, harm: str
) -> None:
    (part,) = (finished.out / "results").glob("*.part-*")
    if harm == "change":
        part.write_bytes(part.read_bytes()[:-1] + b"?")
    else:
        part.unlink()
    there = finished.folder / "there"
    done = script("unpack", finished.out / "results", there)
    assert done.returncode == 2
    assert "missing or damaged" in done.stderr
    assert list(there.iterdir()) == []


def test_results_are_split_into_parts_below_the_limit_and_joined_again(finished: Machine) -> None:
    noise = os.urandom(30_000_000)
    film = Path("runs/cheetah-base-0/play.mp4")
    (finished.out / film).write_bytes(noise)
    finished.run()
    parts = list((finished.out / "results").glob("*.part-*"))
    assert len(parts) == 3
    assert all(part.stat().st_size < 15 * 2**20 for part in parts)
    there = finished.folder / "there"
    assert script("unpack", finished.out / "results", there).returncode == 0
    assert (there / film).read_bytes() == noise


def wheels(folder: Path) -> Path:
    """Wheels that need PyTorch, and one that does not, with nothing in them."""
    folder.mkdir()
    needs = {
        "mjlab-1.6.0": ["torch>=2.7.0", "torch>=9 ; extra == 'cpu'", "numpy>=2"],
        "tensordict-0.15.3": ["torch>=2.11.0a0"],
        "tqdm-4.70": ["torchrunx>=99"],
    }
    for name, lines in needs.items():
        package, _, version = name.partition("-")
        told = [f"Name: {package}", f"Version: {version}", *(f"Requires-Dist: {n}" for n in lines)]
        with zipfile.ZipFile(folder / f"{name}-py3-none-any.whl", "w") as wheel:
            wheel.writestr(f"{name}.dist-info/METADATA", "\n".join(told) + "\n\n")
    return folder


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """A machine with what was packed for it in `dist`, and with PyTorch of TORCH."""
    machine = Machine(tmp_path_factory.mktemp("packed"))
    machine.command("python3", PYTHON)
    (machine.bin / "torch.py").write_text("import os\n__version__ = os.environ['TORCH']\n")
    told = {"WHEELS": str(wheels(machine.folder / "wheels"))}
    done = machine.call("pack", "dist", "--study", machine.study, **told)
    assert done.returncode == 0, done.stderr
    return machine


@needs_uv
def test_the_manifest_tells_studies_and_which_pytorch_is_needed(packed: Machine) -> None:
    dist = packed.folder / "dist"
    assert (dist / "mine.yaml").read_text() == STUDY
    example = ROOT / "examples" / "published_quadrupeds.yaml"
    assert (dist / "published_quadrupeds.yaml").read_text() == example.read_text()
    told = (dist / "manifest.txt").read_text()
    assert "PyTorch with CUDA there: torch>=2.11.0a0, by tensordict 0.15.3.\n" in told
    assert re.search(r"tested with: torch \d+\.\d+", told)
    for name in ("mine.yaml", "base_policies.yaml", "mjlab-1.6.0-py3-none-any.whl"):
        assert re.search(rf"^\d+\t{name}$", told, re.MULTILINE)
    assert not list(dist.glob("work*"))


@needs_uv
@pytest.mark.parametrize("version", ["2.10.1+cu128", "2.7.0"])
def test_a_pytorch_that_is_too_old_is_refused_before_anything_is_installed(
    packed: Machine, version: str
) -> None:
    before = sorted((packed.folder / "dist").iterdir())
    done = packed.call("install", "dist", TORCH=version, PYTHONPATH=str(packed.bin))
    assert done.returncode == 2
    words = f"error: PyTorch there is {version}, and this needs torch>=2.11.0a0, by tensordict"
    assert words in done.stderr
    assert sorted((packed.folder / "dist").iterdir()) == before


@needs_uv
@pytest.mark.parametrize("version", ["2.11.0a0+nv25", "2.11.0+cu128", "3.0"])
def test_a_pytorch_that_is_new_enough_is_used(
    packed: Machine, version: str, tmp_path: Path
) -> None:
    told = {"TORCH": version, "PYTHONPATH": str(packed.bin)}
    done = packed.call("install", "dist", "--into", tmp_path / "site", **told)
    assert done.stderr.splitlines()[-1] == f"installing into {tmp_path}/site"


@needs_uv
def test_packages_are_those_of_the_lock_without_pytorch() -> None:
    locked = {
        f"{one['name']}=={one['version']}"
        for one in tomllib.loads((ROOT / "uv.lock").read_text())["package"]
    }
    done = script("pack", "--dry-run")
    packages = done.stdout.split()
    assert done.returncode == 0, done.stderr
    assert set(packages) <= locked
    names = [one.partition("==")[0] for one in packages]
    assert {"mjlab", "mujoco-warp", "warp-lang", "rsl-rl-lib", "numpy", "tyro"} <= set(names)
    # For the report, and for families.
    assert {"matplotlib", "pyarrow", "scipy"} <= set(names)
    assert len(names) == len(set(names))
    theirs = re.compile(r"torch|torchvision|triton|nvidia-.*|cuda-.*|colorama|pytest|draft")
    assert [name for name in names if theirs.fullmatch(name)] == []


@needs_uv
def test_packages_that_the_machine_has_can_be_left_out() -> None:
    done = script("pack", "--dry-run", "--without", "scipy onnx")
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
        (("run", "--speed", "3"), "run has no option --speed"),
        (("run", "{}/no.yaml"), "there is no study '{}/no.yaml'"),
        (("run", "{}"), "there is no study '{}'"),
        (("run", "a", "b", "c"), "run takes a study and a folder, and 'c' besides"),
        (("run", "--draft", "/no/such/draft"), "needs '/no/such/draft'"),
        (("run", "--", "--json"), "'draft study --json' itself does that"),
        (("run", "--", "--out=x"), "--out=x comes before --"),
        (("pack", "--study", "{}/no.yaml"), "there is no study '{}/no.yaml'"),
        (("pack", "--study", str(SCRIPT)), "does not end in .yaml"),
        (("pack", "--python", "three"), "--python takes a version such as 3.12"),
        (("pack", "--glibc", "old"), "--glibc takes N"),
        (("install", "--quickly"), "install has no option --quickly"),
        (("install", "{}/no"), "there is no folder '{}/no'"),
        (("unpack", "a"), "unpack takes DIR and INTO"),
        (("unpack", "a", "/dev/null/b"), "cannot make the folder '/dev/null/b'"),
        (("unpack", "/no/such", "{}"), "there is no SHA256SUMS"),
    ],
)
def test_wrong_arguments_are_told(tmp_path: Path, arguments: tuple[str, ...], words: str) -> None:
    done = script(*(one.format(tmp_path) for one in arguments), where=tmp_path)
    assert done.returncode == 2
    assert words.format(tmp_path) in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_help_names_every_mode() -> None:
    done = script("--help")
    assert done.returncode == 0
    for mode in ("pack", "install", "run", "unpack"):
        assert f"gpu_study.sh {mode}" in done.stdout
