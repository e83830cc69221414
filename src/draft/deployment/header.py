"""Sources of a controller in C++: its numbers, and the code that is the same for all."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from draft.deployment.numbers import Number
from draft.deployment.observations import TERMS
from draft.learn.policy.policy import Policy

_PER_LINE = 12
# Code of a policy that has a trim: `draft.learn.policy.trim`.
_TRIM = {
    "TRIM_START": "    trim_ = {};\n",
    "TRIM_STATE": "  std::array<double, 5> trim_{};  // Added to command and gravity.\n",
    "TRIM_SEEN": "seen",
    "TRIM_STEP": """\
      const Vector& linear = sensors.estimated_base_lin_vel;
      const Vector moving{linear[0], linear[1], sensors.base_ang_vel[2]};
      Sensors seen = sensors;
      std::array<double, 5> errors;
      for (std::size_t i = 0; i < 3; ++i) errors[i] = asked[i] - moving[i];
      for (std::size_t i = 0; i < 2; ++i) {
        errors[3 + i] = -errors[i];
        seen.projected_gravity[i] += trim_[3 + i];
      }
      for (std::size_t i = 0; i < 3; ++i) {
        const double end = std::max(TRIM_ENDS[i], std::abs(asked[i]));
        asked[i] = std::clamp(asked[i] + trim_[i], -end, end);
      }
      for (std::size_t i = 0; i < 5; ++i) {
        const double next = trim_[i] + TRIM_RATE[i] * CONTROL_PERIOD * errors[i];
        trim_[i] = std::clamp(next, -TRIM_MOST[i], TRIM_MOST[i]);
      }
""",
}


def sources(numbers: Mapping[str, Number], policy: Policy) -> dict[str, str]:
    """Texts of `controller.hpp` and `main.cpp` by name.

    Args:
        numbers: numbers of the controller.
        policy: the policy, for the terms of its observation.
    """
    terms = [name for name, _ in policy.terms]
    estimates = [TERMS[name].estimated for name in terms if TERMS[name].estimated]
    words = {
        "NUMBERS": "\n".join(_constants(numbers)),
        "LAYERS": "\n".join(_layers(numbers)),
        "ESTIMATES": "".join(
            f"  Vector {one}{{NAN, NAN, NAN}};  // No sensor gives it: see README.md.\n"
            for one in estimates
        ),
        "ESTIMATED_FINITE": "".join(f" ||\n        !detail::finite(s.{x})" for x in estimates),
        "PLACEHOLDERS": "".join(
            f"    sensors.{one} = {{0, 0, 0}};  // PLACEHOLDER: put your estimate here.\n"
            for one in estimates
        ),
        "OBSERVE": "\n".join(_observed(policy)),
        **(_TRIM if policy.trim else dict.fromkeys(_TRIM, "") | {"TRIM_SEEN": "sensors"}),
    }
    found = {}
    for name in ("controller.hpp", "main.cpp"):
        text = Path(__file__).with_name(f"{name}.in").read_text(encoding="utf-8")
        found[name] = re.sub("@([A-Z_]+)@", lambda match: words[match[1]], text)
    return found


def _observed(policy: Policy) -> Iterator[str]:
    """Statements that write the terms of an observation."""
    for (name, length), count in zip(policy.terms, policy.history, strict=True):
        sizes, past = f"({length // count}, {count});", count > 1
        if past:
            yield f"    past{sizes}"
        yield f"    {TERMS[name].code}  // {name}"
        if past:
            yield f"    fill{sizes}"


def _constants(numbers: Mapping[str, Number]) -> list[str]:
    joints, entries = numbers["joint_names"].value, numbers["mean"].value
    lines = [
        f"constexpr std::size_t JOINTS = {np.size(joints)};",
        f"constexpr std::size_t OBSERVATIONS = {np.size(entries)};",
    ]
    for name, (value, unit, doc) in numbers.items():
        lines.append(f"// {doc[:1].upper()}{doc[1:]}{f' [{unit}]' if unit else ''}.")
        array = np.asarray(value)
        if not array.ndim:
            lines.append(f"constexpr double {name.upper()} = {_text(array.item())};")
            continue
        # Weights by inputs: see `detail::layer`.
        flat, kind = array.T.ravel(), _kind(array)
        if kind == "float":
            lines.append(f"inline constexpr float {name.upper()}[] = {{")
        else:
            lines.append(f"constexpr std::array<{kind}, {flat.size}> {name.upper()} = {{")
        texts = [_text(one, kind == "float") for one in flat.tolist()]
        lines += [
            f"    {', '.join(texts[i : i + _PER_LINE])}," for i in range(0, len(texts), _PER_LINE)
        ]
        lines.append("};")
    return lines


def _kind(array: np.ndarray) -> str:
    """Type of C++ of the entries of an array."""
    if array.dtype.kind == "f":
        return "float" if array.dtype.itemsize == 4 else "double"
    return {"b": "bool", "U": "const char*"}[array.dtype.kind]


def _text(value: object, single: bool = False) -> str:
    """A literal; nine digits restore every number of single precision."""
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:.9g}" if single else repr(value)


def _layers(numbers: Mapping[str, Number]) -> list[str]:
    """Statements that evaluate the layers."""
    biases = [number for name, number in numbers.items() if name.startswith("bias_")]
    lines, before = [], "OBSERVATIONS"
    for i, bias in enumerate(biases):
        size = np.size(bias.value)
        last = i + 1 == len(biases)
        out = "action.data()" if last else f"x{i + 1}"
        if not last:
            lines.append(f"  double {out}[{size}];")
        sizes = f"{before}, {'JOINTS' if last else size}"
        lines.append(f"  detail::layer<{sizes}>(x{i}, WEIGHT_{i}, BIAS_{i}, {out});")
        if not last:
            lines.append(f"  detail::elu<{size}>({out});")
        before = str(size)
    return lines
