"""Every shipped robot and design still comes to the numbers that were looked at and accepted.

A record per design is kept beside this file. `pytest tests/golden --force-regen` writes them anew
(and reports the tests whose record changed as failed, once): read the difference before accepting
it.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import draft
from draft.values import plain
from tests.model.shipped import SHIPPED, built

RECORDS = Path(__file__).parent / "records"
OURS, MUJOCOS = 1e-9, 1e-6
DESIGNS = [pytest.param(name, label, id=f"{name}-{label or 'default'}") for name, label in SHIPPED]
# Compiled arrays that any release of MuJoCo has, and that say what robot it is.
ARRAYS = (
    "body_mass",
    "body_inertia",
    "body_ipos",
    "body_pos",
    "body_quat",
    "body_subtreemass",
    "body_parentid",
    "jnt_axis",
    "jnt_pos",
    "jnt_range",
    "jnt_actfrcrange",
    "jnt_type",
    "dof_armature",
    "dof_damping",
    "dof_frictionloss",
    "geom_type",
    "geom_contype",
    "geom_conaffinity",
    "site_pos",
    "qpos0",
)
QUATERNIONS = ("body_quat",)
KINDS = ("body", "joint", "geom", "site", "sensor")


def resolved(design: draft.Design) -> dict[str, Any]:
    """Draft's own numbers of a design."""
    trunk, base = design.lofted, {"base_mass": design.base_mass}
    if trunk is not None:
        base = {"trunk": [trunk.density, trunk.loft.volume, trunk.loft.com, trunk.loft.inertia]}
    return plain(
        {
            "mass": design.mass,
            "actuator_mass": design.actuator_mass,
            "heights": [design.lowest(), design.lowest(home=True)],
            "parameters": dict(design.parameters),
            "actuators": {
                name: {q: getattr(a, q) for q in a.quantities}
                for name, a in design.actuators.items()
            },
            "bodies": design.body_masses(),
            "segments": {s.bodies[0]: [s.length, s.mass, s.copies] for s in design.segments},
            **base,
        }
    )


def findings(design: draft.Design) -> list[list[Any]]:
    """What the filter says: kind, severity, place and number."""
    rows = [
        [f.id, f.severity, f.where, plain({"value": f.value})["value"]] for f in design.findings
    ]
    return sorted(rows, key=lambda row: row[:3])


def fingerprint(values: np.ndarray) -> dict[str, Any]:
    """An array in four numbers: a change of any entry, or of their order, changes one of them."""
    flat = np.asarray(values, dtype=float).ravel()
    weights = 1 + np.modf(np.arange(len(flat)) * 0.6180339887498949)[0]
    return {
        "shape": list(np.shape(values)),
        "sum": float(flat.sum()),
        "size": float(np.abs(flat).sum()),
        "weighted": float(flat @ weights),
    }


def compiled(model: mujoco.MjModel) -> dict[str, Any]:
    """Fingerprints of what MuJoCo made of a robot."""
    found = {}
    for name in ARRAYS:
        values = np.array(getattr(model, name), dtype=float)
        # Newer releases keep damping with a column per polynomial term; the first is the linear.
        if name == "dof_damping" and values.ndim == 2:
            values = values[:, 0]
        if name in QUATERNIONS:
            # A quaternion and its opposite are one rotation: compare the rotation.
            values = np.array([_matrix(q) for q in values])
        found[name] = fingerprint(values)
    cylinders = np.asarray(model.geom_type) != mujoco.mjtGeom.mjGEOM_MESH
    # A mesh's frame is MuJoCo's own choice; its mass and inertia are in the body's.
    found["geom_size"] = fingerprint(np.asarray(model.geom_size)[cylinders])
    found["geom_pos"] = fingerprint(np.asarray(model.geom_pos)[cylinders])
    return found


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix


def names(model: mujoco.MjModel) -> dict[str, list[str]]:
    """Names of a robot's parts, in order, as tasks and policies use them."""
    counts = (model.nbody, model.njnt, model.ngeom, model.nsite, model.nsensor)
    return {
        kind: [getattr(model, kind)(i).name for i in range(count)]
        for kind, count in zip(KINDS, counts, strict=True)
    }


def differences(found: Any, kept: Any, tolerance: float, at: str = "") -> list[str]:
    """Where two records differ: numbers by more than a share, all else at all."""
    if isinstance(kept, dict) and isinstance(found, dict):
        missing = [f"{at}/{k}: only in one of them" for k in kept.keys() ^ found.keys()]
        both = [k for k in kept if k in found]
        # Sums of signed entries cancel: their rounding goes with the size of the entries.
        scale = max(abs(kept["size"]), 1e-12) if "size" in kept else None
        inner = (
            _number(found[k], kept[k], tolerance, f"{at}/{k}", scale)
            if scale is not None and k in ("sum", "weighted")
            else differences(found[k], kept[k], tolerance, f"{at}/{k}")
            for k in both
        )
        return [*missing, *(line for lines in inner for line in lines)]
    if isinstance(kept, list) and isinstance(found, list) and len(kept) == len(found):
        pairs = enumerate(zip(found, kept, strict=True))
        return [d for i, (a, b) in pairs for d in differences(a, b, tolerance, f"{at}/{i}")]
    if isinstance(kept, (int, float)) and isinstance(found, (int, float)):
        return _number(found, kept, tolerance, at)
    return [] if found == kept else [f"{at}: {found!r}, was {kept!r}"]


def _number(
    found: float, kept: float, tolerance: float, at: str, scale: float | None = None
) -> list[str]:
    allowed = tolerance * (abs(kept) if scale is None else scale) + 1e-12
    return [] if abs(found - kept) <= allowed else [f"{at}: {found!r}, was {kept!r}"]


def check(name: str, record: dict[str, Any], tolerances: dict[str, float], renew: bool) -> None:
    """Hold a record against the kept one; write it anew where told to."""
    path = RECORDS / f"{name}.json"
    # What is compared is what a file can hold.
    found = json.loads(json.dumps(record))
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else None
    lines = ["no record was kept"]
    if kept is not None:
        lines = differences(dict.fromkeys(found), dict.fromkeys(kept), 0.0)
        for key in kept.keys() & found.keys():
            lines += differences(found[key], kept[key], tolerances.get(key, 0.0), key)
    if not lines:
        return
    if renew:
        path.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        lines.append(f"{path.name} was written anew: look at the difference, then run again")
    else:
        lines.append("if this is right: pytest tests/golden --force-regen")
    pytest.fail("\n".join(lines), pytrace=False)


@pytest.mark.parametrize(("name", "label"), DESIGNS)
def test_a_shipped_design_comes_to_the_accepted_numbers(
    name: str, label: str | None, request: pytest.FixtureRequest
) -> None:
    model = built(name, label)
    record = {
        "resolved": resolved(model.design),
        "findings": findings(model.design),
        "mujoco": compiled(model.mujoco),
    }
    tolerances = {"resolved": OURS, "findings": OURS, "mujoco": MUJOCOS}
    renew = bool(request.config.getoption("force_regen"))
    check(f"{name}-{label or 'default'}", record, tolerances, renew)


@pytest.mark.parametrize("name", draft.shipped())
def test_a_shipped_robots_parts_keep_their_names(name: str, request: pytest.FixtureRequest) -> None:
    found = names(built(name, None).mujoco)
    check(f"{name}-names", found, {}, bool(request.config.getoption("force_regen")))


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_all_designs_of_a_robot_have_the_same_parts(name: str, label: str | None) -> None:
    assert names(built(name, label).mujoco) == names(built(name, None).mujoco)


def test_every_record_is_of_a_shipped_design() -> None:
    expected = {param.id for param in DESIGNS} | {f"{name}-names" for name in draft.shipped()}
    assert {path.stem for path in RECORDS.glob("*.json")} <= expected


def test_a_fingerprint_tells_a_change_and_a_swap() -> None:
    values = np.random.default_rng(0).normal(size=(5, 3))
    kept = fingerprint(values)
    swapped, changed = values.copy(), values.copy()
    swapped[[0, 1]] = swapped[[1, 0]]
    changed[2, 1] += 1e-5
    assert not differences(fingerprint(values * (1 + 1e-9)), kept, MUJOCOS)
    assert differences(fingerprint(swapped), kept, MUJOCOS)
    assert differences(fingerprint(changed), kept, MUJOCOS)
    assert differences(fingerprint(values[:4]), kept, MUJOCOS)
