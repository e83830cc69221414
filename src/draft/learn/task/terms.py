"""Terms and stages of other packages and of scripts, each with the numbers that it brings.

A term has a group of numbers of its own name in the configuration: `still.weight`, `still.gate`.
This module loads neither mjlab nor PyTorch, and a module that uses its decorators need not either:
its functions import them when they are called.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, make_dataclass
from functools import wraps
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeVar, get_args

import numpy as np

from draft.errors import DraftError, suggest
from draft.extensions import Registry
from draft.learn.task.constants import ANY, ITERATIONS, Scaled, Within, choice
from draft.learn.task.groups import Rewards
from draft.learn.task.stages import STAGES, Stage

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnvCfg

    from draft.learn.task.world.task import Task

Kind = Literal["reward", "termination", "event", "stage"]
Mode = Literal["startup", "reset", "interval", "step"]
F = TypeVar("F", bound=Callable[..., Any])
# Names of Draft's own terms, which stages change by their names; rewards with a `NAME_weight` too.
RESERVED: Mapping[str, tuple[str, ...]] = {
    "reward": (
        *("linear_velocity", "angular_velocity", "vertical_velocity", "joint_limits"),
        *("upper_legs", "speed", "progress", "turning"),
    ),
    "termination": ("tilted", "low", "time_out", "left_ground"),
    "event": (
        *("reset_base", "reset_joints", "foot_friction", "encoder_bias", "shift_centre"),
        *("push", "designs", "inertia_errors"),
    ),
}
_LEADING = {"event": ("env", "env_ids"), "stage": ("cfg", "task")}


class Number(NamedTuple):
    """A number that a term brings.

    Attributes:
        value: number for a leg of 0.48 m: a float, an int, a bool, or a tuple of such.
        unit: its unit.
        doc: its meaning.
        power: power of s = L / 0.48 m that it grows with.
        within: values that it may have.
    """

    value: Any
    unit: str
    doc: str
    power: float = 0.0
    within: Within = ANY


class Term(NamedTuple):
    """A term or stage that is not Draft's own.

    Attributes:
        kind: what it is.
        function: function of the environment (a stage: of mjlab's configuration) and its numbers.
        numbers: class of its numbers, a frozen dataclass whose defaults are those that it brings.
        options: arguments of its decorator besides numbers.
    """

    kind: Kind
    function: Callable[..., Any]
    numbers: type[Any]
    options: Mapping[str, Any]


TERMS: Registry[Term] = Registry("term")


def number(
    value: Any,
    unit: str,
    doc: str,
    *,
    power: float = 0.0,
    least: float | None = None,
    most: float | None = None,
) -> Any:
    """Return a number for a term: a default with its unit, meaning, scaling and range.

    Args:
        value: number for a leg of 0.48 m: a float, an int, a bool, or a tuple of such.
        unit: its unit; "1" for none.
        doc: its meaning.
        power: power of s = L / 0.48 m that it grows with: 1 for lengths, 0.5 for speeds and times.
        least: least value; None for no limit.
        most: largest value; None for no limit.
    """
    low, high = (-math.inf if least is None else least), (math.inf if most is None else most)
    ends = [f"at least {low:g}"] * (least is not None) + [f"at most {high:g}"] * (most is not None)

    def holds(values: Sequence[float]) -> bool:
        return low <= min(values) and max(values) <= high

    within = Within(" and ".join(ends), holds) if ends else ANY
    return Number(value, unit, doc, power, within)


def reward(weight: float, **numbers: Any) -> Callable[[F], F]:
    """Register a function as a reward term of all stages.

    `@reward(weight=-0.5, gate=number(0.1, "m/s", "largest command", power=0.5))` before
    `def still(env, gate)` adds the numbers `still.weight` and `still.gate`.

    Args:
        weight: weight of its values, per second.
        numbers: number of each parameter after `env`, from `number`. One with a power arrives as
            a `Scaled`, whose value in each world is `robot_of(env).scaled(gate)`.

    Raises:
        DraftError: the name is taken, or parameters and numbers differ.
    """
    own = {"weight": Number(float(weight), "1", "weight of the term")}
    return _registration("reward", own, numbers, {})


def termination(time_out: bool = False, **numbers: Any) -> Callable[[F], F]:
    """Register a function as a termination of all stages: it returns a mask, shape (worlds,).

    Args:
        time_out: whether it is a time limit, so that later rewards count, and not a fall.
        numbers: see `reward`.

    Raises:
        DraftError: the name is taken, or parameters and numbers differ.
    """
    return _registration("termination", {}, numbers, {"time_out": time_out})


def event(mode: Mode = "step", **numbers: Any) -> Callable[[F], F]:
    """Register a function of `env`, `env_ids` and its numbers as an event of all stages.

    Policies are watched without it, and evaluated without it unless its mode is "startup" or
    "reset".

    Args:
        mode: when it is called: "startup", "reset", "step", or "interval" for the time [s] between
            two calls that its number `interval` gives, which is no parameter of the function.
        numbers: see `reward`.

    Raises:
        DraftError: the name is taken, or parameters and numbers differ.
    """
    if mode not in get_args(Mode):
        raise DraftError(f"an event has no mode '{mode}'", suggest(mode, get_args(Mode), "modes"))
    own = {"interval": numbers.pop("interval", None)} if mode == "interval" else {}
    if own and not isinstance(own["interval"], Number):
        cause = "an event of mode 'interval' has no number 'interval'"
        raise DraftError(cause, 'interval=number((1.0, 3.0), "s", "time between two calls")')
    return _registration("event", own, numbers, {"mode": mode})


def stage(
    iterations: int,
    origin: str | None = "base",
    like: str | None = None,
    uneven: bool | None = None,
    test: str | None = None,
    **numbers: Any,
) -> Callable[[F], F]:
    """Register a function as a stage of training: it changes mjlab's configuration in place.

    Args:
        iterations: iterations of the stage.
        origin: stage whose policy it starts from; None to start from scratch.
        like: stage whose changes are made first, such as "velocity"; None for none.
        uneven: whether it needs uneven ground; None for that of `like`.
        test: skill test that evaluates its policies; None for that of `like`, or "walk".
        numbers: number of each parameter after `cfg` and `task`; see `reward`.

    Raises:
        DraftError: the name is taken, there is no such stage, or parameters and numbers differ.
    """
    own = {"iterations": Number(int(iterations), "1", "iterations of the stage", 0.0, ITERATIONS)}
    return _registration(
        "stage",
        own,
        numbers,
        {"origin": origin, "like": like, "uneven": uneven, "test": test},
    )


def _registration(
    kind: Kind, own: Mapping[str, Number], numbers: Mapping[str, Any], options: Mapping[str, Any]
) -> Callable[[F], F]:
    """Return a decorator that registers a function."""

    def register(function: F) -> F:
        name, module = function.__name__, function.__module__
        _check_name(kind, name, module)
        leading = _LEADING.get(kind, ("env",))
        takes = tuple(inspect.signature(function).parameters)
        if takes[: len(leading)] != leading or {*takes[len(leading) :]} != {*numbers}:
            wanted = ", ".join((*leading, *numbers))
            cause = f"{module}: {kind} '{name}' takes ({', '.join(takes)}), not ({wanted})"
            raise DraftError(cause, "give each parameter its number, by its name")
        if used := {"weight", "interval", "iterations"} & {*numbers}:
            cause = f"{module}: {kind} '{name}' has a number '{min(used)}', a name of Draft's own"
            raise DraftError(cause, "rename the number and its parameter")
        brought = []
        for key, one in {**own, **numbers}.items():
            if not isinstance(one, Number):
                cause = f"{module}: {kind} '{name}' has no unit and meaning for '{key}'"
                raise DraftError(cause, f'{key}=number({one!r}, "m/s", "what it is")')
            if not one.within.holds(np.ravel(one.value).tolist()):
                cause = f"{module}: {kind} '{name}': {key} must be {one.within.words}"
                raise DraftError(cause, f"it is {one.value!r}")
            value = choice(one.value, one.unit, one.doc, module, one.power, one.within)
            brought.append((key, type(one.value), value))
        about = {"__doc__": inspect.getdoc(function) or kind}
        group = make_dataclass(name.title(), brought, frozen=True, namespace=about)
        if kind == "stage":
            STAGES.add(name, _stage(name, function, module, **options), module)
        TERMS.add(name, Term(kind, function, group, options), module)
        return function

    return register


def _check_name(kind: Kind, name: str, module: str) -> None:
    """Refuse the name of another term, stage or group of numbers."""
    from draft.learn.task.config import Config

    if name in TERMS and TERMS[name].function.__module__ == module == "__main__":
        return  # A cell of a notebook runs again.
    taken = {one.name: "group of numbers" for one in fields(Config)}
    taken |= dict.fromkeys(STAGES, "stage")
    taken |= {one.name[:-7]: "reward" for one in fields(Rewards) if one.name.endswith("_weight")}
    taken |= dict.fromkeys(RESERVED.get(kind, ()), kind)
    taken |= {other: term.kind for other, term in TERMS.items()}
    if name in taken:
        cause = f"{module}: there is a {taken[name]} '{name}' already"
        raise DraftError(cause, f"rename the {kind}")


def _stage(
    name: str,
    function: Callable[..., None],
    module: str,
    origin: str | None,
    like: str | None,
    uneven: bool | None,
    test: str | None,
) -> Stage:
    """Return a stage that is not Draft's own."""
    for other in (origin, like):
        if other is not None and other not in STAGES:
            cause = f"{module}: there is no stage '{other}' for stage '{name}'"
            raise DraftError(cause, f"stages: {', '.join(STAGES)}")

    def change(cfg: ManagerBasedRlEnvCfg, task: Task) -> None:
        guarded(name, function)(cfg, task, **arguments(task.config.groups()[name]))

    first = STAGES[like] if like else Stage(name, change)
    return Stage(
        name,
        change,
        origin,
        like,
        first.shares,
        first.uneven if uneven is None else uneven,
        test or first.test,
    )


def guarded(name: str, function: F) -> F:
    """Return a term's function that reports what it raises in one line."""

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        with TERMS.calls(name, "correct it, or train without it"):
            return function(*args, **kwargs)

    return call  # type: ignore[return-value]


def arguments(numbers: Any) -> dict[str, Any]:
    """Return the numbers that a term's function takes, by parameter: `Scaled` if they scale."""
    return {
        one.name: Scaled(getattr(numbers, one.name), one.metadata["power"])
        if one.metadata["power"]
        else getattr(numbers, one.name)
        for one in fields(numbers)
        if one.name not in ("weight", "interval", "iterations")
    }


def defaults() -> tuple[tuple[str, Any], ...]:
    """Return the numbers of all terms as they bring them, by name."""
    return tuple((name, term.numbers()) for name, term in TERMS.items())
