"""Ray: one cluster for all that works on one."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import draft

ray = pytest.importorskip("ray")
pytest.importorskip("pyarrow")
pytest.importorskip("scipy")

from ray.cluster_utils import Cluster  # noqa: E402

from draft.explore.engines import RayEngine  # noqa: E402
from draft.explore.sweep import run_sweep  # noqa: E402
from draft.study.requests import ReportRequest  # noqa: E402
from draft.study.workers import RayWorker  # noqa: E402
from tests.explore.small import HERE, job, rows  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A cluster of one node with one processor, which is nobody else's."""
    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    yield made
    made.shutdown()


def test_a_cluster_that_loses_a_node_gives_the_rows_of_this_machine(
    cluster: Any, tmp_path: Path
) -> None:
    node = cluster.add_node(num_cpus=1)
    one = job(draft.load("quadruped"), 600, "sweep", chunk=20, metrics=None)
    killed: list[int] = []

    def watch(done: int) -> None:
        if done >= one.n / 2 and not killed:
            killed.append(done)
            cluster.remove_node(node, allow_graceful=False)

    summary = run_sweep(one, tmp_path / "ray", RayEngine(cluster.address), watch)
    assert killed
    assert summary["designs"] == 600
    run_sweep(one, tmp_path / "here", HERE)
    # As text: NaN is not NaN.
    assert str(rows(tmp_path / "ray")) == str(rows(tmp_path / "here"))


def test_a_cluster_does_jobs_of_studies(cluster: Any, tmp_path: Path) -> None:
    ray.init(address=cluster.address, log_to_driver=False, logging_level="ERROR")
    try:
        worker = RayWorker(ray, gpus=0)
        worker.start(ReportRequest(study="nowhere"), tmp_path / "a.log")
        while (code := worker.poll()) is None:
            time.sleep(0.02)
        assert code == 2
        worker.stop()
        assert worker.poll() == -1
    finally:
        ray.shutdown()
    assert "error: " in (tmp_path / "a.log").read_text()
