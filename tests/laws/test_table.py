"""A table of actuators is read in SI units; what is wrong with it is named by file and line."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from pytest_regressions.file_regression import FileRegressionFixture

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


def _write(folder: Path, *rows: dict[str, str]) -> Path:
    names = list(rows[0])
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


def test_a_bad_number_that_may_be_blank_is_skipped_and_said(tmp_path: Path) -> None:
    cells = {"gear_ratio": "-3", "rotor_inertia_kg_m2": "high"}
    parts, skipped = read_parts(_write(tmp_path, {**GOOD, **cells}))
    assert [str(one).split("extra.csv:2: ")[1].split("\n")[0] for one in skipped] == [
        "gear_ratio of 'M1' is -3, not above zero: skipped",
        "rotor_inertia_kg_m2 of 'M1' is 'high', not a number: skipped",
    ]
    assert (parts["M1"].gear_ratio, parts["M1"].rotor_inertia) == (None, None)


def without(column: str) -> list[dict[str, str]]:
    return [{key: value for key, value in GOOD.items() if key != column}]


def named(old: str, new: str) -> list[dict[str, str]]:
    """The good row under another heading."""
    return [{new if key == old else key: value for key, value in GOOD.items()}]


BAD: dict[str, list[dict[str, str]]] = {
    **{f"no {one.heading}": [GOOD, {**GOOD, one.heading: ""}] for one in COLUMNS if one.required},
    **{
        f"{cell} for a {column}": [{**GOOD, column: cell}]
        for column in ("peak_torque_nm", "mass_kg", "length_mm")
        for cell in ("-3", "0", "nan", "inf", "1e999", "12 Nm")
    },
    "an unknown unit": named("mass_kg", "mass_lb"),
    "no unit": named("mass_kg", "mass"),
    "an unknown unit of two words": named("no_load_speed_rad_s", "no_load_speed_hz"),
    "an unknown column": named("vendor", "vendors"),
    "two columns for one quantity": [{**GOOD, "mass_g": "500"}],
    "a column that is not there": without("mass_kg"),
    "several": [{**GOOD, "name": f"M{i}", "mass_kg": "-1"} for i in range(3)],
}
FILES = {
    "an empty file": b"",
    "no text": b"\xff\xfe\x00name",
    "a row of another length": ",".join(GOOD).encode() + b"\nM2,Acme\n",
}


def test_a_bad_table_is_refused_with_every_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file_regression: FileRegressionFixture
) -> None:
    """Each message is pinned; `pytest --force-regen` accepts changed words."""
    monkeypatch.chdir(tmp_path)
    found = {"no file": _message(Path("none.csv")), "a folder": _message(Path())}
    for name, rows in BAD.items():
        found[name] = _message(_write(Path(), *rows))
    for name, data in FILES.items():
        Path("extra.csv").write_bytes(data)
        found[name] = _message(Path("extra.csv"))
    file_regression.check("".join(f"{name}\n{text}\n\n" for name, text in found.items()))


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
