"""Options of a training and an evaluation: added by a field, and checked alike everywhere."""

from __future__ import annotations

from typing import Any

import pytest

import draft
from draft.cli import main
from draft.errors import DraftError
from draft.study.requests import TrainRequest, from_dict, to_dict
from tests.changed_package import ChangedPackage
from tests.study.small import TEXT, jobs, study

# Of the task, which all trainings of a study share; of a call; and of an evaluation.
SHARED = '''
    rocks: Annotated[int | None, Field(ge=1, le=9), Shown("N", "none")] = None
    """Number of rocks on the ground."""
'''
OF_A_CALL = '''
    echo: Annotated[float | None, Field(gt=0), Shown("S", "none")] = None
    """Time between two lines of progress [s]."""
'''
OF_AN_EVALUATION = '''
    slope: Annotated[float, Field(ge=0, le=30), Shown("ANGLE", "flat", unit="deg")] = 0.0
    """Slope of the ground [deg]."""
'''
PROGRAM = """
import contextlib, inspect, io, json, sys
from pathlib import Path
import draft
from draft.cli import main
from draft.cli.completion import entries
from draft.errors import DraftError
from draft.learn.measuring.evaluation import prepare
from draft.learn.measuring.evaluation_options import Options
from draft.learn.measuring.summary import Summary
from draft.learn.training.run import create
from draft.study.requests import from_dict, to_dict
from tests.learn.small import plan
from tests.study.small import TEXT, jobs, study

folder = Path(sys.argv[1])


def refused(call):
    try:
        call()
    except DraftError as error:
        return str(error)


def told(command):
    with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as out:
        main([command, "--help"])
    function = getattr(draft, command)
    return {
        "help": " ".join(out.getvalue().split()),
        "completed": {one.command: one for one in entries()}[command].options,
        "parameters": {
            name: [one.annotation, one.default]
            for name, one in inspect.signature(function).parameters.items()
        },
        "doc": inspect.getdoc(function),
    }


with contextlib.redirect_stderr(io.StringIO()) as err:
    main(["train", "bear", "--rocks", "10"])
request = to_dict(jobs()["bear-base-0"].request(folder, "cpu", None))
train = told("train") | {
    "file": study(TEXT + "rocks: 3\\n").trainings.rocks,
    "worker": from_dict(request | {"echo": 5.0}).echo,
    "errors": [
        refused(lambda: study(TEXT + "rocks: 10\\n")),
        refused(lambda: draft.train("bear", rocks=10)),
        err.getvalue(),
    ],
}
run = create(folder / "run", plan(), {})
(run.folder / "model_1.pt").write_bytes(b"weights")
asked, job = prepare(run, Options(test=["walk"], slope=5.0)), jobs()["bear-base-0-nominal"]
request = to_dict(job.request(folder, "cpu", None))
evaluate = told("evaluate") | {
    "refused": refused(lambda: draft.evaluate("quadruped", slope=31.0)),
    "result": [asked.folder.parent.name, asked.request.as_dict()["slope"]],
    "summary": "slope" in Summary.model_fields,
    "key": job.key,
    "unasked": "slope" in request,
    "worker": from_dict(request | {"slope": 5.0}).slope,
}
print(json.dumps({"train": train, "evaluate": evaluate}, default=str))
"""


@pytest.fixture(scope="module")
def added(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """What a process finds whose Draft has three more options."""
    folder = tmp_path_factory.mktemp("added")
    inserted = {
        "learn/training/options.py": {
            "\n\nclass SliceOptions(": SHARED,
            "\n    def total(": OF_A_CALL,
        },
        # What follows `Extras`.
        "learn/measuring/evaluation_options.py": {"\n\nclass OnDevice(": OF_AN_EVALUATION},
    }
    return ChangedPackage(folder, inserted).run("-c", PROGRAM, str(folder))


def test_an_option_of_a_training_is_added_by_its_field(added: Any) -> None:
    told = added["train"]
    # The command, its completion, and Python.
    assert "--rocks N Number of rocks on the ground. (default: none)" in told["help"]
    assert "--echo S Time between two lines of progress [s]. (default: none)" in told["help"]
    assert {"--rocks", "--echo"} <= {*told["completed"]}
    assert {"rocks", "echo"} <= {*told["parameters"]}
    assert "\n    rocks: number of rocks on the ground; by default none.\n" in told["doc"]
    # The file of a study, and a job of its workers.
    assert (told["file"], told["worker"]) == (3, 5.0)
    expected = "a whole number from 1 to 9"
    assert told["errors"] == [
        f"small.yaml:7:8: rocks: expected {expected}, found 10",
        f"`rocks` 10 is not {expected}\n  omit it for none",
        f"error: --rocks 10 is not {expected}\n  omit it for none\n",
    ]


def test_an_option_is_added_by_its_field(added: Any) -> None:
    told = added["evaluate"]
    # The command, its completion, and Python.
    assert "--slope ANGLE Slope of the ground [deg]. (default: flat)" in told["help"]
    assert "--slope" in told["completed"]
    assert told["parameters"]["slope"] == ["float", 0.0]
    assert "\n    slope: slope of the ground [deg]; by default flat.\n" in told["doc"]
    assert told["refused"] == "`slope` 31 is not a number from 0 to 30 deg\n  omit it for flat"
    # The result, and the jobs of a study and their workers; keys of jobs are as they were.
    assert told["result"] == ["evaluation-slope-5deg", 5.0]
    assert told["summary"]
    assert told["key"] == jobs()["bear-base-0-nominal"].key
    assert (told["unasked"], told["worker"]) == (False, 5.0)


@pytest.mark.parametrize(
    ("option", "value", "key", "stated", "expected"),
    [
        ("envs", 0, "environments", "0", "a whole number from 1 to 1000000"),
        ("iterations", 0, "iterations", "{base: 0}", "a whole number from 1 to 10000000"),
        ("seed", -1, "seeds", "[0, -1]", "a whole number from 0 to 2147483647"),
    ],
)
def test_an_invalid_value_is_refused_alike_wherever_it_is_stated(
    option: str,
    value: int,
    key: str,
    stated: str,
    expected: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["train", "bear", f"--{option}", str(value)]) == 2
    assert f"error: --{option} {value} is not {expected}\n" in capsys.readouterr().err
    with pytest.raises(DraftError, match=f"^`{option}` {value} is not {expected}\n"):
        draft.train("bear", **{option: value})  # pyright: ignore[reportArgumentType]
    lines = [one for one in TEXT.splitlines() if not one.startswith(f"{key}:")]
    with pytest.raises(DraftError, match=rf"^small\.yaml:6:\d+: .*: expected {expected}, found"):
        study("\n".join([*lines, f"{key}: {stated}"]) + "\n")
    if option == "iterations":  # And by a worker of a study.
        with pytest.raises(DraftError, match=f"^`{option}` {value} is not {expected}\n"):
            from_dict(to_dict(TrainRequest(run="a")) | {option: value})
