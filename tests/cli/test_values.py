"""What is said of words that are no value of an option."""

from __future__ import annotations

import pytest

from tests.commands import Command

SCREEN = "screen bear --vary thigh_length=0.2:0.3 --out s --n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("show quadruped --payload ten", "--payload: expected a number, not 'ten'"),
        ("show quadruped --payload None", "--payload: expected a number, not 'None'"),
        ("play cheetah --kick hard", "--kick: expected a number, not 'hard'"),
        ("play cheetah --command a b c", "--command: expected a number, not 'a'"),
        ("play cheetah --command 1 2", "'--command'. Expected 3 values."),
        ("train cheetah --iterations 1.5", "--iterations: expected a whole number, not '1.5'"),
        *(
            (f"{SCREEN} {n}", f"--n: expected a whole number, not '{n}'")
            for n in ("1.5", "many", "inf", "nan")
        ),
        *(
            (f"{word} --skill fly", "Expected one of ('walk', 'run', 'climb', 'push', 'machine').")
            for word in ("play cheetah", "deploy cheetah --out x")
        ),
        ("import x.urdf --population None", "Expected one of ('humanoid', 'quadruped')."),
        (
            "export bear --format dxf",
            "Expected one of ('urdf', 'sdf', 'glb', 'mjcf', 'step', 'usd', 'mjlab', 'isaaclab').",
        ),
        (
            "learn show --recipe lapto",
            "Expected one of ('paper', 'laptop', 'tune', 'any', 'machine').",
        ),
        ("evaluate r --errors papr", "Expected one of ('twins', 'survey', 'paper')."),
    ],
)
def test_a_word_that_is_no_value_is_named_with_what_was_expected(
    words: str, said: str, command: Command
) -> None:
    told = " ".join(command.refuses(words).replace("│", " ").split())
    assert said in told
    assert "None" not in told.replace("'None'", "")
