"""A study's file: what it may say, and what is said where it is wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.learn.bodies import inertia
from draft.learn.task.config import STAGES, Config
from draft.learn.task.recipes import LAPTOP, RECIPES
from draft.study.designs import read_groups
from draft.study.file import Family, read
from draft.study.graph import graph
from draft.study.jobs import Training
from tests.study.small import TEXT, groups, study

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_what_is_left_away_is_the_published_study() -> None:
    least = study("designs: [cheetah]\n")
    assert least.seeds == tuple(range(10))
    assert least.stages == ("base", "velocity", "terrain", "push")
    assert least.environments == 4096
    assert [least.iterations(stage) for stage in least.stages] == [1200, 1800, 2000, 1500]
    assert (least.recipe.name, least.config) == ("paper", Config())
    assert (least.evaluate.replicas, least.evaluate.levels) == (256, None)
    assert (least.evaluate.perturbed, least.evaluate.errors) == (True, "twins")
    assert not least.evaluate.published


@pytest.mark.parametrize(
    ("name", "more"),
    [("published_quadrupeds", ""), ("three_quadrupeds", "recipe: laptop\nseeds: 3\n")],
)
def test_an_example_is_that_study_of_three_designs(name: str, more: str) -> None:
    example = read(EXAMPLES / f"{name}.yaml")
    least = study("designs: [cheetah, bear, giraffe]\n" + more)
    assert example.designs == least.designs
    assert example.seeds == least.seeds
    assert example.config == least.config
    assert example.evaluate == least.evaluate
    assert all(example.iterations(s) == least.iterations(s) for s in example.stages)


def test_an_example_trains_and_evaluates_one_base_policy_of_each_design() -> None:
    for toy in (False, True):
        example = read(EXAMPLES / "base_policies.yaml", toy)
        assert [group.name for group in read_groups(example)] == ["cheetah", "bear", "giraffe"]
        assert (example.seeds, example.stages) == ((0,), ("base",))
        kinds = [job.kind for job in graph(example, read_groups(example)).values()]
        assert kinds == ["train", "evaluate"] * 3 + ["report"]


def test_each_sensitivity_study_changes_one_choice_of_the_study_of_three() -> None:
    of_three = read(EXAMPLES / "three_quadrupeds.yaml")
    paper, fine, twice = (
        read(EXAMPLES / "sensitivity" / f"{name}.yaml")
        for name in ("paper", "fine_physics", "twice_the_steps")
    )
    assert twice.config == of_three.config
    assert paper.config == RECIPES["paper"].config
    assert paper.environments == of_three.environments
    assert paper.iterations("velocity") == of_three.iterations("velocity")
    physics = replace(of_three.config.physics, timestep=0.001, decimation=20)
    assert fine.config == replace(of_three.config, physics=physics)
    assert 2 * of_three.iterations("base") == twice.iterations("base")
    start = read(EXAMPLES / "sensitivity/from_family.yaml")
    assert (start.stages, start.config) == (("velocity",), RECIPES["tune"].config)
    assert all(one.designs == of_three.designs for one in (paper, fine, twice, start))


def test_numbers_of_the_tasks_and_a_ground_are_those_of_all_stages() -> None:
    text = TEXT + "ground: flat\n"
    text += "set: {rewards.height: 0.5, ground.step: [0, 0.1], learning.mirror: true}\n"
    for job in graph(study(text), groups()).values():
        if isinstance(job, Training):
            config = job.plan.config
            assert (job.plan.ground, job.plan.see_ground) == ("flat", False)
            assert (config.rewards.height, config.ground.step) == (0.5, (0.0, 0.1))
            assert config.learning.mirror


def test_a_recipe_is_what_the_other_numbers_start_from() -> None:
    quick = study("designs: [cheetah]\nrecipe: laptop\n")
    assert quick.config == LAPTOP.config
    config = LAPTOP.config
    assert quick.environments == config.learning.environments < 4096
    assert [quick.iterations(s) for s in STAGES] == [config.iterations(s) for s in STAGES]
    text = "designs: [cheetah]\nrecipe: laptop\niterations: {base: 9}\n"
    text += "set: {learning.kl: 0.02, learning.iterations_push: 7, learning.environments: 64}\n"
    changed = study(text)
    assert changed.config.learning.kl == 0.02
    assert changed.config.rewards == LAPTOP.config.rewards
    assert changed.environments == 64
    assert [changed.iterations(stage) for stage in ("base", "push")] == [9, 7]
    assert study(text + "environments: 32\n").environments == 32


def test_a_toy_keeps_designs_stages_and_numbers_and_makes_the_rest_small() -> None:
    text = TEXT + "set: {rewards.height: 0.5}\ntoy: {evaluate: {replicas: 3}}\n"
    toy = study(text, toy=True)
    assert (toy.stages, toy.seeds) == (("base", "push"), (0,))
    assert (toy.environments, toy.iterations("push")) == (8, 2)
    assert toy.config.rewards.height == 0.5
    assert toy.config.learning.hidden == (32, 32)
    assert (toy.evaluate.replicas, toy.evaluate.levels, toy.evaluate.perturbed) == (3, 3, True)
    assert study(text).config.learning.hidden == (512, 256, 128)
    # Its sizes win over the recipe.
    toy = study("designs: [cheetah]\nrecipe: laptop\n", toy=True)
    assert (toy.recipe, toy.environments, toy.iterations("base")) == (LAPTOP, 8, 2)
    assert (toy.config.learning.hidden, toy.config.learning.steps) == ((32, 32), 8)
    assert toy.config.learning.mirror == LAPTOP.config.learning.mirror


@pytest.mark.parametrize("word", inertia.SOURCES)
def test_all_sources_of_inertia_errors_are_words_of_the_file(word: str) -> None:
    text = TEXT.replace("levels: 2", f"errors: {word}")
    assert study(text).evaluate.errors == study(text, toy=True).evaluate.errors == word


def test_a_family_is_read() -> None:
    text = "designs:\n- {design: cheetah, vary: ['thigh_length=0.2:0.3'], bodies: 3}\n- bear\n"
    family, word = study(text).designs
    assert isinstance(family, Family)
    assert (family.bodies, family.see_design, word) == (3, True, "bear")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("design: [cheetah]\n", "small.yaml:1:1: unknown key 'design' in the file\n  did you mean"),
        ("seeds: 3\n", "small.yaml:1:1: 'designs' is missing"),
        ("designs: []\n", "small.yaml:1:10: designs: expected at least 1 entry"),
        ("designs: cheetah\n", "small.yaml:1:10: designs: expected a list, found 'cheetah'"),
        ("designs:\n- cheetah\n- 3\n", "small.yaml:3:3: designs[1]: expected text, found 3"),
        ("designs:\n- {design: bear}\n", "small.yaml:2:3: 'vary' is missing in designs[0]"),
        (TEXT + "sedes: 3\n", "small.yaml:7:1: unknown key 'sedes' in the file\n  did you mean"),
        (TEXT + "recipe: lapto\n",
         "small.yaml:7:9: recipe: unknown value 'lapto'\n  did you mean 'laptop'?"),
        (TEXT + "recipe: fast\n", "unknown value 'fast'\n  "),
        (TEXT + "set:\n  rewards.heigt: 1\n", "small.yaml:8:3: there is no number 'rewards.heigt'"),
        (TEXT + "set:\n  rewards.height: tall\n", "small.yaml:8:3: 'tall' is not a value of"),
        (TEXT + "set: [1]\n", "small.yaml:7:6: set: expected a mapping"),
        (TEXT + "toy: {set: {rewards.heigt: 1}}\n", "small.yaml:7:13: there is no number"),
        (TEXT + "toy: {environments: 0}\n", "toy.environments: expected a whole number from 1"),
        (TEXT + "toy: {iterations: {base: 1}}\n", "toy.iterations: expected a whole number"),
        (TEXT + "toy: {stages: [base]}\n", "unknown key 'stages' in toy"),
        (TEXT.replace("seeds: 2", "seeds: -1"), "small.yaml:2:8: seeds: expected a whole number"),
        (TEXT.replace("seeds: 2", "seeds: true"), "seeds: expected a whole number from 1 to 1000"),
        (TEXT.replace("seeds: 2", "seeds: [0, -1]"), "small.yaml:2:12: seeds[1]: expected a whole"),
        (TEXT.replace("seeds: 2", "seeds: [3, 3]"), "small.yaml:2:8: seeds: 3 is listed twice"),
        (TEXT.replace("seeds: 2", "seeds: []"), "seeds: expected at least 1 entry"),
        (TEXT.replace("[base, push]", "[push, base]"), "out of order; the order is base,"),
        (
            TEXT.replace("[base, push]", "[push]").replace("base: 3, ", ""),
            "small.yaml:3:9: 'base' must come first: 'push' starts from it\n"
            "  add 'base', or a policy that ships: start: {push: family}",
        ),
        (TEXT + "start: {terrain: family}\n", "small.yaml:7:9: stage 'terrain' is not trained"),
        (TEXT + "start: {bse: family}\n", "small.yaml:7:9: start.bse: unknown value 'bse'"),
        (TEXT + "start: {base: famly}\n",
         "small.yaml:7:15: start.base: unknown value 'famly'\n  did you mean 'family'?"),
        (TEXT + "start: {base: 3}\n", "small.yaml:7:15: start.base: expected text"),
        (TEXT + "start: {base: [family]}\n", "small.yaml:7:15: start.base: expected text"),
        (TEXT + "recipe: tune\n",
         "small.yaml:7:9: recipe tune starts from a policy that can run: 'base' does not\n"
         "  start: {base: family}"),
        (TEXT.replace("[base, push]", "[base, push, terrain]"), "out of order; the order is base,"),
        (TEXT.replace("[base, push]", "[base, base]"), "base is listed twice"),
        (TEXT.replace("[base, push]", "[base, jump]"), "small.yaml:3:16: stages[1]: unknown value"),
        (TEXT.replace("[base, push]", "[[base], push]"), "small.yaml:3:10: stages[0]: expected"),
        (TEXT.replace("[base, push]", "[base]"), "small.yaml:4:23: stage 'push' is not trained"),
        (TEXT.replace("base: 3", "base: 0"), "small.yaml:4:20: iterations.base: expected a whole"),
        (TEXT.replace("base: 3", "bse: 3"), "small.yaml:4:14: iterations.bse: unknown value 'bse'"),
        (TEXT.replace("levels: 2", "levels: two"), "evaluate.levels: expected a whole number"),
        (TEXT.replace("levels: 2", "seconds: 0"), "evaluate.seconds: expected a number from 0.5"),
        (
            TEXT + "set: {learning.iterations_base: 20000000}\n",
            r"learning.iterations_base must be from 1 to 10000000, and is 20000000",
        ),
        (TEXT.replace("levels: 2", "perturbed: 1"), "evaluate.perturbed: expected true or false"),
        (TEXT.replace("levels: 2", "errors: papr"),
         "small.yaml:6:33: evaluate.errors: unknown value 'papr'\n  did you mean 'paper'?"),
        (TEXT.replace("levels: 2", "errors: 3"), "evaluate.errors: unknown value 3"),
        (TEXT.replace("levels: 2", "level: 2"), "unknown key 'level' in evaluate\n  did you mean"),
        ("designs: !!python/name:os.system [a]\n", "the tag '!!python/name:os.system' is not"),
        ("designs: [cheetah\n", "not valid YAML"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_with_its_place(text: str, words: str) -> None:
    with pytest.raises(DraftError) as raised:
        study(text)
    assert words in str(raised.value)


@pytest.mark.parametrize(("text", "words"), [("3\n", "a study is a mapping"), (None, "not found")])
def test_a_file_that_is_no_study_is_refused(tmp_path: Path, text: str | None, words: str) -> None:
    path = tmp_path / "study.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(DraftError, match=words):
        read(path)


def test_a_stage_of_an_extension_is_trained_after_the_one_that_it_starts_from(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    more = replace(STAGES["push"], name="kicked", origin="push")
    monkeypatch.setitem(STAGES._items, "kicked", more)
    assert study("designs: [cheetah]\n").stages == ("base", "velocity", "terrain", "push")
    text = "designs: [cheetah]\nseeds: 1\niterations: {kicked: 3}\n"
    found = study(text + "stages: [base, push, kicked]\n")
    assert found.iterations("kicked") == 3
    jobs = graph(found, read_groups(found))
    assert jobs["cheetah-kicked-0"].needs == ("cheetah-push-0",)
    with pytest.raises(DraftError, match="'push' must come first: 'kicked' starts from it"):
        study(text + "stages: [base, kicked]\n")
