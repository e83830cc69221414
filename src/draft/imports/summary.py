"""Summary of an import, with remedies."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from draft.design.widened import ExpectedMass
from draft.imports.drives import GUESSED, LISTED, example
from draft.imports.formatting import Deviation
from draft.imports.volumes import is_slim

if TYPE_CHECKING:
    from draft.imports.importer import Files

Lines = list[tuple[str, str]]


def summary(files: Files, mass: ExpectedMass) -> Lines:
    """Headings and texts, in the order of interest.

    Args:
        files: the import.
        mass: what `expected_mass` says of its design.
    """
    limbs, knees = files.limbs, files.knees
    lines = [("population", f"{limbs.population}: {limbs.reason}; `population` overrules it")]
    if files.fixed:
        lines = [("machine", "on a fixed base: no limb reaches the ground")]
    lines.append(("joints", _joints(files)))
    lines.append(("left and right", _sides(files.deviations, files.mirrored)))
    lines.append(("torques", _sources(files, "torque_from", "`torque`", 17)))
    lines.append(("speeds", _sources(files, "speed_from", "`speed`", 12)))
    if limbs.population == "quadruped" and knees.place is not None:
        text = f"driven at the {knees.place}: {knees.why}"
        lines.append(("knees", f"{text}; `knee_drive` overrules it"))
    if not files.fixed:
        lines.append(("trunk", f"from {files.trunk}"))
    if is_slim(files.drives):
        text = "of slim links, at most what their visible volume weighs in robots of other makers"
        lines.append(("structure", text))
    text = f"{mass.mass:.1f} kg, 90 % band {mass.low:.1f} to {mass.high:.1f}"
    why = f"; wider than the trends' own: {', '.join(mass.wider)}" if mass.wider else ""
    lines.append(("expected mass", text + why))
    return lines


def record(files: Files, mass: ExpectedMass) -> dict[str, object]:
    """The same as plain data for JSON."""
    return {
        "population": {"is": files.population, "why": files.limbs.reason},
        "torques": dict(Counter(one.torque_from for one in files.drives.values())),
        "speeds": dict(Counter(one.speed_from for one in files.drives.values())),
        "knee_drive": {"place": files.knees.place, "why": files.knees.why},
        "trunk": files.trunk or None,
        "expected_mass_kg": {
            "mass": mass.mass,
            "band_90": [mass.low, mass.high],
            "wider_because": list(mass.wider),
        },
    }


def _joints(files: Files) -> str:
    """Joints found, held and dropped."""
    counts = files.reduced.counts
    held = [
        f"{count} {name.removesuffix(' joints')}"
        for name, count in counts.items()
        if name.endswith(" joints")
    ]
    moving = [body for body in files.reduced.root.all() if body.joint is not None]
    coupled = sum(body.coupled for body in moving)
    slides = sum(body.slides and not body.coupled for body in moving)
    text = f"{len(files.drives)} driven hinges"
    text += f", {coupled} joints that follow them" if coupled else ""
    text += f", {slides} slides without a drive" if slides else ""
    text += f"; held or dropped: {', '.join(held)}" if held else "; none held"
    fixed = counts.get("fixed joints merged", 0)
    return text + (f"; {fixed} fixed ones merged" if fixed else "")


def _sides(deviations: tuple[Deviation, ...], mirrored: int) -> str:
    """Whether left and right are equal."""
    if not deviations:
        return "equal" if mirrored else "no limbs that are mirror images"
    shared = sum(one.shared for one in deviations)
    apart = [one for one in deviations if not one.shared]
    text = f"{shared} dimensions differ by millimetres and share a parameter" if shared else ""
    if apart:
        text += "; " if text else ""
        names = ", ".join(one.own for one in apart[:LISTED])
        text += f"{len(apart)} truly differ ({names}): edit both sides"
    return text


def _sources(files: Files, field: str, option: str, value: float) -> str:
    """Number of drives by the source of their torque or speed."""
    sources = {name: str(getattr(one, field)) for name, one in files.drives.items()}
    counts = Counter(sources.values())
    text = ", ".join(f"{counts[name]} {name}" for name in ("declared", "stated") if counts[name])
    for name, why in (("replaced", "implausible"), ("assumed", "none in the file")):
        if counts[name]:
            text += f"{', ' if text else ''}{counts[name]} {name} ({why})"
    guessed = [name for name, source in sources.items() if source in GUESSED]
    return text + (
        f"; state them, {example(option, value, files.reduced, guessed)}" if guessed else ""
    )
