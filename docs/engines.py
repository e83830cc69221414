"""Section of the page of real robots with the shipped policies in other engines."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from draft.errors import counted

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "examples/results/other_engine.json"  # Of `python -m benchmarks.other_engine`.
TEXT = """\
Shipped policies in other engines (`python -m benchmarks.other_engine`): the policy, what it
observes and its torques are the same, the physics is another. Speeds are means [m/s] of {starts}
starts; after a kick of at most that much along x and y, the share of {kicks} robots that do not
fall within 2.5 s. Drake reads the SDFormat of `draft export`: masses, joints, armatures, damping,
friction and shapes.

- MuJoCo: steps of 5 ms and contacts of 20 ms, as in the training of these policies. The next column
  has steps of 1 ms, and `hard` contacts of 4 ms too. MuJoCo Warp has the physics of the first, in
  single precision, on the processor; from the same starts and kicks MuJoCo gives the same numbers.
- Drake: steps of 1 ms. A contact is a point, as in MuJoCo, with Drake's own stiffness: no spec says
  how stiff a foot is, which a hydroelastic contact asks for. The friction of the floor is 1 in all.
  Contacts are approximated by `similar`, which Drake's documentation prefers where impacts matter,
  and by `sap`. Drake's default, `lagged`, bounds the friction of a foot by the normal force of the
  step before, which is none when it lands; its speeds rise with shorter steps.

At 1 and 3 m/s the speeds in Drake differ by at most {trained} from MuJoCo's as trained, by at most
{fine} from those with steps of 1 ms and by at most {hard} from those with hard contacts; at the
other commands, by at most {fastest} from those as trained.
Versions: {versions}."""


def section() -> list[str]:
    """Section with the shipped policies in other engines."""
    known = json.loads(RESULTS.read_text(encoding="utf-8"))
    found: dict[tuple[str, str], dict[str, dict[str, Any]]] = {}
    for row in known["rows"]:
        size = f"at {row['command']:.3g}" if "command" in row else f"kick of {row['kick']:.3g}"
        label = f"{row['skill']} {size} m/s" if "command" in row else f"{size} m/s"
        found.setdefault((row["robot"], label), {})[row["engine"]] = row
    names = list(dict.fromkeys(row["engine"] for row in known["rows"]))
    lines = [f"| robot | | {' | '.join(names)} |", "| --- | --- |" + " ---: |" * len(names)]
    for (robot, label), cells in found.items():
        shown = " | ".join(_cell(cells.get(name)) for name in names)
        lines.append(f"| {robot} | {label} | {shown} |")
    at = {one: [row for row in found.values() if _is_run(row, one)] for one in (True, False)}

    def gap(name: str, judged: bool = True) -> str:
        rows = [row for row in at[judged] if name in row]
        gaps = [abs(row["Drake"]["speed"] / row[name]["speed"] - 1) for row in rows]
        return f"{100 * max(gaps):.1f} %"

    text = TEXT.format(
        versions=", ".join(
            f"{name} {number}" for name, number in sorted(known["versions"].items())
        ),
        starts=_ends([row["roll_outs"] for row in known["rows"] if "speed" in row]),
        kicks=_ends([row["roll_outs"] for row in known["rows"] if "stood" in row]),
        trained=gap("MuJoCo"),
        fine=gap("MuJoCo 1 ms"),
        hard=gap("MuJoCo hard"),
        fastest=gap("MuJoCo", judged=False),
    )
    return ["## Another engine", "", *text.splitlines(), "", *lines, ""]


def _is_run(cells: dict[str, dict[str, Any]], judged: bool) -> bool:
    """Whether they are speeds at a command that is judged, or at another one."""
    command = cells["MuJoCo"].get("command")
    return command is not None and (command in (1.0, 3.0)) == judged


def _ends(values: Sequence[int]) -> str:
    return f"{min(values)} to {max(values)}"


def _cell(row: dict[str, Any] | None) -> str:
    if row is None:
        return "-"
    if "stood" in row:
        return f"{100 * row['stood']:.0f} %"
    falls = f", {counted(row['falls'], 'fall')}" if row["falls"] else ""
    return f"{row['speed']:.2f}{falls}"
