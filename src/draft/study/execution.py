"""Running the jobs of a study: each ready job goes to the next free worker, until time is up.

A study or job that is killed can be resumed: outputs are written as a whole or not at all,
training keeps its last state, and the state of a job is read from its output.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from draft.errors import DraftError
from draft.files import locked
from draft.learn.training.run import is_run
from draft.study.jobs import Evaluating, Job, Reporting, Training
from draft.study.store import BEGUN, DONE, FAILED, RUNNING, SKIPPED, WAITING, Store
from draft.study.workers import Worker

LEAST = 30.0  # No job starts with less time left than this [s].
_RESERVE = 15.0  # Part of a slice in which training ends and saves [s].
_GRACE = 10.0  # Time past the end of a slice after which a job is killed [s].
_TRIES = 2  # Attempts at a job whose process dies.
_PATIENCE = 20.0  # Time that a process of a killed study may still hold a run [s].
_POLL = 0.1  # [s]
_LAST_LINES = 12


class Watch:
    """Observer of a study; its methods do nothing unless overridden."""

    def opened(self, store: Store) -> None:
        """Handle the start: the folder is open, and no job has started."""

    def changed(self, job: Job, state: str, reason: str) -> None:
        """Handle a job's new state.

        Args:
            job: the job.
            state: such as "running" or "done".
            reason: why, in words; "" if there is nothing to say.
        """

    def tick(self) -> None:
        """Handle the passing of time; called several times a second while jobs run."""


@dataclass
class _Task:
    """A job that a worker is running.

    Attributes:
        job: the job.
        worker: the worker.
        began: start, by `time.monotonic()` [s].
        offset: length of the job's log at the start [bytes].
        done: iterations of a training that were done at the start.
    """

    job: Job
    worker: Worker
    began: float
    offset: int
    done: int


class Execution:
    """Work of one call on a study.

    Attributes:
        failures: reasons why jobs failed, by name.
        late: names of jobs left to the next call: unfinished trainings, jobs ended because time was
            up, and a report on part of the study.
        idle: whether no job was finished and no training advanced.
    """

    def __init__(
        self,
        store: Store,
        workers: Sequence[Worker],
        until: float = math.inf,
        watch: Watch | None = None,
    ) -> None:
        """Prepare; nothing is started yet.

        Args:
            store: the study's folder, open.
            workers: what runs the jobs.
            until: end of the slice, by `time.monotonic()` [s].
            watch: observer of the progress.
        """
        self._store, self._until = store, until
        self._watch = watch or Watch()
        self._free, self._tasks = list(workers), list[_Task]()
        self._deaths: dict[str, int] = {}
        self._first_locked: dict[str, float] = {}
        self.failures: dict[str, str] = {}
        self.late: list[str] = []
        self.idle = True
        self._given, self._begun = self._left(), False

    def run(self) -> bool:
        """Work until no further job can start.

        Returns:
            Whether all jobs are done.

        Raises:
            DraftError: the study's folder cannot be written.
        """
        try:
            while True:
                waiting = self._begin_ready()
                if not self._tasks and not waiting:
                    break
                time.sleep(_POLL)
                self._watch.tick()
                for task in [*self._tasks]:
                    self._check(task)
        finally:
            for task in self._tasks:
                task.worker.stop()
            for worker in self._free:
                worker.stop()
        return self._store.finished()

    def missing_seconds(self) -> float:
        """Return about how much longer the slice should have been [s]; 0 if it was of use."""
        if not self.idle or self.failures or self._until == math.inf or self._store.finished():
            return 0.0
        return self._given if self._begun else max(0.0, LEAST - self._given) + _RESERVE

    def _begin_ready(self) -> bool:
        """Give jobs to free workers; return whether a job waits for its run to be released."""
        waiting = False
        for job in self._ready():
            if not self._free:
                break
            if not self._fits(job):
                continue
            if self._held(job):
                waiting = True
            else:
                self._begin(job, self._free.pop(0))
        return waiting

    def _held(self, job: Job) -> bool:
        """Return whether another process holds a job's run and may release it shortly.

        Processes of a killed study end a moment after it. If the run stays locked for longer, the
        job starts and fails with the name of the process that holds it.
        """
        if not isinstance(job, Training) or not locked(job.output(self._store.folder)):
            return False
        first = self._first_locked.setdefault(job.name, time.monotonic())
        return time.monotonic() - first < _PATIENCE

    def _ready(self) -> Iterator[Job]:
        """Yield jobs that could start, in order; skip those whose needs failed."""
        store = self._store
        states = store.states
        for job in store.jobs.values():
            if states[job.name] not in (WAITING, BEGUN) or job.name in self.late:
                continue
            needs = [states[name] for name in job.needs]
            if isinstance(job, Reporting):
                if all(state in (DONE, FAILED, SKIPPED) for state in needs) and DONE in needs:
                    yield job
            elif any(state in (FAILED, SKIPPED) for state in needs):
                store.note(job, SKIPPED)
                self._watch.changed(job, SKIPPED, f"{job.needs[0]} has failed")
            elif all(state == DONE for state in needs):
                yield job

    def _left(self) -> float:
        return self._until - time.monotonic()

    def _fits(self, job: Job) -> bool:
        """Return whether there is time for a job; training may end before it is done.

        The first job of a slice may be an evaluation however long earlier ones took: no slice
        would give it more time.
        """
        least = LEAST
        if isinstance(job, Evaluating) and self._begun:
            least = max(least, 1.2 * self._longest(job))
        return self._left() > least

    def _longest(self, job: Evaluating) -> float:
        """Return the longest time that an evaluation of the same stage took [s]."""
        stage = job.training.plan.stage
        alike = (
            self._store.seconds[other.name]
            for other in self._store.jobs.values()
            if isinstance(other, Evaluating) and other.training.plan.stage == stage
        )
        return max(alike, default=0.0)

    def _begin(self, job: Job, worker: Worker) -> None:
        store, minutes = self._store, None
        if self._left() < math.inf:
            minutes = max(0.1, (self._left() - _RESERVE) / 60.0)
        self._begun = True
        log = store.log(job)
        offset = log.stat().st_size if log.exists() else 0
        store.note(job, RUNNING)
        task = _Task(job, worker, time.monotonic(), offset, _iterations(job, store))
        self._tasks.append(task)
        try:
            job.prepare(store.folder)
        except DraftError as error:
            log.parent.mkdir(parents=True, exist_ok=True)
            with log.open("a", encoding="utf-8") as file:
                file.write(f"error: {error}\n")
            self._fail(task, "it cannot start")
            return
        request = job.request(store.folder, worker.device, minutes, worker.physics)
        worker.start(request, log, fresh=isinstance(job, Reporting))
        self._watch.changed(job, RUNNING, "")

    def _check(self, task: _Task) -> None:
        """Handle the end of a task's job, or kill the job if time is up."""
        code = task.worker.poll()
        if code is None:
            if self._left() < -_GRACE:
                task.worker.stop()
                self._end_late(task)
            return
        job = task.job
        if code < 0 and job.complete(self._store.folder):
            code = 0  # It died after it was done.
        if code < 0 and self._deaths.get(job.name, 0) + 1 < _TRIES:
            self._deaths[job.name] = self._deaths.get(job.name, 0) + 1
            self._settle(task, WAITING, f"its process {_death(code)}; trying again")
        elif code:
            self._fail(task, f"its process {_death(code)}" if code < 0 else f"exit code {code}")
        elif job.complete(self._store.folder):
            partial = isinstance(job, Reporting) and self._incomplete(job)
            reason = "of what is done so far" if partial else ""
            self._settle(task, WAITING if partial else DONE, reason)
            if partial:
                self.late.append(job.name)
        elif isinstance(job, Training) and (changed := self._changed(job)):
            self._fail(task, changed)
        elif isinstance(job, Training) and self._until < math.inf:
            self._settle(task, BEGUN, f"{job.done(self._store.folder)} of {job.iterations}")
            self.late.append(job.name)
        else:
            output = job.output(self._store.folder)
            self._fail(task, f"it exited with 0, but {output} is incomplete or of another job")

    def _changed(self, job: Training) -> str:
        """Return how a run differs from the plan; "" if it does not, or does not exist."""
        output = job.output(self._store.folder)
        differing = job.differing(output) if is_run(output) else []
        return f"its run has other {', '.join(differing[:6])}" if differing else ""

    def _incomplete(self, job: Job) -> bool:
        return any(self._store.states[name] != DONE for name in job.needs)

    def _end_late(self, task: _Task) -> None:
        self.late.append(task.job.name)
        begun = isinstance(task.job, Training)
        self._settle(task, BEGUN if begun else WAITING, "ended, because time is up")

    def _fail(self, task: _Task, reason: str) -> None:
        log = self._store.log(task.job)
        self.failures[task.job.name] = f"{reason}; {log} ends with\n{_last_lines(task, log)}"
        self._settle(task, FAILED, reason)

    def _settle(self, task: _Task, state: str, reason: str) -> None:
        """Free a task's worker, and save the job's state."""
        self._tasks.remove(task)
        self._free.append(task.worker)
        self._store.note(task.job, state, time.monotonic() - task.began)
        if state == DONE or _iterations(task.job, self._store) > task.done:
            self.idle = False
        self._watch.changed(task.job, state, reason)


def _iterations(job: Job, store: Store) -> int:
    return job.done(store.folder) if isinstance(job, Training) else 0


def _death(code: int) -> str:
    try:
        return f"was ended by {signal.Signals(-code).name}" if code < -1 else "died"
    except ValueError:
        return "died"


def _last_lines(task: _Task, log: Path) -> str:
    """Return the last lines that a job wrote to its log, indented."""
    try:
        with log.open("rb") as file:
            file.seek(task.offset)
            text = file.read().decode("utf-8", "replace")
    except OSError:
        text = ""
    lines = [line.rstrip() for line in text.splitlines() if line.strip()]
    return "\n".join(f"    {line}" for line in lines[-_LAST_LINES:]) or "    (nothing)"
