"""Messages of the library, whose arguments a command spells as its options."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from draft.cli import import_, study, train
from draft.cli.spelling import RUNNING, spelt, spelt_error
from draft.errors import Location, Problem, ResolveError


@pytest.fixture
def training() -> Iterator[None]:
    token = RUNNING.set(train.main)
    yield
    RUNNING.reset(token)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("choose another `out`", "choose another --out"),
        ("omit `see_design`", "omit --see-design"),
        ("`values` a=1, or `origin=RUN`", "--set a=1, or --from RUN"),
        ('add `device="cpu"`, `envs=64`', "add --device cpu, --envs 64"),
        ("set `learning.mirror` to false", "set `learning.mirror` to false"),
        ("omit `checkpoint`, or `designs`", "omit `checkpoint`, or `designs`"),
        ("`draft.train` made it", "'draft train' made it"),
        ("`draft.evaluate(RUN)`", "'draft evaluate RUN'"),
        ('`draft.study.collect("a", out="DIR")`', "'draft study collect a --out DIR'"),
        (
            '`draft.train("my runs/a", iterations=300)` continues',
            "'draft train 'my runs/a' --iterations 300' continues",
        ),
        (
            '`draft.train(ROBOT, vary=["a=1:2", "b=3:4"], bodies=8, see_design=True)`',
            "'draft train ROBOT --vary a=1:2 b=3:4 --bodies 8 --see-design'",
        ),
        *((words, words) for words in ("`draft.compare_twin(FILE)`", "`draft.train((`")),
    ],
)
@pytest.mark.usefixtures("training")
def test_a_command_reads_its_options(text: str, words: str) -> None:
    assert spelt(text) == words


def test_python_reads_names_of_arguments() -> None:
    assert spelt("choose another `out`") == "choose another `out`"


def test_each_command_has_its_own_names() -> None:
    for function, words in ((import_.main, "--knee-drive"), (study.main, "`knee_drive`")):
        token = RUNNING.set(function)
        assert spelt("`knee_drive`") == words
        RUNNING.reset(token)


@pytest.mark.usefixtures("training")
def test_an_error_keeps_its_kind_and_its_places() -> None:
    problems = [Problem("`seed` is odd", Location("`vary`", 1, 5), "omit `seed`"), Problem("no")]
    error = spelt_error(ResolveError(problems))
    assert type(error) is ResolveError
    assert str(error) == "--vary:1:5: --seed is odd\n  omit --seed\nno"
