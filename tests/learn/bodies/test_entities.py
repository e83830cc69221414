"""mjlab takes the MJCF of shipped robots as it is."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import mujoco
import pytest

import draft


@pytest.mark.parametrize("name", draft.shipped())
def test_a_shipped_robot_is_an_mjlab_entity_as_it_is(name: str) -> None:
    mjlab = pytest.importorskip("mjlab.entity")
    design = draft.load(name).resolve()
    xml = design.build().xml
    config = mjlab.EntityCfg(spec_fn=lambda: mujoco.MjSpec.from_string(xml))
    entity = mjlab.Entity(config)
    model = entity.spec.compile()
    assert list(entity.joint_names) == list(design.joints)
    # mjlab hangs what is bolted to the world on a body that it can place.
    added = [] if design.floating else ["mocap_base"]
    assert list(entity.body_names) == [*added, *(body.name for body in design.bodies)]
    assert entity.is_fixed_base != design.floating
    assert model.body_subtreemass[0] == pytest.approx(float(design.mass), rel=1e-6)
