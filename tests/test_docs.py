"""The documentation agrees with the code."""

import doctest
from pathlib import Path

import pytest

from docs import actuator_forms
from docs import format as reference

PYTHON = Path(reference.FILE).with_name("python.md")


def test_the_reference_of_the_files_is_what_the_models_say():
    assert reference.FILE.read_text(encoding="utf-8") == reference.text()


@pytest.mark.slow
def test_the_tables_of_the_actuator_trends_are_what_the_code_gives():
    written = actuator_forms.FILE.read_text(encoding="utf-8")
    assert written == actuator_forms.text(written)
    assert written.count("<!-- ") == 3 + len(actuator_forms.TRIED)


@pytest.mark.slow
def test_the_examples_of_the_page_on_python_run(tmp_path, monkeypatch):
    for module in ("pyarrow", "scipy"):
        pytest.importorskip(module)
    monkeypatch.chdir(tmp_path)
    found = doctest.testfile(str(PYTHON), module_relative=False)
    assert found.attempted > 15
    assert found.failed == 0
