"""The budget of lines per package: raise it only in a commit that says why.

Lines are a cost to all who read and change the code. Blank lines and docstrings count too, so that
nothing is gained by denser code.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import draft

SOURCE = Path(draft.__file__).parent
# Lines of Python; "." for the files beside the packages.
BUDGET = {
    ".": 2_620,  # Outputs are checked before the work, so that no file of others is replaced.
    "assistant": 620,
    "browser": 1_304,  # A policy that drives no robot of a page is refused.
    "cli": 6_050,  # Tuples of numbers with messages of their own; doubts of rows that are fitted.
    "deployment": 1_006,  # A trim in both languages.
    "description": 2_330,
    "design": 6_741,  # Knees without a middle of their range bend by their toes.
    "drawing": 70,
    "explore": 4_756,  # Numbers alone are no conditions; limits of zero have a direction.
    "fitting": 3_890,
    "imports": 6_462,  # Folders and missing files for descriptions.
    "laws": 2_090,  # The nearest module of the catalogue.
    "learn": 21_139,  # Gains by weight, in every file; cells of bodies of any legs.
    "metrics": 3_200,
    "model": 5_655,  # USD; configurations for mjlab and Isaac Lab; parts in every format.
    "reporting": 1_614,  # A policy that drives no robot of a report is refused.
    "serving": 706,  # Files and messages for a page on this machine.
    "spec": 5_958,  # Remedies of units and of a single = in expressions.
    "studio": 3_160,
    "study": 6_506,  # Stages keep the gains of the policy that they start from.
    "twins": 1_600,
    "validation": 992,
    "variation": 350,
}


@pytest.mark.parametrize("package", BUDGET)
def test_a_package_keeps_within_its_lines(package: str) -> None:
    files = (SOURCE / package).glob("*.py" if package == "." else "**/*.py")
    lines = sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files)
    assert lines <= BUDGET[package]


def test_every_package_has_a_budget() -> None:
    packages = {path.parent.name for path in SOURCE.glob("*/__init__.py")}
    assert packages == {*BUDGET} - {"."}
