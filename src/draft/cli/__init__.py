"""The command line: `draft COMMAND ...`. One thin module per command, imported when it is used.

The module of a command has the function `main`, or a function for each of its subcommands in
`SUBCOMMANDS`, or both. tyro turns the arguments of a function into arguments and options, and its
docstring into the help.
"""

from __future__ import annotations

import errno
import importlib
import keyword
import os
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence

from draft.errors import DraftError, RefusedError, suggest

Function = Callable[..., int]

ACCEPTED, REFUSED, BAD_INPUT, FAULT, INTERRUPTED = 0, 1, 2, 70, 130

COMMANDS = {
    "build": "Compile a robot to a checked MuJoCo model and write its folder.",
    "export": "Write a robot as URDF with an actuator table, as glTF, and as MJCF.",
    "check": "Check whether a robot can be built: exit 0 accepted, 1 refused, 2 bad input.",
    "show": "Show the tree, masses, actuators and findings of a robot.",
    "metrics": "Show what a design can do without learning: torque margins, jump, impact and more.",
    "report": "Write one HTML page about a few designs, which opens offline.",
    "page": "Write a web page in which robots walk under live physics, for any static host.",
    "view": "Show a robot in MuJoCo's viewer, or in the browser with --web.",
    "studio": "Design a robot in the browser: sliders, masses, trends, findings.",
    "list": "List the shipped robots and their designs.",
    "new": "Start a robot of your own from a shipped one.",
    "import": "Turn a robot's URDF or MJCF into a spec of your own.",
    "twin": "Compare a real robot with Draft's prediction of it.",
    "sensitivity": "Show what a change of each number of a design does to its metrics.",
    "solve": "Find the nearest design that meets conditions, and why each number moved.",
    "compare": "Show designs side by side, which number makes what difference, and what limits.",
    "screen": "Screen very many designs by closed-form metrics and the filter, into one file.",
    "sweep": "Build very many designs and measure their models, into a folder of parts.",
    "optimise": "Search for the best designs with Optuna, and save them as named designs.",
    "train": "Train a legged robot to walk on mjlab, in slices of time if need be.",
    "study": "Train and evaluate designs x seeds x stages, with a report; it can be resumed.",
    "evaluate": "Measure what trained policies can do: speed, stairs, pushes, efficiency.",
    "surface": "Measure what bodies over a plane of two numbers can do with a trained policy.",
    "learn": "Show every number of the learning tasks, with its source.",
    "play": "Show what a policy can do: as a video, in the browser, or as an ONNX file.",
    "deploy": "Write the controller of a policy for a real robot, in plain C++ and Python.",
    "trends": "Fit, show, check and draw the actuator trends.",
    "survey": "Read public robot descriptions and fit the structure trends.",
    "schema": "Print or write the JSON Schemas of the files.",
    "mcp": "Let an assistant design robots below a folder, over the Model Context Protocol.",
    "doctor": "Describe the installation and the machine in a table for an issue.",
}

_USAGE = """\
usage: draft COMMAND [options]

Three short files in, a checked MuJoCo model out.

commands:
{commands}

options:
  -h, --help                    show this help; 'draft COMMAND --help' shows a command's
  --version                     show the version
  --install-completion [SHELL]  complete commands, options and designs in bash or zsh

examples:
  draft build bear
  draft show quadruped --set thigh_length=0.3 actuators.leg.peak_torque=90
  draft new my_robot --like hopper

exit codes:
  0 done, 1 refused by the design filter, 2 bad input, 70 a fault of Draft, 130 interrupted
"""
_FORMAT_WARNING = warnings.formatwarning
_RENDERERS = "unset MUJOCO_GL; 'draft doctor' lists the renderers that draw here"


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
        from draft.extras import own_version

        print(f"draft {own_version()}")
        return ACCEPTED
    before, warnings.formatwarning = warnings.formatwarning, _warning
    try:
        _check_current_folder()
        return _run(args)
    except RefusedError as error:
        _fail(f"refused\n{_indented(str(error))}")
        return REFUSED
    except DraftError as error:
        return _fail(str(error))
    except KeyboardInterrupt as interrupt:
        print(": ".join(["interrupted", *map(str, interrupt.args)]), file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output has gone; the interpreter's own flush must not fail on it.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return ACCEPTED
    except OSError as error:
        if error.errno == errno.ENOSPC:
            return _fail("there is no space left to write the output")
        return _fault(error)
    except Exception as error:
        renderer = os.environ.get("MUJOCO_GL")
        if renderer and _is_from_mujoco_itself(error):
            cause = f"MuJoCo cannot load the renderer of MUJOCO_GL={renderer}"
            return _fail(f"{cause}\n  {_RENDERERS}")
        return _fault(error)
    finally:
        warnings.formatwarning = before


def _check_current_folder() -> None:
    """Refuse a current folder that was deleted: no relative path can be read or written there.

    Raises:
        DraftError: it was.
    """
    try:
        os.getcwd()
    except FileNotFoundError:
        cause, remedy = "the current folder was deleted", "change to another one: cd ~"
        raise DraftError(cause, remedy) from None


def _is_from_mujoco_itself(error: Exception) -> bool:
    """Return whether an error ended the import of MuJoCo, which loads its renderer then."""
    trace, importing = error.__traceback__, False
    while trace is not None:
        module = trace.tb_frame.f_globals.get("__name__")
        importing |= module == "mujoco" and trace.tb_frame.f_code.co_name == "<module>"
        trace = trace.tb_next
    return importing


def _run(words: list[str]) -> int:
    command, *arguments = words
    if command == "--install-completion":
        from draft.cli.completion import install

        return install(arguments)
    if command not in COMMANDS:
        remedy = suggest(command, COMMANDS, "commands")
        raise DraftError(f"there is no command '{command}'", remedy)
    main_, subcommands = functions(command)
    chosen = arguments[0] if arguments else ""
    if chosen in subcommands:
        return _call(subcommands[chosen], f"{command} {chosen}", None, arguments[1:])
    if main_ is None:
        return _choose_subcommand(command, chosen, subcommands)
    return _call(main_, command, _description(COMMANDS[command], subcommands), arguments)


def _call(function: Function, name: str, description: str | None, arguments: list[str]) -> int:
    """Call the function of a command with the arguments that tyro reads."""
    import tyro

    from draft.cli.spelling import RUNNING, spelt_error
    from draft.cli.values import registry

    _check_options(function, name, arguments)
    running = RUNNING.set(function)
    try:
        return tyro.cli(
            function,
            prog=f"draft {name}",
            description=description,
            args=arguments,
            config=(tyro.conf.FlagCreatePairsOff,),
            registry=registry,
        )
    except DraftError as error:
        raise spelt_error(error) from None
    finally:
        RUNNING.reset(running)


def _check_options(function: Function, name: str, given: Sequence[str]) -> None:
    """Refuse options that a command has not, with the nearest one: tyro names only close ones.

    Raises:
        DraftError: there is one.
    """
    from draft.cli.completion import arguments

    options = {option for option in arguments(function) if option} | {"--help"}
    for word in given:
        option = word.partition("=")[0].replace("_", "-")
        if not option.startswith("--") or option in options:
            continue
        if option == "--":
            return
        remedy = suggest(option, options, "options")
        shorter = max((one for one in options if option.startswith(one)), key=len, default="")
        if shorter and not remedy.startswith("did you mean"):
            remedy = f"did you mean '{shorter}'? {remedy}"
        raise DraftError(f"'draft {name}' has no option '{option}'", remedy)


def functions(command: str) -> tuple[Function | None, Mapping[str, Function]]:
    """Import a command, and return its own function, if it has one, and its subcommands'."""
    # A command that is a keyword of Python, `import`, has its module under `import_`.
    name = f"{command}_" if keyword.iskeyword(command) else command
    module = importlib.import_module(f"draft.cli.{name}")
    return getattr(module, "main", None), getattr(module, "SUBCOMMANDS", {})


def _choose_subcommand(command: str, given: str, subcommands: Mapping[str, Function]) -> int:
    """Print the help of a command that has only subcommands, or what is wrong."""
    usage = f"usage: draft {command} {{{','.join(subcommands)}}} [options]"
    if given in ("-h", "--help"):
        print(f"{usage}\n\n{_description(COMMANDS[command], subcommands)}")
        return ACCEPTED
    cause = f"'draft {command}' has no subcommand '{given}'"
    if not given or given.startswith("-"):
        cause = f"'draft {command}' needs a subcommand"
    raise DraftError(cause, suggest(given, subcommands, "subcommands"))


def _description(text: str, subcommands: Mapping[str, Function]) -> str:
    """Return the description of a command, with the first lines of its subcommands' docstrings."""
    width = max(map(len, subcommands), default=0)
    lines = [
        f"  {name:<{width}}  {(function.__doc__ or '').splitlines()[0]}"
        for name, function in subcommands.items()
    ]
    return "\n".join([text, *(["", "subcommands:", *lines] if lines else [])])


def _usage() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:<{width}}  {text}" for name, text in COMMANDS.items()]
    return _USAGE.format(commands="\n".join(lines))


def _warning(
    message: Warning | str, category: type[Warning], file: str, number: int, line: str | None = None
) -> str:
    """Text of a warning: one line about extensions, and Python's about anything else."""
    from draft.extensions import ExtensionWarning

    if issubclass(category, ExtensionWarning):
        return f"warning: {message}\n"
    return _FORMAT_WARNING(message, category, file, number, line)


def _fail(message: str) -> int:
    print(f"error: {message}", file=sys.stderr)
    return BAD_INPUT


def _fault(error: Exception) -> int:
    """Report a fault of Draft itself or of an extension; DRAFT_TRACEBACK=1 adds its traceback."""
    if os.environ.get("DRAFT_TRACEBACK") == "1":
        import traceback

        traceback.print_exception(error)
    from draft.extensions import culprit, fault

    _fail(fault(error))
    return FAULT if culprit(error) is None else BAD_INPUT


def _indented(text: str) -> str:
    return "\n".join(f"  {line}" for line in text.splitlines())
