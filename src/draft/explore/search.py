"""Search for the best designs with Optuna, one generation of N designs at a time.

A search uses a study in memory, where sampling is fast, and exchanges finished trials with the
stored study: it reads those of other processes before each generation and writes its own after it.

Every generation has a random generator of its own, seeded by the search and the trials before it,
and its parents follow from these trials alone. A search that is resumed or extended therefore
repeats the trials of one that was never interrupted. A database that several processes share has no
such order: there a resumed search differs.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from draft import metrics as m
from draft.design import Design
from draft.explore.goals import Constraint, Goal
from draft.explore.job import Job
from draft.explore.parquet_parts import check_same
from draft.explore.rows import Watch
from draft.explore.settings import OptunaSampler
from draft.explore.storage import open_storage, stored
from draft.explore.sweep import build
from draft.extras import need
from draft.files import held
from draft.values import Array, Value
from draft.variation.axes import Axis

if TYPE_CHECKING:
    from optuna import Study
    from optuna.distributions import BaseDistribution
    from optuna.samplers import BaseSampler, NSGAIISampler
    from optuna.trial import FrozenTrial

POPULATION = 50
SCREENED = 20_000  # designs from which the first generation is selected
VIOLATION = "violation"


@dataclass(frozen=True)
class Search:
    """Definition of a search.

    Attributes:
        job: the numbers that are varied, and values that hold for all designs.
        goals: numbers to minimise or maximise.
        constraints: conditions that designs must meet.
        trials: designs to try in all.
        sampler: sampler of Optuna.
    """

    job: Job
    goals: tuple[Goal, ...]
    constraints: tuple[Constraint, ...]
    trials: int
    sampler: OptunaSampler = "nsga2"

    @property
    def metrics(self) -> tuple[str, ...]:
        """Names of the metrics in the goals and constraints."""
        read = [name for goal in self.goals for name in goal.value.metrics]
        read += [name for one in self.constraints for name in one.holds.metrics]
        return tuple(dict.fromkeys(read))

    def manifest(self) -> dict[str, Any]:
        """Identity of the stored study; a search with more trials continues it."""
        own = {
            k: v
            for k, v in self.job.manifest(self.metrics).items()
            if k not in ("n", "where", "chunk")
        }
        return own | {
            "goals": [[goal.text, "less" if goal.less else "more"] for goal in self.goals],
            "subject_to": [one.text for one in self.constraints],
            "search": self.sampler,
        }


def run_search(
    search: Search, out: Path, storage: str | None = None, watch: Watch = lambda done: None
) -> list[FrozenTrial]:
    """Search until the study has the requested number of trials.

    Without `storage`, the trials are those of an uninterrupted search, wherever it was interrupted.

    Args:
        search: the search.
        out: folder of the study, unless `storage` is given.
        storage: URL of a database that several processes may share; None for a file in `out`.
        watch: called with the number of trials so far.

    Returns:
        All trials of the study.

    Raises:
        DraftError: the storage is not available or full, the study is of another search, another
            process searches in the folder, or the extra `explore` is not installed.
    """
    optuna = need("optuna")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Optuna marks some of these features as experimental
        with held(out, "search"):
            study, seen = open_storage(search.manifest(), _directions(search), out, storage)
            run = _Run(search, optuna, study, seen, shared=storage is not None)
            with stored(out, storage, lambda: len(run.seen)):
                return run.run(watch)


def _directions(search: Search) -> list[str]:
    return ["minimize" if goal.less else "maximize" for goal in search.goals]


class _Run:
    """A search in progress.

    Attributes:
        stored: the stored study.
        shared: whether other processes may write to it.
        study: the study in memory.
        seen: numbers of the stored trials that `study` has.
    """

    def __init__(
        self,
        search: Search,
        optuna: ModuleType,
        stored: Study,
        manifest: Mapping[str, Any],
        shared: bool,
    ) -> None:
        self.search, self.optuna, self.stored, self.shared = search, optuna, stored, shared
        check_same(manifest, search.manifest(), "the study")
        self.seen: set[int] = set()
        self.study = optuna.create_study(directions=_directions(search))
        self.axes = {axis.name: _distribution(optuna, axis) for axis in search.job.axes}

    def run(self, watch: Watch) -> list[FrozenTrial]:
        """Run generations until there are enough trials."""
        there = len(self.stored_trials())
        if self.shared:
            self.pull()
        elif there < self.search.trials:
            # Of a generation that is not complete, the trials are sampled again, and are the same.
            self.pull(there - there % POPULATION)
        watch(there)
        if there >= self.search.trials:
            return self.stored.trials
        if self.search.sampler == "nsga2":
            self.select_parents()
        if not self.study.trials:
            for values in first_designs(self.search, POPULATION):
                self.study.enqueue_trial(values)
        while (left := self.search.trials - len(self.seen)) > 0:
            self.generation(left)
            self.pull()
            watch(len(self.seen))
        return self.stored.trials

    def stored_trials(self) -> list[FrozenTrial]:
        """Trials of the stored study, read only."""
        return self.stored.get_trials(deepcopy=False)

    def pull(self, most: int | None = None) -> None:
        """Add finished trials, by default all, that are stored to the study in memory."""
        new = [
            t
            for t in self.stored_trials()[:most]
            if t.number not in self.seen and t.state.is_finished()
        ]
        self.study.add_trials(new)
        self.seen |= {trial.number for trial in new}

    def select_parents(self) -> None:
        """Select the parents of every generation that was pulled, from the first to the last.

        Optuna would go back from the last to the first instead, one call inside the other.
        """
        sampler = _nsga2(self.optuna, seed=0)
        generation = 1
        while sampler.get_population(self.study, generation):
            sampler.get_parent_population(self.study, generation)
            generation += 1

    def generation(self, left: int) -> None:
        """Sample designs, evaluate them together, and store their trials.

        Of the last generation, all designs are evaluated and only some are stored: what a policy
        reaches depends on the designs that are rolled out with it.

        Args:
            left: most trials to store.
        """
        count = min(POPULATION, left) if self.shared else POPULATION
        # Processes that share a study must not all sample the same designs.
        words = [self.search.job.seed, len(self.seen), *([os.getpid()] if self.shared else [])]
        seed = int(np.random.SeedSequence(words).generate_state(1)[0])
        self.study.sampler = _sampler(self.optuna, self.search.sampler, seed)
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
        stored = len(self.stored_trials())
        # Those of this generation that were stored before the search was interrupted.
        again = 0 if self.shared else stored - len(self.seen)
        self.stored.add_trials(finished[again:left])
        first = stored - again
        # This study has those already, unless another process wrote trials in between.
        mine = {_key(trial) for trial in finished}
        self.seen |= {t.number for t in self.stored_trials()[first:] if _key(t) in mine}


def _key(trial: FrozenTrial) -> tuple[tuple[str, Any], ...]:
    return tuple(sorted(trial.params.items()))


def evaluate(search: Search, drawn: Mapping[str, Array]) -> tuple[Array, Array]:
    """Values of the goals, shape (N, goals), and violations, shape (N, constraints)."""
    design = search.job.resolve(drawn)
    found = measure(search, design, drawn)
    n = design.count or 1
    values = [goal.of(design, found) for goal in search.goals]
    violations = [one.violation(design, found) for one in search.constraints]
    stacked = np.stack(violations, axis=1) if violations else np.zeros((n, 0))
    return np.stack(values, axis=1), stacked


def measure(search: Search, design: Design, drawn: Mapping[str, Array]) -> dict[str, Value]:
    """Metrics of N designs; models are built for accepted designs only."""
    closed = [name for name in search.metrics if m.find(name).needs == "design"]
    rest = [name for name in search.metrics if name not in closed]
    found: dict[str, Value] = dict(m.of_design(design, closed))
    if rest:
        built, _ = build(search.job, design, drawn, np.arange(design.count or 1), rest)
        found.update(built)
    return found


def first_designs(search: Search, count: int) -> list[dict[str, float]]:
    """Values of the first designs: those of a screen with the least violation.

    Constraints that need a model, or many poses of each design, are not part of the screen.
    """
    job = search.job
    drawn = job.draw(0, SCREENED)
    design = job.resolve(drawn)
    closed = [
        c
        for c in search.constraints
        if not c.holds.needs_model and not any(m.find(name).sampled for name in c.holds.metrics)
    ]
    names = {name for one in closed for name in one.holds.metrics}
    found = m.of_design(design, names)
    violation = sum((one.violation(design, found) for one in closed), np.zeros(SCREENED))
    rows = np.argsort(violation, kind="stable")[:count]
    return [{name: float(values[row]) for name, values in drawn.items()} for row in rows]


def _distribution(optuna: ModuleType, axis: Axis) -> BaseDistribution:
    if axis.values:
        return optuna.distributions.CategoricalDistribution(axis.values)
    return optuna.distributions.FloatDistribution(axis.low, axis.high, log=axis.log)


def _sampler(optuna: ModuleType, kind: OptunaSampler, seed: int) -> BaseSampler:
    if kind == "nsga2":
        return _nsga2(optuna, seed)
    return optuna.samplers.TPESampler(seed=seed, constraints_func=_violation, constant_liar=True)


def _nsga2(optuna: ModuleType, seed: int) -> NSGAIISampler:
    """Sampler whose choices follow from the trials and the seed alone.

    Optuna lists the parents of a generation in the order of their selection for the first trial
    that asks, and by number for all others. Which trial a random number stands for, and which of
    two equals is selected, depends on that order, and a search that resumes asks anew.
    """
    sampler = optuna.samplers.NSGAIISampler(
        population_size=POPULATION, seed=seed, constraints_func=_violation
    )
    select = sampler.select_parent

    def by_number(study: Study, generation: int) -> list[FrozenTrial]:
        return sorted(select(study, generation), key=lambda trial: trial.number)

    sampler.select_parent = by_number
    return sampler


def _violation(trial: FrozenTrial) -> list[float]:
    return trial.user_attrs.get(VIOLATION, [])
