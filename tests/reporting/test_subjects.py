"""How the command line names designs, and what the page calls them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import draft
from draft.design.references import open_designs
from draft.errors import DraftError
from draft.reporting.subjects import subjects
from tests.written import write_robot


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_robot(Path("monoped"))


def test_a_word_is_a_spec_a_design_a_file_or_a_saved_model() -> None:
    model = draft.load("monoped").resolve("long").build()
    model.save("model")
    words = ["monoped", "monoped:long", "monoped:model/design.yaml", "model", "quadruped:bear"]
    designs = open_designs(words)
    assert [design.name for design in designs] == ["monoped"] * 4 + ["quadruped"]
    lengths = [design.parameters["thigh_length"] for design in designs]
    assert lengths[:4] == [0.3, 0.45, 0.45, 0.45]
    titles = [subject.title for subject in subjects(designs)]
    assert titles == [
        "monoped",
        "monoped long",
        "monoped design",
        "monoped design 2",
        "quadruped bear",
    ]


def test_titles_of_one_robot_are_its_designs() -> None:
    found = subjects(open_designs(["monoped", "monoped:long", "monoped:long"]))
    assert [subject.title for subject in found] == ["default", "long", "long 2"]
    assert len({subject.color for subject in found}) == 3


def test_a_saved_model_of_an_unknown_robot_is_explained() -> None:
    draft.load("monoped").resolve().build().save("model")
    Path("monoped").rename("elsewhere")
    with pytest.raises(DraftError, match=r"SPEC:model/design\.yaml"):
        open_designs(["model"])
    assert open_designs(["elsewhere:model/design.yaml"])[0].name == "monoped"


def test_a_saved_model_whose_robot_has_changed_is_refused() -> None:
    draft.load("monoped").resolve().build().save("model")
    path = Path("model/report.json")
    record = json.loads(path.read_text())
    path.write_text(json.dumps(record | {"mass_kg": 99.0}))
    with pytest.raises(DraftError, match="was written of 99 kg"):
        open_designs(["model"])
    path.write_text("[]")
    with pytest.raises(DraftError, match=r"report\.json. cannot be read"):
        open_designs(["model"])
