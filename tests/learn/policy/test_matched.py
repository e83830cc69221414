"""In mjlab, a policy drives a robot of other names, order and signs as it drives its own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

import draft  # noqa: E402
from draft.design.references import open_design  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.measuring import learned_metrics as learned  # noqa: E402
from draft.learn.measuring.evaluation_options import BodyRollOuts  # noqa: E402
from draft.learn.measuring.policies import open_source  # noqa: E402
from draft.metrics import of_policy  # noqa: E402
from tests.learn.policy.test_matching import GO2, LEGS, made, tree  # noqa: E402

pytestmark = [
    pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch"),
    pytest.mark.filterwarnings("ignore"),
]
SIGNS = {"FL": (-1, 1, -1), "FR": (1, -1, -1), "RL": (-1, -1, 1), "RR": (-1, -1, -1)}
NAMES = ("swing", "thigh", "calf")


def test_other_names_signs_and_order_walk_as_fast(tmp_path: Path) -> None:
    shipped = Path(draft.__file__).parent / "robots/quadruped"
    plain = open_design("quadruped")
    made(tmp_path / "other", shipped, tree(NAMES, SIGNS, LEGS[::-1]))
    other = open_design(tmp_path / "other")
    source = open_source()
    (one, _), (two, _) = (
        learned.of_designs(source, design, BodyRollOuts(replicas=4, seconds=4.0), device="cpu")
        for design in (plain, other)
    )
    assert one.inside.all()
    assert two.inside.all()
    # Their joints start with other random offsets.
    assert two.top_speed == pytest.approx(one.top_speed, rel=0.05)
    assert two.kick == pytest.approx(one.kick, rel=0.25)


def test_an_import_has_learned_metrics_that_say_that_it_is_outside(tmp_path: Path) -> None:
    draft.import_robot(GO2, out=tmp_path / "go2")
    design = open_design(tmp_path / "go2")
    found = of_policy(design, replicas=1, seconds=3.0, outside=True)
    assert found["learned.inside"] == 0
    assert float(found["learned.top_speed"]) > 1.5
    assert np.isnan(float(of_policy(design, replicas=1, seconds=1.0)["learned.top_speed"]))
