"""What is written about Draft is what Draft does."""

from docs import actuator_forms
from docs import format as reference


def test_the_reference_of_the_files_is_what_the_models_say():
    assert reference.FILE.read_text(encoding="utf-8") == reference.text()


def test_the_tables_of_the_actuator_trends_are_what_the_code_gives():
    written = actuator_forms.FILE.read_text(encoding="utf-8")
    assert written == actuator_forms.text(written)
    assert written.count("<!-- ") == 3 + len(actuator_forms.TRIED)
