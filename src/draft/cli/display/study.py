"""What `draft study` shows and reads: its designs, its plan, how far it is."""

from __future__ import annotations

import json as json_
import math
import re
import sys
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from rich.console import Group as Together
from rich.console import RenderableType
from rich.live import Live
from rich.table import Table

from draft.cli.bodies import members
from draft.cli.display.verdict import console
from draft.errors import DraftError, Problem
from draft.model.folder import design_text
from draft.study import costs
from draft.study.capacity import Hands
from draft.study.execution import Execution
from draft.study.file import Family, Study, at_place
from draft.study.jobs import REPORT, Group, Job, Training
from draft.study.store import BEGUN, DONE, FAILED, RUNNING, SKIPPED, WAITING, Store
from draft.study.workers import Worker

_STYLES = {DONE: "green", RUNNING: "bold", BEGUN: "yellow", FAILED: "bold red", SKIPPED: "red"}
_ROWS = 30  # of the table that renews itself


def groups(study: Study) -> list[Group]:
    """Read the designs of a study.

    Raises:
        DraftError: a design that cannot be read or trained, or stands twice; with its place.
    """
    found: list[Group] = []
    for number, design in enumerate(study.designs):
        where = study.place("designs", number)
        group = at_place(partial(_group, design), where)
        if len(group.members) > study.environments:
            cause = f"{study.environments} worlds cannot hold {len(group.members)} designs"
            remedy = f"give 'environments: {len(group.members)}' or more"
            raise DraftError(Problem(cause, where, remedy))
        found.append(group)
    count = Counter(group.name for group in found)
    # Designs of one name belong to different robots, unless they are the same.
    found = [
        replace(group, name=_safe(group.members[0].name)) if count[group.name] > 1 else group
        for group in found
    ]
    for number, group in enumerate(found):
        if group.name in [other.name for other in found[:number]]:
            cause = f"'{group.name}' stands twice"
            remedy = "name each design once, or give the family a name"
            raise DraftError(Problem(cause, study.place("designs", number), remedy))
    return found


def _group(design: str | Family) -> Group:
    if isinstance(design, Family):
        return _family(design)
    designs, found = members([design])
    name = _safe(found[0].name.rpartition(":")[2])
    return Group(name, found, {m.name: design_text(d) for m, d in zip(found, designs, strict=True)})


def _family(family: Family) -> Group:
    """Bodies of a family, drawn once for all seeds and stages."""
    designs, found = members([family.design], family.vary, family.bodies, (), family.seed)
    spec, width = designs[0].spec.name, len(str(len(designs)))
    names = [f"{spec}:body_{number:0{width}d}" for number in range(1, len(designs) + 1)]
    default = f"{_safe(family.design.rpartition('/')[2])}-{len(designs)}-bodies"
    return Group(
        name=family.name or default,
        members=tuple(replace(m, name=name) for m, name in zip(found, names, strict=True)),
        designs={name: design_text(d) for name, d in zip(names, designs, strict=True)},
        family=True,
        see_design=family.see_design,
    )


def _safe(name: str) -> str:
    """A name as a file's."""
    return re.sub(r"[^\w.]+", "-", name).strip("-") or "design"


def print_plan(store: Store, rate: float | None, hands: Hands | None, json: bool) -> None:
    """Print the jobs, what they wait for, and an estimate of their hours.

    Args:
        store: the study's folder.
        rate: steps per second of a job; None to measure or assume.
        hands: what would do them; None for GPUs that are not here.
        json: print it as JSON.
    """
    rates = costs.Rates(store.folder, store.jobs, rate, hands)
    unit = "hours" if rates.on_cpu else "GPU-hours"
    changed = store.changed()
    left = {
        name: 0.0
        if store.states[name] == DONE
        else costs.hours(job, store.folder, rates, job in changed)
        for name, job in store.jobs.items()
    }
    total = sum(left.values())
    if json:
        jobs = {
            name: job.record() | {"state": store.states[name], "hours": left[name]}
            for name, job in store.jobs.items()
        }
        told = {"folder": str(store.folder), "jobs": jobs, "hours": total, "rate": rates.words()}
        told |= {"unit": unit, **_told(hands), "versions_changed": store.upgrades}
        print(json_.dumps(told, indent=1))
        return
    table = Table(box=None, pad_edge=False)
    for heading in ("job", "after", "state"):
        table.add_column(heading, no_wrap=True)
    table.add_column(unit, justify="right")
    for name, job in store.jobs.items():
        needs = job.needs[0] if len(job.needs) == 1 else f"{len(job.needs)} jobs" * bool(job.needs)
        words = _new(store, job)
        table.add_row(name, needs, words, f"{left[name]:.3f}" if left[name] else "")
    out = console()
    out.print(table)
    if store.upgrades:
        out.print(_upgrades(store))
    if hands is not None and hands.on_cpu:
        out.print(f"engine: {costs.setting(hands)}")
    count = (hands.at_once or 1) if hands is not None and rates.on_cpu else 1
    words = f"{total / count:,.2f} {unit} are left" + f" with {count} jobs at once" * (count > 1)
    out.print(f"{_counts(store)}; {words}: {rates.words()}")


def _told(hands: Hands | None) -> dict[str, Any]:
    """What would do the jobs, as plain data."""
    if hands is None:
        return {"engine": None, "why": None, "processes": None, "at_once": None}
    engine = {"engine": hands.engine.name, "why": hands.engine.why}
    return engine | {"processes": hands.processes, "at_once": hands.at_once}


def _upgrades(store: Store) -> str:
    """Versions that changed; only one of Draft itself makes outputs old."""
    return f"versions changed since: {store.upgrades}; what is done is kept, --out DIR begins anew"


def _new(store: Store, job: Job) -> str:
    state = store.states[job.name]
    if job in store.changed():
        return "changed"
    if state == BEGUN and isinstance(job, Training):
        return f"{job.done(store.folder)} of {job.iterations}"
    return "done" if state == DONE else "new"


def _counts(store: Store) -> str:
    """How many jobs are in which state."""
    count = Counter(store.states.values())
    done = f"{count[DONE]} of {count.total()} jobs are done"
    others = (f"{number} {state}" for state, number in count.items() if state in (FAILED, SKIPPED))
    return ", ".join((done, *others))


def execute(
    store: Store, workers: Sequence[Worker], begun: float, minutes: float | None, json: bool
) -> int:
    """Do the jobs, show how far they are, and tell what came of it.

    Args:
        store: the study's folder, open.
        workers: who does the jobs.
        begun: `time.monotonic()` when the command began.
        minutes: for how long; None for no limit.
        json: tell it as JSON.

    Returns:
        The exit code: 1 where a job failed.
    """
    changed = store.put_aside
    if not json:
        print(f"{store.folder}: {_counts(store)}")
        if changed:
            what = "output is" if len(changed) == 1 else "outputs are"
            place = f"{store.folder}/aside"
            print(f"{len(changed)} {what} of other numbers, and kept in {place}")
        if store.unknown:
            what = ", ".join(store.unknown)
            print(f"not whole, or not of this study, and kept in {store.folder}/aside: {what}")
        if store.upgrades:
            print(_upgrades(store))
    screen = _Screen(store, json)
    until = math.inf if minutes is None else begun + 60.0 * minutes
    execution = Execution(store, workers, until, screen.tell, screen.tick)
    with screen:
        done = execution.run()
    lacking = execution.lacking()
    more = math.ceil((minutes or 0.0) + lacking / 60.0) if lacking else None
    if json:
        told = {"folder": str(store.folder), "done": done, "jobs": store.states}
        told |= {} if more is None else {"minutes_needed": more}
        print(json_.dumps(told | {"failures": execution.failures}, indent=1))
    else:
        _print_end(store, execution, done, more)
    return 1 if execution.failures else 0


def _print_end(store: Store, execution: Execution, done: bool, more: int | None) -> None:
    for name, why in execution.failures.items():
        print(f"{name} failed: {why}", file=sys.stderr)
    print(_counts(store))
    index = store.folder / REPORT / "index.html"
    if index.is_file():
        print(f"report: {index}")
    if more is not None:
        print(f"nothing could be done in this time; give --minutes {more} or more")
    elif not done:
        print("the same command goes on")
    if not done and not index.is_file() and DONE in store.states.values():
        print(f"what is done so far: draft study report {store.folder}")


class _Screen:
    """Shows jobs as they go: a table that renews itself, or lines where nobody looks."""

    def __init__(self, store: Store, silent: bool) -> None:
        self._store, self._silent = store, silent
        self._console = console()
        self._live: Live | None = None
        self._drawn = -math.inf
        self._began: dict[str, float] = {}

    def __enter__(self) -> _Screen:
        if self._console.is_terminal and not self._silent:
            self._live = Live(console=self._console, auto_refresh=False)
            self._live.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        if self._live is not None:
            self._live.update(self._table(), refresh=True)
            self._live.__exit__(*error)

    def tell(self, job: Job, state: str, words: str) -> None:
        """A job has a new state."""
        now = time.monotonic()
        taken = now - self._began.get(job.name, now)
        if state == RUNNING:
            self._began[job.name] = now
        if self._silent or self._live is not None:
            self._drawn = -math.inf
            return
        done = sum(state == DONE for state in self._store.states.values())
        line = f"[{done}/{len(self._store.states)}] {job.name}: {state}"
        line += f" after {taken:.0f} s" if state != RUNNING and job.name in self._began else ""
        print(line + (f", {words}" if words else ""), flush=True)

    def tick(self) -> None:
        """Draw the table again, once in a while."""
        if self._live is not None and time.monotonic() - self._drawn > 1.0:
            self._drawn = time.monotonic()
            self._live.update(self._table(), refresh=True)

    def _table(self) -> RenderableType:
        store = self._store
        table = Table(box=None, show_header=False)
        order = (RUNNING, FAILED, BEGUN, WAITING, SKIPPED)
        ahead = [job for job in store.jobs.values() if store.states[job.name] in order]
        ahead.sort(key=lambda job: order.index(store.states[job.name]))
        for job in ahead[:_ROWS]:
            state = store.states[job.name]
            far = ""
            if isinstance(job, Training) and state in (RUNNING, BEGUN):
                far = f"{job.done(store.folder)} of {job.iterations}"
            table.add_row(job.name, f"[{_STYLES.get(state, 'dim')}]{state}[/]", far)
        return Together(_counts(store), table)
