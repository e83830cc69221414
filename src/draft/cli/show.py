"""`draft show`: print a robot as a tree and tables."""

from __future__ import annotations

from rich.console import Group
from rich.table import Table
from rich.text import Text
from rich.tree import Tree

from draft.cli.display.record import record
from draft.cli.display.sustained import print_limits
from draft.cli.display.verdict import console, print_findings, verdict
from draft.cli.options import DesignArgument, DesignName, JsonOutput, Payload, Values, open_design
from draft.design import Design
from draft.design.actuators import Actuator, Origin
from draft.design.bands import actuator_bands
from draft.design.report import actuator_rows, mass_by_origin, mass_parts, own_parts
from draft.design.structure_law import structure_laws, trunk_words
from draft.design.widened import mass_with_band
from draft.spec.primitives.root import TrunkPart

BAR = 28
_ORIGINS = {"trend": "predicted"}


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    payload: Payload = None,
    json: JsonOutput = False,
) -> int:
    """Show the tree, masses, actuators and findings of a robot."""
    resolved, clock = open_design(reference, design, values, payload)
    if json:
        print(record(resolved, clock, None))
        return 0 if resolved.accepted else 1
    out = console()
    sound = resolved.accepted and resolved.judged
    out.print(Text(verdict(resolved), style="bold green" if sound else "bold red"))
    if resolved.spec.doc:
        out.print(Text(resolved.spec.doc, style="dim"))
    out.print(Group("", _tree(resolved), "", _actuators(resolved), "", _masses(resolved)))
    if resolved.lofted is not None:
        out.print(_trunk(resolved, resolved.lofted))
    print_limits(resolved)
    print_findings(resolved)
    if not resolved.findings:
        out.print("no findings")
    return 0 if resolved.accepted else 1


def _tree(design: Design) -> Tree:
    """Return the bodies with joints and masses; a chain that is used again is only named."""
    masses = design.body_masses()
    nodes: list[Tree] = []
    drawn: dict[int, str] = {}
    hidden: set[int] = set()
    for i, body in enumerate(design.bodies):
        if body.parent is None:
            nodes.append(Tree(_label(design, i, masses[body.name])))
            continue
        if body.parent in hidden:
            hidden.add(i)
            nodes.append(nodes[body.parent])
            continue
        link = id(design.spec.bodies[i].link)
        twin = drawn.get(link)
        if twin is not None:
            hidden.add(i)
            text = Text.assemble(body.name, (f"  as {twin}", "dim"))
            nodes.append(nodes[body.parent].add(text))
            continue
        drawn[link] = body.name
        nodes.append(nodes[body.parent].add(_label(design, i, masses[body.name])))
    return nodes[0]


def _label(design: Design, index: int, mass: object) -> Text:
    body = design.bodies[index]
    text = Text.assemble((body.name, "bold"), f"  {mass:.3f} kg")
    if body.joint is not None:
        axis = " ".join(f"{x:g}" for x in body.joint_axis)
        unit = {"prismatic": "m, slides", "continuous": "rad, without end"}
        low, high = body.joint.range
        span = f"{low:g}..{high:g} {unit.get(body.joint.kind, 'rad')}"
        span = "rolls" if body.joint.rolls else span
        span += f", {body.joint.moved_by}" if body.joint.moved_by else ""
        text.append(f"  {body.joint.name} ({axis}) {span}", style="cyan")
    if body.actuator is not None:
        text.append(f"  [{body.actuator.name}]", style="magenta")
    return text


def _actuators(design: Design) -> Group:
    tables: list[Table | str] = []
    for actuator in design.actuators.values():
        tables += [_actuator(actuator), ""]
    return Group(*tables[:-1])


def _actuator(actuator: Actuator) -> Table:
    like = f", like {actuator.like}" if actuator.like else ""
    table = Table(
        title=f"actuator {actuator.name}{like}",
        title_justify="left",
        box=None,
        title_style="bold",
        pad_edge=False,
    )
    table.add_column("")
    table.add_column("value", justify="right")
    table.add_column("", style="dim")
    table.add_column("from", style="dim")
    table.add_column("n", justify="right", style="dim")
    table.add_column("held-out error", justify="right", style="dim")
    table.add_column("90 % band", justify="right")
    bands = actuator_bands(actuator)
    for key, quantity in actuator_rows([actuator]).items():
        factor = quantity.factor
        origin = actuator.origins.get(key, Origin("stated"))
        trend = actuator.laws.law(origin.trend) if origin.trend else None
        source = origin.kind if origin.kind == "stated" else origin.detail
        table.add_row(
            quantity.label,
            f"{getattr(actuator, key) * factor:.4g}",
            quantity.table_unit,
            source,
            str(trend.n) if trend else "",
            f"{trend.held_out['vendor']:.2f} x" if trend and trend.held_out else "",
            " .. ".join(f"{x * factor:.3g}" for x in bands[key]) if key in bands else "",
        )
    return table


def _trunk(design: Design, trunk: TrunkPart) -> Text:
    """Return the law that the trunk weighs by, and how far such totals are off."""
    if trunk.density_stated:
        stated = "stated density" if trunk.shape is None else "own part"
        return Text(f"trunk by its {stated}\n", style="dim")
    laws = structure_laws(design)
    error = f"totals of held-out {laws.name}s err by {laws.held_out_total:.2f} x"
    return Text(f"trunk by {trunk_words(design, trunk)}\n{error}\n", style="dim")


def _masses(design: Design) -> Table:
    """Return the mass of actuators by class, trunk and segments."""
    table = Table(title="mass", title_justify="left", title_style="bold", box=None, pad_edge=False)
    table.add_column("")
    table.add_column("kg", justify="right")
    table.add_column("%", justify="right")
    table.add_column("")
    total = float(design.mass)
    for label, mass in mass_parts(design):
        share = mass / total
        bar = Text("█" * round(share * BAR), style="blue")
        table.add_row(label, f"{mass:.2f}", f"{100 * share:.0f}", bar)
    table.add_row(Text("total", style="bold"), Text(f"{total:.2f}", style="bold"), "", "")
    mass = mass_with_band(design)
    low, high = (f"{x:.1f}" for x in (mass.low, mass.high))
    why = f"wider: {', '.join(mass.wider)}" if mass.wider else ""
    table.add_row("90 % band", Text(f"{low} .. {high}"), "", Text(why, style="dim"))
    if parts := own_parts(design):
        for origin, kg in mass_by_origin(design).items():
            files = ", ".join(
                dict.fromkeys(one["file"] for one in parts if one["origin"] == origin)
            )
            share, note = kg / total, Text(files, style="dim")
            table.add_row(_ORIGINS.get(origin, origin), f"{kg:.2f}", f"{100 * share:.0f}", note)
    return table
