"""Options of a training: one is added by its field alone, and is checked in one way everywhere."""

from __future__ import annotations

from pathlib import Path

import pytest

import draft
from draft.cli import main
from draft.errors import DraftError
from draft.study.requests import TrainRequest, from_dict, to_dict
from tests.changed_package import ChangedPackage
from tests.study.small import TEXT, study

# Of the task, which all trainings of a study share, and of a call.
SHARED = '''
    rocks: Annotated[int | None, Field(ge=1, le=9), Shown("N", "none")] = None
    """Number of rocks on the ground."""
'''
OF_A_CALL = '''
    echo: Annotated[float | None, Field(gt=0), Shown("S", "none")] = None
    """Time between two lines of progress [s]."""
'''
PROGRAM = """
import contextlib, inspect, io, json, sys
from pathlib import Path
import draft
from draft.cli import main
from draft.cli.completion import entries
from draft.errors import DraftError
from draft.study.requests import from_dict, to_dict
from tests.study.small import TEXT, jobs, study

told = {"errors": []}
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as out:
    main(["train", "--help"])
told["help"] = " ".join(out.getvalue().split())
told["completed"] = {one.command: one for one in entries()}["train"].options
told["signature"] = [*inspect.signature(draft.train).parameters]
told["doc"] = inspect.getdoc(draft.train)
told["file"] = study(TEXT + "rocks: 3\\n").trainings.rocks
request = to_dict(jobs()["bear-base-0"].request(Path(sys.argv[1]), "cpu", None))
told["worker"] = from_dict(request | {"echo": 5.0}).echo
for refused in (lambda: study(TEXT + "rocks: 10\\n"), lambda: draft.train("bear", rocks=10)):
    try:
        refused()
    except DraftError as error:
        told["errors"].append(str(error))
with contextlib.redirect_stderr(io.StringIO()) as out:
    main(["train", "bear", "--rocks", "10"])
told["errors"].append(out.getvalue())
print(json.dumps(told))
"""


def test_an_option_of_a_training_is_added_by_its_field(tmp_path: Path) -> None:
    inserted = {"\n\nclass SliceOptions(": SHARED, "\n    def total(": OF_A_CALL}
    changed = ChangedPackage(tmp_path, {"learn/training/options.py": inserted})
    told = changed.run("-c", PROGRAM, str(tmp_path))
    # The command, its completion, and Python.
    assert "--rocks N Number of rocks on the ground. (default: none)" in told["help"]
    assert "--echo S Time between two lines of progress [s]. (default: none)" in told["help"]
    assert {"--rocks", "--echo"} <= {*told["completed"]}
    assert {"rocks", "echo"} <= {*told["signature"]}
    assert "\n    rocks: number of rocks on the ground; by default none.\n" in told["doc"]
    # The file of a study, and a job of its workers.
    assert (told["file"], told["worker"]) == (3, 5.0)
    in_file, in_python, on_the_command_line = told["errors"]
    expected = "a whole number from 1 to 9"
    assert in_file == f"small.yaml:7:8: rocks: expected {expected}, found 10"
    assert in_python == f"`rocks` 10 is not {expected}\n  omit it for none"
    assert on_the_command_line == f"error: --rocks 10 is not {expected}\n  omit it for none\n"


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


def test_a_worker_refuses_invalid_options_as_the_command_does() -> None:
    bad = to_dict(TrainRequest(run="a")) | {"iterations": 0}
    with pytest.raises(DraftError, match="`iterations` 0 is not a whole number from 1 to 10000000"):
        from_dict(bad)
