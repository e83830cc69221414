"""Random faults in specs, expressions and descriptions, and what Draft must make of them.

A trial is one input with faults, drawn with a seed. The suite runs a few hundred of each kind
(tests/test_fuzz.py), `python scripts/fuzz.py` as many as wanted.
"""

from __future__ import annotations

import contextlib
import copy
import os
import random
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from draft.cli import main
from draft.errors import ResolveError, SpecError
from draft.spec.expressions import parse
from tests import written
from tests.imports.test_geometry_check import PLACED
from tests.imports.test_limbs import KINDS as ROBOTS
from tests.imports.written import CUBE, quadruped

SECONDS = 20.0  # CPU time of the slowest trial: a hang takes for ever
Place = tuple[str | int, ...]


@dataclass(frozen=True)
class Outcome:
    """What came of a trial.

    Attributes:
        code: exit code of the command; of an expression 0, or 2 if it is refused.
        fault: what Draft did wrong; "" for nothing.
    """

    code: int
    fault: str = ""


# --- specs -----------------------------------------------------------------------------------

FILES: dict[str, Any] = {
    "parameters.yaml": yaml.safe_load(written.PARAMETERS),
    "tree.yaml": yaml.safe_load(written.TREE),
    "root.yaml": yaml.safe_load(written.ROOT),
}
NUMBERS = (0, -1, 1e9, -1e300, 1e300, 1e-300, 100.0, 1e-9)
TEXTS = (
    *("", " ", "x", "-x", "é", "a b", "a" * 300, "null", "thigh", "trunk", "foot", "leg", "min"),
    *("thigh_length", "leg.radius", "-leg.length", "leg.mass ** 9", "1 / 0", "sqrt(-1)", "1e400"),
    *("9**9**9", "lambda: 1", "thigh_length == 0.3", "1e308 * thigh_length"),
    "1 / (thigh_length - 0.3)",
)
OTHERS = (None, True, [], {}, [0], [0, 0], [0, 0, 0], ["x"], {"x": 1})
# Pieces of text that are put into a file.
PIECES = (
    *("\x00", "\x07", "\t", "\ufeff", "\u202e", "\ud7ff", "\r", "&a ", "*a", "!!python/name:os "),
    *("%YAML 9", "---\n", "- ", ": ", "{", "]", "'", '"', "|\n", "? ", "#", "<<: ", "\n\n", "  "),
)


def places(data: Any, path: Place) -> Iterator[Place]:
    """Path of everything inside plain data, itself included."""
    yield path
    items = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data if isinstance(data, list) else ())
    )
    for key, value in items:
        yield from places(value, (*path, key))


PLACES = [path for file, data in FILES.items() for path in places(data, (file,))]


def content(place: Place) -> Any:
    """What the sound robot has at a place."""
    here: Any = FILES
    for step in place:
        here = here[step]
    return here


AMOUNTS = [
    place
    for place in PLACES
    if isinstance(content(place), (int, float)) or "_length" in str(place[-1:])
]
FACTORS = (-1, 0, 0.01, 0.5, 0.9, 1.1, 2, 3, 10, 1000, 1e-6, 1e12)


def spoiled(place: Place, value: Any) -> dict[str, Any]:
    """The sound robot with another value at one place."""
    data: Any = copy.deepcopy(FILES)
    here = data
    for step in place[:-1]:
        here = here[step]
    here[place[-1]] = value
    return data


def texts(data: dict[str, Any]) -> dict[str, str]:
    """Texts of files with this content."""
    return {
        file: yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        for file, content in data.items()
    }


def value(rng: random.Random) -> Any:
    """A value that hardly fits anywhere."""
    kind = rng.randrange(4)
    if kind == 0:
        return rng.uniform(-10, 10)
    return rng.choice((NUMBERS, TEXTS, OTHERS)[kind - 1])


def spec(rng: random.Random) -> dict[str, str]:
    """Files of the sound robot with a value that is wrong, or with faults in their text."""
    if rng.random() < 0.3:
        place = rng.choice(AMOUNTS)
        return texts(spoiled(place, f"({content(place)}) * {rng.choice(FACTORS)}"))
    files = texts(spoiled(rng.choice(PLACES), value(rng)))
    if rng.random() < 0.3:
        files = texts(FILES)
        file = rng.choice([*files])
        for _ in range(rng.randint(1, 3)):
            files[file] = _broken(files[file], rng)
    return files


def _broken(text: str, rng: random.Random) -> str:
    """A text with a piece put in, cut out or moved."""
    at, other = rng.randrange(len(text) + 1), rng.randrange(len(text) + 1)
    length = rng.randint(1, 8)
    kind = rng.randrange(4)
    if kind == 0:
        return text[:at] + rng.choice(PIECES) + text[at:]
    if kind == 1:
        return text[:at] + text[at + length :]
    if kind == 2:
        return text[:at] + text[other : other + 10 * length] + text[at:]
    return text[:at] if rng.random() < 0.1 else text[:at] + str(value(rng)) + text[at:]


def try_spec(rng: random.Random) -> Outcome:
    """Check or build a robot with faults in the current folder."""
    Path("robot").mkdir()
    for file, text in spec(rng).items():
        (Path("robot") / file).write_text(text, encoding="utf-8", errors="surrogatepass")
    words = rng.choice((["check"], ["check"], ["check"], ["build", "--out", "out"]))
    return _command([words[0], "robot", *words[1:]], Path("out"))


def _command(words: list[str], folder: Path) -> Outcome:
    """Run a command that may write a folder."""
    out, err = StringIO(), StringIO()
    begun = time.process_time()
    with redirect_stdout(out), redirect_stderr(err):
        code = main(words)
    said = out.getvalue() + err.getvalue()
    fault = ""
    if code not in (0, 1, 2):
        fault = f"the exit code is {code}"
    elif "Traceback" in said or "bug in Draft" in said:
        fault = "Draft blames itself"
    elif code == 2 and not err.getvalue().startswith("error: "):
        fault = "nothing says what is wrong"
    elif code != 2 and words[0] == "check" and not out.getvalue().strip():
        fault = "there is no verdict"
    elif code and folder.exists():
        fault = "a folder was left behind"
    elif time.process_time() - begun > SECONDS:
        fault = f"it took more than {SECONDS:g} s"
    return Outcome(code, fault and f"{fault}:\n{said}")


# --- expressions -----------------------------------------------------------------------------

ATOMS = ("x", "y", "s", "0", "1", "2")
FORMS = (
    *("({0} + {1})", "({0} - {1})", "({0} * {1})", "({0} / {1})", "({0} % {1})", "sqrt({0})"),
    *("({0} if {1} else {2})", "where({0}, {1}, {2})", "({0} and {1})", "({0} or {1})"),
    *("({0} < {1} <= {2})", "(not {0})", "min({0}, {1})", "max({0}, {1})", "log({0})"),
    *("({0} ** {1})", "abs({0})", "clip({0}, {1}, {2})", "atan2({0}, {1})", "exp({0})"),
)


def expression(rng: random.Random, depth: int = 4) -> str:
    """An expression with divisions and roots that have no value for some numbers."""
    if depth == 0 or rng.random() < 0.2:
        return rng.choice(ATOMS)
    form = rng.choice(FORMS)
    return form.format(*(expression(rng, depth - 1) for _ in range(3)))


def try_expression(rng: random.Random) -> Outcome:
    """Compare an expression of a batch with the same expression of every design alone."""
    text = expression(rng)
    try:
        parsed = parse(text)
    except SpecError:
        return Outcome(2)
    arrays = {name: np.array([rng.randint(-2, 2) for _ in range(6)], float) for name in ("x", "y")}
    shared = {"s": float(rng.randint(-2, 2))}  # one number for all designs
    try:
        with np.errstate(all="ignore"):
            together = np.broadcast_to(np.asarray(parsed.value(arrays | shared), float), 6)
    except ResolveError:  # what all designs share has no value
        together = np.full(6, np.nan)
    for i, row in enumerate(together):
        own = {name: float(column[i]) for name, column in arrays.items()} | shared
        try:
            alone = parsed.value(own)
        except ResolveError:
            alone = np.nan
        if np.isfinite(alone) != np.isfinite(row) or (
            np.isfinite(row) and abs(row - alone) > 1e-9 * max(1.0, abs(alone))
        ):
            return Outcome(0, f"{text}\nwith {own} is {alone} alone and {row} in a batch")
    return Outcome(0)


# --- descriptions ----------------------------------------------------------------------------

TYPES = ("revolute", "continuous", "prismatic", "ball", "planar", "floating", "fixed", "free")
VALUES = (
    *("", "0", "-1", "1e-300", "1e300", "-1e9", "nan", "inf", "1e999", "0x10", "½", "a b c"),
    *("1 2", "0 0 0", "1 0 0", "true", "false", "auto", "../../../etc/passwd", "/etc/passwd"),
    *("package://../../x.stl", "base", "body", "FL_hip", "world", "x" * 300, "\u202e", "&#0;"),
    *TYPES,
)
ELEMENTS = (
    '<include file="../secret.xml"/>',
    '<include file="/etc/hostname"/>',
    '<joint name="x"/>',
    '<link name="body"/>',
    "<body/>",
    '<mesh filename="../../secret.stl"/>',
    "<default><default/></default>",
    '<compiler angle="gradian" eulerseq="abc" meshdir=".."/>',
    "<equality><connect/><weld body1='a'/><joint joint1='a' joint2='a'/></equality>",
    "<actuator><position joint='l_hip_pitch'/><general/></actuator>",
    '<!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
    "<frame><body/></frame>",
    "<replicate/>",
)
ATTRIBUTE = re.compile(r'(\w+)="([^"]*)"')
ELEMENT = re.compile(r"<[^<>]+>")
NUMBER = re.compile(r"(?<=[\" ])-?\d+\.?\d*(?=[\" ])")


def description(rng: random.Random) -> str:
    """A sound description of some kind of robot with one to four faults."""
    robots = [text for text, *_ in ROBOTS.values()]
    text = rng.choice([quadruped(), quadruped(mesh="b.obj"), *PLACED.values(), *robots])
    for _ in range(rng.randint(1, 4)):
        text = rng.choice((_value, _value, _number, _attribute, _element, _drop, _cut, _move))(
            text, rng
        )
    return text


def _found(pattern: re.Pattern[str], text: str, rng: random.Random) -> re.Match[str] | None:
    found = list(pattern.finditer(text))
    return rng.choice(found) if found else None


def _value(text: str, rng: random.Random) -> str:
    place = _found(ATTRIBUTE, text, rng)
    if place is None:
        return text
    return text[: place.start(2)] + rng.choice(VALUES) + text[place.end(2) :]


def _number(text: str, rng: random.Random) -> str:
    place = _found(NUMBER, text, rng)
    if place is None:
        return text
    scaled = float(place[0]) * rng.choice((-1, 0, 1e-6, 0.5, 2, 1000, 1e12))
    return text[: place.start()] + f"{scaled:g}" + text[place.end() :]


def _attribute(text: str, rng: random.Random) -> str:
    place = _found(ATTRIBUTE, text, rng)
    return text if place is None else text[: place.start()] + text[place.end() :]


def _element(text: str, rng: random.Random) -> str:
    place = _found(ELEMENT, text, rng)
    at = len(text) if place is None else place.end()
    return text[:at] + rng.choice(ELEMENTS) + text[at:]


def _drop(text: str, rng: random.Random) -> str:
    place = _found(ELEMENT, text, rng)
    return text if place is None else text[: place.start()] + text[place.end() :]


def _cut(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] if rng.random() < 0.2 else text[:at] + text[at + rng.randint(1, 5) :]


def _move(text: str, rng: random.Random) -> str:
    one, other = _found(ELEMENT, text, rng), _found(ELEMENT, text, rng)
    if one is None or other is None:
        return text
    return text[: other.end()] + one[0] + text[other.end() :]


def try_description(rng: random.Random) -> Outcome:
    """Import a description with faults; files outside its folder must not be read."""
    for name in ("secret.xml", "secret.stl"):
        Path(name).write_text("<mujoco/>", encoding="utf-8")
    above = os.path.realpath(".")
    Path("robot").mkdir()
    with contextlib.chdir("robot"):
        Path("b.obj").write_text(CUBE, encoding="utf-8")
        Path("r.urdf").write_text(description(rng), encoding="utf-8", errors="replace")
        with _opened() as read:
            outcome = _command(["import", "r.urdf", "--out", "out"], Path("out"))
        if outcome.fault:
            return outcome
        if outcome.code == 1 or (outcome.code == 0) != Path("out").is_dir():
            return Outcome(outcome.code, "the exit code does not tell whether it was imported")
        left = [path.name for path in Path().iterdir() if path.name.startswith(".")]
    strange = [
        path
        for path in sorted(read)
        if path in ("/etc/passwd", "/etc/hostname")
        or (path.startswith(above) and not path.startswith(os.path.join(above, "robot")))
    ]
    if strange or left:
        return Outcome(outcome.code, f"read elsewhere: {strange}; left behind: {left}")
    return outcome


@contextlib.contextmanager
def _opened() -> Iterator[set[str]]:
    """Real paths of the files that are opened meanwhile."""
    found: set[str] = set()
    if not _watchers:  # an audit hook cannot be removed
        sys.addaudithook(_watch)
    _watchers.append(found)
    try:
        yield found
    finally:
        _watchers[:] = [_nobody]


_nobody: set[str] = set()
_watchers: list[set[str]] = []


def _watch(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open" and _watchers and _watchers[-1] is not _nobody:
        path = arguments[0]
        if isinstance(path, (str, bytes, os.PathLike)):
            _watchers[-1].add(os.path.realpath(os.fsdecode(path)))


# --- trials ----------------------------------------------------------------------------------

TRIALS: dict[str, Callable[[random.Random], Outcome]] = {
    "spec": try_spec,
    "expression": try_expression,
    "description": try_description,
}


def run(kind: str, seed: int, folder: Path) -> Outcome:
    """Run one trial.

    Args:
        kind: "spec", "expression" or "description".
        seed: equal seeds give equal trials.
        folder: empty folder to work in.
    """
    with contextlib.chdir(folder):
        return TRIALS[kind](random.Random(f"{kind} {seed}"))
