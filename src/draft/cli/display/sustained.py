"""Table of what a design can sustain: loads for a time, and how long it stands."""

from __future__ import annotations

import math

from rich.table import Table

from draft.cli.display.verdict import console
from draft.design import Design
from draft.design.battery import battery
from draft.design.electronics import electronics
from draft.metrics import of_design, overload, payload_for
from draft.metrics.heat import HOUR, hold_time_fold
from draft.values import brief, scalar

SHORT = 10.0


def print_limits(design: Design) -> None:
    """Print what a design can sustain; nothing for a robot without legs."""
    if not design.floating:
        return
    found = of_design(design, ["standing_torque_rated", "hold_time", "payload_peak"])
    share, time, peak = (scalar(value) for value in found.values())
    if math.isnan(share):
        return
    table = Table(
        title="what it can sustain",
        title_justify="left",
        title_style="bold",
        box=None,
        pad_edge=False,
    )
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("", style="dim")
    table.add_column("90 % band", justify="right")
    table.add_column("metric", style="dim")
    name = "standing_torque_rated"
    table.add_row("standing torque / rated, worst joint", f"{share:.3g}", "", "", name)
    fold = hold_time_fold()
    endless = math.isinf(time)
    band = "" if endless else f"{brief(time / fold)} .. {brief(time * fold)}"
    table.add_row(
        "it can stand for",
        "no limit" if endless else brief(time),
        "" if endless else "s",
        band,
        "hold_time",
    )
    more = "more " if scalar(design.payload_mass) > 0 else ""
    for words, seconds in (("an hour", HOUR), ("ten seconds", SHORT)):
        load = payload_for(design, seconds)
        low, high = max(scalar(load.low), 0.0), max(scalar(load.high), 0.0)
        mass = scalar(load.mass)
        shown = brief(mass) if mass > 0 else "none"
        band = f"{brief(low)} .. {brief(high)}"
        name = "payload_hour" if seconds == HOUR else ""
        table.add_row(f"{more}payload for {words}", shown, "kg", band, name)
    words = f"{more}payload at peak torque, without heat"
    table.add_row(words, brief(peak), "kg", "", "payload_peak")
    energy = battery(design)
    low, high = (brief(scalar(end)) for end in energy.band)
    known = low == high
    text = "battery" if design.battery_stated else "battery, usual for its mass"
    band = "" if known else f"{low} .. {high}"
    table.add_row(text, brief(scalar(energy.energy)), "Wh", band)
    power, hours = of_design(design, ["standing_power", "endurance_standing"]).values()
    drawn = electronics(design)
    band = " .. ".join(f"{scalar(power - drawn.power + end):.3g}" for end in drawn.band)
    band = "" if drawn.law is None else band
    table.add_row("power while standing", f"{scalar(power):.3g}", "W", band, "standing_power")
    ends = [scalar(hours * end / energy.energy) for end in energy.band]
    band = "" if known else f"{ends[0]:.2g} .. {ends[1]:.2g}"
    table.add_row("standing on it", f"{scalar(hours):.2g}", "h", band, "endurance_standing")
    console().print(table, "")
    if words := own_weight(design):
        console().print(words, "", markup=False)


def own_weight(design: Design) -> str:
    """Sentence on a robot too heavy for its own rated torque; "" for others."""
    found = overload(design)
    if found is None:
        return ""
    mass = -scalar(of_design(design, ["payload_rated"])["payload_rated"])
    pose = "in the crouch" if design.floating else "at its reach"
    weight = "its own weight" + (" and its payload" if scalar(design.payload_mass) > 0 else "")
    return (
        f"payload_rated is below zero: the robot cannot hold {weight} at rated torque {pose}. "
        f"It is {brief(mass)} kg too heavy: {found.joint} needs {brief(found.torque)} of "
        f"{brief(found.rated)} N m."
    )
