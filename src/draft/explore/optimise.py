"""Searches of one robot, with their front."""

from __future__ import annotations

from functools import partial

from draft.explore import front, goals
from draft.explore.front import Front
from draft.explore.job import Robot, checked_folder, make, opened
from draft.explore.search import SCREENED, Search, run_search
from draft.explore.settings import Sampled, SearchSettings
from draft.extras import check
from draft.plotting import save
from draft.settings import takes


@takes(SearchSettings)
def optimise(robot: Robot, settings: SearchSettings) -> Front:
    """Search for designs that no other beats in every goal, and save them as named designs.

    A call that was interrupted resumes when it is repeated, and ends with the trials of one that
    was not; more `trials` continue the study. With `storage` the order of trials is by chance.

        >>> front = draft.optimise(
        ...     "quadruped",
        ...     vary={"thigh_length": (0.15, 0.6), "actuators.leg.peak_torque": (40, 150)},
        ...     minimise=["mass"],
        ...     maximise=["jump_height"],
        ...     subject_to=["accepted"],
        ...     trials=20,
        ...     out="search",
        ... )
        >>> front.trials, sorted(front[0]["goals"])
        (20, ['jump_height', 'mass'])
        >>> draft.load("quadruped").resolve("search/designs/front_001.yaml").accepted
        True

    Args:
        robot: a spec or a design, or its reference, as `screen` takes it.
        settings: fields of `SearchSettings`, by keyword.

    Returns:
        The best designs; empty where no trial meets all conditions.

    Raises:
        DraftError: an argument is invalid, the study is of another search, a file cannot be
            written, or the extra `explore` (with `figure`, `figures`) is not installed.
    """
    out = checked_folder(settings.out)
    if settings.figure:
        check("matplotlib", "figures")
    sampled = Sampled(
        vary=settings.vary, values=settings.values, seed=settings.seed, n=SCREENED, metrics=()
    )
    job = make(robot, "optimise", sampled, SCREENED, settings)
    spec = opened(job)
    search = Search(
        job,
        goals.goals(spec, settings.minimise, settings.maximise),
        goals.constraints(spec, settings.subject_to),
        settings.trials,
        settings.sampler,
    )
    done = run_search(search, out, settings.storage, settings.watch(settings.trials))
    best = front.front(search, done)
    front.save(search, best, out)
    if settings.figure:
        from draft.explore import front_figure

        save(out, {"front": partial(front_figure.draw, search, done, best)})
    return Front(out, len(done), tuple(best), front.failed(search, done))
