"""A study's folder: its jobs and their state, kept so that a killed study can be resumed.

study.yaml   the study's file as it was started or last resumed with
study.json   jobs and their state
designs/     design files of families
runs/        runs, with their evaluations
logs/        output of each job
report/      report on everything that was evaluated
aside/       outputs of jobs that have changed; restored when the file is changed back
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from draft.errors import DraftError
from draft.files import LOCK, lock, write
from draft.learn.training.run import upgrades, versions
from draft.study.file import Study
from draft.study.jobs import Group, Job, Reporting, Training

FORMAT = 1
STATE, FILE, ASIDE = "study.json", "study.yaml", "aside"
WAITING, RUNNING, BEGUN, DONE, FAILED, SKIPPED = (
    "waiting",
    "running",
    "begun",
    "done",
    "failed",
    "skipped",
)


class Store:
    """A study on disk.

    Attributes:
        folder: the folder, absolute.
        study: the study.
        groups: its designs and families.
        jobs: jobs by name, in order.
        states: state of each job, by name.
        seconds: time that each job took, by name; 0 if unknown [s].
        put_aside: names of jobs whose output had other numbers and was put aside on opening.
        unknown: names of jobs whose place held something else, which was put aside on opening.
        upgrades: packages whose versions changed since the study last ran, in words.
    """

    def __init__(self, folder: Path, study: Study, groups: Sequence[Group], jobs: dict[str, Job]):
        """Read what a folder holds; nothing is written yet.

        Raises:
            DraftError: it holds something else, or is damaged.
        """
        self.folder, self.jobs = folder.absolute(), jobs
        self.study, self.groups = study, groups
        self._lock: IO[str] | None = None
        self.put_aside: list[str] = []
        self.unknown: list[str] = []
        self._read()

    def _read(self) -> None:
        old = _read_state(self.folder, self.study)
        # A job that never started has no output, whatever is in its place.
        self._old: dict[str, dict[str, Any]] = {
            name: record
            for name, record in old.get("jobs", {}).items()
            if record["state"] not in (WAITING, SKIPPED)
        }
        self._aside: dict[str, dict[str, Any]] = old.get("aside", {})
        self.upgrades = upgrades(old.get("versions"))
        self.states = self._states()
        self.seconds = {name: self._seconds(job) for name, job in self.jobs.items()}

    def _same(self, job: Job) -> bool:
        """Return whether the output in the folder is of this job."""
        record = self._old.get(job.name, {})
        if isinstance(job, Training) and record.get("run_key") == job.run_key:
            # A shorter run can be continued, unless the exact run was put aside.
            other = record["key"] != job.key and self._aside_path(f"{job.name}-{job.key}").exists()
            return record.get("iterations", 0) <= job.iterations and not other
        return record.get("key") == job.key

    def _states(self) -> dict[str, str]:
        """Return the states of all jobs; a report waits for all that it reports on."""
        states = {name: self._state(job) for name, job in self.jobs.items()}
        for name, job in self.jobs.items():
            if isinstance(job, Reporting) and any(states[need] != DONE for need in job.needs):
                states[name] = WAITING
        return states

    def _state(self, job: Job) -> str:
        """Return the state of a job from its output; a job that failed is tried again."""
        if not self._same(job):
            return WAITING
        if job.complete(self.folder):
            # A report on part of the study is written again.
            partial = isinstance(job, Reporting) and self._old[job.name].get("state") != DONE
            return WAITING if partial else DONE
        begun = isinstance(job, Training) and job.output(self.folder).exists()
        return BEGUN if begun else WAITING

    def finished(self) -> bool:
        """Return whether all jobs are done."""
        return all(state == DONE for state in self.states.values())

    def changed(self) -> list[Job]:
        """Return the jobs whose output in the folder has other numbers."""
        known = [job for job in self.jobs.values() if job.name in self._old]
        return [j for j in known if not self._same(j) and j.output(self.folder).exists()]

    def open(self) -> None:
        """Lock the folder for this process, and put outputs with other numbers aside.

        Raises:
            DraftError: another process has the folder, or it cannot be written.
        """
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock = lock(self.folder, "run of the study")
            self._read()
            self._put_aside()
            self._restore()
            for group in self.groups:
                for path, text in group.files(self.folder).items():
                    write(path, text)
        except OSError as error:
            cause = f"cannot write '{self.folder}': {(error.strerror or str(error)).lower()}"
            raise DraftError(cause, "choose another `out`") from None
        write(self.folder / FILE, self.study.text)
        self._old = {}
        self.save()

    def close(self) -> None:
        """Release the folder."""
        if self._lock is not None:
            self._lock.close()

    def note(self, job: Job, state: str, seconds: float = 0.0) -> None:
        """Save a job's state, and the time since its last start [s].

        The time of a training is the sum over its slices; that of any other job is its last
        attempt's.
        """
        self.states[job.name] = state
        if isinstance(job, Training):
            self.seconds[job.name] += seconds
        elif seconds:
            self.seconds[job.name] = seconds
        self.save()

    def log(self, job: Job) -> Path:
        """Return the file of a job's output."""
        return self.folder / "logs" / f"{job.name}.log"

    def save(self) -> None:
        """Write study.json."""
        study = self.study
        record = {
            "format": FORMAT,
            "name": study.name,
            "toy": study.toy,
            "versions": versions(),
            "designs": [
                {
                    "name": group.name,
                    "members": [member.name for member in group.members],
                    "family": group.family,
                }
                for group in self.groups
            ],
            "seeds": list(study.seeds),
            "stages": list(study.stages),
            "recipe": study.recipe.name,
            "iterations": {stage: study.iterations(stage) for stage in study.stages},
            "environments": study.environments,
            "evaluate": study.evaluate.model_dump(),
            "jobs": {name: self._record(job) for name, job in self.jobs.items()},
            "aside": self._aside,
        }
        write(self.folder / STATE, json.dumps(record, indent=1) + "\n")

    def _record(self, job: Job) -> dict[str, object]:
        output = os.path.relpath(job.output(self.folder), self.folder)
        seconds = round(self.seconds[job.name], 3)
        now = {"state": self.states[job.name], "seconds": seconds, "output": output}
        return job.record() | now

    def _put_aside(self) -> None:
        """Move outputs of jobs that are no longer in the study, or have other numbers.

        Evaluations are moved before the runs that hold them, so that each can be restored alone.
        """
        for name, record in reversed(list(self._old.items())):
            job = self.jobs.get(name)
            if record["kind"] == Reporting.kind or (job is not None and self._same(job)):
                continue
            del self._old[name]
            path, key = self.folder / record["output"], f"{name}-{record['key']}"
            if path.exists() and self._aside_path(key).exists():
                # A killed call moved this job's output already; this is of something else.
                self._move_unknown(name, path)
            elif path.exists():
                _move(path, self._aside_path(key))
                self._aside[key] = record
                self.put_aside.append(name)

    def _restore(self) -> None:
        """Restore outputs that were put aside and are wanted again; move what is in their place."""
        for job in self.jobs.values():
            key, output = f"{job.name}-{job.key}", job.output(self.folder)
            kept, there = self._aside_path(key), output.exists()
            held = there and job.holds(self.folder, output)
            back = not held and kept.exists() and job.holds(self.folder, kept)
            if there and (back or not held) and not isinstance(job, Reporting):
                self._move_unknown(job.name, output)
            if back:
                _move(kept, output)
            record = self._old.pop(job.name, None) or self._aside.get(key)
            if record is None and held and not isinstance(job, Reporting):
                record = job.record()  # study.json was lost, but the output identifies its job.
            if record is not None and (back or held):
                self._old[job.name] = record
                self._aside.pop(key, None)
        self.states = self._states()
        self.seconds = {name: self._seconds(job) for name, job in self.jobs.items()}

    def _aside_path(self, key: str) -> Path:
        return self.folder / ASIDE / key

    def _move_unknown(self, name: str, path: Path) -> None:
        """Move an output aside that belongs to no known job of the study."""
        number, place = 1, self._aside_path(f"{name}-unknown")
        while place.exists():
            number += 1
            place = self._aside_path(f"{name}-unknown-{number}")
        _move(path, place)
        self.unknown.append(name)

    def _seconds(self, job: Job) -> float:
        return float(self._old[job.name].get("seconds", 0.0)) if self._same(job) else 0.0


def _read_state(folder: Path, study: Study) -> Mapping[str, Any]:
    """Return the content of a folder's study.json; empty for a new folder."""
    path = folder / STATE
    if not path.exists() and (folder / FILE).is_file():
        return {}  # It was lost; outputs are recognised by their content.
    if not path.exists():
        try:
            mine = (LOCK, f".{STATE}.tmp")
            others = [p.name for p in folder.iterdir() if not p.name.startswith(mine)]
        except FileNotFoundError:
            return {}
        except OSError as error:
            cause = f"cannot read '{folder}': {(error.strerror or str(error)).lower()}"
            raise DraftError(cause, "choose another `out`") from None
        if others:
            cause = f"'{folder}' holds no study, but {min(others)}; it is kept"
            raise DraftError(cause, "choose another `out`")
        return {}
    try:
        old = json.loads(path.read_text(encoding="utf-8"))
        known = old["format"] == FORMAT and isinstance(old["jobs"], dict)
        ours = all(
            {"kind", "key", "output", "state"} <= record.keys() for record in old["jobs"].values()
        )
        name, was_toy = str(old["name"]), bool(old["toy"])
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        cause = f"{path} cannot be read as a study: {error}"
        remedy = "delete it to rebuild it from the outputs, or choose another `out`"
        raise DraftError(cause, remedy) from None
    if not known or not ours:
        cause = f"'{folder}' was written by another version of Draft"
        raise DraftError(cause, "choose another `out`")
    if (name, was_toy) != (study.name, study.toy):
        which = f"{'the toy of ' * was_toy}study '{name}'"
        cause = f"'{folder}' is of {which}; it is kept"
        remedy = "choose another `out`, or repeat the command that started it"
        raise DraftError(cause, remedy)
    return old


def _move(path: Path, to: Path) -> None:
    to.parent.mkdir(parents=True, exist_ok=True)
    os.rename(path, to)
