"""Controllers that `draft.deploy` wrote, in Python and compiled, behind one face."""

from __future__ import annotations

import functools
import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]
COMPILER = shutil.which("g++") or shutil.which("clang++")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="needs a compiler of C++17")


class Seen(NamedTuple):
    """What a robot measures and is asked, in the order of the arguments of `Controller.step`."""

    now: float
    time: float
    asked: float
    command: Sequence[float]
    velocity: Sequence[float]
    turning: Sequence[float]
    gravity: Sequence[float] | Array
    angle: Array
    speed: Array


class Given(NamedTuple):
    """What a step gives."""

    observation: Array
    action: Array
    output: Array  # Target angle, target speed, kp, kd and torque limit, shape (5, joints).


class Deployed(Protocol):
    """A controller in either language."""

    @property
    def stop(self) -> str: ...

    def start(self, now: float) -> None: ...
    def step(self, seen: Seen) -> Given: ...
    def torque(self, angle: Array, speed: Array, now: float) -> Array: ...
    def hold(self, angle: Array, share: float) -> Array: ...
    def network(self, observation: NDArray[np.float32]) -> Array: ...
    def gravity(self, quaternion: Array) -> Array: ...


@functools.cache
def module(folder: Path) -> Any:
    """The file `controller.py` of a folder as a module, which needs no Draft."""
    spec = importlib.util.spec_from_file_location(
        f"controller_{hash(folder)}", folder / "controller.py"
    )
    assert spec is not None
    assert spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made  # Its dataclasses look for it.
    spec.loader.exec_module(made)
    return made


class Python:
    """The controller in Python."""

    def __init__(self, folder: Path) -> None:
        self._module = module(folder)
        self.own = self._module.Controller()
        self._out: Any = None

    @property
    def stop(self) -> str:
        return self.own.stop

    def start(self, now: float) -> None:
        self.own.start(now)

    def step(self, seen: Seen) -> Given:
        measured = self._module.Sensors(
            *(seen.time, seen.turning, seen.gravity, seen.angle, seen.speed, seen.velocity)
        )
        command = self._module.Command(seen.asked, seen.command)
        self._out = self.own.step(measured, command, seen.now)
        return Given(self.own.observation, self.own.action, _stacked(self._out))

    def torque(self, angle: Array, speed: Array, now: float) -> Array:
        return self.own.torque(self._out, angle, speed, now)

    def hold(self, angle: Array, share: float) -> Array:
        self._out = self.own.hold(angle, share)
        return _stacked(self._out)

    def network(self, observation: NDArray[np.float32]) -> Array:
        return self.own.network(observation)

    def gravity(self, quaternion: Array) -> Array:
        return self._module.gravity(quaternion)


def _stacked(out: Any) -> Array:
    return np.array([out.angle, out.speed, out.stiffness, out.damping, out.torque_limit])


@functools.cache
def compiled(folder: Path) -> Path:
    """Program of `driver.cpp` with the header of a folder."""
    program = folder.parent / f"{folder.name}-driver"
    source = Path(__file__).with_name("driver.cpp")
    words = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{folder}"]
    done = subprocess.run(
        [str(COMPILER), *words, "-o", str(program), str(source)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return program


class Compiled:
    """The controller in C++, in a process of its own."""

    def __init__(self, folder: Path) -> None:
        self._process = subprocess.Popen(
            [str(compiled(folder))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.stop = ""
        self.names = self._ask("names").split()

    def close(self) -> None:
        self._process.communicate()

    def start(self, now: float) -> None:
        self._ask("start", [now])

    def step(self, seen: Seen) -> Given:
        found = self._numbers("step", np.concatenate([np.ravel(one) for one in seen]))
        joints = len(self.names)
        first = len(found) - 6 * joints
        action, *output = found[first:].reshape(6, joints)
        return Given(found[:first], action, np.array(output))

    def torque(self, angle: Array, speed: Array, now: float) -> Array:
        return self._numbers("torque", np.concatenate([[now], angle, speed]))

    def hold(self, angle: Array, share: float) -> Array:
        return self._numbers("hold", np.concatenate([[share], angle])).reshape(5, -1)

    def network(self, observation: NDArray[np.float32]) -> Array:
        return self._numbers("network", observation.astype(float))

    def gravity(self, quaternion: Array) -> Array:
        return self._numbers("gravity", quaternion)

    def _numbers(self, kind: str, values: Iterable[float]) -> Array:
        return np.array(self._ask(kind, values).split(), float)

    def _ask(self, kind: str, values: Iterable[float] = ()) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{kind} {' '.join(map(repr, map(float, values)))}\n")
        self._process.stdin.flush()
        text, _, self.stop = self._process.stdout.readline().rstrip("\n").partition("|")
        return text
