"""Training in slices, from other runs, and when something goes wrong."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from draft.errors import DraftError  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.training.ppo import trainer as trainers  # noqa: E402
from draft.learn.training.ppo.checkpoint import read_checkpoint  # noqa: E402
from draft.learn.training.ppo.log import Table, read  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.progress import fastest, hardest_row  # noqa: E402
from draft.learn.training.run import Origin, Plan, Run, file_digest, open_run  # noqa: E402
from tests.learn.runs import QUICK, begin, same, train, weights  # noqa: E402
from tests.learn.small import plan  # noqa: E402

missing = pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch")
NATIVE = pytest.param("native", marks=missing)
ENGINES = ["warp", NATIVE]


@pytest.fixture(scope="module")
def base(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Trainer]:
    """A base run of three iterations, in one go."""
    run = begin(tmp_path_factory.mktemp("base") / "run", plan())
    return run, train(run, 3, engine="warp")


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory, base: tuple[Run, Trainer]) -> Any:
    """A base run of three iterations in one go, by engine; made once each."""
    made = {"warp": base[1]}

    def of(engine: str) -> Trainer:
        if engine not in made:
            folder = tmp_path_factory.mktemp(engine) / "run"
            made[engine] = train(begin(folder, plan()), 3, engine=engine)
        return made[engine]

    return of


@pytest.mark.parametrize("engine", ENGINES)
def test_slices_add_up_to_one_long_run_bit_by_bit(long: Any, tmp_path: Path, engine: str) -> None:
    whole = long(engine)
    sliced = train(begin(tmp_path / "run", plan()), 1, 2, 3, engine=engine)
    assert same(weights(whole), weights(sliced))
    assert torch.equal(whole.env.sim.data.qpos[:], sliced.env.sim.data.qpos[:])
    assert [row["iteration"] for row in read(tmp_path / "run/progress.csv")] == [1, 2, 3]


FAMILY = plan("cheetah", "bear", stage="terrain")
REMEMBERS = plan(
    "cheetah",
    "bear",
    ground="flat",
    values={"observations.history": 3, "observations.linear_velocity": False},
)
SYMMETRIC = plan(stage="velocity", values={"learning.mirror": True, "velocity.growth": 0.5})


@missing
@pytest.mark.parametrize(
    "of",
    [FAMILY, SYMMETRIC, REMEMBERS],
    ids=["family on terrain", "symmetric", "past steps"],
)
def test_slices_add_up_on_native_mujoco(tmp_path: Path, of: Plan) -> None:
    whole = train(begin(tmp_path / "whole", of), 3, engine="native")
    sliced = train(begin(tmp_path / "sliced", of), 1, 3, engine="native")
    assert same(weights(whole), weights(sliced))
    # In double precision: all that the physics goes on from.
    assert torch.equal(whole.env.sim.state, sliced.env.sim.state)  # type: ignore[attr-defined]


@missing
@pytest.mark.parametrize(("left", "right"), [("native", "warp"), ("warp", "native")])
def test_a_state_that_one_engine_left_is_taken_up_by_the_other(
    tmp_path: Path, left: str, right: str
) -> None:
    # On a plane: they take other contacts with height fields.
    run = begin(tmp_path / "run", plan("cheetah", "bear", ground="flat"))
    before = train(run, 2, engine=left)
    after = Trainer(open_run(run.folder), "cpu", engine=right)
    assert type(after.env.sim) is not type(before.env.sim)
    assert after.iteration == 2
    for name in ("qpos", "qvel", "qacc_warmstart", "ctrl", "time", "xpos", "cvel"):
        one, other = (getattr(of.env.sim.data, name)[:].float() for of in (before, after))
        size = max(1.0, float(one.abs().max()))
        torch.testing.assert_close(other, one, rtol=0, atol=2e-6 * size, msg=name)
    assert same(weights(after), weights(before))
    for name in ("body_mass", "geom_friction", "body_ipos"):
        one, other = (getattr(of.env.sim.model, name)[:].float() for of in (before, after))
        torch.testing.assert_close(other, one, rtol=1e-6, atol=1e-7)
    # From there both do the same, with the same chance.
    for _ in range(3):
        seen = []
        for of in (before, after):
            torch.manual_seed(1)
            with torch.inference_mode():
                found: Any = of.env.step(torch.full((4, 12), 0.3))[0]["critic"]
            seen.append(found.clone())
        torch.testing.assert_close(seen[1], seen[0], rtol=1e-3, atol=2e-3)
    assert after.train(3)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_killed_run_resumes_from_its_last_state(
    long: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str
) -> None:
    run = begin(tmp_path / "run", plan())
    killed = Trainer(run, "cpu", engine=engine)
    save, calls = killed.save, iter(range(10))

    def dies() -> None:
        # After two iterations, of which the second had not been saved.
        if next(calls) == 2:
            raise KeyboardInterrupt
        save()

    monkeypatch.setattr(trainers, "SAVE_SECONDS", 0.0)
    monkeypatch.setattr(killed, "save", dies)
    with pytest.raises(KeyboardInterrupt):
        killed.train(3)
    monkeypatch.undo()
    assert open_run(run.folder).done() == 1
    assert same(weights(long(engine)), weights(train(run, 3, engine=engine)))
    assert [row["iteration"] for row in read(run.folder / "progress.csv")] == [1, 2, 3]


@pytest.mark.parametrize("engine", ENGINES)
def test_a_training_that_stops_early_keeps_the_policy_it_reached(
    long: Any, tmp_path: Path, engine: str
) -> None:
    run = begin(tmp_path / "run", plan())  # It keeps a checkpoint every two iterations.
    stopped = Trainer(run, "cpu", engine=engine)
    assert not stopped.train(3, stop=lambda: stopped.iteration == 1)
    assert run.checkpoint()[0] == run.done() == 1
    kept = read_checkpoint(run.checkpoint()[1], "cpu")["actor_state_dict"]
    assert same(kept, stopped.runner.alg.save()["actor_state_dict"])
    assert run.policy_line(1).startswith("policy: iteration 1 of 3, unfinished: `draft.train(")
    assert same(weights(long(engine)), weights(train(run, 3, engine=engine)))
    assert run.policy_line(3) == "policy: iteration 3 of 3"


def test_a_resumed_run_keeps_the_state_of_its_curriculum(tmp_path: Path) -> None:
    values = {"velocity.ramp": [[0, 0.4], [1, 0.6], [2, 0.8]]}
    run = begin(tmp_path / "run", plan(stage="velocity", values=values))
    train(run, 2)
    resumed = Trainer(run, "cpu", engine=QUICK)
    assert resumed.env.common_step_counter == 2 * 4
    command = resumed.env.command_manager.get_term("twist")
    assert float(command.range_now()[0, 0]) == pytest.approx(0.8 * 15.0)  # type: ignore[attr-defined]


@pytest.mark.parametrize("engine", ENGINES)
def test_rows_of_the_terrain_are_part_of_the_state(tmp_path: Path, engine: str) -> None:
    run = begin(tmp_path / "run", plan(stage="terrain"))
    trainer = Trainer(run, "cpu", engine=engine)
    terrain: Any = trainer.env.scene.terrain
    terrain.terrain_levels[:] = torch.tensor([2, 1, 0, 2])
    trainer.save()
    again: Any = Trainer(run, "cpu", engine=engine).env.scene.terrain
    assert again.terrain_levels.tolist() == [2, 1, 0, 2]


def after(base: tuple[Run, Trainer], folder: Path, **more: Any) -> Run:
    """A run of stage push that starts from the base run, or from what is said to be that."""
    iteration, file = base[0].checkpoint()
    words = {"run": str(base[0].folder), "iteration": iteration, "digest": file_digest(file)}
    origin = Origin(**words | more.pop("origin", {}))
    return begin(folder, replace(plan(stage="push", **more), origin=origin))


def test_a_second_stage_starts_from_the_base_policy_alone(
    base: tuple[Run, Trainer], tmp_path: Path
) -> None:
    trainer = Trainer(after(base, tmp_path / "run"), "cpu", engine=QUICK)
    assert same(weights(trainer), weights(base[1]))
    assert not trainer.runner.alg.optimizer.state
    assert trainer.env.common_step_counter == 0
    assert trainer.iteration == 0


def test_a_policy_is_found_beside_a_run_that_was_moved_with_it(
    base: tuple[Run, Trainer], tmp_path: Path
) -> None:
    shutil.copytree(base[0].folder, tmp_path / "base")
    run = after(base, tmp_path / "run", origin={"run": "/elsewhere/base"})
    assert same(weights(Trainer(run, "cpu", engine=QUICK)), weights(base[1]))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        pytest.param({"origin": {"digest": "0" * 16}}, "has changed since", id="changed"),
        pytest.param({"values": {"learning.hidden": [8, 8]}}, "does not fit", id="another size"),
    ],
)
def test_a_policy_that_is_not_the_one_of_the_plan_is_not_taken(
    base: tuple[Run, Trainer], tmp_path: Path, more: dict[str, Any], words: str
) -> None:
    with pytest.raises(DraftError, match=words):
        Trainer(after(base, tmp_path / "run", **more), "cpu", engine=QUICK)


def test_a_state_of_another_run_is_not_gone_on_with(
    base: tuple[Run, Trainer], tmp_path: Path
) -> None:
    run = begin(tmp_path / "run", plan(environments=5))
    run.resume.write_bytes(base[0].resume.read_bytes())
    with pytest.raises(DraftError, match="another environment"):
        Trainer(run, "cpu", engine=QUICK)


def test_a_run_that_lost_its_state_does_not_restart_silently(
    base: tuple[Run, Trainer], tmp_path: Path
) -> None:
    run = Run(shutil.copytree(base[0].folder, tmp_path / "run"), base[0].plan)
    run.resume.write_bytes(run.resume.read_bytes()[:1000])
    with pytest.raises(DraftError, match="cannot be read as a checkpoint") as caught:
        Trainer(run, "cpu", engine=QUICK)
    assert "delete the run's folder and train again" in str(caught.value)
    run.resume.unlink()
    with pytest.raises(DraftError, match=r"has checkpoints, but no resume.pt to resume from"):
        Trainer(run, "cpu", engine=QUICK)


class Trap:
    """What runs code where pickles are trusted."""

    def __reduce__(self) -> Any:
        return (print, ("code was run",))


@pytest.mark.parametrize(
    "content",
    [b"", b"no archive", b"PK\x03\x04", Trap()],
    ids=["empty", "no archive", "cut", "a trap"],
)
def test_a_broken_checkpoint_is_explained_and_runs_no_code(tmp_path: Path, content: Any) -> None:
    file = tmp_path / "model_1.pt"
    if isinstance(content, bytes):
        file.write_bytes(content)
    else:
        torch.save({"a": content}, file)
    with pytest.raises(DraftError, match="cannot be read as a checkpoint"):
        read_checkpoint(file, "cpu")


@pytest.mark.parametrize("engine", ENGINES)
def test_numbers_that_are_none_stop_training_and_leave_the_last_state(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, engine: str
) -> None:
    run = begin(tmp_path / "run", plan())
    trainer = train(run, 2, engine=engine)
    before = {p.name: p.read_bytes() for p in run.folder.iterdir() if p.is_file()}
    trainer = Trainer(run, "cpu", engine=engine)
    step = trainer._wrapped.step

    def broken(actions: Any) -> Any:
        seen, rewards, dones, extras = step(actions)
        seen["actor"][1, 3] = float("nan")
        return seen, rewards, dones, extras

    monkeypatch.setattr(trainer._wrapped, "step", broken)
    with pytest.raises(DraftError, match="iteration 3: observations are not finite"):
        trainer.train(3)
    after = {p.name: p.read_bytes() for p in run.folder.iterdir() if p.is_file()}
    assert after == before


def test_progress_has_rewards_by_term(base: tuple[Run, Trainer]) -> None:
    rows = read(base[0].folder / "progress.csv")
    terms = {name for name in rows[0] if name.startswith("reward/")}
    active = base[1].env.reward_manager.active_terms
    assert terms == {f"reward/{name}" for name in active}
    for row in rows:
        assert sum(row[name] for name in terms) == pytest.approx(row["reward"], abs=1e-4)
    assert list((base[0].folder / "tensorboard").glob("*")) == []  # Only the launcher writes it.


def test_a_row_truncated_by_a_kill_is_skipped(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    file.write_text("iteration,reward\n1,0.5\n2,0.6\n3,")
    assert [row["iteration"] for row in read(file)] == [1, 2]
    Table(file, 1).add({"iteration": 2.0, "reward": 0.7})
    assert file.read_text() == "iteration,reward\n1,0.5\n2,0.7\n"


def test_a_new_name_adds_a_column_to_the_table(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    table = Table(file, 0)
    table.add({"iteration": 1.0, "reward": 0.5})
    table.add({"iteration": 2.0, "reward": 0.6, "curriculum/row": 2.0})
    table.add({"iteration": 3.0, "reward": 0.7})
    assert file.read_text() == ("iteration,reward,curriculum/row\n1,0.5,nan\n2,0.6,2\n3,0.7,nan\n")


def test_what_a_training_had_reached_by_an_iteration_is_known(tmp_path: Path) -> None:
    file = tmp_path / "progress.csv"
    assert hardest_row(file, 5) is None
    rows = ("1,nan,0.9", "2,3,nan", "3,2,1.3", "4,7,nan")
    file.write_text("\n".join(("iteration,stairs/hardest_row,curriculum/fastest", *rows, "")))
    assert [hardest_row(file, i) for i in (1, 2, 3, 4)] == [None, 3.0, 3.0, 7.0]
    assert [fastest(file, i) for i in (0, 1, 2)] == [None, 0.9, 0.9]
    assert fastest(file) == 1.3
