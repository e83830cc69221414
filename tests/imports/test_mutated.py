"""Damaged descriptions end in one clear error or an import: no traceback, no reading elsewhere.

`DRAFT_MUTATED=2000 pytest tests/imports/test_mutated.py` tries more than the suite does.
"""

from __future__ import annotations

import io
import os
import random
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from draft.__main__ import main
from tests.imports.test_geometry_check import PLACED
from tests.imports.test_limbs import KINDS
from tests.imports.written import CUBE, quadruped

COUNT = int(os.environ.get("DRAFT_MUTATED", "200"))
SECONDS = 20.0  # CPU time of the slowest: a hang takes for ever.
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


def mutated(text: str, rng: random.Random) -> str:
    """A text with one to four faults."""
    for _ in range(rng.randint(1, 4)):
        text = rng.choice((_value, _value, _number, _attribute, _element, _drop, _cut, _move))(
            text, rng
        )
    return text


def _place(pattern: re.Pattern[str], text: str, rng: random.Random) -> re.Match[str] | None:
    found = list(pattern.finditer(text))
    return rng.choice(found) if found else None


def _value(text: str, rng: random.Random) -> str:
    place = _place(ATTRIBUTE, text, rng)
    if place is None:
        return text
    return text[: place.start(2)] + rng.choice(VALUES) + text[place.end(2) :]


def _number(text: str, rng: random.Random) -> str:
    place = _place(re.compile(r"(?<=[\" ])-?\d+\.?\d*(?=[\" ])"), text, rng)
    if place is None:
        return text
    value = float(place[0]) * rng.choice((-1, 0, 1e-6, 0.5, 2, 1000, 1e12))
    return text[: place.start()] + f"{value:g}" + text[place.end() :]


def _attribute(text: str, rng: random.Random) -> str:
    place = _place(ATTRIBUTE, text, rng)
    return text if place is None else text[: place.start()] + text[place.end() :]


def _element(text: str, rng: random.Random) -> str:
    place = _place(ELEMENT, text, rng)
    at = len(text) if place is None else place.end()
    return text[:at] + rng.choice(ELEMENTS) + text[at:]


def _drop(text: str, rng: random.Random) -> str:
    place = _place(ELEMENT, text, rng)
    return text if place is None else text[: place.start()] + text[place.end() :]


def _cut(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text) + 1)
    return text[:at] if rng.random() < 0.2 else text[:at] + text[at + rng.randint(1, 5) :]


def _move(text: str, rng: random.Random) -> str:
    one, other = _place(ELEMENT, text, rng), _place(ELEMENT, text, rng)
    if one is None or other is None:
        return text
    return text[: other.end()] + one[0] + text[other.end() :]


def originals() -> list[str]:
    """Sound descriptions of all kinds, one with a mesh."""
    robots = [text for text, *_ in KINDS.values()]
    return [quadruped(), quadruped(mesh="b.obj"), *PLACED.values(), *robots]


@contextmanager
def opened() -> Iterator[set[str]]:
    """Real paths of the files that are opened to be read."""
    found: set[str] = set()
    active = [True]

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if active and event == "open" and isinstance(arguments[0], (str, bytes, os.PathLike)):
            found.add(os.path.realpath(os.fsdecode(arguments[0])))

    sys.addaudithook(watch)  # It cannot be removed, so it is put to sleep.
    try:
        yield found
    finally:
        active.clear()


@pytest.mark.slow
def test_a_damaged_description_ends_in_an_error_or_an_import(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot = tmp_path / "robot"
    robot.mkdir()
    for name in ("secret.xml", "secret.stl"):
        (tmp_path / name).write_text("<mujoco/>")
    (robot / "b.obj").write_text(CUBE)
    monkeypatch.chdir(robot)
    main(["import", "nothing.urdf"])  # What is imported on first use is not the description's.
    rng = random.Random(1)
    texts = originals()
    codes: dict[int, int] = {}
    with opened() as read:
        for i in range(COUNT):
            text = mutated(rng.choice(texts), rng)
            Path("r.urdf").write_text(text, encoding="utf-8", errors="replace")
            out, err = io.StringIO(), io.StringIO()
            begun = time.process_time()
            with redirect_stdout(out), redirect_stderr(err):
                code = main(["import", "r.urdf", "--out", f"out{i}"])
            said = out.getvalue() + err.getvalue()
            assert code in (0, 2), (i, code, said, text)
            assert "Traceback" not in said, (i, said, text)
            assert (code == 0) == Path(f"out{i}").is_dir(), (i, said, text)
            assert code == 0 or err.getvalue().startswith("error: "), (i, said, text)
            assert "draft-import" not in said, (i, said, text)
            assert time.process_time() - begun < SECONDS, (i, text)
            codes[code] = codes.get(code, 0) + 1
    assert min(codes.get(0, 0), codes.get(2, 0)) > COUNT / 20, codes
    outside = [path for path in read if path.startswith(str(tmp_path)) and "/robot/" not in path]
    assert not outside
    assert not [path for path in read if path.startswith("/etc/")]
