"""Folder of a run: robots, stage and numbers of the training, and its progress.

run.json        stage, seed, worlds, numbers, versions, designs, the run that it started from
members.json    the robots; with the MJCF of each where their texts differ in more than numbers
members.npz     otherwise, of a family: the MJCF as one template, and the numbers of each robot
designs/        numbers of each design; `draft build SPEC:FILE` builds it
model_N.pt      checkpoints: policy, value function, optimiser after N iterations
resume.pt       state to resume from as if the run had never stopped
resume.R.N.pt   the same of process R after N iterations, with several processes
progress.csv    one row per iteration
state.json      iterations and seconds done, iterations asked for, processes, engine
tensorboard/    the rows of progress.csv for TensorBoard
"""

from __future__ import annotations

import glob
import hashlib
import json
import re
import shutil
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict

from draft.errors import DraftError, counted, listed
from draft.extras import own_version
from draft.files import LOCK, cannot_write, lock, locked, new_folder, write
from draft.learn.bodies.legged import LeggedRobot, by_topology, check_family
from draft.learn.policy.policy import ANY, CLIMBING_FAMILY, FAMILY, MACHINE_FAMILY
from draft.learn.task.config import Config, from_dict
from draft.learn.task.stages import STAGES
from draft.learn.task.terms import TERMS
from draft.learn.training.members import MEMBERS, files_of, read_members, robots_digest
from draft.learn.training.progress import PROGRESS, fastest, hardest_row
from draft.learn.training.reached import Reached

if TYPE_CHECKING:
    from draft.learn.task.recipes import Recipe
    from draft.learn.training.options import TaskOptions

FORMAT = 2
# Names of the policies that ship, as those to start from.
SHIPPED = {
    "any": ANY,
    "family": FAMILY,
    "family_climb": CLIMBING_FAMILY,
    "family_machine": MACHINE_FAMILY,
}
RUN, RESUME, STATE = "run.json", "resume.pt", "state.json"
_PACKAGES = (
    *("mjlab", "rsl-rl-lib", "torch"),
    *("mujoco", "mjbatch", "mujoco-warp", "warp-lang"),
)


class State(TypedDict, total=False):
    """Content of state.json.

    Attributes:
        iteration: iterations done.
        seconds: seconds of training so far [s].
        processes: number of processes that share the run.
        engine: "native" or "warp".
        total: iterations that were asked for.
    """

    iteration: int
    seconds: float
    processes: int
    engine: str
    total: int


@dataclass(frozen=True)
class Origin:
    """Policy that a stage starts from.

    Attributes:
        run: folder of its run, its ONNX file, or the name of one that ships, see `SHIPPED`.
        iteration: iterations of the checkpoint.
        digest: hash of its content.
    """

    run: str
    iteration: int
    digest: str

    @property
    def policy_file(self) -> Path | None:
        """ONNX file of the policy; None for the checkpoint of a run."""
        return policy_file(self.run)

    def folder(self, beside: Path) -> Path:
        """Folder of the run that it is of; in `beside` if a study was moved with all its runs."""
        source = Path(self.run)
        return source if source.is_dir() else beside / source.name


def policy_file(name: str | Path) -> Path | None:
    """ONNX file that a policy to start from is named by; None if the name is that of a run."""
    if str(name) in SHIPPED:
        return SHIPPED[str(name)]
    path = Path(name)
    return path if path.suffix == ".onnx" and not is_run(path) else None


@dataclass(frozen=True)
class Plan:
    """Everything that determines what a run learns.

    Attributes:
        members: one quadruped, or several of one topology, in one simulation.
        stage: one of `draft.learn.task.stages.STAGES`.
        seed: seed of everything random.
        environments: number of worlds, on each GPU.
        config: the numbers.
        ground: "uneven" or "flat".
        see_design: whether the policy observes the features of its design.
        see_ground: whether the policy observes the height scan.
        origin: checkpoint whose policy it starts from; None for none.
    """

    members: tuple[LeggedRobot, ...]
    stage: str = "base"
    seed: int = 0
    environments: int = 4096
    config: Config = field(default_factory=Config)
    ground: str = "uneven"
    see_design: bool = False
    see_ground: bool = True
    origin: Origin | None = None

    @property
    def mixed(self) -> bool:
        """Whether its robots have several topologies, and one policy that knows joints by slots."""
        return len(by_topology(self.members)) > 1

    @staticmethod
    def of(
        members: tuple[LeggedRobot, ...],
        options: TaskOptions,
        recipe: Recipe,
        config: Config,
        stage: str,
        seed: int,
        see_design: bool,
    ) -> Plan:
        """Return the plan of a training from scratch.

        Args:
            members: robots to train.
            options: ground and number of worlds, where they are not the recipe's.
            recipe: set of numbers that the training starts from.
            config: the numbers, with those of the options.
            stage: stage to train.
            seed: seed of everything random.
            see_design: whether the policy observes the features of its design.
        """
        ground = options.ground or recipe.ground(stage)
        return Plan(
            members=members,
            stage=stage,
            seed=seed,
            environments=options.envs or config.learning.environments,
            config=config,
            ground=ground,
            see_design=see_design,
            see_ground=ground == "uneven",
        )

    def record(self) -> dict[str, Any]:
        """Return the plan as plain data; equal plans have equal records."""
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
            "config": self.config.of_stage(self.stage).as_dict(),
            **({"mixed": True} if self.mixed else {}),
        }


@dataclass(frozen=True, repr=False)
class Run:
    """A run on disk.

    Attributes:
        folder: its folder.
        plan: its plan.
    """

    folder: Path
    plan: Plan

    def __repr__(self) -> str:
        plan = self.plan
        names = listed((member.name for member in plan.members), 1)
        done = counted(self.done(), "iteration")
        return f"Run('{self.folder}', {names}, stage {plan.stage}, {done})"

    @property
    def resume(self) -> Path:
        """File from which the first process resumes."""
        return self.folder / RESUME

    def state(self, rank: int, iteration: int) -> Path:
        """File from which process `rank` resumes, for all but the first."""
        return self.folder / f"resume.{rank}.{iteration}.pt"

    def states(self, rank: int) -> list[tuple[int, Path]]:
        """Existing files of a process to resume from, by iterations done, rising."""
        return self._numbered(rf"resume\.{rank}\.(\d+)\.pt")

    def checkpoints(self) -> list[tuple[int, Path]]:
        """Existing checkpoints by iterations done, rising."""
        return self._numbered(r"model_(\d+)\.pt")

    def _numbered(self, pattern: str) -> list[tuple[int, Path]]:
        """Files whose names match, by the number in them."""
        files = []
        for path in self.folder.glob("*.pt"):
            match = re.fullmatch(pattern, path.name)
            if match:
                files.append((int(match[1]), path))
        return sorted(files)

    def checkpoint(self, iteration: int | None = None) -> tuple[int, Path]:
        """Return the iteration and file of a checkpoint; the last one if `iteration` is None.

        Raises:
            DraftError: there is none.
        """
        known = dict(self.checkpoints())
        if not known:
            remedy = "train it, or wait for its first iterations"
            raise DraftError(f"{self.folder} has no checkpoint yet", remedy)
        wanted = max(known) if iteration is None else iteration
        if wanted not in known:
            remedy = f"checkpoints: {', '.join(map(str, known))}"
            cause = f"{self.folder} has no checkpoint of iteration {wanted}"
            raise DraftError(cause, remedy)
        return wanted, known[wanted]

    def reached(self, iteration: int) -> Reached:
        """Difficulty that its training had reached by an iteration."""
        progress = self.folder / PROGRESS
        return Reached(hardest_row(progress, iteration), fastest(progress, iteration))

    def done(self) -> int:
        """Iterations done, as last recorded."""
        value = self._recorded().get("iteration")
        return value if isinstance(value, int) else 0

    def seconds(self) -> float:
        """Seconds of training so far, as last recorded [s]."""
        value = self._recorded().get("seconds")
        return float(value) if isinstance(value, int | float) else 0.0

    def processes(self) -> int | None:
        """Number of processes that wrote its last state; None if it has none."""
        value = self._recorded().get("processes")
        return value if isinstance(value, int) else None

    def engine(self) -> str | None:
        """Engine of its last slice of training; None if it has not been trained."""
        value = self._recorded().get("engine")
        return value if isinstance(value, str) else None

    def total(self) -> int:
        """Iterations that were last asked for; those of its stage if it has not been trained."""
        value = self._recorded().get("total")
        return value if isinstance(value, int) else self.plan.config.iterations(self.plan.stage)

    def policy_line(self, iteration: int) -> str:
        """One line on the policy of a checkpoint: its iteration, and whether training is finished.

        Args:
            iteration: iterations of the checkpoint.
        """
        done, total = self.done(), self.total()
        text = f"policy: iteration {iteration} of {total}"
        if done >= total:
            return text if iteration >= total else f"{text}, an earlier checkpoint of {self.folder}"
        given = json.dumps(str(self.folder), ensure_ascii=False)
        if total != self.plan.config.iterations(self.plan.stage):
            given += f", iterations={total}"
        reached = f" from {done}" if done != iteration else ""
        return f"{text}, unfinished: `draft.train({given})` continues the training{reached}"

    def _recorded(self) -> State:
        """Content of state.json; nothing if it is missing or cannot be read."""
        try:
            state: State = json.loads((self.folder / STATE).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return state if isinstance(state, dict) else {}

    def note(self, iteration: int, seconds: float, processes: int, engine: str, total: int) -> None:
        """Write the progress to state.json; see `State`."""
        state: State = {"iteration": iteration, "seconds": seconds}
        state |= {"processes": processes, "engine": engine, "total": total}
        write(self.folder / STATE, json.dumps(state) + "\n")


def create(folder: Path, plan: Plan, designs: dict[str, str]) -> Run:
    """Create a run's folder, whole or not at all.

    Args:
        folder: folder to create; it may exist and be empty.
        plan: the training plan.
        designs: text of each design's YAML file, by name.

    Raises:
        DraftError: the folder is not empty, or cannot be written.
    """
    record = {"format": FORMAT, "versions": versions()} | plan.record()
    used = plan.config.of_stage(plan.stage).terms
    terms = {name: TERMS[name].function.__module__ for name, _ in used}
    record |= {"extensions": terms} if terms else {}
    files: dict[str, str | bytes] = {
        RUN: json.dumps(record, indent=2) + "\n",
        **files_of(plan.members),
    } | {f"designs/{safe(name)}.yaml": text for name, text in designs.items()}
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            cause = f"'{folder}' exists and is not a run of Draft; it is kept"
            raise DraftError(cause, "choose another `out`")
        folder.parent.mkdir(parents=True, exist_ok=True)
        _remove_leftovers(folder)
    except OSError as error:
        raise cannot_write(folder, error, "choose another `out`") from None
    with ExitStack() as held, new_folder(folder, replace=False) as temporary:
        # Held until the folder is in place: another process removes leftovers that nobody holds.
        held.enter_context(lock(temporary, "training"))
        for name, text in files.items():
            write(temporary / name, text)
    return Run(folder, plan)


def _remove_leftovers(folder: Path) -> None:
    """Remove temporary folders of killed processes; a process that is alive holds a lock."""
    for path in folder.parent.glob(f".{glob.escape(folder.name)}-*"):
        temporary = re.fullmatch(r"[a-z0-9_]{8}", path.name[len(folder.name) + 2 :])
        if temporary and (path / LOCK).is_file() and not locked(path):
            shutil.rmtree(path, ignore_errors=True)


def is_run(folder: Path) -> bool:
    """Return whether a folder is a run's."""
    return (folder / RUN).is_file()


def read_record(folder: Path) -> dict[str, Any]:
    """Return the content of run.json; nothing if it cannot be read."""
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return record if isinstance(record, dict) else {}


def open_run(folder: Path) -> Run:
    """Read a run's folder.

    Raises:
        DraftError: it is not a run, is broken, or was written by another version.
    """
    if not is_run(folder):
        remedy = "create one with `draft.train(DESIGN)`"
        raise DraftError(f"'{folder}' is not a run of `draft.train`", remedy)
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
        for name, module in record.get("extensions", {}).items():
            if name not in TERMS:
                cause = f"'{folder}' was trained with '{name}' of {module}, which is not loaded"
                raise DraftError(cause, "install the package that has it, or import it first")
        if record["format"] != FORMAT or record["stage"] not in STAGES:
            cause = f"'{folder}' was written by another version of Draft"
            raise DraftError(cause, "train it again in another folder")
        members = read_members(folder)
        if not record.get("mixed"):
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
        raise DraftError(cause, "train it again in another folder") from None
    if robots_digest(members) != record["robots"]:
        cause = f"'{folder}' is broken: the robots of {MEMBERS} are not those of {RUN}"
        raise DraftError(cause, "train it again in another folder")
    return Run(folder, plan)


def check_same(run: Run, plan: Plan) -> None:
    """Check that a run has a given plan, so that it can be resumed with it.

    Raises:
        DraftError: the plans differ; the message says in what.
    """
    differing = differences(run.plan.record(), plan.record())
    if differing:
        names = ", ".join(name.replace("_", " ") for name in differing[:6])
        cause = f"'{run.folder}' holds a run with another plan: {names} differ"
        remedy = "choose another `out`, or repeat the command that created it"
        groups = {name.partition(".")[0] for name in differing} - {*run.plan.record()["config"]}
        if modules := sorted({TERMS.origin(group) for group in groups if group in TERMS}):
            remedy = f"the terms of {', '.join(modules)} were added since: name the folder alone "
            remedy += "to resume without them"
        raise DraftError(cause, remedy)


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> list[str]:
    """Names of the entries in which two plans' records differ, numbers as "rewards.height"."""
    names = [name for name in new if name != "config" and old.get(name) != new[name]]
    return names + [
        f"{group}.{name}"
        for group, numbers in new["config"].items()
        for name, value in numbers.items()
        if old.get("config", {}).get(group, {}).get(name) != value
    ]


def versions() -> dict[str, str]:
    """Versions of the packages that a training depends on; "none" if one is not installed."""
    return {"draft": own_version(), **{package: _version(package) for package in _PACKAGES}}


@cache
def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


def upgrades(then: object) -> str:
    """List the packages whose installed versions differ from recorded ones; "" if none does.

    Args:
        then: versions from `versions`; anything else, as from a broken file, counts as none.
    """
    old = then if isinstance(then, dict) else {}
    return ", ".join(
        f"{name} {old[name]} -> {now}"
        for name, now in versions().items()
        if old.get(name, now) != now and now != "none"
    )


def file_digest(path: Path) -> str:
    """Return the hash of a file's content."""
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def safe(name: str) -> str:
    """Return a design's name as a file name."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-") or "design"
