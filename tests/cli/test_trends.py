"""`draft trends`, called as a shell would call it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

import draft
from draft.errors import DraftError
from draft.laws.actuators import FILE
from draft.laws.catalogue import FILE as CATALOGUE
from tests.commands import Command

HEADER = "name,vendor,family,peak_torque_nm,no_load_speed_rad_s,gear_ratio,mass_kg,diameter_mm,"
HEADER += "length_mm,rotor_inertia_kg_m2,source\n"
ROWS = {
    "good": "M1,Acme,QDD,20,30,9,0.45,90,40,1e-4,https://example.org\n",
    "grams": "M2,Acme,QDD,20,30,9,450,90,40,1e-4,https://example.org\n",
    "blank": "M3,Acme,QDD,20,30,9,,90,40,1e-4,https://example.org\n",
    "skipped": "M4,Acme,QDD,20,30,9,0.45,90,40,-1,https://example.org\n",
}


def _table(*rows: str) -> str:
    Path("extra.csv").write_text(HEADER + "".join(ROWS[row] for row in rows), encoding="utf-8")
    return "extra.csv"


def _add(line: str) -> None:
    with Path("robot/parameters.yaml").open("a", encoding="utf-8") as file:
        file.write(f"{line}\n")


def test_the_table_shows_published_and_reproduced_figures_side_by_side(command: Command) -> None:
    lines = command("trends table").out.splitlines()
    assert lines[0].split() == [
        *("quantity", "figure", "published", "source", "reproduced", "draft")
    ]
    assert any(line.split()[-5:] == ["1.31", "paper", "1.31", "same", "1.242"] for line in lines)
    assert sum(" differs " in line for line in lines) == 1
    assert any(line.split()[-4:] == ["released", "data", "0.666", "same"] for line in lines)
    figures = command.json("trends table")["actuators"]
    (mass,) = [
        f for f in figures if (f["quantity"], f["figure"]) == ("mass", "error, vendor held out")
    ]
    assert (mass["published"], mass["reproduced"], mass["same"]) == ("1.31", "1.31", True)
    assert mass["source"] == "paper"
    assert [f["figure"] for f in figures if f["same"] is False] == ["R2"]


def test_the_check_of_the_shipped_catalogue_names_the_rows_that_sources_contradict(
    command: Command,
) -> None:
    out = command("trends check").out
    assert out.endswith("114 modules, 4 doubts\n")
    assert "contradicted: AK80-64: two sources give 0.85 kg, not 1.40 kg" in out


def test_wrong_rows_are_reported_with_their_file_and_row(command: Command) -> None:
    table = _table("good", "grams")
    out = command(f"trends check --catalogue {table}", code=1).out
    assert "extra.csv:3: unit slip: M2: mass 450 kg, where such modules have about" in out
    assert "perhaps grams, not kilograms" in out
    (doubt,) = command.json(f"trends check --catalogue {table}", code=1)["doubts"]
    assert (doubt["kind"], doubt["file"], doubt["line"]) == ("unit_slip", "extra.csv", 3)
    out = command(f"trends fit --catalogue {table} --out doubted.json").out
    assert "extra.csv:3: unit slip: M2: mass 450 kg, where such modules have about" in out
    table = _table("good", "blank")
    err = command(f"trends fit --catalogue {table} --out x.json", code=2).err
    assert "extra.csv:3: mass_kg of 'M3' is missing" in err
    assert not Path("x.json").exists()
    err = command(f"trends check --catalogue {_table('skipped')}").err
    assert "warning: extra.csv:2: rotor_inertia_kg_m2 of 'M4' is -1, not above zero: skipped" in err


@pytest.mark.slow
def test_a_robot_can_use_laws_refitted_with_rows_of_its_own(command: Command) -> None:
    robot = Path("robot")
    shipped = FILE.read_bytes()
    fit = f"trends fit --catalogue {_table('good')}"
    assert "from 115 modules" in command(f"{fit} --out robot/mine.json").out
    assert "written to trends.json" in command(fit).out
    assert Path("trends.json").is_file()
    assert FILE.read_bytes() == shipped
    before = draft.load(robot).resolve().actuators["leg"].mass
    _add("trends: mine.json")
    leg = draft.load(robot).resolve().actuators["leg"]
    assert leg.laws.name == "mine.json"
    assert leg.mass == pytest.approx(before, rel=0.05)
    assert leg.mass != before


def test_a_robot_picks_its_set_of_laws() -> None:
    robot = Path("robot")
    file = robot / "parameters.yaml"
    data = yaml.safe_load(file.read_text(encoding="utf-8"))
    masses = {}
    for name in (None, "draft", "paper"):
        data["trends"] = name
        chosen = {key: value for key, value in data.items() if value is not None}
        file.write_text(yaml.safe_dump(chosen), encoding="utf-8")
        masses[name] = draft.load(robot).resolve().actuators["leg"].mass
    assert masses[None] == masses["draft"] != masses["paper"]


def test_a_robot_can_use_structure_trends_fitted_to_other_robots(command: Command) -> None:
    robot = Path("robot")
    before = draft.load(robot).resolve()
    command("survey fit --out robot/mine.json")
    _add("structure: mine.json")
    assert draft.load(robot).resolve().mass == pytest.approx(before.mass, rel=1e-9)
    own = json.loads(Path("robot/mine.json").read_text(encoding="utf-8"))
    for people in ("humanoid", "quadruped"):
        own[people]["trunk"]["terms"][0]["factor"] *= 2
    Path("robot/mine.json").write_text(json.dumps(own), encoding="utf-8")
    after = draft.load(robot).resolve()
    assert after.trunk.mass == pytest.approx(2 * before.trunk.mass)
    assert after.mass_band(0.9).high > before.mass_band(0.9).high


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "structure: ../mine.json",
            r"parameters.yaml:\d+:12: .*expected calibrated, paper or the name of a .json",
        ),
        ("structure: none.json", "none.json: cannot be read: no such file"),
        ("structure: bad.json", "bad.json: holds no structure trends of"),
        *(
            (f"trends: {value}", r"parameters.yaml:\d+:9: .*expected draft, paper or")
            for value in ("best", "../mine.json", "a/b.json", "3", "[draft]")
        ),
    ],
)
def test_trends_that_cannot_be_used_are_named(line: str, words: str) -> None:
    Path("robot/bad.json").write_text('{"humanoid": 3}', encoding="utf-8")
    _add(line)
    with pytest.raises(DraftError, match=words):
        draft.load("robot").resolve()


@pytest.mark.slow
def test_figures_are_written_as_png_and_pdf(command: Command) -> None:
    pytest.importorskip("matplotlib")
    out = command("trends figures --out figures").out
    names = {path.name for path in Path("figures").iterdir()}
    kinds = {"actuator_relations", "actuator_predicted", "held_out_errors"}
    kinds |= {"structure_by_class", "structure_predicted"}
    assert names == {f"{kind}.{end}" for kind in kinds for end in ("png", "pdf")}
    assert all(path.stat().st_size > 5000 for path in Path("figures").iterdir())
    assert Path(out.splitlines()[0]).exists()
    Path("file").write_text("", encoding="utf-8")
    assert "cannot write file" in command("trends figures --out file", code=2).err
    assert "cannot write file/here.json" in command("trends fit --out file/here.json", code=2).err


def test_a_robot_names_modules_of_its_own(command: Command) -> None:
    command("new mine --like hopper")
    path = Path("mine/parameters.yaml")
    text = path.read_text()
    header = CATALOGUE.read_text().splitlines()[0]
    numbers = ["super_x", "me", "mine", "900", "20", "9", "2", "90", "60"]
    row = dict(zip(header.split(","), numbers, strict=False)) | {"source": "https://example.com"}
    line = ",".join(row.get(name, "") for name in header.split(","))
    Path("mine/mine.csv").write_text(f"{header}\n{line}\n")
    strong = "check mine --set actuators.leg.like=super_x"
    command(strong, code=2)
    path.write_text(text.replace("population:", "catalogue: mine.csv\npopulation:", 1))
    command(strong)
    for wrong in ("../mine.csv", "mine.json", "gone.csv"):
        path.write_text(text.replace("population:", f"catalogue: {wrong}\npopulation:", 1))
        assert wrong in command.refuses("check mine")
