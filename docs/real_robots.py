"""What Draft predicts of real robots beside what is published: writes docs/real-robots.md.

python -m benchmarks.real_robots unitree_go2   # measures robots
python -m docs.real_robots                     # the page, from what is measured
python -m docs.real_robots --picture           # with the picture of the robots
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.real_robots import (
    COMPARED,
    OWN,
    OWNED,
    ROBOTS,
    by_policy,
    file_of,
    ratios,
    records,
)
from benchmarks.roll_outs import run_as_command
from docs import engines, pictures
from draft.cli.display.capabilities import SHOWN
from draft.errors import counted
from draft.files import write
from draft.laws.survey import read
from draft.learn.policy.validity import ANY_NAME, FAMILY_NAME
from draft.plotting import decorate, make_folder
from draft.twins.compare import compare_twin
from draft.validation.causes import JUDGED as CAUSED
from draft.validation.physics import SETTINGS, USUAL
from draft.values import brief

ROOT = Path(__file__).resolve().parents[1]
PAGE, IMAGES = ROOT / "docs/real-robots.md", ROOT / "docs/images/real_robots"
PHYSICS = ROOT / "examples/results/physics.json"  # Of `python -m benchmarks.physics --out`.
UNDER = ("top_speed", "kick", "step_up", "step_down", "walking_power")
JUDGED = {
    "top_speed": "top speed [m/s]",
    "step_up": "step [m]",
    "payload_peak": "standing load [kg]",
    "walking_power": "power of a walk [W]",
}
LABELS = {"kick": "kick [m/s]"}
INTRODUCTION = """\
What Draft predicts of {count} machines from their makers' descriptions: joints, lengths, torques
and speeds are the maker's, masses and inertias Draft's, with the machine held out of the trends.
One policy drives the {driven} quadrupeds whose knees point backwards, and another one climbs; they
were trained on bodies of Draft alone and have seen none of these machines.
{others}
`draft twin FILE --capabilities` measures one robot; [limits](limits.md) tells what the numbers
leave out.

![The bodies that Draft predicts of them, at one scale](images/real_robots/robots.png)

Physics: contacts with a time constant of 10 ms, targets that arrive up to 15 ms late, 16 roll-outs
of 9 s at each command, kick and step, no command that is faster than those of the training, and
stairs at 0.3 sqrt(g L) with the leg length L. The velocity that the policy of all quadrupeds
observes errs by up to 0.5 m/s, that of any legs by up to 0.1 m/s.
Intervals are those of the roll-outs alone, from 5 to 95 %."""
OTHERS = """\
That of [any legs](any-legs.md) drives {count} others, on a plane, with commands up to those of its
training."""
UNDRIVEN = "Of the others the closed forms are told."
RULE = """\
The rule, stated before the comparison: top speed, step and standing load are limits of a machine.
Products keep below them, so a prediction below the best published figure of that machine is an
error, and one above it is not. The power of a walk is right within a factor of 1.5. A payload
without a definition is not judged. A, B and C: measured in a paper or certified, stated by the
maker, secondary text. A top speed below sqrt(g L), where walking ends, is a claim on a product, and
in brackets."""
WHY = """\
Most are below, by a tenth to a third, and steps by far. That is not the machines: the same policy
ran 3.8 m/s with the Go2 and 6.6 m/s with the B2 on the soft feet and without the delay of its first
training, which does not hold on hard ground. To learn on for 150 iterations with one machine alone
gains little (below); makers' controllers had more time and other rewards. The climbing policy has
learnt from 25 million steps and climbs a quarter of the leg length, where papers jump; it stops
before higher steps rather than falls, and was still learning. A policy of a machine's own:
`draft twin FILE --capabilities --train DIR`.

The policy of all legs is asked at most 0.7 sqrt(g L) on two legs, a walk: what it does is no
prediction of how fast these machines run. It walks with bent knees, which takes power."""
_NEAR = 0.05  # Logarithm of the ratio of speeds whose labels would overlap.


def main(picture: bool = False, robots: Path = ROBOTS) -> None:
    """Write the page.

    Args:
        picture: whether to draw the robots anew.
        robots: folder of their descriptions.
    """
    rows = records()
    if picture:
        surveyed, models = {one.robot for one in read()}, []
        for key in (row["robot"] for row in rows):
            held = key if key in surveyed else ""
            without = (held,) if held else ()
            twin = compare_twin(file_of(robots, key), without=without, key=held, poses=2)
            models.append(twin.model)
        pictures.row(models, IMAGES / "robots.png", (2000, 560))
    speeds(rows)
    write(PAGE, page(rows))
    print(PAGE)


def speeds(found: Sequence[dict[str, Any]]) -> None:
    """Draw predicted over published top speeds."""
    from matplotlib.figure import Figure

    points = [
        (one, item)
        for one in found
        for item in one["published"]
        if item["quantity"] == "top_speed" and one["predicted"].get("top_speed", {}).get("value")
    ]
    if not points:
        return
    figure = Figure(figsize=(6.4, 5.2), layout="constrained")
    axes = figure.add_subplot()
    ends = [0.8, 8.0]
    axes.fill_between(ends, ends, [20, 20], color="#e8f0e8", lw=0, label="not below: right")
    axes.plot(ends, ends, color="#888888", lw=1)
    for one, item in points:
        own, theirs = one["predicted"]["top_speed"], item["value"]
        low, high = own["value"] - own["low"], own["high"] - own["value"]
        color = "#1f5fa8" if item["physical"] else "#b0b0b0"
        look = {"color": color, "ms": 5, "lw": 1}
        if one["policy"] == ANY_NAME:
            look["mfc"] = "white"
        axes.errorbar(theirs, own["value"], [[low], [high]], fmt="o", **look)
        # Beside a near one further right there is room on the left alone.
        crowded = any(
            theirs < other["value"] < 1.2 * theirs
            and abs(math.log(its["predicted"]["top_speed"]["value"] / own["value"])) < _NEAR
            for its, other in points
        )
        axes.annotate(
            one["robot"].removeprefix("unitree_").removeprefix("deeprobotics_"),
            (theirs, own["value"]),
            (-5, 3) if crowded else (5, 3),
            textcoords="offset points",
            ha="right" if crowded else "left",
            fontsize=8,
            color=color,
        )
    axes.set(xlim=ends, ylim=ends)
    decorate(axes, "published top speed [m/s]", "predicted top speed [m/s]")
    axes.legend(loc="lower right", frameon=False)
    make_folder(IMAGES)
    figure.savefig(IMAGES / "speeds.png", dpi=120)


def page(found: Sequence[dict[str, Any]]) -> str:
    """The page."""
    return "\n".join(
        (
            "# Real robots: can it be trusted?",
            "",
            "<!-- Written by `python -m docs.real_robots`; do not edit. -->",
            "",
            *_introduction(found),
            "",
            "## Predicted and published",
            "",
            *RULE.splitlines(),
            "",
            *_published(found),
            "",
            *_score(found),
            "",
            *WHY.splitlines(),
            "",
            *_own(found),
            "![Predicted over published top speed](images/real_robots/speeds.png)",
            "",
            "Blue: claims on the machine. Grey: below sqrt(g L), claims on a product.",
            "Rings: robots that the policy of all legs drives.",
            "",
            "## The maker's masses and predicted ones",
            "",
            *_ratios(found),
            "",
            *_causes(found),
            "",
            *_physics(),
            *engines.section(),
            "## All columns",
            "",
            *(line for one in found for line in (*_columns(one), "")),
        )
    )


def _introduction(found: Sequence[dict[str, Any]]) -> list[str]:
    driven, others = (len(by_policy(name, found)) for name in (FAMILY_NAME, ANY_NAME))
    words = OTHERS.format(count=others) if others else UNDRIVEN
    return INTRODUCTION.format(count=len(found), driven=driven, others=words).splitlines()


def _published(found: Sequence[dict[str, Any]]) -> list[str]:
    lines = ["| robot | " + " | ".join(JUDGED.values()) + " |", "| --- |" + " --- |" * len(JUDGED)]
    for one in found:
        judged = {item["quantity"]: item for item in one["published"]}
        cells = []
        for name in JUDGED:
            item, own = judged.get(name), one["predicted"].get(name)
            ours = "-" if own is None or own["value"] is None else brief(own["value"])
            if item is None:
                cells.append(ours)
                continue
            sign = {"least": "> ", "most": "< ", "": ""}[item["bound"]]
            theirs = f"{sign}{brief(item['value'])} {item['confidence']}"
            theirs = theirs if item["physical"] else f"({theirs})"
            cells.append(f"{ours}; published {theirs}: **{item['verdict']}**")
        lines.append(f"| {one['robot']} | " + " | ".join(cells) + " |")
    return lines


def _score(found: Sequence[dict[str, Any]]) -> list[str]:
    """How often the rule holds; robots that the policy of all legs drives have their own lines."""
    others = by_policy(ANY_NAME, found)
    lines = _held([one for one in found if one["policy"] != ANY_NAME])
    if others:
        lines += ["", "Of the robots that the policy of all legs drives:", "", *_held(others)]
    return lines


def _held(found: Sequence[dict[str, Any]]) -> list[str]:
    items = [(one, item) for one in found for item in one["published"]]
    limits = [item["verdict"] for _, item in items if item["verdict"] in ("right", "below")]
    powers = [item["verdict"] for _, item in items if item["verdict"] in ("within", "outside")]
    folds = [
        abs(math.log(one["predicted"]["top_speed"]["value"] / item["value"]))
        for one, item in items
        if item["quantity"] == "top_speed"
        and item["physical"]
        and one["predicted"].get("top_speed", {}).get("value")
    ]
    lines = []
    if limits:
        share = f"{limits.count('right')} of {len(limits)}"
        lines.append(f"Limits: {share} predictions are not below what is published.")
    if powers:
        lines.append(f"Power: {powers.count('within')} of {len(powers)} within a factor of 1.5.")
    if folds:
        mean = math.exp(statistics.fmean(folds))
        lines.append(
            f"Top speeds that are claims on machines: geometric mean fold error {mean:.2f} over "
            f"{len(folds)} machines."
        )
    return lines


def _own(found: Sequence[dict[str, Any]]) -> list[str]:
    """Table of the robots' own policies beside that of the family."""
    rows = [json.loads(path.read_text(encoding="utf-8")) for path in sorted(OWN.glob("*.json"))]
    if not rows:
        return []
    family = {one["robot"]: one["predicted"] for one in found}
    least, most = (of(len(row["seeds"]) for row in rows) for of in (min, max))
    seeds = counted(most, "seed") if least == most else f"{least} to {counted(most, 'seed')}"
    lines = [
        f"Policies of their own: {rows[0]['iterations']} iterations each from the family's, with",
        f"predicted masses; that of the family, then of {seeds} of its own. These were asked up to",
        "4.78 m/s or what their own training reached, that of the family up to 4.1 (A1) to 5.4 m/s",
        "(B2), by size.",
        "",
        "| robot | " + " | ".join(JUDGED.get(name, LABELS.get(name, "")) for name in OWNED) + " |",
        "| --- |" + " --- |" * len(OWNED),
    ]
    for row in rows:
        cells = []
        for name in OWNED:
            of = [one[name] for one in row["seeds"].values() if name in one]
            known = family.get(row["robot"], {}).get(name, {}).get("value")
            before = "-" if known is None else brief(known)
            ends = " to ".join(dict.fromkeys((brief(min(of)), brief(max(of))))) if of else ""
            cells.append(f"{before}; {ends}" if of else before)
        lines.append(f"| {row['robot']} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _ratios(found: Sequence[dict[str, Any]]) -> list[str]:
    lines = [
        "Capability with predicted masses over that with the maker's, by the same policy and",
        "seed. After a first fall the draws differ: ratios hold the chance of 16 roll-outs too,",
        "which is much of that of a kick.",
        "",
        "| capability | robots | median of abs(log ratio) | range of ratios |",
        "| --- | ---: | ---: | --- |",
    ]
    for policy, of_policy in ((FAMILY_NAME, ""), (ANY_NAME, ", any legs")):
        for name in COMPARED:
            of = ratios(by_policy(policy, found), name)
            if not of:
                continue
            spread = statistics.median(abs(math.log(ratio)) for ratio in of)
            label = SHOWN[name][0] + of_policy
            ends = f"{min(of):.2f} to {max(of):.2f}"
            lines.append(f"| {label} | {len(of)} | {100 * spread:.0f} % | {ends} |")
    return lines


def _causes(found: Sequence[dict[str, Any]]) -> list[str]:
    """Table of the change that each error of the masses makes."""
    rows = [one["causes"] for one in by_policy(FAMILY_NAME, found) if one.get("causes")]
    labels = list(dict.fromkeys(label for row in rows for of in row.values() for label in of))
    lines = [
        "Which error it is: the same with one of the maker's numbers in place of a predicted one,",
        "as the median over the robots of abs(log ratio), and the largest of any robot.",
        "",
        "| the maker's | " + " | ".join(SHOWN[name][0] for name in CAUSED) + " |",
        "| --- |" + " ---: |" * len(CAUSED),
    ]
    for label in labels:
        cells = []
        for name in CAUSED:
            of = [abs(math.log(row[name][label])) for row in rows if label in row[name]]
            cells.append(f"{100 * statistics.median(of):.1f} % ({100 * max(of):.0f} %)")
        lines.append(f"| {label} | " + " | ".join(cells) + " |")
    return lines


def _physics() -> list[str]:
    """Section with the capabilities under other physics, over those as trained."""
    if not PHYSICS.is_file():
        return []
    rows = json.loads(PHYSICS.read_text(encoding="utf-8"))
    by_robot = {(row["robot"], row["setting"]): row for row in rows}
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    shown = [name for name in UNDER if any(name in row for row in rows)]
    none = [
        f"the {SHOWN[name][0]} of {robot}"
        for name in shown
        for robot in robots
        if name not in by_robot[robot, USUAL] and not name.startswith("step")
    ]
    climb = [robot for robot in robots if "step_up" in by_robot[robot, USUAL]]
    lines = [
        "## Other physics",
        "",
        "By the policy of all quadrupeds (`python -m benchmarks.physics`), with predicted masses:",
        "capabilities over those with the physics of the training, as the median of",
        f"{', '.join(robots)}, and the",
        "least and the greatest. What falls by a sixth or more holds on that ground alone.",
        *([f"Left out, as there is none as trained: {', '.join(none)}."] if none else []),
        *([f"Steps are those of {' and '.join(climb)}; a dash was not measured."] if climb else []),
        "",
        "| physics | " + " | ".join(SHOWN[name][0] for name in shown) + " |",
        "| --- |" + " --- |" * len(shown),
    ]
    measured = {row["setting"] for row in rows}
    for setting_ in (one.label for one in SETTINGS if one.label in measured):
        cells = []
        for name in shown:
            of = [
                by_robot[robot, setting_][name] / by_robot[robot, USUAL][name]
                for robot in robots
                if all(by_robot.get((robot, s), {}).get(name) for s in (setting_, USUAL))
            ]
            ends = f"{statistics.median(of):.2f} ({min(of):.2f} to {max(of):.2f})" if of else "-"
            cells.append(ends)
        lines.append(f"| {setting_} | " + " | ".join(cells) + " |")
    return [*lines, ""]


def _columns(one: dict[str, Any]) -> list[str]:
    lines = [f"### {one['robot']}", "", "| | maker's masses | predicted |", "| --- | ---: | ---: |"]
    for name, (label, unit) in SHOWN.items():
        if name in one["predicted"]:
            cells = (_cell(one[arm][name]) for arm in ("maker", "predicted"))
            heading = label if unit == "1" else f"{label} [{unit}]"
            lines.append(f"| {heading} | " + " | ".join(cells) + " |")
    return [*lines, "", *(f"- {note}" for note in one["notes"])]


def _cell(one: dict[str, Any]) -> str:
    if one["value"] is None:
        return "-"
    if one["low"] == one["high"]:
        return brief(one["value"])
    return f"{brief(one['value'])} ({brief(one['low'])} to {brief(one['high'])})"


if __name__ == "__main__":
    run_as_command(main, __doc__)
