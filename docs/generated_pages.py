"""Pages of the site that follow from the code: commands, tables of names, laws, API and examples.

`write_all` writes them to docs/generated, which git ignores, whenever the site is built, so that
they cannot differ from the code.
"""

from __future__ import annotations

import ast
import contextlib
import inspect
import io
import json
import os
import types
from collections.abc import Callable, Iterator
from importlib.resources import files
from pathlib import Path

import draft
from draft.cli import COMMANDS, functions, main
from draft.metrics import LEARNED, METRICS
from draft.metrics.capabilities import CAPABILITIES

DOCS = Path(__file__).resolve().parent
OUT = DOCS / "generated"
EXAMPLES = DOCS.parent / "examples"
IMAGES = DOCS / "images" / "examples"
_WIDTH = "100"
_NEEDS = {
    "design": "the numbers of the design",
    "model": "a compiled model",
    "policy": "a policy that observes its design",
}
_BETTER = {"more": "more", "less": "less", "": ""}


def write_all() -> None:
    """Write all generated pages; a page whose text is unchanged is not touched."""
    pages = {name: page() for name, page in PAGES.items()}
    pages |= {f"examples/{path.stem}": example(path) for path in examples()}
    for name, text in pages.items():
        path = OUT / f"{name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
    for path in OUT.rglob("*.md"):
        if str(path.relative_to(OUT).with_suffix("").as_posix()) not in pages:
            path.unlink()


def commands() -> str:
    """Return the reference of the commands: their help, as the terminal prints it."""
    parts = [
        "# Commands\n\n`draft COMMAND --help` prints the same text. Exit codes: 0 done, 1 refused "
        "by the design filter, 2 bad input, 70 a fault of Draft, 130 interrupted.\n"
    ]
    for command, summary in COMMANDS.items():
        own, subcommands = functions(command)
        parts.append(f"\n## draft {command}\n\n{summary}\n")
        if own is not None:
            parts.append(_fenced(_help(command)))
        for name in subcommands:
            parts.append(f"\n### draft {command} {name}\n{_fenced(_help(command, name))}")
    return "".join(parts)


def metrics() -> str:
    """Return the reference of the metrics, from their registry."""
    parts = [
        "# Metrics\n\n`draft metrics DESIGN` prints all of them; conditions (`--where`), goals "
        "(`--minimise`) and `draft.metrics.of_design` take them by name. Those that need a model "
        "are computed from its joint-space inertia; those that need a policy are measured by "
        "roll-outs (`draft metrics DESIGN --learned`, `draft.metrics.of_policy`).\n"
    ]
    for metric in (*METRICS.values(), *LEARNED.values()):
        unit = {"1": "none", "bool": "yes or no"}.get(metric.unit, metric.unit)
        needs = _NEEDS[metric.needs]
        better = f"- better: {_BETTER[metric.better]}\n" if metric.better else ""
        parts.append(
            f"\n## {metric.name}\n\n{metric.doc}\n\n- unit: {unit}\n{better}- needs: {needs}\n"
            f"- formula: `{metric.formula}`\n- source: {metric.source}\n"
        )
    return "".join(parts)


def laws() -> str:
    """Return the reference of the laws, from the coefficient files."""
    data = files("draft.laws") / "data"
    actuators = json.loads((data / "actuator_trends.json").read_text(encoding="utf-8"))
    structure = json.loads((data / "structure_trends.json").read_text(encoding="utf-8"))
    parts = [
        "# Laws\n\nThe laws that predict what a spec leaves open, as the shipped coefficient files "
        "hold them. An error is a geometric mean fold, exp(mean |ln(predicted / published)|), of "
        "rows held out of the fit. [Actuator trends](../actuator-trends.md) and [structure trends]"
        "(../structure-trends.md) say how they were fitted.\n"
    ]
    for key, name in (("draft", "Actuators, `trends: draft`"), ("paper", "Actuators, `paper`")):
        parts.append(f"\n## {name}\n\n{_LAW_HEAD}")
        parts += [_law(law, record) for law, record in actuators[key]["laws"].items()]
    for population in ("quadruped", "humanoid"):
        record = structure[population]
        parts.append(f"\n## Structure of a {population}\n\n{_LAW_HEAD}")
        parts += [_law(law, found) for law, found in record["segments"].items()]
        whole = ("trunk", "calibrated", "other", "whole", "end")
        parts += [_law(law, record[law]) for law in whole if law in record]
    return "".join(parts)


def capabilities() -> str:
    """Return the reference of what a policy is measured by, from the table of capabilities."""
    head = "\n| name | quantity | unit | better | definition |\n|---|---|---|---|---|\n"
    parts = [
        "# Capabilities\n\nWhat a robot can do with a policy, from roll-outs of the standard tests "
        "([What can a policy do?](../learning.md#what-can-a-policy-do)). Reports, studies, "
        "`summary.json` and `draft.evaluate` use these names.\n",
        head,
    ]
    for name, one in CAPABILITIES.items():
        unit = "" if one.unit == "1" else one.unit
        parts.append(f"| `{name}` | {one.label} | {unit} | {one.better} | {one.text} |\n")
    return "".join(parts)


_LAW_HEAD = "| quantity | law | unit | rows | held-out error |\n|---|---|---|---|---|\n"


def _law(name: str, record: dict[str, object]) -> str:
    held_out = record.get("held_out")
    errors = held_out if isinstance(held_out, dict) else {}
    shown = ", ".join(f"{key} {value:.2f}" for key, value in errors.items())
    title = name.replace("_", " ")
    return f"| {title} | `{record['formula']}` | {record['unit']} | {record['n']} | {shown} |\n"


def api() -> str:
    """Return the reference of the public names of `draft`, for Sphinx's autodoc."""
    parts = [
        "# Python API\n\n`dir(draft)` lists these names; [Draft from Python](../python.md) is a "
        "tour of them.\n"
    ]
    for name in dir(draft):
        value = getattr(draft, name)
        if isinstance(value, types.ModuleType):
            # Aliases of types and the registry have no docstrings of their own.
            members = [one for one in value.__all__ if _is_ours(getattr(value, one))]
            # Names of `draft` have an entry of their own.
            members = [one for one in members if one not in dir(draft)]
            body = f".. automodule:: draft.{name}\n"
            for one in members:
                kind = "class" if inspect.isclass(getattr(value, one)) else "function"
                body += f"\n.. auto{kind}:: draft.{name}.{one}\n"
        elif inspect.isclass(value):
            body = f".. autoclass:: draft.{name}\n   :members:\n"
        else:
            body = f".. autofunction:: draft.{name}\n"
        parts.append(f"\n## {name}\n\n```{{eval-rst}}\n{body}```\n")
    return "".join(parts)


def _is_ours(value: object) -> bool:
    """Whether a value is a function or a class of Draft's."""
    documented = inspect.isfunction(value) or inspect.isclass(value)
    return documented and value.__module__.startswith("draft.")


def examples() -> list[Path]:
    """Return the example scripts, in order of their names."""
    return sorted(EXAMPLES.glob("*.py"))


def title(script: Path) -> str:
    """Return the first line of the docstring of a script, without its full stop."""
    doc = ast.get_docstring(ast.parse(script.read_text(encoding="utf-8"))) or script.stem
    return doc.splitlines()[0].rstrip(".")


def example(script: Path) -> str:
    """Return the page of an example: its title, picture and text."""
    picture = IMAGES / f"{script.stem}.png"
    shown = f"![{title(script)}](../../images/examples/{picture.name})\n\n"
    return (
        f"# {title(script)}\n\n{shown if picture.is_file() else ''}"
        f"    python examples/{script.name}\n\n"
        f"```{{literalinclude}} ../../../examples/{script.name}\n:language: python\n```\n"
    )


def example_index() -> str:
    """Return the list of the examples."""
    names = "\n".join(f"{path.stem}" for path in examples())
    return (
        "# Examples\n\nScripts of less than sixty lines, to copy from. Each prints its numbers; "
        "`--picture FILE` also draws what its page shows.\n\n"
        f"```{{toctree}}\n:maxdepth: 1\n\n{names}\n```\n"
    )


PAGES: dict[str, Callable[[], str]] = {
    "commands": commands,
    "metrics": metrics,
    "capabilities": capabilities,
    "laws": laws,
    "api": api,
    "examples/index": example_index,
}


def _fenced(text: str) -> str:
    return f"\n```text\n{text.strip()}\n```\n"


def _help(*command: str) -> str:
    """Return the help of a command as the terminal prints it, 100 columns wide."""
    out = io.StringIO()
    with _terminal(), contextlib.redirect_stdout(out), contextlib.suppress(SystemExit):
        main([*command, "--help"])
    return out.getvalue()


@contextlib.contextmanager
def _terminal() -> Iterator[None]:
    """Set the width of the terminal, and plain text, as long as it lasts."""
    before = {name: os.environ.get(name) for name in ("COLUMNS", "NO_COLOR")}
    os.environ |= {"COLUMNS": _WIDTH, "NO_COLOR": "1"}
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
