"""What Draft predicts of real robots beside what is published: writes docs/real-robots.md.

    python -m docs.real_robots                           # the page, from the measured columns
    python -m docs.real_robots --measure ../shared/robots/survey unitree_go2 unitree_a1

With `--measure` it measures robots first, of which a folder has the descriptions, and writes what
`draft twin FILE --capabilities --json` prints to examples/results/real_robots.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import tyro

from draft.cli.display.capabilities import SHOWN, record
from draft.learn.measuring.evaluation_options import Extras
from draft.validation.compare import real_robot
from draft.values import brief

ROOT = Path(__file__).resolve().parents[1]
PAGE, RESULTS = ROOT / "docs/real-robots.md", ROOT / "examples/results/real_robots"
# Physics of the page: what holds on hard ground, with the delay of a real controller.
HONEST = Extras(contact_time=0.01, delay=0.01)
JUDGED = {
    "top_speed": "top speed [m/s]",
    "step_up": "step [m]",
    "payload_peak": "standing load [kg]",
    "walking_power": "power of a walk [W]",
}
INTRODUCTION = """\
What Draft predicts of {count} machines ({names}) from their makers' descriptions: joints, lengths,
torques and speeds are the maker's, masses and inertias Draft's, with the machine held out of the
trends. One policy drives all of them; it was trained on bodies of Draft alone and has seen none of
them. `draft twin FILE --capabilities` measures one robot; [limits](limits.md) tells what the
numbers leave out.

Physics: contacts with a time constant of 10 ms, targets that arrive 10 ms late, 16 roll-outs of 9 s
at each command, kick and step, and no command that is faster than those of the training."""
RULE = """\
The rule, stated before the comparison: top speed, step and standing load are limits of a machine.
Products keep below them, so a prediction below the best published figure of that machine is an
error, and one above it is not. The power of a walk is right within a factor of 1.5. A payload
without a definition is not judged. A, B and C: measured in a paper or certified, stated by the
maker, secondary text. A top speed below sqrt(g L), where walking ends, is a claim on a product, and
in brackets."""
COMPARED = ("top_speed", "kick", "step_up", "walking_power")
ENERGIES = ("walking_power",)


def main(
    keys: Annotated[tuple[str, ...], tyro.conf.Positional] = (),
    /,
    measure: Path | None = None,
    policy: str | None = None,
) -> None:
    """Measure robots if asked, and write the page."""
    if measure is not None:
        RESULTS.mkdir(parents=True, exist_ok=True)
        for key in keys:
            file = next(iter(sorted(measure.glob(f"{key}.*"))))
            print(key, file=sys.stderr)
            found = real_robot(file, key=key, policy=policy, conditions=HONEST)
            text = json.dumps(record(found), indent=1) + "\n"
            (RESULTS / f"{key}.json").write_text(text, encoding="utf-8")
    PAGE.write_text(page(records()), encoding="utf-8")
    print(PAGE)


def records() -> list[dict[str, Any]]:
    """Measured columns of all robots, by key."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(RESULTS.glob("*.json"))]


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
            "## The maker's masses and predicted ones",
            "",
            *_ratios(found),
            "",
            "## All columns",
            "",
            *(line for one in found for line in (*_columns(one), "")),
        )
    )


def _introduction(found: Sequence[dict[str, Any]]) -> list[str]:
    names = ", ".join(one["robot"] for one in found)
    return INTRODUCTION.format(count=len(found), names=names).splitlines()


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


def _ratios(found: Sequence[dict[str, Any]]) -> list[str]:
    lines = [
        "Capability with predicted masses over that with the maker's, by the same policy, noise",
        "and starts.",
        "",
        "| capability | robots | median of abs(log ratio) | range of ratios |",
        "| --- | ---: | ---: | --- |",
    ]
    for name in COMPARED:
        pairs = [(one["predicted"].get(name), one["maker"].get(name)) for one in found]
        ratios = [
            ours["value"] / theirs["value"]
            for ours, theirs in pairs
            if ours and theirs and ours["value"] and theirs["value"]
        ]
        if not ratios:
            continue
        spread = statistics.median(abs(math.log(ratio)) for ratio in ratios)
        label = SHOWN[name][0]
        ends = f"{min(ratios):.2f} to {max(ratios):.2f}"
        lines.append(f"| {label} | {len(ratios)} | {100 * spread:.0f} % | {ends} |")
    return lines


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
    tyro.cli(main, description=__doc__)
