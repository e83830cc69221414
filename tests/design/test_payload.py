"""A payload is a block on the trunk of any robot, and every number knows it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.explore import job
from draft.explore.settings import Sampled
from draft.metrics import METRICS, of_design, payload_for
from draft.spec.payload import USUAL_DENSITY
from tests.helpers import parameter, robot

QUADRUPED = draft.load("quadruped")
KNOWS = ("mass", "torque_margin", "payload_rated", "jump_height", "top_speed", "cost_of_standing")


@given(st.floats(0.1, 60), st.floats(100, 5000))
def test_the_block_is_a_cube_on_the_highest_point_of_the_trunk(mass: float, density: float) -> None:
    design = QUADRUPED.resolve("bear", {"payload": mass, "payload_density": density})
    block = design.bodies[-1].end_geom
    assert block is not None
    side = (mass / density) ** (1 / 3)
    assert block.size == pytest.approx((side, side, side))
    top = float(design.trunk.loft.vertices[:, 2].max())
    assert block.center == pytest.approx((0.0, 0.0, top + side / 2), abs=1e-12)
    bare = QUADRUPED.resolve("bear")
    assert design.mass == pytest.approx(bare.mass + mass)
    assert design.payload_mass == mass
    assert bare.payload_mass == 0.0


FLOATING = [name for name in draft.shipped() if draft.load(name).resolve().floating]


@pytest.mark.parametrize("name", FLOATING)
def test_every_robot_with_a_payload_compiles_to_its_mass(name: str) -> None:
    design = draft.load(name).resolve({"payload": 3.0})
    model = design.build().mujoco
    assert model.body_subtreemass[1] == pytest.approx(design.mass, rel=1e-6)
    assert model.body("payload").mass[0] == pytest.approx(3.0)


def test_payload_rated_and_peak_fall_by_the_payload() -> None:
    bare = of_design(QUADRUPED.resolve("cheetah"))
    loaded = of_design(QUADRUPED.resolve("cheetah", {"payload": 10}))
    for name in ("payload_rated", "payload_hour", "payload_peak"):
        assert loaded[name] == pytest.approx(float(bare[name]) - 10)
    assert loaded["standing_torque_rated"] > bare["standing_torque_rated"]


def test_the_mass_is_said_to_include_the_payload(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "cheetah", "--payload", "10"]) == 0
    first = capsys.readouterr().out.splitlines()[0]
    assert first.endswith("accepted, robot on 4 legs, 43.6 kg with its payload of 10 kg, 12 joints")
    assert main(["show", "cheetah"]) == 0
    assert "33.6 kg, 12 joints" in capsys.readouterr().out.splitlines()[0]
    assert "payload included" in METRICS["mass"].doc


def test_the_payload_for_an_hour_that_show_prints_is_a_metric(
    capsys: pytest.CaptureFixture[str],
) -> None:
    design = QUADRUPED.resolve("cheetah")
    hour = of_design(design, ["payload_hour"])["payload_hour"]
    assert hour == payload_for(design, 3600).mass
    assert main(["show", "cheetah"]) == 0
    (line,) = (x for x in capsys.readouterr().out.splitlines() if "payload for an hour" in x)
    assert line.split()[-1] == "payload_hour"
    assert f" {float(hour):.3g} " in line


def test_jump_and_top_speed_know_the_load() -> None:
    loads = np.array([0.0, 10.0, 60.0, 120.0])
    found = of_design(QUADRUPED.resolve("cheetah", {"payload": loads}))
    jumps, speeds = np.asarray(found["jump_height"]), np.asarray(found["top_speed"])
    assert np.all(np.diff(jumps) < 0)
    assert np.all(np.diff(speeds) <= 0)
    assert speeds[-1] < speeds[0]
    assert speeds[0] == of_design(QUADRUPED.resolve("cheetah"))["top_speed"]


def test_the_command_metrics_knows_the_load(capsys: pytest.CaptureFixture[str]) -> None:
    def told(*words: str) -> dict[str, float]:
        assert main(["metrics", "cheetah", "--json", *words]) == 0
        return json.loads(capsys.readouterr().out)["metrics"]

    bare, loaded = told(), told("--payload", "95")
    expected = of_design(QUADRUPED.resolve("cheetah", {"payload": 95.0}))
    for name in ("jump_height", "top_speed", "payload_rated", "mass"):
        assert loaded[name] == pytest.approx(expected[name])
    assert 0 < loaded["jump_height"] < bare["jump_height"]
    # Half of the legs carry it at a time, and a joint has no torque left to move.
    assert loaded["top_speed"] < bare["top_speed"]


def test_no_payload_leaves_every_metric_as_it_was() -> None:
    bare = of_design(QUADRUPED.resolve("cheetah"))
    empty = of_design(QUADRUPED.resolve("cheetah", {"payload": 0}))
    for name, value in bare.items():
        assert empty[name] == pytest.approx(value, rel=1e-12), name


def test_what_robots_of_its_size_weigh_is_compared_without_the_payload() -> None:
    heavy = QUADRUPED.resolve("cheetah", {"payload": 60})
    assert {f.id for f in heavy.findings} & {"total_mass", "actuator_share"} == set()


def test_a_parameter_of_ones_own_keeps_its_name() -> None:
    spec = robot(parameters={"payload": parameter(0.5)})
    design = spec.resolve({"payload": 0.7})
    assert design.spec is spec
    assert design.parameters["payload"] == 0.7


def test_build_writes_the_load_and_its_design_file_has_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "loaded"
    assert main(["build", "cheetah", "--payload", "10", "--out", str(out)]) == 0
    capsys.readouterr()
    record = json.loads((out / "report.json").read_text(encoding="utf-8"))
    assert record["carried_mass_kg"] == pytest.approx(10)
    assert record["parameters"]["payload_density"]["value"] == USUAL_DENSITY
    again = QUADRUPED.resolve(out / "design.yaml")
    assert again.mass == pytest.approx(record["mass_kg"], rel=1e-9)
    assert main(["metrics", str(out), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["metrics"]
    assert main(["metrics", "cheetah", "--payload", "10", "--json"]) == 0
    assert found["payload_rated"] == pytest.approx(
        json.loads(capsys.readouterr().out)["metrics"]["payload_rated"]
    )


def test_a_screen_draws_robots_with_their_load() -> None:
    pytest.importorskip("scipy")
    bare = Sampled(vary={"thigh_length": (0.2, 0.3)}, n=8)
    where = "payload_rated > 10 and payload == 10"
    loaded = bare.model_copy(update={"values": {"payload": 10.0}, "where": where})
    made = job.make(QUADRUPED, "screen", loaded, 8)
    design = made.resolve(made.draw(0, 8))
    expected = np.asarray(QUADRUPED.resolve(made.draw(0, 8)).mass) + 10
    assert np.asarray(design.mass) == pytest.approx(expected)
    condition = made.condition()
    assert condition is not None
    assert condition.holds(design, of_design(design, condition.metrics)).all()


def test_a_payload_can_be_varied() -> None:
    pytest.importorskip("scipy")
    made = job.make(QUADRUPED, "screen", Sampled(vary=["payload=0:20"], n=4), 4)
    drawn = made.draw(0, 4)
    assert np.asarray(made.resolve(drawn).payload_mass) == pytest.approx(drawn["payload"])
