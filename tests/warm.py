"""A warm process of an environment, in which commands and scripts run in forks of their own.

What every command imports first is imported once; what only some import is not, so that a package
that an environment lacks is missed as before. MuJoCo is not either: a command chooses its renderer
before it imports it.
"""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

_SERVER = """
import json, os, runpy, sys, traceback
import numpy, yaml, pydantic, rich.console, rich.table, tyro, typeguard
import draft.cli, draft.spec, draft.design
assert "mujoco" not in sys.modules


def do(asked):
    for number, name in enumerate((os.devnull, asked["out"], asked["err"])):
        how = os.O_WRONLY | os.O_CREAT if number else os.O_RDONLY
        os.dup2(os.open(name, how), number)
    os.chdir(asked["folder"])
    os.environ.clear()
    os.environ.update(asked["environment"])
    first, *rest = asked["words"]
    if first == "-m":
        sys.argv, sys.path[0] = [rest[0], *rest[1:]], os.getcwd()
        runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    else:
        sys.argv, sys.path[0] = [first, *rest], os.path.dirname(os.path.abspath(first))
        runpy.run_path(first, run_name="__main__")


for line in sys.stdin:
    child = os.fork()
    if not child:
        code = 0
        try:
            do(json.loads(line))
        except SystemExit as ended:
            if isinstance(ended.code, str):
                print(ended.code, file=sys.stderr)
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
        except BaseException:
            traceback.print_exc()
            code = 1
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Warm:
    """Python of an environment, already started."""

    def __init__(self, python: Path) -> None:
        """Start it.

        Args:
            python: the program.
        """
        self._folder = python.parent
        self._process = subprocess.Popen(
            [str(python), "-W", "ignore", "-c", _SERVER],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            encoding="utf-8",
        )
        atexit.register(self.close)

    def __call__(
        self, words: Sequence[str], folder: Path, environment: dict[str, str]
    ) -> subprocess.CompletedProcess[str]:
        """Run Python with arguments.

        Args:
            words: `-m MODULE` or a script, and its arguments.
            folder: current folder.
            environment: environment variables.
        """
        # Scripts that call `draft` find the one of this environment.
        path = os.pathsep.join([str(self._folder), environment.get("PATH", "")])
        environment = environment | {"PATH": path}
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None
        assert stdout is not None
        with tempfile.TemporaryDirectory() as kept:
            out, err = Path(kept) / "out", Path(kept) / "err"
            asked = {"words": list(words), "folder": str(folder), "environment": environment}
            print(json.dumps(asked | {"out": str(out), "err": str(err)}), file=stdin, flush=True)
            answer = stdout.readline()
            assert answer, "the process of the environment has ended"
            said = (one.read_text(encoding="utf-8") for one in (out, err))
            return subprocess.CompletedProcess(list(words), int(answer), *said)

    def close(self) -> None:
        """Let it end."""
        if self._process.poll() is None:
            for pipe in (self._process.stdin, self._process.stdout):
                if pipe is not None:
                    pipe.close()
            self._process.wait()
