"""Tables of the survey: its robots, those that the fits use, and the reasons for exclusions."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem

DATA = Path(__file__).resolve().parent / "data"
FILE = DATA / "robots.csv"


@dataclass(frozen=True, slots=True)
class Robot:
    """A robot of the survey.

    Attributes:
        key: short name, which is the stem of its file in a folder.
        name: name of the robot.
        maker: name of its maker.
        population: "humanoid", "quadruped", or any other text for neither.
        used: whether the fits use it.
        reason: why the fits do not use it.
        package: module of `robot_descriptions` that contains it; "" for none.
        source: repository, path and commit.
        licence: SPDX tag of the description.
    """

    key: str
    name: str
    maker: str
    population: str
    used: bool
    reason: str
    package: str
    source: str
    licence: str


@dataclass(frozen=True, slots=True)
class Hosts:
    """Segments of a quadruped that carry the drives of its hip pitch and its knee.

    Attributes:
        remote: whether the knee is driven from the hip, through a linkage or belt.
        hip_pitch: class of the segment with the hip pitch drive.
        knee: class of the segment with the knee drive.
    """

    remote: bool
    hip_pitch: str
    knee: str


@lru_cache(maxsize=1)
def robots() -> dict[str, Robot]:
    """All robots of the survey by key."""
    return {
        row["key"]: Robot(
            row["key"],
            row["robot"],
            row["maker"],
            row["population"],
            row["used_in_fit"] == "true",
            row["exclusion_reason"],
            row["package"],
            " ".join((row["source_repo"], row["source_path"], row["source_commit"])),
            row["license_spdx"],
        )
        for row in _table("robots.csv")
    }


@lru_cache(maxsize=1)
def hosts() -> dict[str, Hosts]:
    """Segments that carry the drives of quadrupeds, by the key of the robot."""
    return {
        row["key"]: Hosts(row["knee_drive"] == "remotized", row["hip_pitch_host"], row["knee_host"])
        for row in _table("actuator_hosts.csv")
    }


@lru_cache(maxsize=1)
def disclosed_units() -> dict[str, list[tuple[float, float]]]:
    """Peak torque [N m] and mass [kg] of units disclosed by makers, by robot, lightest first."""
    units: dict[str, list[tuple[float, float]]] = {}
    for row in _table("disclosed_units.csv"):
        units.setdefault(row["key"], []).append((float(row["torque_nm"]), float(row["mass_kg"])))
    return {key: sorted(pairs, key=lambda pair: pair[1]) for key, pairs in units.items()}


@lru_cache(maxsize=1)
def excluded_segments() -> Mapping[tuple[str, str], str]:
    """Reasons for omitting a class of a robot from the fits, by (robot, class)."""
    return {(row["key"], row["class"]): row["reason"] for row in _table("excluded_segments.csv")}


def _table(name: str) -> list[dict[str, str]]:
    with (DATA / name).open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def read_manifest(path: Path) -> list[tuple[Robot, Path]]:
    """Read a manifest: robots and their files.

    Its columns are key, population, used_in_fit, exclusion_reason and file (relative to the
    manifest); others are ignored.

    Raises:
        DescriptionError: the manifest is missing, lacks a column, or has an invalid row.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        raise DescriptionError(Problem("cannot read this manifest", Location(str(path)))) from None
    reader = csv.DictReader(text.splitlines())
    needed = ("key", "population", "used_in_fit", "exclusion_reason", "file")
    missing = [name for name in needed if name not in (reader.fieldnames or ())]
    if missing:
        cause = f"a manifest has the columns {', '.join(needed)}; missing: {', '.join(missing)}"
        raise DescriptionError(Problem(cause, Location(str(path), 1)))
    listed: list[tuple[Robot, Path]] = []
    for row in reader:
        where = Location(str(path), reader.line_num)
        if row["used_in_fit"] not in ("true", "false"):
            cause = f"used_in_fit of '{row['key']}' is '{row['used_in_fit']}', not true or false"
            raise DescriptionError(Problem(cause, where))
        if row["used_in_fit"] == "false" and not row["exclusion_reason"]:
            cause = f"'{row['key']}' is excluded without a reason"
            raise DescriptionError(Problem(cause, where, "fill in exclusion_reason"))
        if not row["key"] or not row["file"]:
            raise DescriptionError(Problem("this row has no key or no file", where))
        listed.append((_from_manifest(row), path.parent / row["file"]))
    return listed


def _from_manifest(row: dict[str, str]) -> Robot:
    return Robot(
        row["key"],
        row.get("robot") or row["key"],
        row.get("maker") or "",
        row["population"],
        row["used_in_fit"] == "true",
        row["exclusion_reason"],
        "",
        row.get("source_repo") or "",
        row.get("license_spdx") or "",
    )
