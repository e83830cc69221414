"""Learning from Python: what `draft.learn` offers by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from draft import learn
from draft.errors import DraftError
from draft.learn.measuring import evaluation
from draft.learn.measuring.summary import parse
from draft.study.requests import EvaluateRequest, TrainRequest
from tests.learn.small import plan
from tests.study.small import write_output


@pytest.fixture
def done(tmp_path: Path) -> Path:
    """A run of which two iterations are done, without learning anything."""
    folder = tmp_path / "cheetah-base-0"
    learn.begin(folder, plan(), {})
    write_output(TrainRequest(run=str(folder), iterations=2, device="cpu"))
    return folder


def test_every_name_is_there_and_no_other() -> None:
    assert all(callable(getattr(learn, name)) for name in learn.__all__)
    with pytest.raises(AttributeError, match=r"'draft\.learn' has no attribute 'teach'"):
        learn.teach  # noqa: B018


def test_a_run_that_is_done_is_not_trained(done: Path) -> None:
    for run in (learn.open_run(done), done, str(done)):
        assert learn.train(run, iterations=2).done() == 2


def test_a_run_is_begun_once_and_a_later_stage_starts_from_the_one_beside_it(done: Path) -> None:
    assert learn.begin(done, plan(), {}).plan == plan()
    push = learn.begin(done.with_name("cheetah-push-0"), plan(stage="push"), {})
    assert push.plan.origin is not None
    assert (push.plan.origin.run, push.plan.origin.iteration) == (str(done), 2)
    alone = done.with_name("alone")
    assert learn.begin(alone, plan(stage="push"), {}, "scratch").plan.origin is None
    with pytest.raises(DraftError, match="holds a run with another plan: seed differ"):
        learn.begin(done, plan(seed=1), {})


def test_a_result_that_is_there_is_not_measured_again(
    done: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    options: dict[str, Any] = {"levels": 2, "replicas": 4, "seconds": 3.0, "errors": "paper"}
    write_output(EvaluateRequest(run=str(done), test=["walk"], **options))
    monkeypatch.setattr(evaluation, "setting", lambda *_: pytest.fail("it is measured"))
    found = learn.evaluate(learn.open_run(done), test=["walk"], **options)
    assert found.arm == "perturbed"
    file = done / "evaluation/perturbed-walking/summary.json"
    assert found == parse(file.read_text())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"errors": "papr"}, "`errors` 'papr' is not known\n  did you mean 'paper'?"),
        ({"protocol": "walk"}, "`protocol` 'walk' is not known\n  did you mean 'walking'?"),
        ({"test": ["swim"]}, "`test` 'swim' is not known"),
        ({"seconds": 0.1}, "`seconds` 0.1 is not a number from 0.5 to 3600 s"),
        ({"checkpoint": 5}, "has no checkpoint of iteration 5"),
    ],
)
def test_settings_that_cannot_be_evaluated_are_refused(
    done: Path, words: dict, message: str
) -> None:
    with pytest.raises(DraftError) as raised:
        learn.evaluate(learn.open_run(done), **words)
    assert message in str(raised.value)
