"""Validation errors of pydantic as problems with a place in the file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import pydantic
from pydantic_core import ErrorDetails

from draft.errors import Location, Problem, suggest
from draft.spec.primitives import LINKS
from draft.spec.reader import Path_, Source

MAX_PROBLEMS = 12
NAME_RULE = "a name has letters, digits and _, no digit first, and at most 64 of them"
# Types of the root of a tree.
ROOTS = ("root", "fixed")
_RANGE = ("joint", "range")
ONLY_WHEELS = (
    "; only the joint of a link of 'type: wheel', and one that 'follows' another, have none"
)
_KEY = "[key]"  # pydantic's last step where a mapping's key is wrong, not its value
_MAPPING = "expected a mapping of keys and values"


def translate(error: pydantic.ValidationError, source: Source) -> list[Problem]:
    """Problems of a validation error, the first few of them."""
    found = [problem for item in error.errors() for problem in _problems(item, source)]
    shown = list(dict.fromkeys(found))
    rest = len(shown) - MAX_PROBLEMS
    if rest > 0:
        return [*shown[:MAX_PROBLEMS], Problem(f"and {rest} more", Location(source.file))]
    return shown


def first_few(problems: Iterable[Problem]) -> list[Problem]:
    """First few of many problems, each once; the others are not generated."""
    shown: dict[Problem, None] = {}
    for problem in problems:
        if len(shown) == MAX_PROBLEMS and problem not in shown:
            return [*shown, Problem("and more", None, "correct these first")]
        shown[problem] = None
    return [*shown]


def _problems(item: ErrorDetails, source: Source) -> Iterator[Problem]:
    """Problems of one error of pydantic."""
    path = _path(item["loc"], source.data)
    what, context = _dotted(path), item.get("ctx", {})
    if item["type"] == "unknown_keys":
        for key in context["unknown"]:
            remedy = context["absent"].get(key) or suggest(key, context["known"], "known here")
            for type_, link in LINKS.items():
                if link.end is not None and link.end.key == key:
                    remedy = f"only a link of 'type: {type_}' has it; {remedy}"
            where = source.at((*path, key), key=True)
            yield Problem(f"unknown key '{key}' in {what}", where, remedy)
        return
    if item["type"] == "missing":
        name = item["loc"][-1]
        remedy = f"add '{name}: ...'" + (ONLY_WHEELS if (*path[-1:], name) == _RANGE else "")
        yield Problem(f"'{name}' is missing in {what}", source.at(path), remedy)
        return
    cause, remedy = _cause_and_remedy(item["type"], item["msg"], item["input"], context)
    if item["type"] in ("link_type", "root_type"):
        path = (*path, "type")
        what = _dotted(path)
    yield Problem(f"{what}: {cause}", source.at(path, key=item["loc"][-1:] == (_KEY,)), remedy)


def _cause_and_remedy(
    kind: str, message: str, value: object, context: Mapping[str, Any]
) -> tuple[str, str]:
    """Cause and remedy of a value of the wrong type."""
    found = f"found {_shown(value)}"
    match kind:
        case "model_type" | "dict_type":
            return f"{_MAPPING}, {found}", "write 'key: value', one per line"
        case "list_type":
            return f"expected a list, {found}", "write [a, b, ...], or one '- ...' per line"
        case "string_type":
            return f"expected text, {found}", ""
        case "too_short":
            return f"expected at least {_entries(context['min_length'])}, {found}", ""
        case "too_long":
            return f"expected at most {_entries(context['max_length'])}, {found}", _quoted(value)
        case "string_too_short":
            return "expected a sentence, found nothing", ""
        case "string_too_long":
            limit = f"the limit is {context['max_length']}"
            return f"text of {len(str(value))} characters", limit
        case "string_pattern_mismatch":
            return f"{_shown(value)} is not a name", NAME_RULE
        case "literal_error":
            choices = re.findall(r"'([^']*)'", context["expected"])
            return f"unknown value {_shown(value)}", suggest(str(value), choices, "choose from")
        case "broken_rule":
            return context["cause"], context["remedy"]
        case "link_type" | "root_type":
            type_ = value["type"] if isinstance(value, dict) else value
            remedy = suggest(str(type_), ROOTS if kind == "root_type" else LINKS, "choose from")
            if kind == "link_type" and type_ in ROOTS:
                remedy = (
                    "only the root of the tree is of it; a link without 'joint' is fixed to its "
                    f"parent; {remedy}"
                )
            return f"unknown value {_shown(type_)}", remedy
    return f"{message}, {found}", ""


def _quoted(value: object) -> str:
    """Remedy where YAML has split an expression at its comma: the expression in quotes."""
    if not isinstance(value, list):
        return ""
    joined = ""
    for entry in value:
        joined = f"{joined}, {entry}" if joined else str(entry)
        if joined.count("(") <= joined.count(")"):
            if ", " in joined:
                return f'quote an expression with a comma inside [ ]: "{joined}"'
            joined = ""
    return ""


def _path(loc: tuple[int | str, ...], data: object) -> Path_:
    """Path in the data of a location of pydantic, without the tags of unions."""
    path: Path_ = ()
    here: Any = data
    for step in loc:
        if isinstance(here, list):
            here = dict(enumerate(here))
        if isinstance(here, dict) and step in here:
            here = here[step]
            path = (*path, step)
    return path


def _dotted(path: Path_) -> str:
    """Path in dotted form: `chains.leg[1].joint`."""
    steps = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path)
    return steps.removeprefix(".") or "the file"


def _entries(count: int) -> str:
    return "1 entry" if count == 1 else f"{count} entries"


def _shown(value: object) -> str:
    match value:
        case dict():
            return "a mapping"
        case list():
            return f"a list of {len(value)}"
        case None:
            return "nothing"
        case bool():
            return str(value).lower()
    text = repr(value) if isinstance(value, str) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
