"""Robots of one's own, for tests of the studio."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import draft
from draft.spec.load import ROBOTS


def with_motor_of_its_own(folder: Path) -> draft.Spec:
    """A hopper in a folder, whose motor is like a module of the table there."""
    shutil.copytree(ROBOTS / "hopper", folder)
    (folder / "mine.csv").write_text(
        "name,vendor,family,peak_torque_nm,no_load_speed_rad_s,gear_ratio,mass_kg,diameter_mm,"
        "length_mm,rotor_inertia_kg_m2,source\n"
        "S-40,Acme,S,40,25,9,0.80,96,45,0.00008,data sheet 2026\n"
        "S-80,Acme,S,80,21,9,1.25,112,56,0.00016,data sheet 2026\n"
    )
    file = folder / "parameters.yaml"
    text = file.read_text().replace("population:", "catalogue: mine.csv\npopulation:", 1)
    file.write_text(
        re.sub("(?m)^  leg:\n", "  leg:\n    like: S-40\n", text).replace(
            "    peak_torque: 50\n    no_load_speed: 25\n", ""
        )
    )
    return draft.load(folder)
