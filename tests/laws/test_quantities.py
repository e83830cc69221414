"""The table of actuator quantities, and all that reads it."""

from __future__ import annotations

from typing import Any

import pytest

import draft
from draft.laws.quantities import QUANTITIES, Identity
from draft.spec.schema import STATED
from tests.changed_package import ChangedPackage

# Line of the table after which a copy of the package gains another one.
AFTER = "    volume: Value = _line("  # What follows the mass.
NEW = """    torque_density: Value = _line(
        "kN m/kg", "torque per mass", "Peak torque over mass [kN m/kg].",
        law=Identity("tau / m", ("peak_torque", "mass"), lambda torque, mass: torque / mass),
        shown=("N m/kg", 1e3),
    )
"""
# What its readers say of it: data for `json`.
READ = """
import io, json, types
import numpy as np, rich.console
import draft, docs.format
from draft.cli import show
from draft.design.bands import actuator_bands
from draft.design.report import design_file, report
from draft.variation.axes import parse, unit_of
from draft.explore.where import condition
from draft.fitting.actuators.catalogue_rows import rows_of
from draft.laws.catalogue import catalogue
from draft.reporting import tables
from draft.reporting.subjects import subjects
from draft.spec.jsonschema import schema_text
from draft.studio import cards, fields

KEY = "actuators.leg.torque_density"
spec = draft.load("hopper")
one, of_two = spec.resolve(), spec.resolve({"actuators.leg.peak_torque": np.array([40.0, 80.0])})
stated = spec.resolve({KEY: 0.03})
text = io.StringIO()
rich.console.Console(file=text, width=200).print(show._actuators(one))
leg = one.actuators["leg"]
print(json.dumps({
    "ratio": leg.torque_density / (leg.peak_torque / leg.mass),
    "two": len(of_two.actuators["leg"].torque_density),
    "stated": stated.actuators["leg"].torque_density,
    "kind": stated.actuators["leg"].origins["torque_density"].kind,
    "band": "torque_density" in actuator_bands(leg),
    "record": report(one)["actuators"]["leg"]["torque_density"],
    "file": design_file(stated)["values"][KEY],
    "resolved": design_file(one)["resolved"]["actuators"]["leg"]["torque_density"],
    "expression": spec.resolve({"thigh_length": "10*leg.torque_density/leg.torque_density/50"})
        .parameters["thigh_length"],
    "condition": bool(condition(spec, "leg.torque_density > 0").holds(one, {})[0]),
    "varied": unit_of(spec, parse(spec, [KEY + "=0.01:0.02"])[0].name),
    "show": text.getvalue(),
    "page": tables.actuators(subjects([one])),
    "card": cards.actuators(one),
    "slider": fields.stated(stated, "leg")[-1]._asdict(),
    "field": KEY in fields.names(spec),
    "schema": json.loads(schema_text("parameters"))["$defs"]["ActuatorClass"],
    "reference": docs.format.text(),
    "column": int(rows_of(catalogue().values()).has("torque_density").sum()),
}, default=float))
"""


@pytest.fixture(scope="module")
def added(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """What a copy of the package says whose table of quantities gains one entry."""
    inserted = {"laws/quantities.py": {AFTER: NEW}}
    return ChangedPackage(tmp_path_factory.mktemp("copy"), inserted).run("-c", READ)


@pytest.mark.slow
def test_a_quantity_is_added_by_its_line_and_its_law(added: dict[str, Any]) -> None:
    """The recipe of CONTRIBUTING: sized, stated, with a band, and in every reader."""
    assert added["ratio"] == 1.0
    assert added["two"] == 2
    assert (added["stated"], added["kind"], added["file"]) == (0.03, "stated", 0.03)
    record = added["record"]
    assert (record["unit"], record["origin"], record["from"]) == ("kN m/kg", "derived", "tau / m")
    assert set(record["inputs"]) == {"peak_torque", "mass"}
    assert added["resolved"] == record["value"]
    # Expressions, conditions and ranges.
    assert added["expression"] == pytest.approx(0.2)
    assert added["condition"]
    assert added["varied"] == "kN m/kg"
    # Tables, pages and the studio, in the unit that is shown.
    (row,) = (line for line in added["show"].splitlines() if "torque per mass" in line)
    assert row.split()[3:6] == [f"{record['value'] * 1e3:.4g}", "N", "m/kg"]
    assert "torque per mass<small>N m/kg</small>" in added["page"]
    assert "torque per mass" in added["card"]
    assert added["field"]
    slider = added["slider"]
    assert (slider["name"], slider["unit"]) == ("actuators.leg.torque_density", "kN m/kg")
    text = "Peak torque over mass [kN m/kg]."
    assert slider["doc"].startswith(f"{text} Catalogue modules:")
    # The schema, the reference and the fits.
    assert added["schema"]["properties"]["torque_density"]["description"] == text
    assert f"| `torque_density` | *number* | {text} |" in added["reference"]
    assert "`mass`, `torque_density`," in added["reference"]
    assert added["column"] == 114


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_quantity_says_what_it_is(name: str) -> None:
    quantity = QUANTITIES[name]
    assert quantity.text[0].isupper()
    assert quantity.text.endswith(".")
    assert quantity.unit == "1" or f"[{quantity.unit}]" in quantity.text
    assert quantity.factor == 1.0 or quantity.shown[0]


def test_every_quantity_of_a_sized_class_has_a_law_above_its_inputs() -> None:
    above: set[str] = set()
    for name, quantity in QUANTITIES.items():
        if isinstance(quantity.law, Identity):
            assert set(quantity.law.inputs) <= above
        above.add(name)
    sized = draft.load("quadruped").resolve().actuators["leg"]
    assert set(QUANTITIES) - set(sized.quantities) == {
        *("corner_speed", "stall_torque", "width", "height"),
    }
    assert {*QUANTITIES} - {*STATED} == {"volume", "stall_torque", "width", "height"}
