"""The command line: `draft COMMAND ...`. One thin module per command, imported when it is used."""

from __future__ import annotations

import errno
import importlib
import keyword
import os
import sys
from collections.abc import Sequence
from functools import partial

from draft.errors import DraftError, RefusedError, suggest

ACCEPTED, REFUSED, BAD_INPUT, FAULT, INTERRUPTED = 0, 1, 2, 70, 130

COMMANDS = {
    "build": "Compile a robot to a checked MuJoCo model and write its folder.",
    "export": "Write a robot as URDF with an actuator table, as glTF, as MJCF.",
    "check": "Say whether a robot could be built: exit 0 accepted, 1 refused, 2 bad input.",
    "show": "Show the tree, masses, actuators and findings of a robot.",
    "metrics": "Say what a design can do, without learning: torque margins, jump, impact and more.",
    "report": "Write one HTML page about a few designs, which opens offline.",
    "view": "Look at a robot in MuJoCo's viewer, or in the browser with --web.",
    "studio": "Design a robot in the browser: sliders, masses, trends, findings.",
    "list": "List the robots that come with Draft, and their designs.",
    "new": "Start a robot of your own from a shipped one.",
    "import": "Turn a robot's URDF or MJCF into a spec of your own.",
    "twin": "Compare a robot that exists with what Draft predicts of it.",
    "screen": "Screen very many designs by closed-form metrics and the filter, into one file.",
    "sweep": "Build very many designs and measure their models, into a folder of parts.",
    "optimise": "Search for the best designs with Optuna, and save them as named designs.",
    "train": "Teach a quadruped to walk on mjlab, in slices of time if need be.",
    "study": "Train and evaluate designs x seeds x stages, with a report; it can be resumed.",
    "evaluate": "Measure what trained policies can do: speed, stairs, pushes, efficiency.",
    "learn": "Show every number of the learning tasks, with its source.",
    "play": "Show what a policy can do: as a video, in the browser, or as an ONNX file.",
    "trends": "Fit, show, check and draw the actuator trends.",
    "survey": "Read public robot descriptions and fit the structure trends.",
    "schema": "Print or write the JSON Schemas of the files.",
}

_USAGE = """\
usage: draft COMMAND [options]

Three short files in, a checked MuJoCo model out.

commands:
{commands}

options:
  -h, --help  show this help; 'draft COMMAND --help' shows a command's
  --version   show the version

examples:
  draft build quadruped --design bear
  draft show quadruped --set thigh_length=0.3 actuators.leg.peak_torque=90
  draft new my_robot --like hopper

exit codes:
  0 done, 1 refused by the design filter, 2 bad input, 70 a fault of Draft, 130 interrupted
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command.

    Returns:
        The exit code: 0 done, 1 refused by the design filter, 2 bad input, 70 a fault of Draft,
        130 interrupted.
    """
    # Not list(...): once `draft list` has run, that name is the module of this package.
    args = [*(sys.argv[1:] if arguments is None else arguments)]
    if not args or args[0] in ("-h", "--help", "help"):
        print(_usage(), end="")
        return ACCEPTED
    if args[0] == "--version":
        from importlib.metadata import version

        print(f"draft {version('draft')}")
        return ACCEPTED
    command, *rest = args
    if command not in COMMANDS:
        return _fail(f"there is no command '{command}'\n  {suggest(command, COMMANDS, 'commands')}")
    try:
        return _run(command, rest)
    except RefusedError as error:
        _fail(f"refused\n{_indented(str(error))}")
        return REFUSED
    except DraftError as error:
        return _fail(str(error))
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # Whoever read our output has gone; let the interpreter's own flush find nothing to do.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ACCEPTED
    except OSError as error:
        if error.errno == errno.ENOSPC:
            return _fail("there is no space left to write the output")
        return _fault(error)
    except Exception as error:
        return _fault(error)


def _run(command: str, arguments: list[str]) -> int:
    import tyro

    # A command that is a word of Python, `import`, has its module under `import_`.
    name = f"{command}_" if keyword.iskeyword(command) else command
    module = importlib.import_module(f"draft.cli.{name}")
    # A module with subcommands of its own has an `app`, any other a `main`.
    run = module.app.cli if hasattr(module, "app") else partial(tyro.cli, module.main)
    return run(
        prog=f"draft {command}",
        description=COMMANDS[command],
        args=arguments,
        config=(tyro.conf.FlagCreatePairsOff,),
    )


def _usage() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {text}" for name, text in COMMANDS.items()]
    return _USAGE.format(commands="\n".join(lines))


def _fail(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return BAD_INPUT


def _fault(error: Exception) -> int:
    """Say that Draft itself is wrong; the traceback is for those who ask for it."""
    if os.environ.get("DRAFT_TRACEBACK") == "1":
        import traceback

        traceback.print_exception(error)
    print(
        f"error: this is a fault of Draft: {type(error).__name__}: {str(error)[:400]}\n"
        "  please report it to Draft's developers, with the command and the robot's files; "
        "DRAFT_TRACEBACK=1 shows where it happened",
        file=sys.stderr,
    )
    return FAULT


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())
