"""A table of actuators is read in SI units; what is wrong with it is named by file and line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from draft.errors import DraftError
from draft.laws.catalogue import FILE, catalogue, read_parts, with_rows
from draft.laws.table import COLUMNS

GOOD = {
    "name": "M1",
    "vendor": "Acme",
    "family": "QDD",
    "peak_torque_nm": "20",
    "no_load_speed_rad_s": "30",
    "gear_ratio": "9",
    "mass_kg": "0.5",
    "diameter_mm": "90",
    "length_mm": "40",
    "rotor_inertia_kg_m2": "1e-4",
    "source": "https://example.org/m1",
}


def _write(folder: Path, *rows: dict[str, str], header: list[str] | None = None) -> Path:
    names = header or list(rows[0])
    lines = [",".join(names), *(",".join(row.get(name, "") for name in names) for row in rows)]
    path = folder / "extra.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _message(path: Path) -> str:
    with pytest.raises(DraftError) as error:
        read_parts(path)
    return str(error.value)


def test_a_row_is_read_in_si_units(tmp_path: Path) -> None:
    parts, skipped = read_parts(_write(tmp_path, GOOD))
    part = parts["M1"]
    assert not skipped
    assert (part.mass, part.radius, part.length) == (0.5, 0.045, 0.04)
    assert (part.gear_ratio, part.rotor_inertia) == (9.0, 1e-4)
    assert str(part.where).endswith("extra.csv:2")


def test_other_known_units_are_converted(tmp_path: Path) -> None:
    renamed = {
        "peak_torque_nm": ("peak_torque_mnm", "20000"),
        "no_load_speed_rad_s": ("no_load_speed_rpm", "286.4789"),
        "mass_kg": ("mass_g", "500"),
        "diameter_mm": ("diameter_cm", "9"),
        "length_mm": ("length_m", "0.04"),
        "rotor_inertia_kg_m2": ("rotor_inertia_g_cm2", "1000"),
    }
    row = {renamed.get(k, (k, v))[0]: renamed.get(k, (k, v))[1] for k, v in GOOD.items()}
    (there,) = read_parts(_write(tmp_path, row))[0].values()
    (here,) = read_parts(_write(tmp_path, GOOD))[0].values()
    for quantity in ("peak_torque", "no_load_speed", "mass", "radius", "length", "rotor_inertia"):
        assert getattr(there, quantity) == pytest.approx(getattr(here, quantity), rel=1e-6)


@pytest.mark.parametrize("column", [c.heading for c in COLUMNS if c.required])
def test_a_row_without_what_every_module_needs_is_refused(tmp_path: Path, column: str) -> None:
    message = _message(_write(tmp_path, GOOD, {**GOOD, "name": "M2", column: ""}, header=[*GOOD]))
    assert "extra.csv:3" in message
    assert f"{column} of 'M2' is missing" in message or column == "name"


@pytest.mark.parametrize(
    ("cell", "words"),
    [
        ("-3", "is -3, not above zero"),
        ("0", "is 0, not above zero"),
        ("nan", "is nan, not a finite number"),
        ("inf", "is inf, not a finite number"),
        ("1e999", "is 1e999, not a finite number"),
        ("12 Nm", "is '12 Nm', not a number"),
    ],
)
@pytest.mark.parametrize("column", ["peak_torque_nm", "mass_kg", "length_mm"])
def test_a_bad_number_that_every_module_needs_is_refused(
    tmp_path: Path, column: str, cell: str, words: str
) -> None:
    message = _message(_write(tmp_path, {**GOOD, column: cell}))
    assert f"extra.csv:2: {column} of 'M1' {words}" in message


@pytest.mark.parametrize("column", ["gear_ratio", "rotor_inertia_kg_m2"])
@pytest.mark.parametrize("cell", ["-3", "nan", "high"])
def test_a_bad_number_that_may_be_blank_is_skipped_and_said(
    tmp_path: Path, column: str, cell: str
) -> None:
    parts, skipped = read_parts(_write(tmp_path, {**GOOD, column: cell}))
    (problem,) = skipped
    assert f"extra.csv:2: {column} of 'M1' is" in str(problem)
    assert ": skipped" in str(problem)
    assert getattr(parts["M1"], column.removesuffix("_kg_m2")) is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("mass_kg", "mass_lb", "unknown unit 'lb'; use mass_kg or mass_g"),
        ("mass_kg", "mass", "the unit is missing; use mass_kg or mass_g"),
        ("no_load_speed_rad_s", "no_load_speed_hz", "unknown unit 'hz'"),
        ("vendor", "vendors", "did you mean 'vendor'"),
    ],
)
def test_an_unknown_unit_or_column_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    row = {new if k == old else k: v for k, v in GOOD.items()}
    message = _message(_write(tmp_path, row))
    assert f"extra.csv:1: unknown column '{new}'" in message
    assert words in message


def test_two_columns_for_one_quantity_are_refused(tmp_path: Path) -> None:
    message = _message(_write(tmp_path, {**GOOD, "mass_g": "500"}))
    assert "two columns give 'mass'" in message


def test_a_missing_column_is_named_with_its_units(tmp_path: Path) -> None:
    row = {k: v for k, v in GOOD.items() if k != "mass_kg"}
    assert "extra.csv:1: no column 'mass_kg'" in _message(_write(tmp_path, row))


def test_every_problem_of_a_table_is_listed(tmp_path: Path) -> None:
    rows = [{**GOOD, "name": f"M{i}", "mass_kg": "-1"} for i in range(3)]
    message = _message(_write(tmp_path, *rows))
    assert [f"extra.csv:{line}" in message for line in (2, 3, 4)] == [True] * 3


def test_a_row_of_another_length_is_refused(tmp_path: Path) -> None:
    path = _write(tmp_path, GOOD)
    path.write_text(path.read_text(encoding="utf-8") + "M2,Acme\n", encoding="utf-8")
    assert "extra.csv:3: 2 cells under 11 headings" in _message(path)


def test_a_file_that_is_not_there_a_folder_and_an_empty_one_are_named(tmp_path: Path) -> None:
    assert "none.csv: cannot be read" in _message(tmp_path / "none.csv")
    assert "cannot be read" in _message(tmp_path)
    empty = tmp_path / "empty.csv"
    empty.write_text("", encoding="utf-8")
    assert "no column 'name'" in _message(empty)
    empty.write_bytes(b"\xff\xfe\x00name")
    assert "is not a CSV table" in _message(empty)


def test_a_name_that_is_there_already_is_refused_with_both_places(tmp_path: Path) -> None:
    path = _write(tmp_path, {**GOOD, "name": "AK80-6"})
    with pytest.raises(DraftError, match=r"extra.csv:2: there is already a module 'AK80-6'") as e:
        with_rows([path])
    assert f"{FILE}:2" in str(e.value)


def test_further_rows_come_after_the_shipped_ones(tmp_path: Path) -> None:
    parts, skipped = with_rows([_write(tmp_path, GOOD)])
    assert not skipped
    assert list(parts) == [*catalogue(), "M1"]


def test_the_shipped_table_has_nothing_to_skip() -> None:
    parts, skipped = read_parts(FILE)
    assert not skipped
    assert all(math.isfinite(part.mass) for part in parts.values())
