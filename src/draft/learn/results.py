"""Results of `draft evaluate`: a folder RUN/evaluation/ARM-PROTOCOL, whole or not at all.

worlds.parquet        one row per roll-out
utilisation.parquet   counted samples of the joints' shares of their limits
occupancy.parquet     counted samples of their torque and speed together
summary.json          curves, scalars, utilisation, and all that they stand on
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.errors import DraftError, Problem
from draft.extras import need
from draft.files import write
from draft.learn.battery import Battery, Met, flags
from draft.learn.progress import fastest, hardest_row
from draft.learn.run import PROGRESS, Run, file_digest, robots_digest, versions
from draft.learn.scalars import Worlds, curves, scalars
from draft.learn.utilisation import QUANTITIES, Histograms, utilisation

if TYPE_CHECKING:
    from draft.learn.quadruped import Quadruped

FORMAT = 2
FOLDER = "evaluation"
SUMMARY, WORLDS, UTILISATION = "summary.json", "worlds.parquet", "utilisation.parquet"
OCCUPANCY = "occupancy.parquet"
PARTS = (WORLDS, UTILISATION, OCCUPANCY, SUMMARY)
_FAMILY = "several designs: see by_member"
# What means nothing of a roll-out that fell.
_OF_WALKERS = ("speed", "mechanical", "heat", "rise")


@dataclass(frozen=True)
class Asked:
    """All that decides a result.

    Attributes:
        iteration: of the checkpoint.
        checkpoint: hash of its file.
        robots: hash of the designs.
        arm: "nominal" or "perturbed".
        errors: whose inertia errors robots of the perturbed arm have, see
            `draft.learn.inertia.extents`; None in the nominal arm.
        protocol: "walking" or "published".
        replicas: roll-outs of each level, shared out among the designs.
        seconds, settle: of a roll-out, and what of it does not count [s].
        evaluation_seed: of everything random.
        levels: by battery.
    """

    iteration: int
    checkpoint: str
    robots: str
    arm: str
    errors: str | None
    protocol: str
    replicas: int
    seconds: float
    settle: float
    evaluation_seed: int
    levels: dict[str, list[float]]

    def as_dict(self) -> dict[str, Any]:
        """Plain data."""
        return asdict(self)


def asked(
    run: Run,
    batteries: Sequence[Battery],
    checkpoint: int | None,
    arm: str,
    protocol: str,
    **numbers: Any,
) -> Asked:
    """What is asked of a run.

    Args:
        run: the run.
        batteries: with their levels.
        checkpoint: its iteration; the last where None.
        arm: "nominal" or "perturbed".
        protocol: "walking" or "published".
        numbers: `replicas`, `seconds`, `settle`, `evaluation_seed` and `errors`.

    Raises:
        DraftError: there is no such checkpoint.
    """
    iteration, file = run.checkpoint(checkpoint)
    return Asked(
        iteration=iteration,
        checkpoint=file_digest(file),
        robots=robots_digest(run.plan.members),
        arm=arm,
        protocol=protocol,
        levels={battery.name: list(battery.levels) for battery in batteries},
        **numbers,
    )


def place(run: Run, arm: str, protocol: str, out: Path | None = None) -> Path:
    """Folder of a result.

    Args:
        run: the run.
        arm: "nominal" or "perturbed".
        protocol: "walking" or "published".
        out: holds a folder per run; the run's own where None.
    """
    base = run.folder / FOLDER if out is None else out / run.folder.resolve().name
    return base / f"{arm}-{protocol}"


def read(folder: Path) -> dict[str, Any] | None:
    """Summary of a whole result; None where there is none, or only a part of one."""
    if not all((folder / name).is_file() for name in PARTS):
        return None
    try:
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    whole = isinstance(summary, dict) and summary.get("format") == FORMAT
    return summary if whole and isinstance(summary.get("asked"), dict) else None


def answers(summary: Mapping[str, Any], what: Asked) -> bool:
    """Tell whether a result is of just what is asked, by whatever versions of the packages."""
    return summary["asked"] == json.loads(json.dumps(what.as_dict()))


def summarise(
    run: Run,
    what: Asked,
    batteries: Sequence[Battery],
    worlds: Worlds,
    histograms: Histograms,
    **record: Any,
) -> dict[str, Any]:
    """All that roll-outs say, as plain data.

    Args:
        run: the run.
        what: was asked.
        batteries: with their levels.
        worlds: the roll-outs.
        histograms: counted samples.
        record: `device` and `took_s`.
    """
    members = run.plan.members
    progress = run.folder / PROGRESS
    met = Met(hardest_row(progress, what.iteration), fastest(progress, what.iteration))
    told = flags(batteries, run.plan, what.iteration, met)
    if len(members) == 1:
        found = _of_member(members[0], worlds, histograms, told)
    else:
        found = _of_family(members, worlds, histograms, told)
    asked_ = what.as_dict()
    return {
        "format": FORMAT,
        "design": members[0].name if len(members) == 1 else run.folder.resolve().name,
        "members": [member.name for member in members],
        "stage": run.plan.stage,
        "seed": run.plan.seed,
        **{name: value for name, value in asked_.items() if name != "levels"},
        "asked": asked_,
        "versions": versions(),
        **record,
        **found,
        "flags": list(dict.fromkeys(told)),
    }


def save(folder: Path, summary: Mapping[str, Any], worlds: Worlds, histograms: Histograms) -> None:
    """Write a result, whole or not at all; it takes the place of an older one.

    Raises:
        DraftError: it cannot be written, or pyarrow is missing.
    """
    arrow, parquet = need("pyarrow", "learn"), need("pyarrow.parquet", "learn")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
        try:
            os.chmod(temporary, 0o755)
            new = temporary / "new"
            new.mkdir()
            parquet.write_table(arrow.table(_world_columns(arrow, worlds)), new / WORLDS)
            parquet.write_table(arrow.table(_counts(histograms)), new / UTILISATION)
            parquet.write_table(arrow.table(_plane(histograms)), new / OCCUPANCY)
            write(new / SUMMARY, json.dumps(summary, indent=1, allow_nan=False) + "\n")
            if folder.exists():
                os.rename(folder, temporary / "old")
            os.rename(new, folder)
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    except OSError as error:
        cause = f"cannot write '{folder}': {error.strerror or error}"
        raise DraftError(Problem(cause, None, "choose another --out")) from None


def _of_member(
    member: Quadruped, worlds: Worlds, histograms: Histograms, told: list[str]
) -> dict[str, Any]:
    """Numbers, curves and scalars of one design; what to know of it is added to `told`."""
    rows = worlds.of(worlds.member == member.name)
    found = curves(rows)
    made = scalars(found, member.leg_length)
    told += made.flags
    return {
        "leg_length": member.leg_length,
        "mass": member.mass,
        "top_speed_estimate": member.top_speed,
        "batteries": found,
        "scalars": made.values,
        "reasons": made.reasons,
        **utilisation(histograms, found, made.values, member.name),
    }


def _of_family(
    members: Sequence[Quadruped], worlds: Worlds, histograms: Histograms, told: list[str]
) -> dict[str, Any]:
    """Curves over all designs, and each design's own numbers."""
    by_member = {}
    for member in members:
        own: list[str] = []
        by_member[member.name] = _of_member(member, worlds, histograms, own)
        told += [f"{member.name}: {words}" for words in own]
    names = by_member[members[0].name]["scalars"]
    return {
        "leg_length": None,
        "mass": None,
        "top_speed_estimate": None,
        "batteries": curves(worlds),
        "scalars": dict.fromkeys(names),
        "reasons": dict.fromkeys(names, _FAMILY),
        "utilisation": {},
        "utilisation_level": {},
        "limiting": {},
        "by_member": by_member,
    }


def _world_columns(arrow: Any, worlds: Worlds) -> dict[str, Any]:
    """Columns of worlds.parquet; what means nothing is null."""
    columns = dict(vars(worlds))
    for name in _OF_WALKERS:
        columns[name] = arrow.array(columns[name], mask=worlds.fell)
    return columns


def _counts(histograms: Histograms) -> dict[str, Any]:
    """Columns of utilisation.parquet: bins that hold something."""
    found = histograms.counts
    group, joint, quantity, bin_ = np.nonzero(found)
    return {
        **_samples(histograms, group, joint),
        "quantity": np.array(QUANTITIES)[quantity],
        "bin": bin_.astype(np.int32),
        "count": found[group, joint, quantity, bin_],
    }


def _plane(histograms: Histograms) -> dict[str, Any]:
    """Columns of occupancy.parquet: cells that hold something."""
    found = histograms.plane
    group, joint, torque, speed = np.nonzero(found)
    return {
        **_samples(histograms, group, joint),
        "torque": torque.astype(np.int32),
        "speed": speed.astype(np.int32),
        "count": found[group, joint, torque, speed],
    }


def _samples(histograms: Histograms, group: np.ndarray, joint: np.ndarray) -> dict[str, Any]:
    """Columns that tell whose samples are counted."""
    return {
        **{name: getattr(histograms, name)[group] for name in ("battery", "level", "member")},
        "joint": np.array(histograms.classes)[joint],
    }
