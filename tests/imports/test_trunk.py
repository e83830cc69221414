"""The trunk of an import without meshes, and the parts that are not stretched into it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from draft.description.description import Geometry
from draft.imports import solids
from draft.imports.importer import Imported, import_robot
from draft.values import scalar
from tests.imports.written import bolt, imported, joint, link, notes, quadruped

EXAMPLES = Path(__file__).parents[2] / "examples" / "descriptions"
BOX = '<collision><geometry><box size="{}"/></geometry></collision>'
# Of the box that has the inertia of each link of the quadruped [m].
OWN = [0.4, 0.2, 0.1]


def with_trunk(size: str, more: str = "") -> str:
    """A quadruped whose trunk has a box that collides."""
    return quadruped(more).replace("</link>", BOX.format(size) + "</link>", 1)


def trunk(found: Imported) -> list[float]:
    design = found.spec.resolve()
    return [float(design.parameters[f"trunk_{word}"]) for word in ("length", "width", "height")]


def test_primitives_that_collide_bound_a_trunk_without_meshes() -> None:
    found = imported(with_trunk("0.5 0.25 0.12"))
    assert trunk(found) == pytest.approx([0.5, 0.25, 0.12], abs=3e-3)
    # Its maker describes it so: nothing to warn of.
    assert found.files.trunk == "its primitives"
    assert not notes(found, "stand in")


def test_a_missing_mesh_and_what_stands_in_for_the_trunk_are_one_warning() -> None:
    (told,) = notes(imported(quadruped(mesh="gone.stl")), "mesh")
    words = "mesh 'gone.stl' is missing; for the trunk, the box with its inertia stands in"
    assert told == f"beast.urdf:2: {words}"


def test_primitives_far_smaller_than_the_trunk_do_not() -> None:
    found = imported(with_trunk("0.05 0.05 0.05"))
    assert trunk(found) == pytest.approx(OWN, abs=3e-3)
    assert notes(found, "the box with its inertia stands in")


def head(kind: str, name: str = "head") -> str:
    shape = BOX.format("0.1 0.08 0.1")
    text = link(name, 0.5).replace("</link>", f"{shape}</link>")
    limit = 'lower="-1" upper="1" effort="0" velocity="0"'
    return text + joint("neck", "body", name, (0.33, 0, 0.1), "0 0 1", limit, kind)


@pytest.mark.parametrize(
    ("more", "name"),
    [(head("revolute"), "head"), (head("fixed", "carry_handle"), "carry_handle")],
)
def test_a_held_head_and_a_handle_are_boxes_of_their_own(more: str, name: str) -> None:
    found = imported(with_trunk("0.5 0.25 0.12", more))
    assert trunk(found) == pytest.approx([0.5, 0.25, 0.12], abs=3e-3)
    design = found.spec.resolve()
    part = next(body for body in design.bodies if body.name == name)
    assert part.link.end is not None
    assert part.link.end.key == "box"
    volume = 0.1 * 0.08 * 0.1
    density = float(design.parameters[f"{name}_density"])
    assert design.body_masses()[name] == pytest.approx(density * volume, rel=1e-3)
    assert [float(x) for x in part.position] == pytest.approx([0.33, 0, 0.1], abs=1e-3)


def test_what_a_limb_hangs_on_stays_part_of_the_trunk() -> None:
    text = with_trunk("0.5 0.25 0.12")
    shoulder = link("payload_frame").replace("</link>", f"{BOX.format('0.1 0.1 0.1')}</link>")
    arm = joint("bolt", "body", "payload_frame", (0.4, 0, 0.1), kind="fixed")
    arm += link("boom") + joint("swing", "payload_frame", "boom", (0, 0, 0.1), "0 0 1")
    text = text.replace("</robot>", shoulder + arm + "</robot>")
    assert "payload_frame" not in {body.name for body in imported(text).spec.bodies}


@pytest.mark.parametrize(
    ("kind", "size", "edges"),
    [
        ("box", (0.1, 0.2, 0.3), (0.1, 0.2, 0.3)),
        ("sphere", (0.1,), (0.2, 0.2, 0.2)),
        ("cylinder", (0.1, 0.4), (0.2, 0.2, 0.4)),
        ("capsule", (0.1, 0.4), (0.2, 0.2, 0.6)),
    ],
)
def test_primitives_are_cut_like_meshes(
    kind: str, size: tuple[float, ...], edges: tuple[float, ...]
) -> None:
    shape = Geometry("collision", kind, size, position=(0.1, 0.0, 0.0))
    points = solids.triangles(shape).reshape(-1, 3)
    assert np.ptp(points, axis=0) == pytest.approx(edges, rel=0.02)
    assert points.min(axis=0)[0] == pytest.approx(0.1 - edges[0] / 2, abs=1e-6)


@pytest.mark.parametrize("text", [quadruped(), (EXAMPLES / "unitree_go2/go2.urdf").read_text()])
def test_the_trunk_of_an_import_keeps_its_mass_when_only_legs_change(text: str) -> None:
    spec = imported(text).spec
    before = spec.resolve()
    longer = spec.resolve({"thigh_length": 1.2 * before.parameters["thigh_length"]})
    assert scalar(longer.leg_length or 0) > 1.08 * scalar(before.leg_length or 0)
    assert longer.trunk.mass == before.trunk.mass
    assert longer.mass > before.mass


def test_an_import_weighs_what_the_law_says_at_its_own_legs() -> None:
    spec = imported(quadruped()).spec
    assert "thigh + shank of the robot that it came from" in Path("mine/root.yaml").read_text()
    own = spec.resolve()
    assert spec.root is not None
    by_law = replace(spec, root=replace(spec.root, leg_length=None)).resolve()
    assert own.trunk.leg_length == pytest.approx(by_law.leg_length, rel=1e-9)
    assert own.body_masses() == pytest.approx(by_law.body_masses(), rel=1e-9)
    # A larger trunk is heavier, by the law.
    wide = spec.resolve({"trunk_width": 0.3}).trunk
    volumes = wide.loft.volume / own.trunk.loft.volume
    assert wide.mass / own.trunk.mass == pytest.approx(volumes**0.5)


def test_an_import_on_other_legs_states_no_leg_length() -> None:
    found = import_robot(EXAMPLES / "unitree_go2/go2.urdf", "mine", population="humanoid")
    assert "leg_length" not in (found.folder / "root.yaml").read_text()


def bolted(name: str, parent: str, xyz: str, size: str, mass: float) -> str:
    """A link with a box, fixed to its parent."""
    return (
        f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.05" iyy="0.05" '
        f'izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial>{BOX.format(size)}</link>'
    ) + bolt(f"{name}_bolt", parent, name, xyz)


def test_a_trunk_whose_mesh_is_missing_is_not_stretched_over_its_mast() -> None:
    more = bolted("mast", "body", "-0.1 0 0.7", "0.05 0.05 1.2", 1.0)
    more += bolted("head", "mast", "0 0 0.7", "0.2 0.3 0.2", 2.0)
    found = imported(quadruped(more, mesh="gone.stl"), out="tall")
    values = found.files.texts["parameters.yaml"]
    size = re.findall(r"trunk_(?:length|width|height): {value: ([0-9.]+)", values)
    assert [float(x) for x in size] == pytest.approx(OWN, abs=0.02)
    (told,) = notes(found, "stands in")
    assert "without what reaches far out of it: 'mast', 'head'" in told
    plain = imported(quadruped(mesh="gone.stl"), out="plain")
    assert found.spec.resolve().mass == pytest.approx(plain.spec.resolve().mass)
