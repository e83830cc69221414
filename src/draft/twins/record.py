"""A comparison as plain data for JSON, and how far each group of links misses."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from draft.twins.compare import Comparison
from draft.twins.dynamics import Errors
from draft.twins.links import Pair, Side
from draft.values import scalar

DIGITS = 6


def record(found: Comparison) -> dict[str, Any]:
    """All of a comparison in SI units; numbers that do not exist are None."""
    mass = found.expected
    table = {
        "robot": found.name,
        "population": found.population,
        "mass_kg": {
            "vendor": found.vendor_mass,
            "twin": found.design.mass,
            "ratio": found.mass_ratio,
            "links_without_mass": list(found.unstated),
            "band_90": [mass.low, mass.high],
            "wider_because": list(mass.wider),
        },
        "groups_kg": {
            name: {"vendor": a, "twin": b, "ratio": b / a if a > 0 else None}
            for name, (a, b) in found.groups().items()
        },
        "inertia_error_percent": _errors(found.inertia),
        "gravity_error_percent": _errors(found.gravity),
        "causes_of_inertia_error": [
            {
                "group": cause.group,
                "links": list(cause.links),
                "inertia_error_percent": cause.inertia,
                "vendor_kg": cause.vendor_mass,
                "twin_kg": cause.twin_mass,
            }
            for cause in found.causes
        ],
        "knee_drive": _knees(found),
        "poses": len(found.inertia.values),
        "misalignment": {
            "anchor_m": max(pair.anchor_gap for pair in found.links),
            "axis_deg": math.degrees(max(pair.axis_gap for pair in found.links)),
        },
        "stance_height_m": {"vendor": found.stance[0], "twin": found.stance[1]},
        "joints": dict(found.joints),
        "unmatched_joints": list(found.unmatched),
        "links": [_link(pair) for pair in found.links],
        "residuals": residuals(found),
        "notes": [str(note) for note in found.files.reduced.notes],
    }
    return plain(table)


def _knees(found: Comparison) -> dict[str, Any]:
    """Place of the knees' motors, and the other one where it matters."""
    knees, other = found.files.knees, found.other_knees
    table: dict[str, Any] = {"place": knees.place, "why": knees.why, "other": None}
    if other is not None:
        table["other"] = {
            "place": other.place,
            "change_percent": other.change,
            "inertia_error_percent": _errors(other.inertia),
            "gravity_error_percent": _errors(other.gravity),
        }
    return table


def residuals(found: Comparison) -> dict[str, Any]:
    """Residuals between the vendor's groups of links and the twin's; see `draft.laws.residuals`."""
    leg = found.design.leg_length
    length = 1.0 if leg is None else scalar(leg)
    groups: dict[str, list[Pair]] = {}
    for pair in found.links:
        groups.setdefault(pair.group, []).append(pair)
    table: dict[str, Any] = {}
    for name, pairs in groups.items():
        real = [p for p in pairs if p.vendor.mass > 0 and p.twin.mass > 0]
        real = [p for p in real if p.name not in found.unstated]
        if not real:
            continue
        vendor, twin = sum(p.vendor.mass for p in real), sum(p.twin.mass for p in real)
        shifts = np.array([p.com_shift for p in real]) / length
        table[name] = {
            "mass": vendor / twin,
            "gyration": _mean([p.gyration_ratio for p in real]),
            "com_shift": shifts.mean(axis=0).tolist(),
            "com_spread": shifts.std(axis=0).tolist(),
            "bodies": len(real),
        }
    return plain(table)


def _mean(ratios: Sequence[float]) -> float:
    """Geometric mean of the ratios that exist."""
    logs = [math.log(ratio) for ratio in ratios if ratio > 0]
    return math.exp(sum(logs) / len(logs)) if logs else float("nan")


def _errors(errors: Errors) -> dict[str, float]:
    return {
        "median": errors.median,
        "variance": errors.variance,
        "p10": errors.quantile(0.1),
        "p90": errors.quantile(0.9),
    }


def _link(pair: Pair) -> dict[str, Any]:
    return {
        "link": pair.name,
        "joint": pair.joint,
        "group": pair.group,
        "vendor": _side(pair.vendor),
        "twin": _side(pair.twin),
        "anchor_gap_m": pair.anchor_gap,
        "axis_gap_deg": math.degrees(pair.axis_gap),
    }


def _side(side: Side) -> dict[str, Any]:
    return {"mass_kg": side.mass, "com_m": side.com.tolist(), "gyration_m": side.gyration}


def plain(value: Any) -> Any:
    """Python's own numbers, to six significant digits; those that are not finite as None."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(f"{float(value):.{DIGITS}g}") if math.isfinite(value) else None
    return value
