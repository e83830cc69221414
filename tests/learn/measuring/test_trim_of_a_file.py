"""A file of one robot is measured with its trim, as the policy of all legs that it was made of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

for library in ("onnx", "torch", "mjlab", "mjbatch"):
    pytest.importorskip(library)
from benchmarks.roll_outs import Case, rolled_out  # noqa: E402
from draft.design.references import open_design  # noqa: E402
from draft.learn.bodies.legged import legged_robot  # noqa: E402
from draft.learn.measuring.policies import open_source  # noqa: E402
from draft.learn.policy.onnx_write import of_policy  # noqa: E402
from draft.learn.policy.reduced import any_legs  # noqa: E402


def test_a_file_moves_its_robot_as_the_policy_of_all_legs(tmp_path: Path) -> None:
    robot = legged_robot(open_design("hexapod"))
    file = tmp_path / "hexapod.onnx"
    file.write_bytes(of_policy(any_legs().of_robot(robot), robot, (1.0, 1.0, 1.0)))
    sources = open_source(robot=robot), open_source(file, blind=True)
    cases = [Case.ahead(0.25)]
    both = [rolled_out(one, [robot], cases, replicas=2, seconds=1.5) for one in sources]
    np.testing.assert_allclose(both[0].velocity, both[1].velocity, atol=1e-3)
