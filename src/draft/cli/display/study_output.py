"""Terminal output of `draft study`: the plan, the progress of jobs, and the outcome."""

from __future__ import annotations

import json as json_
import math
import sys
import time
from collections import Counter
from collections.abc import Mapping
from types import TracebackType

from rich.console import Group as Lines
from rich.console import RenderableType
from rich.live import Live
from rich.table import Table

from draft.cli.display.verdict import console
from draft.cli.spelling import spelt
from draft.study.capacity import Capacity
from draft.study.costs import Estimate, setting
from draft.study.execution import Watch
from draft.study.jobs import Job, Training
from draft.study.running import Outcome
from draft.study.store import BEGUN, DONE, FAILED, RUNNING, SKIPPED, WAITING, Store

_STYLES = {DONE: "green", RUNNING: "bold", BEGUN: "yellow", FAILED: "bold red", SKIPPED: "red"}
_ROWS = 30  # Rows of the table that is refreshed.


def print_plan(store: Store, estimate: Estimate, capacity: Capacity | None, json: bool) -> None:
    """Print the jobs, their needs, and the hours that are left.

    Args:
        store: folder of the study.
        estimate: hours of the jobs.
        capacity: what would run them; None for GPUs that are not here.
        json: whether to print JSON.
    """
    if json:
        jobs = {
            name: job.record() | {"state": store.states[name], "hours": estimate.hours[name]}
            for name, job in store.jobs.items()
        }
        record = {"folder": str(store.folder), "jobs": jobs, "hours": estimate.total}
        record |= {"rate": estimate.source, "unit": estimate.unit, **_capacity_record(capacity)}
        print(json_.dumps(record | {"versions_changed": store.upgrades}, indent=1))
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("job", "after", "state"):
        table.add_column(heading, no_wrap=True)
    table.add_column(estimate.unit, justify="right")
    for name, job in store.jobs.items():
        needs = job.needs[0] if len(job.needs) == 1 else f"{len(job.needs)} jobs" * bool(job.needs)
        left = estimate.hours[name]
        table.add_row(name, needs, _planned(store, job), f"{left:.3f}" if left else "")
    out = console()
    out.print(table)
    if store.upgrades:
        out.print(_upgrades(store))
    if capacity is not None and capacity.on_cpu:
        out.print(f"engine: {setting(capacity)}")
    count = estimate.at_once
    words = f"{estimate.total / count:,.2f} {estimate.unit} are left"
    words += f" with {count} jobs at once" * (count > 1)
    out.print(f"{_counts(store.states)}; {words}: {spelt(estimate.source)}")


def _capacity_record(capacity: Capacity | None) -> dict[str, str | int | None]:
    """Return what would run the jobs, as plain data."""
    if capacity is None:
        return {"engine": None, "why": None, "processes": None, "at_once": None}
    engine = {"engine": capacity.engine.name, "why": capacity.engine.why}
    return engine | {"processes": capacity.processes, "at_once": capacity.at_once}


def _upgrades(store: Store) -> str:
    """Return the versions that changed; only a change of Draft itself repeats jobs."""
    return (
        f"versions changed since: {store.upgrades}; finished jobs are kept, "
        "--out DIR starts from scratch"
    )


def _planned(store: Store, job: Job) -> str:
    state = store.states[job.name]
    if job in store.changed():
        return "changed"
    if state == BEGUN and isinstance(job, Training):
        return f"{job.done(store.folder)} of {job.iterations}"
    return "done" if state == DONE else "new"


def _counts(states: Mapping[str, str]) -> str:
    """Return the number of jobs in each state, in words."""
    count = Counter(states.values())
    done = f"{count[DONE]} of {count.total()} jobs are done"
    others = (f"{number} {state}" for state, number in count.items() if state in (FAILED, SKIPPED))
    return ", ".join((done, *others))


def print_notes(store: Store) -> None:
    """Print what drawing the families of a study refused, on stderr."""
    for group in store.groups:
        if group.note:
            print(spelt(group.note), file=sys.stderr)


def print_outcome(outcome: Outcome, json: bool) -> None:
    """Print what was done, what failed, and how to continue."""
    if json:
        record = {"folder": str(outcome.folder), "done": outcome.done, "jobs": outcome.jobs}
        if outcome.minutes_needed is not None:
            record["minutes_needed"] = outcome.minutes_needed
        print(json_.dumps(record | {"failures": outcome.failures}, indent=1))
        return
    for name, reason in outcome.failures.items():
        print(f"{name} failed: {spelt(reason)}", file=sys.stderr)
    print(_counts(outcome.jobs))
    if outcome.report is not None:
        print(f"report: {outcome.report}")
    if outcome.minutes_needed is not None:
        print(f"too little time to do anything; pass --minutes {outcome.minutes_needed} or more")
    elif not outcome.done:
        print("repeat the command to resume")
    if not outcome.done and outcome.report is None and DONE in outcome.jobs.values():
        print(f"report on what is done so far: draft study report {outcome.folder}")


class Screen(Watch):
    """Progress of jobs: a table that is refreshed on a terminal, elsewhere one line per change."""

    def __init__(self, silent: bool) -> None:
        self._silent = silent
        self._console = console()
        self._live: Live | None = None
        self._store: Store | None = None
        self._drawn = -math.inf
        self._began: dict[str, float] = {}

    def __enter__(self) -> Screen:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._live is not None and self._store is not None:
            self._live.update(self._table(self._store), refresh=True)
            self._live.__exit__(kind, error, traceback)

    def opened(self, store: Store) -> None:
        """Print what was found in the folder."""
        self._store = store
        print_notes(store)
        if self._silent:
            return
        print(f"{store.folder}: {_counts(store.states)}")
        if store.put_aside:
            count = len(store.put_aside)
            what = "1 output has" if count == 1 else f"{count} outputs have"
            print(f"{what} other numbers; moved to {store.folder}/aside")
        if store.unknown:
            names = ", ".join(store.unknown)
            print(f"incomplete or not of this study; moved to {store.folder}/aside: {names}")
        if store.upgrades:
            print(_upgrades(store))
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False)
            self._live.__enter__()

    def changed(self, job: Job, state: str, reason: str) -> None:
        """Print a job's new state."""
        now = time.monotonic()
        taken = now - self._began.get(job.name, now)
        if state == RUNNING:
            self._began[job.name] = now
        if self._silent or self._live is not None or self._store is None:
            self._drawn = -math.inf
            return
        done = sum(state == DONE for state in self._store.states.values())
        line = f"[{done}/{len(self._store.states)}] {job.name}: {state}"
        line += f" after {taken:.0f} s" if state != RUNNING and job.name in self._began else ""
        print(line + (f", {reason}" if reason else ""), flush=True)

    def tick(self) -> None:
        """Refresh the table, at most once a second."""
        if self._live is None or self._store is None or time.monotonic() - self._drawn <= 1.0:
            return
        self._drawn = time.monotonic()
        self._live.update(self._table(self._store), refresh=True)

    def _table(self, store: Store) -> RenderableType:
        table = Table(box=None, show_header=False)
        order = (RUNNING, FAILED, BEGUN, WAITING, SKIPPED)
        jobs = [job for job in store.jobs.values() if store.states[job.name] in order]
        jobs.sort(key=lambda job: order.index(store.states[job.name]))
        for job in jobs[:_ROWS]:
            state = store.states[job.name]
            progress = ""
            if isinstance(job, Training) and state in (RUNNING, BEGUN):
                progress = f"{job.done(store.folder)} of {job.iterations}"
            table.add_row(job.name, f"[{_STYLES.get(state, 'dim')}]{state}[/]", progress)
        return Lines(_counts(store.states), table)
