"""Shell completion for bash and zsh: commands, options, choices and shipped designs."""

from __future__ import annotations

import inspect
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, get_args, get_origin, get_type_hints

from draft.cli import COMMANDS, Function, functions
from draft.design.references import shipped_designs
from draft.errors import DraftError
from draft.files import write
from draft.settings import choices

SHELLS = ("bash", "zsh")
_TOP_OPTIONS = ("--help", "--version", "--install-completion")
# Metavars that stand for a design, a name of a design, or a robot.
_DESIGN, _DESIGN_NAME, _ROBOT = "DESIGN", "NAME|FILE", "ROBOT"


@dataclass(frozen=True)
class Values:
    """Completions of a value.

    Attributes:
        words: words that complete it.
        paths: option of bash's compgen for paths that complete it too: "-d" folders, "-f" all
            files, "" none.
    """

    words: tuple[str, ...]
    paths: str = ""


@dataclass(frozen=True)
class Entry:
    """Words that complete a command.

    Attributes:
        command: such as "build" or "study report".
        subcommands: names of its subcommands.
        options: all options.
        flags: options without a value.
        repeated: options that take several values.
        values: completions of an option's values, by option; "" for those of the arguments.
    """

    command: str
    subcommands: tuple[str, ...]
    options: tuple[str, ...]
    flags: tuple[str, ...]
    repeated: tuple[str, ...]
    values: dict[str, Values]


def install(arguments: Sequence[str]) -> int:
    """Write the completion script, and print how the shell loads it.

    Args:
        arguments: name of the shell; empty for the user's login shell.

    Raises:
        DraftError: the shell is not supported, or the script cannot be written.
    """
    shell = arguments[0] if arguments else os.path.basename(os.environ.get("SHELL", ""))
    if shell not in SHELLS or len(arguments) > 1:
        cause = f"there is no completion for the shell '{' '.join(arguments) or shell}'"
        remedy = f"run draft --install-completion {' or '.join(SHELLS)}"
        raise DraftError(cause, remedy)
    data = Path(os.environ.get("XDG_DATA_HOME") or Path.home() / ".local" / "share")
    path = data / "bash-completion" / "completions" / "draft"
    write(path, script())
    print(f"written to {path}")
    if shell == "bash":
        print("open a new shell to use it; without the package bash-completion, add to ~/.bashrc:")
        print(f"  source {path}")
    else:
        print("add to ~/.zshrc, and open a new shell:")
        print(
            f"  autoload -U +X compinit bashcompinit && compinit && bashcompinit && source {path}"
        )
    return 0


def entries() -> Iterator[Entry]:
    """Yield what completes each command and subcommand; imports all of them."""
    for command in COMMANDS:
        main, subcommands = functions(command)
        names = tuple(subcommands)
        yield _entry(command, main, names) if main else Entry(command, names, (), (), (), {})
        for name, function in subcommands.items():
            yield _entry(f"{command} {name}", function, ())


def _entry(command: str, function: Function, subcommands: tuple[str, ...]) -> Entry:
    flags, repeated, values = [], [], {}
    for name, (kind, metavar) in arguments(function).items():
        if kind is bool:
            flags.append(name)
            continue
        if get_origin(_without_none(kind)) is tuple:
            repeated.append(name)
        words = tuple(map(str, choices(kind)))
        values[name] = Values(words) if words else _designs(metavar)
    options = tuple(name for name in (*values, *flags) if name)
    return Entry(command, subcommands, options, tuple(flags), tuple(repeated), values)


def arguments(function: Function) -> dict[str, tuple[object, str]]:
    """Return type and metavar of each option of a command, as tyro names it; "" for arguments."""
    return {option: (kind, metavar) for _, option, kind, metavar in _arguments(function)}


def spellings(function: Function) -> dict[str, str]:
    """Return the option of each argument of a command's function."""
    return {name: option for name, option, *_ in _arguments(function) if option}


def _arguments(function: Function) -> Iterator[tuple[str, str, object, str]]:
    """Yield name, option, type and metavar of each argument; the option is "" without one."""
    hints = get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        kind, *markers = (
            get_args(hints[name]) if get_origin(hints[name]) is Annotated else [hints[name]]
        )
        # The markers of `tyro.conf.arg`; other markers have neither.
        given = next((text for m in markers if (text := getattr(m, "name", None))), name)
        metavar = next((text for m in markers if (text := getattr(m, "metavar", None))), "")
        positional = parameter.kind is parameter.POSITIONAL_ONLY
        yield name, "" if positional else f"--{given.replace('_', '-')}", kind, metavar


def _without_none(kind: object) -> object:
    """Return a type without None, if it allows None."""
    kinds = [one for one in get_args(kind) if one is not type(None)]
    return kinds[0] if len(kinds) == 1 and type(None) in get_args(kind) else kind


def _designs(metavar: str) -> Values:
    """Return the shipped names that complete a value, by its metavar."""
    robots = shipped_designs()
    designs = tuple(name for names in robots.values() for name in names)
    if _DESIGN in metavar.strip("[]. ").split("|"):
        return Values((*robots, *designs), "-d")
    if metavar == _DESIGN_NAME:
        return Values(designs, "-f")
    return Values(tuple(robots)) if metavar == _ROBOT else Values(())


def script() -> str:
    """Return the completion script; zsh reads it by bashcompinit."""
    found = list(entries())
    pairs = [entry.command for entry in found if " " in entry.command]
    words = [
        f'        "{entry.command} {option}")'
        f' words="{" ".join(values.words)}" paths={values.paths} ;;'
        for entry in found
        for option, values in entry.values.items()
        if values.words
    ]
    return _SCRIPT.format(
        commands=" ".join((*COMMANDS, *_TOP_OPTIONS)),
        shells=" ".join(SHELLS),
        pairs="|".join(f'"{pair}"' for pair in pairs),
        options="\n".join(
            f'        "{entry.command}") subcommands="{" ".join(entry.subcommands)}"'
            f' options="{" ".join((*entry.options, "--help"))}" flags="{" ".join(entry.flags)}"'
            f' repeated="{" ".join(entry.repeated)}" ;;'
            for entry in found
        ),
        words="\n".join(words),
        designs="\n".join(
            f'            {robot}) words="{" ".join(designs)}" ;;'
            for robot, designs in shipped_designs().items()
            if designs
        ),
        full=" ".join(
            f"{robot}:{design}"
            for robot, designs in shipped_designs().items()
            for design in designs
        ),
    )


_SCRIPT = """\
# Completion of draft for bash and zsh, written by 'draft --install-completion'.
_draft() {{
    local current="${{COMP_WORDS[COMP_CWORD]}}" previous="${{COMP_WORDS[COMP_CWORD - 1]}}"
    local command="${{COMP_WORDS[1]}}" option="" words="" paths="" i
    local subcommands="" options="" flags="" repeated=""
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        COMPREPLY=($(compgen -W "{commands}" -- "$current"))
        return
    fi
    if ((COMP_CWORD > 2)); then
        case "$command ${{COMP_WORDS[2]}}" in
            {pairs}) command="$command ${{COMP_WORDS[2]}}" ;;
        esac
    fi
    case "$command" in
{options}
        --install-completion) words="{shells}" ;;
    esac
    # The option whose value is completed: the one before, or the last one if it takes several.
    for ((i = COMP_CWORD - 1; i > 1; i--)); do
        if [[ ${{COMP_WORDS[i]}} == --* ]]; then
            if [[ " $flags " != *" ${{COMP_WORDS[i]}} "* ]]; then
                if ((i == COMP_CWORD - 1)) || [[ " $repeated " == *" ${{COMP_WORDS[i]}} "* ]]; then
                    option="${{COMP_WORDS[i]}}"
                fi
            fi
            break
        fi
    done
    case "$command $option" in
{words}
    esac
    if [[ $current == -* ]]; then
        words="$options"
    elif [[ $current == : || $previous == : ]]; then
        # SPEC:DESIGN; bash splits words at colons, and zsh does not.
        i=$((COMP_CWORD - 1))
        if [[ $current == : ]]; then current=""; else i=$((COMP_CWORD - 2)); fi
        words="" paths=-f
        case "${{COMP_WORDS[i]}}" in
{designs}
        esac
    elif [[ $current == ?*:* ]]; then
        words="{full}"
    elif [[ -n $subcommands && $COMP_CWORD == 2 ]]; then
        words="$subcommands" paths=-f
    fi
    local IFS=$'\\n'
    words="${{words// /$'\\n'}}"
    COMPREPLY=($(compgen -W "$words" -- "$current"))
    if [[ -n $paths && $current != -* ]]; then
        COMPREPLY+=($(compgen $paths -- "$current"))
    fi
}}
# Without a completion of its own, bash completes files.
complete -o default -o filenames -F _draft draft
"""
