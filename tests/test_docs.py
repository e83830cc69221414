"""What is written about Draft is what Draft does."""

from docs import format as reference


def test_the_reference_of_the_files_is_what_the_models_say():
    assert reference.FILE.read_text(encoding="utf-8") == reference.text()
