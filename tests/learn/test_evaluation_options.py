"""Options of an evaluation: one is added by its field alone."""

from __future__ import annotations

from pathlib import Path

from tests.changed_package import ChangedPackage

OPTION = '''
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
from tests.study.small import jobs

told, folder = {}, Path(sys.argv[1])
with contextlib.suppress(SystemExit), contextlib.redirect_stdout(io.StringIO()) as out:
    main(["evaluate", "--help"])
told["help"] = " ".join(out.getvalue().split())
told["completed"] = "--slope" in {one.command: one for one in entries()}["evaluate"].options
parameter = inspect.signature(draft.evaluate).parameters["slope"]
told["signature"] = [parameter.annotation, parameter.default]
told["doc"] = inspect.getdoc(draft.evaluate)
try:
    draft.evaluate("quadruped", slope=31.0)
except DraftError as error:
    told["refused"] = str(error)
run = create(folder / "run", plan(), {})
(run.folder / "model_1.pt").write_bytes(b"weights")
asked = prepare(run, Options(test=["walk"], slope=5.0))
told["folder"], told["asked"] = asked.folder.parent.name, asked.request.as_dict()["slope"]
told["summary"] = "slope" in Summary.model_fields
job = jobs()["bear-base-0-nominal"]
told["key"] = job.key
request = to_dict(job.request(folder, "cpu", None))
told["unasked"] = "slope" in request
told["worker"] = from_dict(request | {"slope": 5.0}).slope
print(json.dumps(told))
"""


def test_an_option_is_added_by_its_field(tmp_path: Path) -> None:
    from tests.study.small import jobs

    # What follows `Extras`.
    inserted = {"learn/measuring/evaluation_options.py": {"\n\nclass RollOuts(": OPTION}}
    told = ChangedPackage(tmp_path, inserted).run("-c", PROGRAM, str(tmp_path))
    # The command, its completion, and Python.
    assert "--slope ANGLE Slope of the ground [deg]. (default: flat)" in told["help"]
    assert told["completed"]
    assert told["signature"] == ["float", 0.0]
    assert "\n    slope: slope of the ground [deg]; by default flat.\n" in told["doc"]
    assert told["refused"] == "`slope` 31 is not a number from 0 to 30 deg\n  omit it for flat"
    # The result, and the jobs of a study and their workers; keys of jobs are as they were.
    assert (told["folder"], told["asked"]) == ("evaluation-slope-5deg", 5.0)
    assert told["summary"]
    assert told["key"] == jobs()["bear-base-0-nominal"].key
    assert (told["unasked"], told["worker"]) == (False, 5.0)
