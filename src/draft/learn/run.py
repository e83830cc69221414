"""A run's folder: what is trained, with which numbers, and how far it has come.

run.json        stage, seed, worlds, numbers, versions, designs, what it started from
members.json    the robots, with their MJCF
designs/        each design's numbers; `draft build SPEC --design FILE` makes it again
model_N.pt      checkpoints that are kept: policy, value, optimiser after N iterations
resume.pt       all that is needed to go on as if it had never stopped
resume.R.N.pt   the same of process R after N iterations, on several GPUs
progress.csv    one row per iteration
state.json      how far it is
tensorboard/    the same for TensorBoard
"""

from __future__ import annotations

import glob
import hashlib
import json
import os
import re
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Problem
from draft.files import LOCK, lock, locked, write
from draft.learn.config import STAGES, Config, from_dict
from draft.learn.quadruped import Quadruped, check_family

FORMAT = 2
RUN, MEMBERS, RESUME, STATE, PROGRESS = (
    "run.json",
    "members.json",
    "resume.pt",
    "state.json",
    "progress.csv",
)
_PACKAGES = (
    *("draft", "mjlab", "rsl-rl-lib", "torch"),
    *("mujoco", "mjbatch", "mujoco-warp", "warp-lang"),
)


@dataclass(frozen=True)
class Origin:
    """The run that a stage starts from: its folder, checkpoint's iteration and content's hash."""

    run: str
    iteration: int
    digest: str


@dataclass(frozen=True)
class Plan:
    """All that decides what a run learns.

    Attributes:
        members: one quadruped, or several of one topology, in one simulation.
        stage: of `draft.learn.config.STAGES`.
        seed: of everything random.
        environments: worlds, on each GPU.
        config: the numbers.
        ground: "uneven" or "flat".
        see_design: the policy sees what tells designs apart.
        see_ground: the policy sees the height scan.
        origin: the run whose policy it starts from; None for none.
    """

    members: tuple[Quadruped, ...]
    stage: str = "base"
    seed: int = 0
    environments: int = 4096
    config: Config = Config()
    ground: str = "uneven"
    see_design: bool = False
    see_ground: bool = True
    origin: Origin | None = None

    def record(self) -> dict[str, Any]:
        """The plan as plain data; equal plans have equal records."""
        return {
            "designs": [member.name for member in self.members],
            "robots": robots_digest(self.members),
            "stage": self.stage,
            "seed": self.seed,
            "environments": self.environments,
            "ground": self.ground,
            "see_design": self.see_design,
            "see_ground": self.see_ground,
            "origin": asdict(self.origin) if self.origin else None,
            "config": self.config.as_dict(),
        }


@dataclass(frozen=True, repr=False)
class Run:
    """A run on disk."""

    folder: Path
    plan: Plan

    def __repr__(self) -> str:
        plan = self.plan
        names = plan.members[0].name
        if len(plan.members) > 1:
            names += f" and {len(plan.members) - 1} more"
        return f"Run('{self.folder}', {names}, stage {plan.stage}, {self.done()} iterations)"

    @property
    def resume(self) -> Path:
        """File to go on from."""
        return self.folder / RESUME

    def state(self, rank: int, iteration: int) -> Path:
        """File that process `rank` of several goes on from, all but the first."""
        return self.folder / f"resume.{rank}.{iteration}.pt"

    def states(self, rank: int) -> list[tuple[int, Path]]:
        """What a process has of `state`, by iterations done, rising."""
        return self._numbered(rf"resume\.{rank}\.(\d+)\.pt")

    def checkpoints(self) -> list[tuple[int, Path]]:
        """Checkpoints that are kept, by iterations done, rising."""
        return self._numbered(r"model_(\d+)\.pt")

    def _numbered(self, pattern: str) -> list[tuple[int, Path]]:
        """Files whose names match, by the number in them."""
        found = []
        for path in self.folder.glob("*.pt"):
            match = re.fullmatch(pattern, path.name)
            if match:
                found.append((int(match[1]), path))
        return sorted(found)

    def checkpoint(self, iteration: int | None = None) -> tuple[int, Path]:
        """A checkpoint, the last where none is named.

        Raises:
            DraftError: there is none.
        """
        found = dict(self.checkpoints())
        if not found:
            remedy = "train it, or wait for its first iterations"
            raise DraftError(Problem(f"{self.folder} has no checkpoint yet", None, remedy))
        wanted = max(found) if iteration is None else iteration
        if wanted not in found:
            remedy = f"checkpoints: {', '.join(map(str, found))}"
            cause = f"{self.folder} has no checkpoint of iteration {wanted}"
            raise DraftError(Problem(cause, None, remedy))
        return wanted, found[wanted]

    def done(self) -> int:
        """Iterations done, as last noted."""
        found = self._noted("iteration")
        return found if isinstance(found, int) else 0

    def seconds(self) -> float:
        """Seconds of training so far, as last noted."""
        found = self._noted("seconds")
        return float(found) if isinstance(found, int | float) else 0.0

    def processes(self) -> int | None:
        """Processes that its last state is of; None where it has none."""
        found = self._noted("processes")
        return found if isinstance(found, int) else None

    def engine(self) -> str | None:
        """Engine that it last ran on; None where it has not run."""
        found = self._noted("engine")
        return found if isinstance(found, str) else None

    def _noted(self, name: str) -> Any:
        try:
            return json.loads((self.folder / STATE).read_text(encoding="utf-8")).get(name)
        except (OSError, ValueError, AttributeError):
            return None

    def note(self, iteration: int, seconds: float, processes: int, engine: str) -> None:
        """Note how far it is: iterations and seconds of training so far, and on what it runs."""
        state = {"iteration": iteration, "seconds": seconds}
        state |= {"processes": processes, "engine": engine}
        write(self.folder / STATE, json.dumps(state) + "\n")


def robots_digest(members: Sequence[Quadruped]) -> str:
    """A hash that changes when any robot does."""
    text = json.dumps([member.as_dict() for member in members], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def create(folder: Path, plan: Plan, designs: dict[str, str]) -> Run:
    """Make a run's folder, whole or not at all.

    Args:
        folder: where; it may exist and be empty.
        plan: what is trained.
        designs: file of each design by name, as YAML.

    Raises:
        DraftError: the folder holds something, or cannot be written.
    """
    record = {"format": FORMAT, "versions": versions()} | plan.record()
    files = {
        RUN: json.dumps(record, indent=2) + "\n",
        MEMBERS: json.dumps([member.as_dict() for member in plan.members]) + "\n",
    } | {f"designs/{safe(name)}.yaml": text for name, text in designs.items()}
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            cause = f"'{folder}' exists and is no run of Draft; it is kept"
            raise DraftError(Problem(cause, None, "choose another --out"))
        folder.parent.mkdir(parents=True, exist_ok=True)
        _sweep(folder)
        temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            with lock(temporary, "draft train"):
                os.chmod(temporary, 0o755)
                for name, text in files.items():
                    write(temporary / name, text)
                if folder.exists():
                    folder.rmdir()
                os.rename(temporary, folder)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        cause = f"cannot write '{folder}': {error.strerror}"
        raise DraftError(Problem(cause, None, "choose another --out")) from None
    return Run(folder, plan)


def _sweep(folder: Path) -> None:
    """Remove what killed processes left of making a run's folder; who is at it holds a lock."""
    for path in folder.parent.glob(f".{glob.escape(folder.name)}-*"):
        left = re.fullmatch(r"[a-z0-9_]{8}", path.name[len(folder.name) + 2 :])
        if left and (path / LOCK).is_file() and not locked(path):
            shutil.rmtree(path, ignore_errors=True)


def is_run(folder: Path) -> bool:
    """Tell whether a folder is a run's."""
    return (folder / RUN).is_file()


def read_record(folder: Path) -> dict[str, Any]:
    """What run.json says, as it stands there; nothing where it cannot be read."""
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def open_run(folder: Path) -> Run:
    """Read a run's folder.

    Raises:
        DraftError: it is none, is broken, or of another version.
    """
    if not is_run(folder):
        remedy = "'draft train DESIGN' makes one"
        raise DraftError(Problem(f"'{folder}' is no run of 'draft train'", None, remedy))
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
        robots = json.loads((folder / MEMBERS).read_text(encoding="utf-8"))
        if record["format"] != FORMAT or record["stage"] not in STAGES:
            cause = f"'{folder}' was written by another version of Draft"
            raise DraftError(Problem(cause, None, "train it anew in another folder"))
        members = tuple(Quadruped.from_dict(robot) for robot in robots)
        check_family(members)
        plan = Plan(
            members=members,
            stage=record["stage"],
            seed=int(record["seed"]),
            environments=int(record["environments"]),
            config=from_dict(record["config"]),
            ground=record["ground"],
            see_design=bool(record["see_design"]),
            see_ground=bool(record["see_ground"]),
            origin=Origin(**record["origin"]) if record["origin"] else None,
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        cause = f"'{folder}' is broken: {RUN} or {MEMBERS} cannot be read ({error})"
        raise DraftError(Problem(cause, None, "train it anew in another folder")) from None
    if robots_digest(members) != record["robots"]:
        cause = f"'{folder}' is broken: {MEMBERS} has other robots than {RUN} says"
        raise DraftError(Problem(cause, None, "train it anew in another folder"))
    return Run(folder, plan)


def check_same(run: Run, plan: Plan) -> None:
    """Check that a run is of a plan, so that it can go on.

    Raises:
        DraftError: something differs; it is named.
    """
    differing = differences(run.plan.record(), plan.record())
    if differing:
        what = ", ".join(name.replace("_", " ") for name in differing[:6])
        cause = f"'{run.folder}' holds a run of something else: {what} differ"
        remedy = "choose another --out, or repeat the command that it was begun with"
        raise DraftError(Problem(cause, None, remedy))


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Names of what two plans' records have different, numbers as "rewards.height"."""
    found = [name for name in new if name != "config" and old.get(name) != new[name]]
    return found + [
        f"{group}.{name}"
        for group, numbers in new["config"].items()
        for name, value in numbers.items()
        if old.get("config", {}).get(group, {}).get(name) != value
    ]


def versions() -> dict[str, str]:
    """Versions of all that decides how a run goes; "none" of what is not installed."""
    return {package: _version(package) for package in _PACKAGES}


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def upgrades(then: Any) -> str:
    """Packages that are installed here in other versions than then, in words; "" for none.

    Args:
        then: as `versions` gave it; anything else, as a broken file has it, tells nothing.
    """
    old = then if isinstance(then, dict) else {}
    return ", ".join(
        f"{name} {old[name]} -> {now}"
        for name, now in versions().items()
        if old.get(name, now) != now and now != "none"
    )


def file_digest(path: Path) -> str:
    """Hash of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def safe(name: str) -> str:
    """A design's name as a file's."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-") or "design"
