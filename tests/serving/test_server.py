"""The server of viser: what it keeps from the terminal."""

from __future__ import annotations

import warnings

import pytest

from draft.serving.server import Server


def test_what_comes_too_late_for_a_closed_tab_is_dropped_in_silence() -> None:
    pytest.importorskip("viser")
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        server = Server("127.0.0.1", 0)
        shown = server.viser.gui.add_number("speed", 0.0)
        server.close()
        shown.value = 1.0
    assert [str(one.message) for one in seen if "closed connection" in str(one.message)] == []
