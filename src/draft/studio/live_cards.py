"""Cards about the walking robot and the clicked link, as HTML; all text is escaped."""

from __future__ import annotations

from html import escape

from draft.design import Design
from draft.errors import counted
from draft.studio import plots
from draft.studio.cards import COLORS, card
from draft.studio.walker import Walker
from draft.values import scalar

KEYS = "Keys: I and K faster and slower, J and L turn, U and O sideways, M stand, P push."


def walking(walker: Walker) -> str:
    """Speed, falls and limits of the walking robot, or why it stands."""
    if not walker.on:
        return card('<div class="mute">The robot stands.</div>')
    walk = walker.walk
    if walk is None:
        text = "<br>".join(escape(line.strip()) for line in walker.message.splitlines())
        return card(_note(plots.WARN, "It stands", text, "ds-stands"))
    return card(
        f'<div class="row"><span id="ds-speed">{walker.speed:.2f} m/s</span>'
        f'<span class="mute">asked for {walker.command[0]:.2f} m/s</span>'
        f'<span class="mute" id="ds-falls">{_falls(walk.falls)}</span></div>'
        f'<div id="ds-limit">{escape(walker.verdict())}</div>',
        "" if walk.fit.inside else _flag(walk.fit.outside[0].name),
    )


def region(walker: Walker) -> str:
    """Policy of the walking robot, and what lies outside its region of validity."""
    if walker.walk is None:
        return card(f'<div class="mute">{KEYS}</div>') if not walker.on else ""
    found = walker.walk.fit
    about = f'<div class="mute">Policy of {escape(found.name)}.</div>'
    if not found.inside:
        text = escape(found.warning[:1].upper() + found.warning[1:]) + ". It still tries."
        about = _note(plots.WARN, "Not trained for this body", text, "ds-outside")
    return card(about, f'<div class="mute">{KEYS}</div>')


def link(design: Design, body: int) -> str:
    """Mass, drive and findings of one link.

    Args:
        design: the design.
        body: index of its body, the trunk being 0.
    """
    one = design.bodies[body]
    mass = scalar(list(design.body_masses().values())[body])
    share = 100 * mass / scalar(design.mass)
    rows = [("mass", f"{mass:.3f} kg, {share:.1f} % of the robot")]
    joint = design.joints.get(one.prefix + one.joint.name) if one.joint is not None else None
    places = {one.name}
    if one.joint is not None and joint is not None:
        low, high = (scalar(end) for end in joint.range)
        unit = "m" if joint.slide else "rad"
        span = "rolls" if joint.rolls else f"{low:.2f} to {high:.2f} {unit}"
        span += f", {joint.moved_by}" if joint.moved_by else ""
        rows.append(("joint", f"{one.prefix + one.joint.name}, {span}"))
        places.add(one.prefix + one.joint.name)
    for what, actuator in (
        ("driven by", design.drive(joint) if joint else None),
        ("carries", one.actuator),
    ):
        if actuator is None:
            continue
        numbers = f"{scalar(actuator.peak_torque):.3g} N m, {scalar(actuator.no_load_speed):.3g}"
        rows.append((what, f"actuator {actuator.name}: {numbers} rad/s"))
        places.add(actuator.name)
    cells = "".join(
        f'<tr><td class="mute">{what}</td><td>{escape(text)}</td></tr>' for what, text in rows
    )
    # A finding about one of several copies, such as the four legs, is about all of them.
    own = {b.name: b.name.removeprefix(b.prefix) for b in design.bodies}
    places.add(own[one.name])
    found = [f for f in design.findings if places & {own.get(w, w) for w in f.where.split("/")}]
    notes = [
        _note(COLORS[f.severity], f"{f.severity}: {f.id.replace('_', ' ')}", escape(f.message))
        for f in found
    ] or ['<div class="mute">no findings about it</div>']
    return card(f'<h3 id="ds-link">Link {escape(one.name)}</h3>', f"<table>{cells}</table>", *notes)


def _flag(name: str) -> str:
    words = f"Not trained for this {escape(name)}; it still tries."
    return f'<div style="color:{plots.WARN}">{words}</div>'


def _falls(count: int) -> str:
    return "no falls" if not count else counted(count, "fall")


def _note(color: str, title: str, text: str, name: str = "") -> str:
    mark = f' id="{name}"' if name else ""
    return (
        f'<div class="note"{mark} style="border-color:{color}"><b style="color:{color}">'
        f"{escape(title)}</b>{text}</div>"
    )
