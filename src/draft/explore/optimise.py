"""Searching for the best designs with Optuna, generation by generation, by arrays.

A search works on a study in memory, where asking costs little, and shares finished trials with the
stored one: what others have added is read before each generation, its own are written after it.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from draft import metrics as m
from draft.design import Design
from draft.errors import DraftError, Problem
from draft.explore.goals import Constraint, Goal
from draft.explore.job import Job
from draft.explore.parquet_parts import check_same
from draft.explore.screen import Watch
from draft.explore.storage import open_storage
from draft.explore.sweep import Sweep
from draft.extras import need
from draft.values import Array, Value

POPULATION = 50
SCREENED = 20_000  # designs that the first generation is chosen from
_MOST = 10**6
VIOLATION = "violation"

Kind = Literal["nsga2", "tpe"]


@dataclass(frozen=True)
class Search:
    """What is searched for.

    Attributes:
        job: what is varied, and values that hold for all.
        goals: what to make small or large.
        constraints: what designs must meet.
        trials: designs that are looked at, in all.
        sampler: Optuna's.
    """

    job: Job
    goals: tuple[Goal, ...]
    constraints: tuple[Constraint, ...]
    trials: int
    sampler: Kind = "nsga2"

    @property
    def metrics(self) -> tuple[str, ...]:
        """Metrics that goals and constraints read."""
        read = [name for goal in self.goals for name in goal.value.metrics]
        read += [name for one in self.constraints for name in one.holds.metrics]
        return tuple(dict.fromkeys(read))

    def manifest(self) -> dict[str, Any]:
        """What a stored study is about; a longer search of the same goes on with it."""
        own = {k: v for k, v in self.job.manifest().items() if k not in ("n", "where", "chunk")}
        return own | {
            "goals": [[goal.text, "less" if goal.less else "more"] for goal in self.goals],
            "subject_to": [one.text for one in self.constraints],
            "search": self.sampler,
        }


def run_search(
    search: Search, out: Path, storage: str | None = None, watch: Watch = lambda done: None
) -> Any:
    """Search until the study has so many trials.

    Args:
        search: what for.
        out: folder of the results; also of the study, unless `storage` names another place.
        storage: URL of a database that several processes may share.
        watch: called with the number of trials so far.

    Returns:
        The trials, as Optuna's frozen trials.

    Raises:
        DraftError: no such storage, a study of another search, an extra that is not installed.
    """
    optuna = need("optuna")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    if not 1 <= search.trials <= _MOST:
        cause = f"--trials {search.trials} is not from 1 to {_MOST}"
        raise DraftError(Problem(cause, None, "such as 2000"))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Optuna calls what is used here experimental
        stored, seen = open_storage(search.manifest(), _directions(search), out, storage)
        return _Run(search, optuna, stored, seen).go(watch)


def _directions(search: Search) -> list[str]:
    return ["minimize" if goal.less else "maximize" for goal in search.goals]


class _Run:
    def __init__(self, search: Search, optuna: Any, stored: Any, manifest: Any) -> None:
        self.search, self.optuna, self.stored = search, optuna, stored
        check_same(manifest, search.manifest(), "the study")
        self.seen: set[int] = set()
        seed = int(
            np.random.SeedSequence([search.job.seed, len(stored.trials)]).generate_state(1)[0]
        )
        self.study = optuna.create_study(
            directions=_directions(search), sampler=_sampler(optuna, search.sampler, seed)
        )
        self.axes = {axis.name: _distribution(optuna, axis) for axis in search.job.axes}

    def go(self, watch: Watch) -> Any:
        """Generations until there are trials enough."""
        self.pull()
        watch(len(self.study.trials))
        if not self.study.trials:
            for values in start(self.search, min(POPULATION, self.search.trials)):
                self.study.enqueue_trial(values)
        while (left := self.search.trials - len(self.seen)) > 0:
            self.generation(min(POPULATION, left))
            self.pull()
            watch(len(self.seen))
        return self.stored.trials

    def known(self) -> list[Any]:
        """Trials of the stored study, to be read only."""
        return self.stored.get_trials(deepcopy=False)

    def pull(self) -> None:
        """Learn the trials of the stored study that this process has not seen."""
        new = [t for t in self.known() if t.number not in self.seen and t.state.is_finished()]
        self.study.add_trials(new)
        self.seen |= {trial.number for trial in new}

    def generation(self, count: int) -> None:
        """Ask for designs, resolve them together, tell what they are, store them."""
        asked = [self.study.ask(self.axes) for _ in range(count)]
        drawn = {name: np.array([t.params[name] for t in asked], float) for name in self.axes}
        values, violations = evaluate(self.search, drawn)
        for i, trial in enumerate(asked):
            trial.set_user_attr(VIOLATION, violations[i].tolist())
            if np.all(np.isfinite(values[i])):
                self.study.tell(trial, values[i].tolist())
            else:
                self.study.tell(trial, state=self.optuna.trial.TrialState.FAIL)
        numbers = {trial.number for trial in asked}
        finished = [t for t in self.study.get_trials(deepcopy=False) if t.number in numbers]
        first = len(self.known())
        self.stored.add_trials(finished)
        # Those are known here already, unless another process wrote in between.
        mine = {_key(trial) for trial in finished}
        self.seen |= {t.number for t in self.known()[first:] if _key(t) in mine}


def _key(trial: Any) -> tuple[Any, ...]:
    return tuple(sorted(trial.params.items()))


def evaluate(search: Search, drawn: Mapping[str, Array]) -> tuple[Array, Array]:
    """Goals, shape (N, goals), and violations of the constraints, shape (N, constraints)."""
    design = search.job.resolve(drawn)
    found = measure(search, design, drawn)
    n = design.count or 1
    values = [goal.of(design, found) for goal in search.goals]
    missed = [one.violation(design, found) for one in search.constraints]
    return np.stack(values, axis=1), np.stack(missed, axis=1) if missed else np.zeros((n, 0))


def measure(search: Search, design: Design, drawn: Mapping[str, Array]) -> dict[str, Value]:
    """Metrics of N designs; those that need a model are built where the filter accepts."""
    closed = [name for name in search.metrics if m.METRICS[name].needs == "design"]
    rest = [name for name in search.metrics if name not in closed]
    found: dict[str, Value] = dict(m.of_design(design, closed))
    if rest:
        built, _ = Sweep(search.job).build(design, drawn, np.arange(design.count or 1), rest)
        found.update(built)
    return found


def start(search: Search, count: int) -> list[dict[str, float]]:
    """Designs to begin with, from a screen: those that miss the constraints least.

    What only models know is left out of the screen.
    """
    job = search.job
    drawn = job.draw(0, SCREENED)
    design = job.resolve(drawn)
    closed = [c for c in search.constraints if not c.holds.needs_model]
    names = {name for one in closed for name in one.holds.metrics}
    found = m.of_design(design, names)
    missed = sum((one.violation(design, found) for one in closed), np.zeros(SCREENED))
    rows = np.argsort(missed, kind="stable")[:count]
    return [{name: float(values[row]) for name, values in drawn.items()} for row in rows]


def _distribution(optuna: Any, axis: Any) -> Any:
    if axis.values:
        return optuna.distributions.CategoricalDistribution(axis.values)
    return optuna.distributions.FloatDistribution(axis.low, axis.high, log=axis.log)


def _sampler(optuna: Any, kind: Kind, seed: int) -> Any:
    def violation(trial: Any) -> list[float]:
        return trial.user_attrs.get(VIOLATION, [])

    if kind == "nsga2":
        return optuna.samplers.NSGAIISampler(
            population_size=POPULATION, seed=seed, constraints_func=violation
        )
    return optuna.samplers.TPESampler(seed=seed, constraints_func=violation, constant_liar=True)
