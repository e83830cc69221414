"""The designer of a page: a robot's files and values in, what the page needs of the robot out.

A page asks with messages, and one class answers them in both places: in the process of a live page
(`live.py`), and in a worker of the browser, where Python runs with a MuJoCo of the page
(`thin/mujoco.py`). Messages are JSON:

    {"id": 7, "files": {"parameters.yaml": "...", ...}, "binary": {"thigh.stl": "..."},
     "values": {"thigh_length": 0.3}, "title": "cheetah", "color": "#33608f",
     "known": ["policy-0123456789ab"]}

with files that are no text in base64 as `binary`, are answered by the robot as the page has it
(`draft.browser.robots.robot`), with the verdict, the findings and the text of the model; the
numbers of its network, unless the page knows it; and its fields, or by the problems. A robot
without a title has that of its files.

    {"id": 7, "robot": {...}, "network": "...", "fields": [{"name": "thigh_length", ...}]}
    {"id": 7, "problems": [{"where": "tree.yaml:3:5", "cause": "...", "remedy": "..."}]}
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

import pydantic

from draft.browser.robots import compiled, driven, network_part, robot
from draft.design import Design
from draft.errors import DraftError, Problem
from draft.laws.quantities import QUANTITIES
from draft.learn.policy.reduced import AnyPolicy
from draft.spec import Spec
from draft.spec.expressions import Expression
from draft.values import scalar
from draft.variation.axes import unit_of

_KEPT = 8  # Robots whose files were read last, which an edit of a value uses again.


class _Request(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)

    id: int
    files: dict[str, str]
    binary: dict[str, pydantic.Base64Bytes] = {}
    values: dict[str, float | str | None]
    title: str
    color: str
    known: list[str] = []


class Designer:
    """Answers the messages of a page."""

    def __init__(self, skill: str, policies: Sequence[AnyPolicy] = ()) -> None:
        """Prepare to answer.

        Args:
            skill: what policies can do, see `draft.browser.robots.driven`.
            policies: policies to walk with before those that ship.
        """
        self._skill, self._policies = skill, policies

    def answer(self, message: str | bytes) -> str:
        """Answer a message; what is wrong with it is an answer too."""
        try:
            asked = _Request.model_validate_json(message)
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            at = ".".join(map(str, first["loc"])) or "it"
            problem = Problem(f"the page sent a message that cannot be read: {at}: {first['msg']}")
            return json.dumps({"id": None, "problems": [_plain(problem)]})
        try:
            found = self._robot(asked)
        except DraftError as error:
            found = {"problems": [_plain(problem) for problem in error.problems]}
        return json.dumps({"id": asked.id, **found}, allow_nan=False)

    def _robot(self, asked: _Request) -> dict[str, Any]:
        design = _spec((*asked.files.items(), *asked.binary.items())).resolve(dict(asked.values))
        model = compiled(design)
        title = asked.title or design.name
        made = robot(model, title, asked.color, driven([model], self._skill, self._policies))
        found: dict[str, Any] = {"robot": made.plain, "fields": list(fields(design))}
        if made.fit is not None:
            made.plain["network"], numbers = network_part(made.fit.policy)
            if made.plain["network"] not in asked.known:
                found["network"] = base64.b64encode(numbers).decode()
        return found


@lru_cache(maxsize=_KEPT)
def _spec(files: tuple[tuple[str, str | bytes], ...]) -> Spec:
    return Spec.parse(dict(files))


def _plain(problem: Problem) -> dict[str, str]:
    where = "" if problem.where is None else str(problem.where)
    return {"where": where, "cause": problem.cause, "remedy": problem.remedy}


def source(design: Design) -> dict[str, Any]:
    """Files of a design's robot by name, the design's values and its fields, for messages.

    Files that are no text, such as parts of binary STL, are in base64 under "binary".
    """
    values = {
        name: value if value is None or isinstance(value, str) else scalar(value)
        for name, value in design.values.items()
    }
    files, binary = {}, {}
    for name, file in design.spec.files.items():
        content = file.read_bytes()
        try:
            files[name] = content.decode()
        except UnicodeDecodeError:
            binary[name] = base64.b64encode(content).decode()
    own = {"files": files, "binary": binary}
    return {**own, "values": values, "fields": list(fields(design))}


def fields(design: Design) -> Iterator[dict[str, Any]]:
    """Numbers of a design that can be changed: its parameters, and what its actuators state.

    Each has a name, a unit, the text that states it, its value, its range and a description.
    """
    spec, given = design.spec, design.values
    for name, parameter in spec.parameters.items():
        low, high = parameter.bounds or (None, None)
        yield {
            **_stated(design, name, parameter.value, given),
            "value": scalar(design.parameters[name]),
            **{"low": low, "high": high, "doc": parameter.doc},
        }
    for owner, actuator in spec.actuators.items():
        like = given.get(f"actuators.{owner}.like") or actuator.like or ""
        yield {
            **{"name": f"actuators.{owner}.like", "unit": "", "text": like, "value": None},
            **{"low": None, "high": None, "doc": "Product of the catalogue."},
        }
        for quantity, one in QUANTITIES.items():
            name = f"actuators.{owner}.{quantity}"
            if quantity in actuator.stated or name in given:
                value = scalar(getattr(design.actuators[owner], quantity))
                yield {
                    **_stated(design, name, actuator.stated.get(quantity), given),
                    **{"value": value, "low": None, "high": None, "doc": one.text},
                }


def _stated(
    design: Design, name: str, written: Expression | None, given: Mapping[str, Any]
) -> dict[str, str]:
    text = given.get(name)
    if text is None:
        text = "" if written is None else written.text
    elif not isinstance(text, str):
        text = f"{scalar(text):.10g}"
    return {"name": name, "unit": unit_of(design.spec, name), "text": text}
