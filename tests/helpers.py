"""Small robots for tests, written as the three files and read by the ordinary reader."""

from __future__ import annotations

import copy
import json
from collections.abc import Mapping
from typing import Any

import yaml

import draft

BOX = {
    "axis": "x",
    "sections": [
        {"at": -0.2, "rectangle": [0.2, 0.1]},
        {"at": 0.2, "rectangle": [0.2, 0.1]},
    ],
}
DRIVE = {"peak_torque": 60, "no_load_speed": 20, "gear_ratio": 15}
# Hip and knee of one actuator class: the smallest leg with consecutive actuators.
LEG: list[dict[str, Any]] = [
    {"name": "housing", "motor": {"actuator": "leg", "axis": "x"}},
    {
        "name": "thigh",
        "joint": {"name": "hip", "axis": "x", "range": [-1, 1], "actuator": "leg"},
        "link": {"axis": "-z", "length": 0.3, "segment": "thigh"},
        "motor": {"actuator": "leg", "axis": "y"},
    },
    {
        "name": "shank",
        "type": "sphere",
        "joint": {"name": "knee", "axis": "y", "range": [-2, 2], "actuator": "leg"},
        "link": {"axis": "-z", "length": 0.25, "segment": "shank"},
        "sphere": {"radius": 0.02, "site": "foot"},
    },
]


# The leg with a driven wheel in place of its foot.
WHEELED: list[dict[str, Any]] = [
    *LEG[:2],
    {
        "name": "shank",
        "joint": {"name": "knee", "axis": "y", "range": [-2, 2], "actuator": "leg"},
        "link": {"axis": "-z", "length": 0.25, "segment": "shank"},
        "motor": {"actuator": "wheel", "axis": "y"},
    },
    {
        "name": "rim",
        "type": "wheel",
        "at": [0, 0.06, -0.25],
        "joint": {"name": "roll", "axis": "y", "actuator": "wheel"},
        "wheel": {"radius": 0.09, "width": 0.04, "axis": "y", "mass": 0.6, "site": "foot"},
    },
]
WHEEL_DRIVE = {"peak_torque": 12, "no_load_speed": 40, "gear_ratio": 6}


def leg(**changes: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The leg, with some keys of some of its links changed; None takes a key away."""
    links = copy.deepcopy(LEG)
    for link in links:
        for key, value in changes.get(link["name"], {}).items():
            link[key] = value
            if value is None:
                del link[key]
    return links


def robot(
    chain: list[dict[str, Any]] | None = None,
    children: list[dict[str, Any]] | None = None,
    parameters: Mapping[str, Any] | None = None,
    actuators: Mapping[str, Any] | None = None,
    root: Mapping[str, Any] | None = None,
    allow: list[str] | None = None,
    population: str = "quadruped",
    chains: Mapping[str, list[dict[str, Any]]] | None = None,
    trunk: Mapping[str, Any] | None = None,
    files: Mapping[str, bytes] | None = None,
) -> draft.Spec:
    """A robot with one chain, `leg`, hung once from a box unless `children` says otherwise."""
    links = LEG if chain is None else chain
    hung = [{"chain": "leg", "at": [0, 0, -0.2]}] if children is None else children
    texts: dict[str, Any] = {
        "parameters.yaml": {
            "name": "tester",
            "population": population,
            "parameters": dict(parameters or {}),
            "actuators": {"leg": DRIVE} if actuators is None else dict(actuators),
            "allow": allow or [],
        },
        "tree.yaml": {
            "chains": {"leg": links, **(chains or {})},
            "tree": {"name": "trunk", "type": "root", **(trunk or {}), "children": hung},
        },
        "root.yaml": {**BOX, **(root or {})},
    }
    # Through JSON, so that a list used twice is written twice and not as an alias.
    plain = json.loads(json.dumps(texts))
    written = {name: yaml.safe_dump(x, sort_keys=False) for name, x in plain.items()}
    return draft.Spec.parse({**written, **(files or {})})


def wheeled(wheel: Mapping[str, Any] | None = None, **more: Any) -> draft.Spec:
    """A quadruped on driven wheels; some keys of its wheel link may be changed, as by `leg`."""
    links = copy.deepcopy(WHEELED)
    links[-1] |= wheel or {}
    places = [
        {"chain": "leg", "at": [x, y, -0.05], "prefix": f"{end}{side}_", **mirror}
        for end, x in (("F", 0.25), ("R", -0.25))
        for side, y, mirror in (("L", 0.12, {}), ("R", 0.12, {"mirror": "y"}))
    ]
    actuators = {"leg": DRIVE, "wheel": WHEEL_DRIVE}
    return robot(links, **{"children": places, "actuators": actuators} | more)


def parameter(value: float | str, low: float = -1e6, high: float = 1e6) -> dict[str, Any]:
    """A declaration of a parameter."""
    declared: dict[str, Any] = {"value": value, "unit": "m", "doc": "A test's number."}
    if not isinstance(value, str):
        declared["range"] = [low, high]
    return declared


def ids(design: draft.Design) -> set[str]:
    """Kinds of finding that a design has."""
    return {finding.id for finding in design.findings}


def loaded() -> draft.Spec:
    """A robot with a payload on its trunk, whose mass may be nothing."""
    load = {
        "name": "load",
        "type": "box",
        "link": {"axis": "x", "length": 0.1, "mass": 0.2},
        "box": {"size": [0.1, 0.2, 0.1], "mass": "payload", "shift": [0.02, 0.03, 0.04]},
    }
    return robot(
        children=[{"chain": "leg", "at": [0, 0, -0.2]}, load],
        parameters={"payload": parameter(0.5)},
    )
