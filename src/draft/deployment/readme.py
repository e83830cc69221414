"""The README of a controller: files, observations, joints, limits, and what to do first."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from draft.deployment.numbers import Number
from draft.deployment.observations import TERMS
from draft.extras import own_version
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy.matching import structure_of
from draft.learn.policy.policy import Policy
from draft.learn.policy.validity import Fit
from draft.model import Model

_LIMITS = ("timeout", "command_timeout", "tilt", "gravity_error", "margin", "command")
_TRIM = ("trim_rate", "trim_most", "trim_ends")
_OF_JOINTS = {
    "home": "home",
    "low": "low",
    "high": "high",
    "action_scale": "action scale",
    "stiffness": "kp",
    "damping": "kd",
    "peak_torque": "peak torque",
    "stall_torque": "stall torque",
    "no_load_speed": "no-load speed",
    "speed_limit": "speed limit",
}


def readme(
    fit: Fit,
    member: LeggedRobot,
    model: Model,
    numbers: Mapping[str, Number],
    doubts: Sequence[str],
    folder: str,
) -> str:
    """Text of `README.md`.

    Args:
        fit: the policy.
        member: the robot.
        model: its model.
        numbers: numbers of the controller.
        doubts: sentences that whoever runs it must know.
        folder: name of the controller's folder.
    """
    policy = fit.policy
    estimated = [TERMS[name].estimated for name, _ in policy.terms if TERMS[name].estimated]
    parts = [
        f"# Controller of {model.design.reference}",
        f"Written by Draft {own_version()} from the policy of {fit.name}, stage {policy.stage}, "
        f"{policy.iterations} iterations. Numbers are SI, angles radians. The trunk's frame is x "
        f"forward, y left, z up, with its origin at the origin of the body `{member.trunk}` in "
        "Draft's model, where the site of the inertial sensor is.",
        "Before you switch it on, read docs/howto/before-you-switch-it-on.md of Draft: what to "
        "measure first, and the order of tests.",
        "\n".join(f"- {one}" for one in doubts),
        _FILES,
        "## Use",
        _use(estimated, folder),
        "## Observation",
        f"The policy acts every {policy.control_period * 1e3:g} ms. The controller computes its "
        "observation from `Sensors` and `Command`, in this order:",
        "\n".join(_observations(policy)),
        "## Joints",
        "All arrays have this order. The axis is in the trunk's frame in the home pose: a positive "
        "angle turns by the right hand about it, in your encoders as in Draft's model. The sign "
        "is that by which the policy sees and moves the joint; the controller applies it, and you "
        "do not.",
        "\n".join(_joints(member, model, numbers)),
        "\n".join(_joint_numbers(numbers)),
        "Torques, speeds and gains are those at the joint, after the gearbox and the transmission.",
        "## Limits and safe stop",
        _STOP,
        "\n".join(_table(numbers, _LIMITS)),
        *(_shifting(numbers) if _TRIM[0] in numbers else ()),
        "The network is evaluated in double precision from the weights of the ONNX file, which are "
        "of single precision: an evaluation in single precision differs by some 1e-6.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


_FILES = """\
| file | content |
|---|---|
| `controller.hpp` | the policy, its limits and its safe stop in C++17, without other libraries |
| `main.cpp`, `CMakeLists.txt` | an example with its loop, with a robot that only stands still |
| `controller.py`, `policy.npz` | the same in Python, with NumPy |
| `design.yaml`, `report.json` | the design, and where each of its numbers comes from |"""


def _use(estimated: Sequence[str], folder: str) -> str:
    text = """\
Everything here follows from the policy and the design, so write it again rather than edit it: copy
`main.cpp` into a program of your own, and compile it with this folder as an include path. The
example, compiled in the folder above:

    c++ -std=c++17 -O3 -o robot FOLDER/main.cpp && ./robot

or `cmake -S FOLDER -B build && make -C build`. In Python, run in this folder:

```python
import time
import numpy as np
from controller import Command, Controller, Sensors, gravity

controller = Controller()
now = time.monotonic()
sensors = Sensors(now, np.zeros(3), gravity((1, 0, 0, 0)), controller.numbers["home"],
                  np.zeros(len(controller.names)){more})
controller.start(now)
out = controller.step(sensors, Command(now, (0.0, 0.0, 0.0)), now)
print(out.angle, controller.stop)
```

`step` gives targets and gains. Drives with a position controller take them as they are: target
angle, target speed, kp, kd and the largest torque. Other drives take `torque`, which is called in
between at the rate of the training or faster. `hold` leads to the home pose, from which the policy
must start. `torque` checks its targets: call it for both kinds of drives, and once `stop` names a
reason, give them `output()`."""
    indent = " " * 18
    more = "".join(
        f",\n{indent}{one}=np.zeros(3)  # PLACEHOLDER: put your estimate here.\n{indent}"
        for one in estimated
    )
    text = text.replace("{more}", more).replace("FOLDER", folder)
    for name in estimated:
        text += (
            f"\n\n**`{name}` is an input that no sensor gives: the robot must estimate it.** An "
            "error there is an error of its speed. Without an estimator, use a policy that does "
            "not observe `base_lin_vel`."
        )
    return text


def _observations(policy: Policy) -> Iterator[str]:
    yield "| entries | term | what it is | unit |"
    yield "|---|---|---|---|"
    first = 0
    for (name, length), count in zip(policy.terms, policy.history, strict=True):
        term, last = TERMS[name], first + length - 1
        past = f"; the last {count} steps, the oldest first" if count > 1 else ""
        yield f"| {first} to {last} | `{name}` | {term.meaning}{past} | {term.unit} |"
        first += length


def _joints(member: LeggedRobot, model: Model, numbers: Mapping[str, Number]) -> Iterator[str]:
    axes = np.array(structure_of(member, model.mujoco).axes)
    names, signs, rolls = (np.asarray(numbers[x].value) for x in ("joint_names", "sign", "rolls"))
    yield "| | joint | axis x, y, z | sign | driven to |"
    yield "|---|---|---|---|---|"
    for i, name in enumerate(names.tolist()):
        axis = ", ".join(f"{x + 0.0:.3g}" for x in np.round(axes[member.joints.index(name)], 4))
        target = "a speed" if rolls[i] else "an angle"
        yield f"| {i} | `{name}` | {axis} | {signs[i]:+.0f} | {target} |"


def _joint_numbers(numbers: Mapping[str, Number]) -> Iterator[str]:
    names = numbers["joint_names"].value
    assert isinstance(names, tuple)
    heads = [f"{word} [{numbers[key].unit}]" for key, word in _OF_JOINTS.items()]
    yield f"| joint | {' | '.join(heads)} |"
    yield "|---|" + "---|" * len(heads)
    columns = {key: np.asarray(numbers[key].value) for key in _OF_JOINTS}
    rolls = np.asarray(numbers["rolls"].value)
    for i, name in enumerate(names):
        texts = (  # Nothing checks the angle of a wheel.
            "-" if rolls[i] and key in ("low", "high") else f"{column[i]:.4g}"
            for key, column in columns.items()
        )
        yield f"| `{name}` | {' | '.join(texts)} |"


_STOP = """\
The controller stops by damping: kp is 0, kd is `stop_damping`, and the torques stay within the
lines of the motors. A stop holds until `start` is called. It stops if

- a measurement, the command, a target or an action is not a finite number;
- `step` is late, or the measurements are older than the time-out, or as far ahead of the clock;
- the trunk is tilted, or gravity is no unit vector;
- a joint is beyond its range by the margin, or faster than its speed limit.

A command that is too old, or as far ahead of the clock, counts as zero, and one beyond that of the
training as its end. A second stop must not need this program: a switch that opens the power of the
drives."""


def _shifting(numbers: Mapping[str, Number]) -> Iterator[str]:
    yield "## Trim"
    yield (
        "This policy was not trained with this robot. The errors of its velocity add up and change "
        "the command or the gravity that it observes, so that a constant drift ends; `start` "
        "forgets them. A robot that is held, or a wrong estimate of its velocity, drives them to "
        "their bounds."
    )
    yield "\n".join(_table(numbers, _TRIM))


def _table(numbers: Mapping[str, Number], names: Sequence[str]) -> Iterator[str]:
    yield "| name | value | what it is |"
    yield "|---|---|---|"
    for name in names:
        value, unit, doc = numbers[name]
        text = ", ".join(f"{x:.3g}" for x in np.ravel(np.asarray(value, float)))
        yield f"| `{name}` | {text} {unit if unit != '1' else ''} | {doc} |"
