"""Doing the jobs of a study: what is ready goes to whoever is free, until the time is up.

Whatever is killed, the study or a job, the same command goes on: outputs are written whole or not
at all, training keeps its last state, and a job's state is read from its output.
"""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from draft.errors import DraftError
from draft.files import locked
from draft.learn.run import is_run
from draft.study.jobs import Evaluating, Job, Reporting, Training
from draft.study.store import BEGUN, DONE, FAILED, RUNNING, SKIPPED, WAITING, Store
from draft.study.workers import Worker

LEAST = 30.0  # seconds below which nothing is begun
_RESERVE = 15.0  # seconds of a slice in which training ends and saves
_GRACE = 10.0  # seconds past the end of a slice after which a job is ended
_TRIES = 2  # of a job whose process died
_PATIENCE = 20.0  # seconds with a run that a process of a killed study may have for a moment yet
_POLL = 0.1
_LAST_LINES = 12

Tell = Callable[[Job, str, str], None]


@dataclass
class _Task:
    """A job that somebody is at work on."""

    job: Job
    worker: Worker
    began: float
    offset: int
    done: int


class Execution:
    """One call's work on a study.

    Attributes:
        failures: why jobs failed, by name.
        late: names of jobs that wait for another slice: training that goes on, what was ended
            because the time was up, a report of a part.
        idle: whether nothing was done, and no training came further.
    """

    def __init__(
        self,
        store: Store,
        workers: Sequence[Worker],
        until: float = math.inf,
        tell: Tell = lambda job, state, words: None,
        tick: Callable[[], None] = lambda: None,
    ) -> None:
        """Note what is worked with.

        Args:
            store: the study's folder, open.
            workers: who does the jobs.
            until: `time.monotonic()` to be done at.
            tell: called with a job, its new state, and why.
            tick: called again and again while jobs are at work.
        """
        self._store, self._until = store, until
        self._tell, self._tick = tell, tick
        self._free, self._tasks = list(workers), list[_Task]()
        self._deaths: dict[str, int] = {}
        self._met: dict[str, float] = {}  # when a job's run was first found taken
        self.failures: dict[str, str] = {}
        self.late: list[str] = []
        self.idle = True
        self._given, self._begun = self._left(), False

    def run(self) -> bool:
        """Work until nothing can be begun any more.

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
                self._tick()
                for task in [*self._tasks]:
                    self._look_at(task)
        finally:
            for task in self._tasks:
                task.worker.stop()
            for worker in self._free:
                worker.stop()
        return self._store.finished()

    def lacking(self) -> float:
        """Seconds by which the slice was too short to do anything, about; 0 where it was not."""
        if not self.idle or self.failures or self._until == math.inf or self._store.finished():
            return 0.0
        return self._given if self._begun else max(0.0, LEAST - self._given) + _RESERVE

    def _begin_ready(self) -> bool:
        """Give jobs to who is free; returns whether one waits for its run to be free."""
        waiting = False
        for job in self._ready():
            if not self._free:
                break
            if not self._fits(job):
                continue
            if self._taken(job):
                waiting = True
            else:
                self._begin(job, self._free.pop(0))
        return waiting

    def _taken(self, job: Job) -> bool:
        """Whether another process has a job's run, and may let go of it shortly.

        Processes of a study that was killed end a moment after it. Whoever keeps the run longer
        is told by the job.
        """
        if not isinstance(job, Training) or not locked(job.output(self._store.folder)):
            return False
        met = self._met.setdefault(job.name, time.monotonic())
        return time.monotonic() - met < _PATIENCE

    def _ready(self) -> Iterator[Job]:
        """Jobs that could be begun, in order; those whose needs failed are skipped."""
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
                self._tell(job, SKIPPED, f"{job.needs[0]} has failed")
            elif all(state == DONE for state in needs):
                yield job

    def _left(self) -> float:
        return self._until - time.monotonic()

    def _fits(self, job: Job) -> bool:
        """Whether there is time for a job; training may end before it is done.

        An evaluation may begin with the slice however long the others took: it never gets more.
        """
        least = LEAST
        if isinstance(job, Evaluating) and self._begun:
            least = max(least, 1.2 * self._took(job))
        return self._left() > least

    def _took(self, job: Evaluating) -> float:
        """Seconds that evaluations of the same stage took, the longest."""
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
            self._fail(task, "it cannot begin")
            return
        request = job.request(store.folder, worker.device, minutes, worker.physics)
        worker.start(request, log, fresh=isinstance(job, Reporting))
        self._tell(job, RUNNING, "")

    def _look_at(self, task: _Task) -> None:
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
            self._settle(task, WAITING, f"its process {_death(code)}; it is tried again")
        elif code:
            self._fail(task, f"its process {_death(code)}" if code < 0 else f"exit code {code}")
        elif job.complete(self._store.folder):
            partly = isinstance(job, Reporting) and self._lacks(job)
            words = "of what is done so far" if partly else ""
            self._settle(task, WAITING if partly else DONE, words)
            if partly:
                self.late.append(job.name)
        elif isinstance(job, Training) and (changed := self._changed(job)):
            self._fail(task, changed)
        elif isinstance(job, Training) and self._until < math.inf:
            self._settle(task, BEGUN, f"{job.done(self._store.folder)} of {job.iterations}")
            self.late.append(job.name)
        else:
            output = job.output(self._store.folder)
            self._fail(task, f"it ended well, but {output} is not whole, or of something else")

    def _changed(self, job: Training) -> str:
        """Why a run is not the one that was planned; empty where it is, or is not there."""
        output = job.output(self._store.folder)
        differing = job.differing(output) if is_run(output) else []
        return f"its run has other {', '.join(differing[:6])}" if differing else ""

    def _lacks(self, job: Job) -> bool:
        return any(self._store.states[name] != DONE for name in job.needs)

    def _end_late(self, task: _Task) -> None:
        self.late.append(task.job.name)
        begun = isinstance(task.job, Training)
        self._settle(task, BEGUN if begun else WAITING, "ended, because the time is up")

    def _fail(self, task: _Task, why: str) -> None:
        log = self._store.log(task.job)
        self.failures[task.job.name] = f"{why}; {log} ends with\n{_last_lines(task, log)}"
        self._settle(task, FAILED, why)

    def _settle(self, task: _Task, state: str, words: str) -> None:
        self._tasks.remove(task)
        self._free.append(task.worker)
        self._store.note(task.job, state, time.monotonic() - task.began)
        if state == DONE or _iterations(task.job, self._store) > task.done:
            self.idle = False
        self._tell(task.job, state, words)


def _iterations(job: Job, store: Store) -> int:
    return job.done(store.folder) if isinstance(job, Training) else 0


def _death(code: int) -> str:
    try:
        return f"was ended by {signal.Signals(-code).name}" if code < -1 else "died"
    except ValueError:
        return "died"


def _last_lines(task: _Task, log: object) -> str:
    try:
        with open(str(log), "rb") as file:
            file.seek(task.offset)
            said = file.read().decode("utf-8", "replace")
    except OSError:
        said = ""
    lines = [line.rstrip() for line in said.splitlines() if line.strip()]
    return "\n".join(f"    {line}" for line in lines[-_LAST_LINES:]) or "    (nothing)"
