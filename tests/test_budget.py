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
    ".": 2_580,  # Reading of STL and OBJ, from `imports`.
    "assistant": 620,
    "browser": 1_300,  # Parts that are no text in the messages of a page, its modules and limits.
    "cli": 6_030,  # `--live` and `--python` of pages, and `deploy`.
    "deployment": 1_006,  # A trim in both languages.
    "description": 2_330,
    "design": 6_741,  # Knees without a middle of their range bend by their toes.
    "drawing": 70,
    "explore": 4_740,
    "fitting": 3_890,
    "imports": 6_450,
    "laws": 2_090,  # The nearest module of the catalogue.
    "learn": 20_915,  # A trim of what the policy of all legs observes.
    "metrics": 3_200,
    "model": 5_655,  # USD; configurations for mjlab and Isaac Lab; parts in every format.
    "reporting": 1_610,  # Tables of parts and of masses by origin.
    "serving": 706,  # Files and messages for a page on this machine.
    "spec": 5_945,  # Parts of STL, OBJ and STEP: fields, reading, checks, inertia.
    "studio": 3_160,
    "study": 6_505,  # Stages that start from policies that ship.
    "twins": 1_600,
    "validation": 990,
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
