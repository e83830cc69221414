"""Ranges as words: `name=low:high`, `name=low:high:log` or `name=a,b,c`."""

from __future__ import annotations

import math
from collections.abc import Sequence

from draft.errors import DraftError

FORM = "write NAME=LOW:HIGH, NAME=LOW:HIGH:log or NAME=A,B,C, in plain numbers"


def ranges(words: Sequence[str]) -> dict[str, tuple[float | str, ...] | list[float]]:
    """Read ranges and lists of values from words; whether a robot has the names is not checked.

    Returns:
        By name: (low, high), (low, high, "log"), or a list of values.

    Raises:
        DraftError: a word has another form, or a name is given twice.
    """
    found: dict[str, tuple[float | str, ...] | list[float]] = {}
    for word in words:
        name, _, text = (part.strip() for part in word.partition("="))
        if not (name and text):
            raise DraftError(f"`vary` '{word}' gives no range", FORM)
        if name in found:
            raise DraftError(f"`vary` gives '{name}' twice", "give it once")
        check_number(name)
        found[name] = _range(word, text)
    return found


def check_number(name: str) -> None:
    """Refuse the name of a catalogue part.

    Raises:
        DraftError: it is one.
    """
    if name.endswith(".like"):
        cause = f"'{name}' is a catalogue part, not a number"
        raise DraftError(f"`vary`: {cause}", f"run once for each, with `values` {name}")


def _range(word: str, text: str) -> tuple[float | str, ...] | list[float]:
    if "," in text or ":" not in text:
        return [_number(word, part) for part in text.split(",")]
    low, high, *more = text.split(":")
    if more not in ([], ["log"]):
        raise DraftError(f"`vary` '{word}': '{':'.join(more)}' is not 'log'", FORM)
    return (_number(word, low), _number(word, high), *more)


def _number(word: str, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        cause = f"`vary` '{word}': '{text.strip()}' is not a number"
        raise DraftError(cause, FORM)
    return number
