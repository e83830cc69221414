"""Capabilities over a plane: the grid, refusals, the region of validity, and the files."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from draft.cli import main  # noqa: E402
from draft.design import Design  # noqa: E402
from draft.design.references import open_design  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.designs import open_bodies  # noqa: E402
from draft.learn.bodies.features import family_features, features  # noqa: E402
from draft.learn.bodies.legged import legged_robot  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.measuring import learned_metrics as learned  # noqa: E402
from draft.learn.measuring.drives import ByStructure  # noqa: E402
from draft.learn.measuring.evaluation_options import BodyRollOuts  # noqa: E402
from draft.learn.measuring.policies import _of_file, of_run, open_source  # noqa: E402
from draft.learn.measuring.rollout.evaluate import evaluate  # noqa: E402
from draft.learn.measuring.rollout.trial import Trial  # noqa: E402
from draft.learn.measuring.surface import Surface, surface  # noqa: E402
from draft.learn.measuring.surface_page import page  # noqa: E402
from draft.learn.measuring.utilisation import Histograms  # noqa: E402
from draft.learn.policy.policy import ANY, FAMILY, open_policy, policy  # noqa: E402
from draft.learn.policy.validity import ANY_NAME, FAMILY_NAME  # noqa: E402
from draft.learn.task.recipes import LAPTOP, RECIPES  # noqa: E402
from draft.learn.training.run import Plan, Run  # noqa: E402
from draft.model.model import preview  # noqa: E402
from tests.learn.measuring.columns import worlds  # noqa: E402
from tests.learn.runs import begin, exported, trained  # noqa: E402
from tests.learn.small import member, plan  # noqa: E402

pytestmark = pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch")
TRAINED = ("thigh_length=0.22:0.28", "actuators.leg.peak_torque=50:90")
# The thigh of 0.85 m is far outside what was trained, and a motor of 400 N m is refused.
ROOT = Path(__file__).parents[3]
PLANE = ("thigh_length=0.25,0.85", "actuators.leg.peak_torque=72,85,400")


def family(see_design: bool) -> Plan:
    """A plan for six bodies on a plane."""
    members = open_bodies(["cheetah"], TRAINED, 6).members
    flat = plan(ground="flat", see_ground=False)
    return replace(flat, members=members, see_design=see_design)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return trained(tmp_path_factory.mktemp("family") / "run", family(see_design=True))


@pytest.fixture(scope="module")
def found(run: Run) -> Surface:
    return surface(open_design("cheetah"), PLANE, of_run(run), replicas=2, seconds=1.0)


def test_every_design_of_the_grid_is_measured_or_refused_with_a_reason(found: Surface) -> None:
    assert found.axes == ("thigh_length", "actuators.leg.peak_torque")
    assert len(found.refusal) == 6
    spec = open_design("cheetah").spec
    for i, (thigh, torque) in enumerate((a, b) for a in (0.25, 0.85) for b in (72, 85, 400)):
        values = {found.axes[0]: thigh, found.axes[1]: torque}
        alone = spec.resolve("cheetah", values)
        assert bool(found.refusal[i]) == (not alone.accepted)
        assert found.mass[i] == pytest.approx(alone.mass)
        if not alone.accepted:
            assert np.isnan(found.learned.top_speed[i])
            assert np.isnan(found.learned.cost_of_transport[i])
    assert [bool(reason) for reason in found.refusal] == [False, False, True] * 2


def test_the_region_of_validity_is_that_of_the_features(run: Run) -> None:
    drive = of_run(run).drive
    assert isinstance(drive, ByStructure)
    region = drive.region
    assert region.holds(family_features(run.plan.members)).all()
    (far,) = open_bodies(["cheetah"], values={"thigh_length": 0.5}).members
    assert not region.holds(features(far)).all()


def test_the_page_names_the_command_that_lets_each_design_walk(found: Surface) -> None:
    text = page(found, "draft surface", "draft studio cheetah --walk --policy my.onnx --set")
    chosen = "thigh_length=0.25 actuators.leg.peak_torque=72"
    assert f"draft studio cheetah --walk --policy my.onnx --set {chosen}" in text


def test_a_surface_repeats_and_its_values_are_in_their_order_however_they_are_given(
    run: Run, found: Surface
) -> None:
    turned = ("thigh_length=0.85,0.25", "actuators.leg.peak_torque=400,72,85")
    again = surface(open_design("cheetah"), turned, of_run(run), replicas=2, seconds=1.0)
    assert again.refusal == found.refusal
    np.testing.assert_array_equal(again.mass, found.mass)
    for one, other in zip(again.values, found.values, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("values", ["0.3", "0.2,0.2,0.3"])
def test_an_axis_needs_different_values(run: Run, values: str) -> None:
    plane = (f"thigh_length={values}", PLANE[1])
    with pytest.raises(DraftError, match="needs different values, at least two"):
        surface(open_design("cheetah"), plane, of_run(run))


def test_the_top_speed_is_that_after_the_run_up() -> None:
    # Roll-outs of 18 s are measured from 12 s on, three times as long as this body speeds up.
    source, design = open_source(None), open_design("cheetah")
    (short, _), (long, _) = (
        learned.of_designs(source, design, rollouts, device="cpu")
        for rollouts in (BodyRollOuts(replicas=2), BodyRollOuts(replicas=2, seconds=18.0))
    )
    assert short.top_speed == pytest.approx(long.top_speed, rel=0.03)
    assert short.cost_of_transport == pytest.approx(long.cost_of_transport, rel=0.1)
    assert short.inside.all()
    assert short.kick > 1.0


@pytest.fixture
def two() -> Design:
    """A cheetah, and a slow one."""
    varied = {"thigh_length": [0.25, 0.4], "actuators.leg.peak_torque": [72.0, 40.0]}
    arrays = {name: np.array(values) for name, values in varied.items()}
    return open_design("cheetah").spec.resolve("cheetah", arrays)


def test_only_slow_bodies_are_asked_for_the_lower_speeds(
    two: Design, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[int, float, float]] = []

    def recorded(trial: Trial, *args: object, **options: object) -> object:
        speeds = trial.tests[0].levels
        asked.append((len(trial.task.members), speeds[0], speeds[-1]))
        return evaluate(trial, *args, **options)  # pyright: ignore[reportArgumentType]

    monkeypatch.setattr("draft.learn.measuring.rollout.evaluate.evaluate", recorded)
    # Speeds are asked for and compared; robots that are kicked are worlds of their own.
    monkeypatch.setattr(learned, "KICKS", learned.KICKS[:1])
    source = open_source(None)
    found, _ = learned.of_designs(source, two, BodyRollOuts(replicas=1), device="cpu")
    levels = learned.speeds(source)
    assert asked == [(2, levels[3], levels[-1]), (1, levels[0], levels[2])]
    monkeypatch.setattr(learned, "LEAD", np.inf)  # All are asked for all.
    every, _ = learned.of_designs(source, two, BodyRollOuts(replicas=1), device="cpu")
    np.testing.assert_allclose(found.top_speed, every.top_speed, rtol=0.05)


def test_progress_has_a_total_from_the_start_and_rises_to_it(two: Design) -> None:
    told: list[tuple[int, int]] = []
    few = BodyRollOuts(replicas=1, seconds=1.0)
    source = open_source(None)
    learned.of_designs(source, two, few, device="cpu", report=lambda *at: told.append(at))
    assert told[0] == (0, 2)
    assert told[-1] == (2, 2)
    assert told == sorted(told)
    assert len(told) > 20  # It tells of every step, not of every block of bodies.


def test_the_plane_of_the_pages_is_accepted_and_within_the_policys_region() -> None:
    ranges = ("thigh_length=0.2:0.36", "actuators.leg.peak_torque=40:95")
    for file in ("docs/learning.md", "docs/howto/train.md"):
        text = (ROOT / file).read_text(encoding="utf-8")
        assert f"draft surface quadruped --vary {' '.join(ranges)}\n" in text
    members = open_bodies(["quadruped"], ranges, 200).members  # Without draws that are refused.
    thigh, torque = (np.linspace(low, high, 20) for low, high in ((0.2, 0.36), (40.0, 95.0)))
    grid = np.meshgrid(thigh, torque, indexing="ij")
    numbers = [axis.ravel() for axis in grid]
    varied = {"thigh_length": numbers[0], "actuators.leg.peak_torque": numbers[1]}
    assert np.all(open_design("quadruped").spec.resolve(None, varied).accepted)
    drive = open_source(None).drive
    assert isinstance(drive, ByStructure)
    assert drive.region.holds(family_features(members)).all()


def test_the_error_of_a_mean_is_that_of_students_t() -> None:
    # t(0.95, 2) = 2.920; s = 0.1.
    assert learned._error(np.array([1.0, 1.1, 1.2])) == pytest.approx(2.920 * 0.1 / 3**0.5, 1e-3)
    assert np.isnan(learned._error(np.array([1.0])))


def test_the_command_writes_a_table_a_figure_and_a_record(
    run: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    words = ["surface", "cheetah", "--policy", str(run.folder), "--vary", *PLANE]
    assert (
        main([*words, "--replicas", "1", "--seconds", "1", "--seed", "1234567", "--out", str(out)])
        == 0
    )
    with (out / "surface.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 6
    assert {"thigh_length", "mass", "refusal", "inside", "top_speed", "kick"} <= set(rows[0])
    assert (out / "surface.png").read_bytes().startswith(b"\x89PNG")
    assert (out / "surface.json").is_file()
    text = (out / "surface.html").read_text(encoding="utf-8")
    assert text.count("<rect data-i=") == 5 * 6  # A cell per design in each of the five maps.
    assert f"draft surface cheetah --vary {' '.join(PLANE)} --policy {run.folder}" in text
    assert "--replicas 1 --seconds 1 --seed 1234567</code>" in text
    assert "draft studio" not in text  # It takes no runs.
    assert "http" not in text.replace("http-equiv", "")
    printed, progress = capsys.readouterr()
    assert progress.startswith("surface: 0 of 4\n")  # Also where stderr is no terminal.
    assert printed.startswith(f"{run.folder}: policy: iteration 1 of 1\n")
    assert "6 designs: 4 measured, 2 refused or unable to walk, 2 outside" in printed


def test_the_page_draws_the_body_of_the_design_that_is_shown(
    found: Surface, tmp_path: Path, browser: Any
) -> None:
    (tmp_path / "surface.html").write_text(page(found, "draft surface"), encoding="utf-8")
    tab = browser.new_context(offline=True).new_page()
    faults: list[str] = []
    tab.on("pageerror", lambda error: faults.append(str(error)))
    tab.goto((tmp_path / "surface.html").as_uri())
    tab.wait_for_function("() => window.draftRobot")
    for i in (0, len(found.refusal) - 1):
        tab.evaluate(f"show({i})")
        own = preview(found.designs[i]).mujoco
        seen = tab.evaluate("[...draftRobot.model.geom_size]")
        np.testing.assert_allclose(seen, own.geom_size.ravel(), atol=1e-6)
        assert tab.evaluate("draftRobot.figure.group.visible")
    assert faults == []
    tab.context.close()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--vary", "thigh_length=0.2:0.3"], "a surface needs two ranges, and --vary has 1"),
        (["--vary", *PLANE, "--points", "1"], "--points 1 is not a whole number from 2 to 100"),
        (
            ["--vary", *PLANE, "--replicas", "0"],
            "--replicas 0 is not a whole number from 1 to 1000",
        ),
        (["--vary", PLANE[0], "thigh=1:2"], "'thigh'"),
        (["--vary", PLANE[0], "trunk_length=1.6:1.7"], "leaves the range"),
    ],
)
def test_a_surface_that_cannot_be_measured_is_explained(
    run: Run, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    assert main(["surface", "cheetah", "--policy", str(run.folder), *words]) == 2
    assert message in capsys.readouterr().err


def test_a_policy_that_does_not_see_its_design_is_refused(tmp_path: Path) -> None:
    blind = begin(tmp_path / "run", family(see_design=False))
    (blind.folder / "model_1.pt").write_bytes(b"weights")
    for open_it in (lambda: of_run(blind), lambda: open_source(policy("cheetah").file)):
        with pytest.raises(DraftError, match="does not see its design"):
            open_it()


def test_an_exported_policy_gives_the_surface_of_its_run(run: Run, found: Surface) -> None:
    pytest.importorskip("onnx")
    source = replace(open_source(exported(run)), forward=of_run(run).forward)
    again = surface(open_design("cheetah"), PLANE, source, replicas=2, seconds=1.0)
    np.testing.assert_array_equal(again.learned.inside, found.learned.inside)
    assert again.refusal == found.refusal


def test_an_exported_policy_is_measured_with_its_own_physics_and_servos() -> None:
    shipped = open_policy(FAMILY)
    own = {"episodes.contact_time": (0.01, 0.01), "episodes.delay": (0.0, 0.015)}
    assert _of_file(shipped, "shipped").plan.config == LAPTOP.config.with_values(own)
    other = replace(
        shipped, timestep=0.001, action_scale=2 * shipped.action_scale, velocity_noise=0.1
    )
    config = _of_file(other, "other").plan.config
    assert (config.physics.timestep, config.physics.decimation) == (0.001, 20)
    assert config.observations.linear_velocity_noise == 0.1
    usual = LAPTOP.config.actuation
    assert config.actuation == replace(usual, action_scale=2 * usual.action_scale)


def test_a_policy_drives_no_robot_of_other_joints() -> None:
    with pytest.raises(DraftError, match="does not drive the joints of humanoid"):
        open_source().drive.check(legged_robot(open_design("humanoid")))


def test_the_policy_of_all_legs_is_opened_for_robots_that_the_family_does_not_drive() -> None:
    quadruped, humanoid = (legged_robot(open_design(x)) for x in ("quadruped", "humanoid"))
    assert open_source(robot=quadruped).name == FAMILY_NAME
    source = open_source(robot=humanoid)
    assert source.name == ANY_NAME
    source.drive.check(humanoid)
    assert source.warning(humanoid) == ""
    noise = source.plan.config.observations.linear_velocity_noise
    assert noise == RECIPES["any"].config.observations.linear_velocity_noise
    strong = replace(humanoid, peak_torque=tuple(9 * x for x in humanoid.peak_torque))
    assert "outside the region of the policy of any legs: peak torque" in source.warning(strong)
    with pytest.raises(DraftError, match="name a robot"):
        open_source(ANY)


def test_the_cost_of_transport_is_electrical_power_per_weight_and_speed() -> None:
    # Braking costs nothing: of 120 W of work 100 W drive, and 50 W heat the motors.
    one, nothing = member(), np.zeros(0)
    row = {"member": one.name, "speed": 0.9, "mechanical": 120.0, "driving": 100.0, "copper": 50.0}
    samples = Histograms(nothing, nothing, nothing, np.zeros((0, 1, 3, 2)), nothing, one.classes)
    one = replace(one, electronics=(30.0,))
    found = learned.of_body(one, worlds("speed", [row] * 4), samples, trained=1.0)
    assert found.numbers["cost_of_transport"] == pytest.approx(180.0 / (one.mass * 9.81 * 0.9))
    assert found.numbers["top_speed"] == pytest.approx(0.9)
