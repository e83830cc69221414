"""Settings that all tests share: processes, what is slow, and one browser."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

# Before NumPy and PyTorch are imported, which read it once: tests run side by side, and their
# matrices are small.
for _name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
# Containers tend to forbid bytecode. Tests start dozens of processes, and each of them would
# compile PyTorch and mjlab again, which takes three times as long as to import them.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from draft.offscreen import prefer_offscreen  # noqa: E402

prefer_offscreen()  # before MuJoCo is imported

import pytest  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402

# No deadlines: a test must not fail because the machine is busy.
settings.register_profile(
    "draft",
    deadline=None,
    max_examples=30,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("draft")

HERE = Path(__file__).parent
# Learning, browsers and clusters; comparisons with real robots; files of which most tests start
# processes or read many files. Single tests elsewhere are marked with `pytest.mark.slow`.
SLOW = (
    "learn",
    "study",
    "twins",
    "deployment/test_controller.py",
    "deployment/test_deploy.py",
    "cli/test_evaluate.py",
    "cli/test_play.py",
    "cli/test_references.py",
    "cli/test_study.py",
    "cli/test_train.py",
    "cli/test_verdict_of_training.py",
    "explore/test_engines.py",
    "explore/test_learned_effects.py",
    "imports/test_bad_descriptions.py",
    "model/test_mujoco_log.py",
    "reporting/test_browser.py",
    "studio/browser",
    "test_ray.py",
)
# Files that take longest, which begin: a long one at the end would run alone, on one core.
LONGEST = (
    "test_site.py",
    "studio/browser/test_walking.py",
    "studio/browser/test_view.py",
    "explore/test_resumed_search.py",
    "learn/measuring/test_surface.py",
    "cli/test_train.py",
    "learn/engine/test_ranks.py",
    "learn/engine/test_family.py",
    "learn/training/test_training.py",
    "reporting/test_browser.py",
    "test_architecture.py",
)
# PyTorch, MuJoCo Warp and a browser take up to 3 GB in each process.
MOST_PROCESSES = 4


def _is_slow(path: Path) -> bool:
    return any(path.is_relative_to(HERE / name) for name in SLOW)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Do not even import the slow files where they are deselected: they import PyTorch."""
    return True if config.option.markexpr == "not slow" and _is_slow(collection_path) else None


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow, and begin with what takes longest."""
    for item in items:
        if _is_slow(item.path):
            item.add_marker(pytest.mark.slow)
    first = {HERE / name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (first.get(item.path, len(first)), not _is_slow(item.path)))


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Processes of `-n auto`: one per core for all tests, and none where files are named."""
    if config.args_source is not pytest.Config.ArgsSource.TESTPATHS:
        return 0
    return min(os.cpu_count() or 1, MOST_PROCESSES)


@pytest.fixture
def command() -> Any:
    """Runs commands in this process."""
    from tests.commands import Command

    return Command()


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """One real browser for all tests of a process; pages wait as long as the test may last."""
    pytest.importorskip("playwright", reason="needs Playwright")
    from benchmarks import browser as chromium

    if chromium.found() is None:
        pytest.skip("needs Chromium or Chrome")
    with chromium.browser() as opened:
        yield opened
