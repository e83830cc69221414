"""Top speed, kick and step under other physics, as a table.

    python -m benchmarks.physics cheetah bear giraffe
    python -m benchmarks.physics unitree_go2 --robots ../shared/robots/survey --policy FILE.onnx

Names that are designs of Draft take them; others are keys of surveyed robots, whose descriptions
are in the folder of `--robots`, with predicted masses.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Annotated

import tyro

from benchmarks.real_robots import ROBOTS, file_of
from benchmarks.roll_outs import run_as_command, save
from draft.design.references import find_design, open_design
from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.measuring.policies import climbing_family, open_source
from draft.twins.compare import compare_twin
from draft.validation.physics import SETTINGS, under_physics

SHOWN = ("top_speed", "kick", "step_up", "step_down", "walking_power")


def main(
    names: Annotated[tuple[str, ...], tyro.conf.Positional],
    /,
    robots: Path = ROBOTS,
    policy: str | None = None,
    replicas: int = 16,
    stairs: bool = False,
    warp: bool = False,
    only: tuple[str, ...] = (),
    out: Path | None = None,
) -> None:
    """Measure and print.

    Args:
        names: designs, or keys of surveyed robots.
        robots: folder of the descriptions.
        policy: run or ONNX file; the family's that ships by default.
        replicas: roll-outs at each level.
        stairs: whether to climb and descend stairs, which takes twice as long.
        warp: whether to measure on MuJoCo Warp too, which takes minutes on a CPU.
        only: labels of settings; all by default.
        out: JSON file for the numbers; those of other robots and settings there are kept.
    """
    chosen = [
        one
        for one in SETTINGS
        if (warp or one.engine != "warp") and (not only or one.label in only)
    ]
    rows = [] if out is None or not out.is_file() else json.loads(out.read_text(encoding="utf-8"))
    for name in names:
        anew = {(name, one.label) for one in chosen}
        rows = [row for row in rows if (row["robot"], row["setting"]) not in anew]
        member = _robot(name, robots)
        source, climber = open_source(policy, blind=True, robot=member), None
        if stairs and not source.of_any_legs:
            climber = source if policy else climbing_family()
        shown = SHOWN if climber else [key for key in SHOWN if not key.startswith("step")]
        print(f"| {name} | {' | '.join(shown)} |")
        measured = under_physics(source, member, chosen, replicas=replicas, climber=climber)
        for one, found in measured:
            values = {key: found[key].value if key in found else math.nan for key in shown}
            print(f"| {one.label} | {' | '.join(f'{v:.3g}' for v in values.values())} |")
            sys.stdout.flush()
            known = {key: round(x, 4) for key, x in values.items() if not math.isnan(x)}
            rows.append({"robot": name, "setting": one.label, **known})
        if out is not None:
            save(out, rows)


def _robot(name: str, robots: Path) -> LeggedRobot:
    try:
        find_design(name)
    except DraftError:
        found = compare_twin(file_of(robots, name), poses=2, without=(name,), key=name)
        return legged_robot(found.design, found.model)
    return legged_robot(open_design(name))


if __name__ == "__main__":
    run_as_command(main, __doc__)
