"""The graph of a study's jobs, and what their keys depend on."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft import files
from draft.errors import DraftError
from draft.learn.engine import machine
from draft.learn.engine.machine import NATIVE, WARP, Engine, EngineName, minutes
from draft.learn.measuring import results
from draft.learn.task.config import STAGES, Config
from draft.learn.task.recipes import LAPTOP
from draft.learn.training import run as runs
from draft.study import graph as graphs
from draft.study.capacity import Capacity
from draft.study.costs import ASSUMED_RATE, Rates, hours
from draft.study.graph import graph
from draft.study.jobs import AUTO, Evaluating, Group, Job, Physics, Training
from draft.study.requests import EvaluateRequest, ReportRequest, TrainRequest
from tests.learn.small import member
from tests.study.small import TEXT, groups, jobs, request_of, study, write_output

HEIGHT = "set: {rewards.height: 0.5}\n"


def asked(job: Job, folder: Path, how: Physics = AUTO) -> Any:
    """What a worker is asked to do for a job."""
    return job.request(folder, "cpu", None, how)


def training(made: dict[str, Job], name: str) -> Training:
    job = made[name]
    assert isinstance(job, Training)
    return job


def differing(a: dict[str, Job], b: dict[str, Job]) -> set[str]:
    """Jobs of both whose keys differ, but for the report."""
    return {name for name in a.keys() & b.keys() if a[name].key != b[name].key} - {"report"}


def test_every_job_comes_after_what_it_needs_and_whole_seeds_come_first() -> None:
    made = jobs()
    seen: list[str] = []
    for name, job in made.items():
        assert set(job.needs) <= set(seen)
        seen.append(name)
    assert len(made) == 2 * 2 * 2 * (1 + 2) + 1
    assert made["cheetah-push-1"].needs == ("cheetah-base-1",)
    assert made["cheetah-push-1-perturbed"].needs == ("cheetah-push-1",)
    assert len(made["report"].needs) == 16
    seeds = [name.split("-")[2] for name in made if name != "report"]
    assert seeds == sorted(seeds)


def test_requests_say_all_that_is_to_be_done(tmp_path: Path) -> None:
    made = jobs(TEXT.replace("levels: 2", "levels: 2, published: true"))
    run = f"{tmp_path}/runs/bear-push-1"
    train = made["bear-push-1"].request(tmp_path, "cuda", 1.5)
    assert train == TrainRequest(run=run, iterations=2, minutes=1.5, device="cuda")
    evaluate = made["bear-push-1-perturbed-published"].request(tmp_path, "cpu", 1.0)
    assert evaluate == EvaluateRequest(
        run=run,
        checkpoint=2,
        test=("push",),
        levels=2,
        replicas=2,
        errors="twins",
        protocol="published",
        device="cpu",
    )
    nominal = asked(made["bear-push-1-nominal"], tmp_path)
    assert (nominal.errors, nominal.protocol) == (None, "walking")
    assert asked(made["report"], tmp_path) == ReportRequest(study=str(tmp_path))


def test_a_training_is_prepared_once_and_starts_from_its_base(tmp_path: Path) -> None:
    made = jobs(TEXT + HEIGHT)
    base, push = made["bear-base-1"], made["bear-push-1"]
    with pytest.raises(DraftError, match=r"there is no policy '.*bear-base-1' to start from"):
        push.prepare(tmp_path)
    base.prepare(tmp_path)
    with pytest.raises(DraftError, match="bear-base-1 has no checkpoint yet"):
        push.prepare(tmp_path)
    write_output(base.request(tmp_path, "cpu", None))
    push.prepare(tmp_path)
    run = runs.open_run(push.output(tmp_path))
    assert run.plan.config.rewards.height == 0.5
    assert run.plan.origin is not None
    assert (run.plan.origin.run, run.plan.origin.iteration) == (str(base.output(tmp_path)), 3)
    assert push.holds(tmp_path, run.folder)
    # What it started from is settled.
    write_output(base.request(tmp_path, "cpu", None), done=9)
    push.prepare(tmp_path)
    assert runs.open_run(run.folder).plan == run.plan
    with pytest.raises(DraftError, match=r"another plan: rewards\.height differ"):
        jobs()["bear-push-1"].prepare(tmp_path)


def test_the_key_of_an_evaluation_keeps_its_words(monkeypatch: pytest.MonkeyPatch) -> None:
    hashed: list[Mapping[str, object]] = []
    monkeypatch.setattr(graphs, "_hash", lambda words: hashed.append(words) or "key")
    jobs()
    own = [words for words in hashed if "arm" in words]
    assert {words["battery"] for words in own} == {"walk", "push"}
    assert {frozenset(words) - {"errors"} for words in own} == {
        frozenset(
            ("run", "battery", "arm", "code", "replicas", "seconds", "seed", "levels", "protocol")
        )
    }


def test_how_jobs_are_done_goes_to_the_requests_and_not_into_keys(tmp_path: Path) -> None:
    made, how = jobs(), Physics("native", 2)
    job = made["bear-base-0"]
    for name in ("bear-base-0", "bear-base-0-nominal"):  # Replicas of the latter are roll-outs.
        request = asked(made[name], tmp_path, how)
        assert (request.engine, request.replicas) == ("native", 2)
    assert asked(made["report"], tmp_path, how) == ReportRequest(study=str(tmp_path))
    # A run that was begun goes on with as many processes as its state is of.
    write_output(request_of(job, tmp_path), done=1)
    state = tmp_path / "runs/bear-base-0/state.json"
    state.write_text(json.dumps({"iteration": 1, "processes": 1, "engine": "warp"}))
    request = asked(job, tmp_path, how)
    assert (request.engine, request.replicas) == ("native", None)


def test_grounds_and_numbers_are_those_of_the_recipe(tmp_path: Path) -> None:
    assert [stage for stage in STAGES if LAPTOP.ground(stage) == "uneven"] == ["terrain"]
    text = TEXT.replace("[base, push]", "[base, velocity, terrain, push]") + "recipe: laptop\n"
    made = jobs(text)
    for stage in ("base", "velocity", "terrain", "push"):
        job = training(made, f"bear-{stage}-0")
        assert (job.plan.ground, job.plan.config) == (LAPTOP.ground(stage), LAPTOP.config)
        # Only terrain makes the base policy, which is of a plane, see the ground.
        assert job.plan.see_ground == (stage == "terrain")
        write_output(request_of(job, tmp_path))
        assert job.holds(tmp_path, job.output(tmp_path))


def test_a_policy_that_saw_the_ground_keeps_seeing_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(STAGES._items, "base", replace(STAGES["base"], uneven=True))
    made = jobs(TEXT + "recipe: laptop\n")
    for stage in ("base", "push"):
        job = training(made, f"bear-{stage}-0")
        assert (job.plan.ground, job.plan.see_ground) == (LAPTOP.ground(stage), True)


def test_a_stage_may_start_from_a_policy_that_ships(tmp_path: Path) -> None:
    text = TEXT.replace("base, push", "base, terrain, push").replace("environments: 4\n", "")
    before = jobs(text + "recipe: laptop\n")
    text += "recipe: tune\nstart: {base: family, terrain: family_climb}\n"
    made = jobs(text)
    base, terrain, push = (
        training(made, f"bear-{stage}-0") for stage in ("base", "terrain", "push")
    )
    assert (base.needs, terrain.needs, push.needs) == ((), (), (base.name,))
    assert base.plan.origin
    assert base.plan.origin.run == "family"
    assert terrain.plan.origin
    assert terrain.plan.origin.run == "family_climb"
    assert push.plan.origin is None
    assert all(job.plan.see_design for job in (base, terrain, push))
    assert (base.plan.see_ground, terrain.plan.see_ground) == (False, True)
    assert all(made[name].key != job.key for name, job in before.items())
    terrain.prepare(tmp_path)
    run = runs.open_run(terrain.output(tmp_path))
    assert run.plan == terrain.plan
    assert terrain.holds(tmp_path, run.folder)
    # Another policy under that name makes another run of it.
    other = jobs(text.replace("family_climb", "family"))["bear-terrain-0"]
    assert not other.holds(tmp_path, run.folder)


def test_stages_keep_the_gains_of_the_policy_of_all_legs_that_the_first_started_from() -> None:
    made = jobs(TEXT.replace("environments: 4\n", "") + "recipe: tune\nstart: {base: any}\n")
    support = [
        training(made, f"bear-{stage}-0").plan.config.actuation.support
        for stage in ("base", "push")
    ]
    assert support == [0.6, 0.6]


def test_a_toy_keeps_the_layers_of_a_policy_that_it_starts_from() -> None:
    text = TEXT + "recipe: tune\nstart: {base: family}\ntoy: {iterations: 1}\n"
    toy = study(text, toy=True)
    assert toy.config.learning.hidden == LAPTOP.config.learning.hidden
    assert toy.config.learning.steps == 8
    assert graph(toy, groups("bear"))["bear-base-0"].needs == ()


def test_a_policy_that_does_not_fit_is_refused_where_it_is_named() -> None:
    with pytest.raises(DraftError, match=r"7:15: .*has layers of 256, 128, 64 units.*\n.*: tune"):
        jobs(TEXT + "start: {base: family}\n")


def test_inertia_errors_are_those_of_the_perturbed_arm(tmp_path: Path) -> None:
    made = jobs(TEXT.replace("levels: 2", "levels: 2, errors: paper"))
    for arm, errors in (("perturbed", "paper"), ("nominal", None)):
        assert asked(made[f"bear-push-1-{arm}"], tmp_path).errors == errors


def test_numbers_of_the_file_are_those_of_its_runs(tmp_path: Path) -> None:
    told = {"learning.mirror": "true", "ground.step": "[0, 0.1]", "push.ramp": "[[0, 1.0], [9, 2]]"}
    lines = "".join(f"  {name}: {value}\n" for name, value in told.items())
    job = graph(study(TEXT + "set:\n" + lines), groups())["bear-base-0"]
    job.prepare(tmp_path)
    read = runs.open_run(job.output(tmp_path)).plan.config
    assert read.learning.mirror
    assert read.ground.step == (0.0, 0.1)
    assert read.push.ramp == ((0, 1.0), (9, 2.0))


def another(value: float) -> float:
    """Another number of the same kind, which is a share where the first is one."""
    if isinstance(value, bool):
        return not value
    return value + 1 if isinstance(value, int) else value / 2 or 0.5


@given(st.sampled_from(sorted({f"{g}.{n}" for g, v in Config().as_dict().items() for n in v})))
def test_any_number_of_the_tasks_makes_every_training_new(name: str) -> None:
    group, _, key = name.partition(".")
    value = Config().as_dict()[group][key]
    if not isinstance(value, list):
        changed = another(value)
    elif isinstance(value[0], list):
        changed = [[0, 9.5]]
    else:
        changed = [another(v) for v in value]
        changed = sorted(changed) if len(changed) == 2 else changed  # Pairs are ranges.
    text = TEXT + f"set: {{{name}: {str(changed).lower()}}}\n"
    assert differing(jobs(), jobs(text)) == jobs().keys() - {"report"}


def test_a_design_that_changes_makes_only_its_own_jobs_new() -> None:
    other = [Group("cheetah", (member("giraffe"),)), groups()[1]]
    found = differing(jobs(), graph(study(), other))
    assert found == {name for name in jobs() if name.startswith("cheetah")}


@pytest.mark.parametrize(
    ("old", "new", "reached"),
    [
        ("push: 2", "push: 3", "push"),
        ("base: 3", "base: 4", ""),
        ("environments: 4", "environments: 5", ""),
        ("replicas: 2", "replicas: 3", "al$|ed$"),
        ("levels: 2", "levels: 3", "al$|ed$"),
        ("levels: 2", "levels: 2, errors: paper", "-perturbed"),
        ("seeds: 2", "seeds: 3", "none"),
        ("seeds: 2", "seeds: 2\nrecipe: paper", "none"),
        ("seeds: 2", "seeds: 2\nrecipe: laptop", ""),
    ],
)
def test_a_change_reaches_what_depends_on_it_and_nothing_else(
    old: str, new: str, reached: str
) -> None:
    before, after = jobs(), jobs(TEXT.replace(old, new))
    assert differing(before, after) == {n for n in before if re.search(reached, n)} - {"report"}
    same = "recipe: paper" in new
    assert (before["report"].key == after["report"].key) == same


def test_a_version_of_draft_makes_all_new_a_format_evaluations_and_a_library_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before, here = jobs(), runs.versions()
    monkeypatch.setattr(runs, "_version", (here | {"torch": "99", "mujoco": "99"}).get)
    assert differing(before, jobs()) == set()
    monkeypatch.setattr(graphs, "FORMAT", 99)
    evaluations = {name for name, job in before.items() if isinstance(job, Evaluating)}
    assert differing(before, jobs()) - {"report"} == evaluations
    monkeypatch.setattr(graphs, "own_version", lambda: "99")
    assert differing(before, jobs()) == before.keys() - {"report"}


def write(tmp_path: Path, name: str, done: int | None = None) -> Job:
    """Do a job."""
    job = jobs()[name]
    write_output(request_of(job, tmp_path), done)
    return job


def test_only_what_answers_an_evaluation_completes_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path, "bear-push-0")
    job = write(tmp_path, "bear-push-0-nominal")
    assert isinstance(job, Evaluating)
    assert job.complete(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(results, "read", lambda folder: pytest.fail("it is read again"))
        assert job.complete(tmp_path)
    for change in ({"replicas": 3}, {"levels": 3}, {"levels": None}, {"seed": 1}, {"seconds": 3.0}):
        other = job.options.model_copy(update=change)
        assert not replace(job, _known={}, options=other).complete(tmp_path)
    summary = job.output(tmp_path) / "summary.json"
    told = json.loads(summary.read_text())
    for changed, complete in (({"asked": None}, False), ({"format": 0}, False), ({}, True)):
        files.write(summary, json.dumps(told | changed))
        assert job.complete(tmp_path) == complete
    files.write(tmp_path / "runs/bear-push-0/model_2.pt", "trained anew")
    assert not job.complete(tmp_path)
    write(tmp_path, "bear-push-0-nominal")
    assert job.complete(tmp_path)
    (job.output(tmp_path) / "worlds.parquet").unlink()
    assert not job.complete(tmp_path)


def test_a_run_that_was_trained_further_is_done_and_evaluated_where_it_was_asked_for(
    tmp_path: Path,
) -> None:
    job = write(tmp_path, "bear-base-0", done=3)
    write(tmp_path, "bear-base-0", done=9)
    assert job.complete(tmp_path)
    assert asked(jobs()["bear-base-0-nominal"], tmp_path).checkpoint == 3
    (tmp_path / "runs/bear-base-0/model_3.pt").unlink()
    assert not job.complete(tmp_path)


def test_a_run_of_something_else_is_not_complete(tmp_path: Path) -> None:
    write_output(request_of(jobs(TEXT + HEIGHT)["bear-base-0"], tmp_path))
    job = training(jobs(), "bear-base-0")
    assert not job.complete(tmp_path)
    assert job.differing(job.output(tmp_path)) == ["rewards.height"]
    (job.output(tmp_path) / "run.json").write_text("[")
    assert not job.complete(tmp_path)


def test_hours_are_steps_by_steps_per_second(tmp_path: Path) -> None:
    made = jobs()
    rates = Rates(tmp_path, made, 100.0)
    assert hours(made["bear-base-0"], tmp_path, rates) == pytest.approx(3 * 4 * 24 / 100 / 3600)
    # One level of 2 replicas, 600 steps each.
    walk = hours(made["bear-base-0-nominal"], tmp_path, rates)
    assert walk == pytest.approx(2 * 600 / 100 / 3600)
    push = hours(made["bear-push-0-nominal"], tmp_path, rates)
    assert push == pytest.approx(2 * 2 * 600 / 100 / 3600)
    assert "of `rate`" in rates.words()


def test_rates_are_measured_from_runs_that_are_there(tmp_path: Path) -> None:
    made = jobs()
    assert "is an assumption" in Rates(tmp_path, made).words()
    write_output(request_of(made["bear-base-0"], tmp_path), done=2)
    # The first iteration compiles; the last line is cut short.
    text = "iteration,steps_per_s\n1,3\n2,500\n3,700\n4,6e2\n5,"
    (tmp_path / "runs/bear-base-0/progress.csv").write_text(text)
    rates = Rates(tmp_path, made)
    assert (rates.of("base"), rates.of("push")) == (600.0, 600.0)
    assert "measured in this study: base 600" in rates.words()
    # One iteration of three is left.
    assert hours(made["bear-base-0"], tmp_path, rates) == pytest.approx(4 * 24 / 600 / 3600)


def on_cpu(name: EngineName, processes: int = 2) -> Capacity:
    return Capacity(Engine(name, "a test"), True, processes, 1, Physics(name, processes))


def test_on_a_cpu_hours_are_those_of_its_engine_and_ground(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    speeds = {NATIVE: {"flat": 4700.0, "uneven": 2500.0}, WARP: {"flat": 500.0, "uneven": 400.0}}
    monkeypatch.setattr(machine, "_RATES", speeds)
    text = TEXT.replace("[base, push]", "[base, terrain]").replace("push: 2", "terrain: 2")
    made = jobs(text + "recipe: laptop\n")
    capacity = on_cpu(NATIVE)
    rates = Rates(tmp_path, made, None, capacity)
    for stage, ground, count in (("base", "flat", 3), ("terrain", "uneven", 2)):
        expected = minutes(count * 4 * 24, 4, capacity.engine, 2, ground) / 60
        assert hours(made[f"bear-{stage}-0"], tmp_path, rates) == pytest.approx(expected)
    assert "measured on another CPU: 9,400 on flat and 5,000 on uneven ground" in rates.words()
    slow = Rates(tmp_path, made, None, on_cpu(WARP, 1))
    base = made["bear-base-0"]
    assert hours(base, tmp_path, slow) > 10 * hours(base, tmp_path, rates)
    finer = jobs(text + "recipe: laptop\nset: {physics.timestep: 0.001, physics.decimation: 20}\n")
    fine = Rates(tmp_path, finer, None, capacity)
    assert hours(finer["bear-base-0"], tmp_path, fine) > 2 * hours(base, tmp_path, rates)
    assert Rates(tmp_path, made).of("base") == ASSUMED_RATE


def test_rates_of_another_engine_tell_nothing_and_a_slow_machine_is_slow_in_all(
    tmp_path: Path,
) -> None:
    made = jobs(TEXT + "recipe: laptop\n")
    write_output(request_of(made["bear-base-0"], tmp_path), done=2)
    run = tmp_path / "runs/bear-base-0"
    (run / "progress.csv").write_text("iteration,steps_per_s\n1,3\n2,500\n")
    rates = Rates(tmp_path, made, None, on_cpu(NATIVE))
    assert not rates.measured
    (run / "state.json").write_text(json.dumps({"iteration": 2, "engine": NATIVE}))
    assert not Rates(tmp_path, made).measured
    before, rates = rates, Rates(tmp_path, made, None, on_cpu(NATIVE))
    assert rates.measured == {"base": 500.0}
    assert rates.of("push") == pytest.approx(500.0 / before.of("base") * before.of("push"))
