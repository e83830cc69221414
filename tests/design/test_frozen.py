"""A design does not change under the hands of who made it or who reads it."""

from __future__ import annotations

import numpy as np
import pytest

import draft


def test_a_design_keeps_its_numbers_when_the_callers_array_changes():
    given = np.array([0.3, 0.4])
    design = draft.load("quadruped").resolve({"thigh_length": given})
    given[:] = 9.0
    assert np.asarray(design.parameters["thigh_length"]).tolist() == [0.3, 0.4]
    assert np.asarray(design.values["thigh_length"]).tolist() == [0.3, 0.4]


def test_a_caller_cannot_write_into_the_faces_that_lofts_share():
    loft = draft.load("quadruped").resolve().trunk.loft
    with pytest.raises(ValueError, match="read-only"):
        loft.faces()[0] = 0


def test_the_report_tells_a_second_opinion_on_the_mass():
    from draft.design.report import report

    design = draft.load("quadruped").resolve("cheetah")
    opinion = report(design)["mass_by_leg_length"]
    assert opinion["inside_the_data"]
    assert opinion["leg_length_m"] == pytest.approx(np.hypot(0.25, 0.10 - 0.023) + 0.23)
    assert opinion["mass_kg"] == pytest.approx(13.2 + 107.2 * 0.4916**2.886, rel=2e-3)
    assert opinion["held_out_error"] < opinion["held_out_error_of_the_sum_over_segments"]
