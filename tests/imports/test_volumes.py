"""Robots slimmer than the surveyed ones: structure by visible volume."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import draft
from draft.imports.importer import Imported
from draft.imports.options import Options
from draft.imports.reduce import Body
from draft.imports.shapes import volume
from draft.imports.spec_tree import Writer
from draft.imports.stated import parse
from draft.imports.volumes import DENSITIES
from tests.imports.written import CUBE, imported, quadruped, written

LONG = 0.2
TREE = Path("mine/tree.yaml")


def made(width: float, torque: str = "", factor: float = 1.0) -> Imported:
    """Import a quadruped whose legs are rods of a width [m]."""
    written(CUBE, "rod.obj")
    text = re.sub('effort="[0-9]+" ', "", quadruped(factor=factor))
    scale = f"{width / 0.6} {width / 0.2} {LONG / 0.1}"
    shape = f'<visual><geometry><mesh filename="rod.obj" scale="{scale}"/></geometry></visual>'
    text = re.sub('(_(?:hip|thigh|calf)".*?)</link>', rf"\1{shape}</link>", text)
    given = Options(torque=parse([torque], "--torque", "N m")) if torque else Options()
    return imported(text, out=f"mine{factor:g}" if factor != 1 else "mine", options=given)


def structure(found: Imported, kind: str, change: dict[str, float] | None = None) -> float:
    """Mass of one segment of a kind [kg]."""
    design = found.spec.resolve(change or {})
    return next(float(one.mass) for one in design.segments if one.kind == kind)


@pytest.mark.parametrize("seed", range(5))
def test_the_volume_of_a_box_is_its_volume_however_it_lies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = np.array([[x, y, z] for x in (0, 0.3) for y in (0, 0.04) for z in (0, 0.06)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    faces = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 5, 1), (0, 4, 5), (2, 3, 7)]
    faces += [(2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 7, 3), (1, 5, 7)]
    triangles = (corners @ turn.T + rng.normal(size=3))[np.array(faces)]
    assert volume(triangles) == pytest.approx(0.3 * 0.04 * 0.06, rel=0.01)


def test_slim_thighs_weigh_their_visible_volume_with_their_drives() -> None:
    found = made(0.03)
    design = found.spec.resolve()
    bodies = {body.name: body for body in design.bodies}
    knee = bodies["FL_thigh"].actuator
    assert knee is not None
    whole = DENSITIES["thigh"] * 0.03 * 0.03 * LONG
    assert structure(found, "thigh") + float(knee.mass) == pytest.approx(whole, rel=0.01)
    assert "slimmer" in (found.folder / "import.json").read_text(encoding="utf-8")


@pytest.mark.parametrize("torque", ["", "2"])
def test_legs_of_a_usual_width_weigh_by_length_also_with_weak_drives(torque: str) -> None:
    made(0.12, torque)
    assert "per_metre" not in TREE.read_text(encoding="utf-8")
    assert "density: population" in Path("mine/root.yaml").read_text(encoding="utf-8")


def test_a_longer_slim_leg_weighs_more_in_proportion() -> None:
    found = made(0.03)
    longer = structure(found, "thigh", {"thigh_length": 0.44})
    assert longer == pytest.approx(structure(found, "thigh") * 2, rel=1e-6)


def test_each_member_of_a_slim_link_with_a_bend_weighs_by_its_own_length() -> None:
    lengths = {"thigh_length": 0.1, "thigh_length_2": 0.3}
    parameters = SimpleNamespace(value=lengths.__getitem__, add=lambda name, *_: name)
    volumes = SimpleNamespace(structure=lambda _: 0.02)
    writer = SimpleNamespace(volumes=volumes, parameters=parameters, population="quadruped")
    nodes: list[dict[str, Any]] = [
        {"link": {"length": name, "segment": "thigh"}} for name in lengths
    ]
    Writer.weigh(cast("Writer", writer), nodes, cast("Body", None), "thigh_link")
    masses = [node["link"]["mass"] for node in nodes]
    assert masses == ["thigh_per_metre * thigh_length", "thigh_per_metre * thigh_length_2"]


def test_a_slim_trunk_gets_a_density_only_below_that_of_the_structure_law() -> None:
    found = made(0.03)
    stated = found.spec.resolve()
    text = (found.folder / "root.yaml").read_text(encoding="utf-8")
    by_law = re.sub("density: .*", "density: population", text)
    (found.folder / "root.yaml").write_text(by_law, encoding="utf-8")
    assert float(stated.trunk.mass) <= float(draft.load(found.folder).resolve().trunk.mass)


def test_stating_the_torques_of_a_slim_robot_keeps_its_limbs_slim() -> None:
    made(0.03, "2")
    assert "mass: thigh_per_metre * thigh_length" in TREE.read_text(encoding="utf-8")


def test_no_mass_of_the_maker_enters() -> None:
    light, heavy = (made(0.03, factor=factor).spec.resolve() for factor in (1, 5))
    assert float(light.mass) == float(heavy.mass)
