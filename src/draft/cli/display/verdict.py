"""Terminal output of the design filter: findings and verdict."""

from __future__ import annotations

from rich.console import Console
from rich.markup import escape

from draft.design import Design
from draft.design.findings import grouped
from draft.design.machine import machine
from draft.errors import counted
from draft.spec import Spec
from draft.values import scalar

STYLES = {"error": "bold red", "warning": "yellow"}


def console() -> Console:
    """Return a console that does not wrap lines when its output goes to a file."""
    # `:bear:` in `quadruped:bear:` is not an emoji.
    made = Console(highlight=False, emoji=False)
    if made.is_terminal:
        return made
    return Console(highlight=False, emoji=False, width=200, soft_wrap=True)


def verdict(design: Design) -> str:
    """One line: name, accepted, refused or not judged, kind of machine, mass, joints."""
    word = "refused" if not design.accepted else "accepted" if design.judged else "not judged"
    load = scalar(design.payload_mass)
    mass = f"{design.mass:.1f} kg" + (f" with its payload of {load:.4g} kg" if load > 0 else "")
    joints = counted(len(design.joints), "joint")
    return f"{design.name} ({design.label}): {word}, {machine(design)}, {mass}, {joints}"


def print_verdict(design: Design) -> None:
    """Print the findings, then the verdict."""
    print_findings(design)
    print(verdict(design))


def print_findings(design: Design) -> None:
    """Print errors first, then warnings, each kind once for a class of parts, with its remedy."""
    out = console()
    for finding in grouped(design.findings):
        severity, style = finding.severity, STYLES[finding.severity]
        allowed = f" [dim](allowed by '{finding.allowed}')[/]" if finding.allowed else ""
        out.print(
            f"[{style}]{severity:<7}[/] [bold]{finding.id}[/] {escape(finding.message)}{allowed}"
        )
        if finding.remedy:
            at = _place(design.spec, finding.where)
            out.print(f"        [dim]{escape(f'{at}: ' if at else '')}{escape(finding.remedy)}[/]")


def _place(spec: Spec, where: str) -> str:
    """Place in the files of an actuator class, or of the first of a pair of links; "" for none."""
    name = where.partition("/")[0]
    links = {body.name: body.link.where for body in spec.bodies}
    found = spec.actuators[name].where if name in spec.actuators else links.get(name)
    return str(found or "")
