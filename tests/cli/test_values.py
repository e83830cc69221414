"""What is said of words that are no value of an option."""

from __future__ import annotations

import pytest

from draft.cli import main


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("show quadruped --payload ten", "--payload: expected a number, not 'ten'"),
        ("show quadruped --payload None", "--payload: expected a number, not 'None'"),
        ("play cheetah --kick hard", "--kick: expected a number, not 'hard'"),
        ("train cheetah --iterations 1.5", "--iterations: expected a whole number, not '1.5'"),
        ("play cheetah --skill fly", "Expected one of ('walk', 'run', 'climb', 'push')."),
        ("import x.urdf --population None", "Expected one of ('humanoid', 'quadruped')."),
    ],
)
def test_a_word_that_is_no_value_is_named_with_what_was_expected(
    words: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as left:
        main(words.split())
    assert left.value.code == 2
    told = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert said in told
    assert "None" not in told.replace("'None'", "")
