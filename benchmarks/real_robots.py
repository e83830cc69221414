"""What Draft predicts of real robots: measures them, or trains policies of their own.

    python -m benchmarks.real_robots unitree_go2 unitree_a1
    python -m benchmarks.real_robots unitree_go2 --train runs/own

It writes what `draft twin FILE --capabilities --json` prints to examples/results/real_robots, with
which errors of the masses cause what, and the bands that Draft states of learnt capabilities, which
follow from all robots there. With `--train` it trains policies of each robot's own instead, with
predicted masses, and writes their numbers to examples/results/own_policies; seeds that are there
already are left as they are. `python -m docs.real_robots` writes the page.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from benchmarks.roll_outs import run_as_command, save
from draft.cli.display.capabilities import record
from draft.errors import DraftError
from draft.learn.measuring.bands import FILE as BANDS
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.policies import open_source
from draft.learn.policy.validity import FAMILY_NAME
from draft.twins.compare import compare_twin
from draft.validation.arms import predicted
from draft.validation.capabilities import measured
from draft.validation.causes import causes
from draft.validation.compare import RealRobot, real_robot
from draft.validation.own import own_policy

ROOT = Path(__file__).resolve().parents[1]
ROBOTS = Path("../shared/robots/survey")
RESULTS = ROOT / "examples/results/real_robots"
OWN = ROOT / "examples/results/own_policies"
COMPARED = ("top_speed", "kick", "step_up", "walking_power", "cost_of_transport")
OWNED = ("top_speed", "kick", "walking_power")
LEAST, SHARE = 9, 0.9  # Robots that a band needs, and the share that it holds.


def main(
    keys: Annotated[tuple[str, ...], tyro.conf.Positional] = (),
    /,
    robots: Path = ROBOTS,
    policy: str | None = None,
    out: Path = RESULTS,
    train: Path | None = None,
    seeds: int = 3,
    iterations: int = 150,
) -> None:
    """Measure robots, or train their own policies; of no robot write the bands alone.

    Args:
        keys: names of robots.
        robots: folder of their descriptions.
        policy: run or ONNX file; by default the one that Draft uses for their legs.
        out: folder of the numbers; those of another policy need one of their own.
        train: folder for the runs of policies of their own.
        seeds: number of these for each robot.
        iterations: iterations of each.
    """
    if policy is not None and out.resolve() == RESULTS:
        cause = f"{RESULTS} holds what the policies that ship do, of which the bands follow"
        raise DraftError(cause, "give another `out`")
    files = {key: file_of(robots, key) for key in keys}
    if train is not None:
        for seed in range(seeds):
            for key, file in files.items():
                _own(key, file, train, seed, iterations)
        return
    for key, file in files.items():
        print(key, file=sys.stderr)
        found = real_robot(file, key=key, policy=policy)
        save(out / f"{key}.json", record(found) | {"causes": _caused(found, policy)})
    if out == RESULTS:
        save(BANDS, bands_of(records()))


def file_of(folder: Path, key: str) -> Path:
    """Description of a robot.

    Raises:
        DraftError: there is none.
    """
    files = sorted(folder.glob(f"{key}.*"))
    if not files:
        raise DraftError(f"{folder} has no description of {key}", "name another one with --robots")
    return files[0]


def records() -> list[dict[str, Any]]:
    """Measured columns of all robots, by key."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(RESULTS.glob("*.json"))]


def by_policy(policy: str, found: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Robots that a policy drives."""
    return [one for one in found if one["policy"] == policy]


def bands_of(found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Folds of capabilities by predicted masses that hold for nine robots of ten.

    Robots that the policy of all legs drives do not count: it follows slower commands, and falls.
    They are the ratios of rank ceil(0.9 (n + 1)) of n robots, which hold for 90 % of others like
    these, whatever the distribution (split conformal prediction; Vovk et al. 2005).
    """
    rows, driven = {}, by_policy(FAMILY_NAME, found)
    for name in COMPARED:
        folds = sorted(abs(math.log(ratio)) for ratio in ratios(driven, name))
        if len(folds) >= LEAST:
            rank = min(math.ceil(SHARE * (len(folds) + 1)), len(folds))
            fold = round(math.exp(folds[rank - 1]), 4)
            rows[name] = {"robots": len(folds), "fold_90": fold}
    return rows


def ratios(found: Sequence[dict[str, Any]], name: str) -> list[float]:
    """Predicted over maker's masses: ratios of a capability of the robots that have both."""
    pairs = [(one["predicted"].get(name), one["maker"].get(name)) for one in found]
    return [
        ours["value"] / theirs["value"]
        for ours, theirs in pairs
        if ours and theirs and ours["value"] and theirs["value"]
    ]


def _caused(found: RealRobot, policy: str | None) -> dict[str, dict[str, float]]:
    """Causes of the differences between both columns, of robots with published figures."""
    if found.policy != FAMILY_NAME or not found.verdicts:
        return {}
    return causes(
        found.twin,
        open_source(policy, blind=True, robot=predicted(found.twin)),
        *setting("auto", "auto"),
    )


def _own(key: str, file: Path, folder: Path, seed: int, iterations: int) -> None:
    """Train and measure a policy of a robot's own with predicted masses, unless it is measured."""
    path = OWN / f"{key}.json"
    known: dict[str, Any] = {"seeds": {}}
    if path.is_file():
        known = json.loads(path.read_text(encoding="utf-8"))
    if known["seeds"] and known["iterations"] != iterations:
        cause = f"{path} holds policies of {known['iterations']} iterations, not {iterations}"
        raise DraftError(cause, "give `iterations` as there, or remove the file")
    if str(seed) in known["seeds"]:
        return
    print(key, seed, file=sys.stderr)
    member = predicted(compare_twin(file, without=(key,), key=key, poses=2))
    own = own_policy(member, folder / key, family=True, seed=seed, iterations=iterations)
    found = measured(own, member, *setting("auto", "auto"))
    values = {name: found[name].value for name in OWNED if not math.isnan(found[name].value)}
    known |= {"robot": key, "iterations": iterations}
    known["seeds"][str(seed)] = {name: round(value, 4) for name, value in values.items()}
    save(path, known)


if __name__ == "__main__":
    run_as_command(main, __doc__)
