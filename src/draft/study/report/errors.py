"""Source of the inertia errors of the perturbed arm, and evaluations with another one."""

from __future__ import annotations

from collections import Counter

from draft.learn.bodies.inertia import SOURCES
from draft.learn.measuring.summary import Summary
from draft.study.report.records import Evaluation, Study

WORDS = {
    "twins": "errors of the twins of Go2 and B2",
    "survey": "errors of all surveyed quadrupeds",
    "paper": "published errors",
}


def sources(study: Study) -> list[str]:
    """Return the sources of inertia errors in a study, the most frequent first."""
    found = Counter(one.summary.errors for one in study.evaluations)
    return sorted((s for s in SOURCES if found[s]), key=lambda s: -found[s])


def arm(summary: Summary) -> str:
    """Return the arm of an evaluation with the source of its inertia errors."""
    return f"{summary.arm} ({summary.errors})" if summary.errors else summary.arm


def flags(study: Study, one: Evaluation) -> list[str]:
    """Return flags of an evaluation whose source of errors differs from most others'."""
    known, own = sources(study), one.summary.errors
    if own is None or own == known[0]:
        return []
    return [f"{WORDS[own]}, where others have {WORDS[known[0]]}: not to be compared"]
