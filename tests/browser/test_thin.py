"""Python in a page's worker, with its thin `mujoco`, gives the robots that Python here gives."""

from __future__ import annotations

import io
import json
import subprocess
import sys
import zipfile
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import browser as chromium
from draft.browser.designer import source
from draft.browser.engine import engine
from draft.browser.pyodide import archive
from draft.design.references import open_design, shipped_designs
from tests.browser import thin_robots

pytestmark = pytest.mark.slow
pytest.importorskip("mjswan", reason="needs the extra page")
pytest.importorskip("playwright", reason="needs Playwright")

RANDOM = 300
WRONG = ["<mujoco><bad/></mujoco>", "<mujoco", "<mujoco><worldbody><geom/></worldbody></mujoco>"]
# Robots whose whole answers are compared: driven by their own policy, by that of a family, by that
# of all legs, and by none; the last one is refused by the filter.
WHOLE = [
    ("cheetah", {}),
    ("quadruped", {"thigh_length": 0.31, "shank_length": 0.3}),
    *((name, {}) for name in ("hexapod", "humanoid", "arm", "hand")),
    ("quadruped", {"actuators.leg.peak_torque": 1.0}),
]


def designs() -> list[tuple[str, dict[str, Any]]]:
    """All shipped designs, and random ones around their numbers; some of these are impossible."""
    shipped = [
        open_design(f"{robot}:{name}" if name else robot)
        for robot, named in shipped_designs().items()
        for name in ("", *named)
    ]
    rng = np.random.default_rng(7)
    found = [(one.spec.name, dict(one.values)) for one in shipped]
    for i in range(RANDOM):
        own = shipped[i % len(shipped)]
        values = {
            name: float(own.parameters[name] * rng.uniform(0.7, 1.4))
            for name, parameter in own.spec.parameters.items()
            if parameter.value.constant is not None and rng.random() < 0.7
        }
        found.append((own.spec.name, {**own.values, **values}))
    return found


@pytest.fixture(scope="module")
def answered(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What was asked, the answers with the thin module, and those with the real MuJoCo."""
    if chromium.found() is None:
        pytest.skip("needs Chromium or Chrome")
    folder = tmp_path_factory.mktemp("thin")
    (folder / "mujoco.js").write_text(engine().script, "utf-8")
    (folder / "mujoco.wasm").write_bytes(engine().wasm)
    (folder / "bridge.js").write_text((files("draft.browser") / "bridge.js").read_text(), "utf-8")
    messages = []
    for i, (reference, values) in enumerate(WHOLE):
        own = source(open_design(reference))
        message = {"id": i, "files": own["files"], "values": {**own["values"], **values}}
        messages.append(json.dumps({**message, "title": reference, "color": "#123456"}))
    # Hips apart from the trunk get brackets, by distances that MuJoCo measures.
    apart = json.loads(messages[1]) | {"values": {}}
    parameters = apart["files"]["parameters.yaml"].replace(
        "{value: 0.16, unit", "{value: 0.6, unit"
    )
    parameters = parameters.replace("hip_spacing + 2 * (leg", "0 * hip_spacing + 2 * (leg")
    apart["files"]["parameters.yaml"] = parameters
    messages.append(json.dumps(apart))
    bad = json.loads(messages[0])
    bad["files"]["root.yaml"] = bad["files"]["root.yaml"].replace("axis", "axes")
    zipfile.ZipFile(io.BytesIO(archive())).extractall(folder / "python")
    robots = {robot: source(open_design(robot))["files"] for robot in shipped_designs()}
    asked = {
        "robots": robots,
        "designs": designs(),
        "wrong": WRONG,
        "messages": [*messages, json.dumps(bad), "{}"],
    }
    (folder / "asked.json").write_text(json.dumps(asked), "utf-8")
    script = [sys.executable, "-m", "tests.browser.thin_robots", str(folder)]
    subprocess.run(script, check=True)
    thin = json.loads((folder / "answers.json").read_text("utf-8"))
    return {"asked": asked, "thin": thin, "own": thin_robots.answer(asked)}


def test_the_other_process_has_the_python_of_the_worker_alone(answered: dict[str, Any]) -> None:
    draft, mujoco = map(Path, answered["thin"]["modules"])
    assert draft.parents[1].name == "python"
    assert mujoco.parent == draft.parents[1] / thin_robots.THIN
    assert "thin" not in answered["own"]["modules"][1]


def test_mujoco_refuses_a_text_in_the_same_words(answered: dict[str, Any]) -> None:
    assert all(answered["own"]["refusals"])
    assert answered["thin"]["refusals"] == answered["own"]["refusals"]


def test_texts_of_models_are_equal_to_the_last_byte(answered: dict[str, Any]) -> None:
    models = 0
    own = answered["own"]["texts"]
    for asked, thin, real in zip(
        answered["asked"]["designs"], answered["thin"]["texts"], own, strict=True
    ):
        assert thin == real, asked
        models += thin.startswith("<mujoco ")
    assert models >= 0.7 * len(own)


def test_whole_answers_are_equal_to_the_rounding_of_another_compiler(
    answered: dict[str, Any],
) -> None:
    for thin, real in zip(answered["thin"]["answers"], answered["own"]["answers"], strict=True):
        assert_close(json.loads(thin), json.loads(real))
    assert answered["own"]["answers"][len(WHOLE)].count('_bracket\\"') == 4


def assert_close(thin: Any, real: Any) -> None:
    """Check that two answers are equal, numbers to within rounding, networks by their sizes."""
    assert type(thin) is type(real)
    if isinstance(real, dict):
        assert thin.keys() == real.keys()
        for key, value in real.items():
            if key == "network":  # Names and numbers of networks that know the body's numbers.
                assert len(thin[key]) == len(value)
            else:
                assert_close(thin[key], value)
    elif isinstance(real, list):
        assert len(thin) == len(real)
        for a, b in zip(thin, real, strict=True):
            assert_close(a, b)
    elif isinstance(real, float):
        assert thin == pytest.approx(real, rel=1e-9, abs=1e-12)
    else:
        assert thin == real
