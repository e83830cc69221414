"""Export to OpenUSD with UsdPhysics, for Isaac Sim, Newton and viewers, as one file of text.

Newton's converter makes it of the URDF: bodies, shapes, joints, couplings. Added here is what URDF
has no place for: drives with the servos of `scene.xml`, and armatures in Newton's `NewtonJointAPI`.
Angular numbers of USD are in degrees: ranges, speeds, and gains per degree.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError
from draft.extras import need, usd_possible
from draft.model.scene import DAMPING, STIFFNESS
from draft.model.urdf import DECLARATION, distinct_name, meshes, robot_element
from draft.values import scalar

if TYPE_CHECKING:
    from draft.model.model import Model

_CONVERTER = "urdf_usd_converter"


def robot_usda(model: Model) -> str:
    """USD text of the robot, all joints at zero and the root at the origin.

    Raises:
        DraftError: the extra `usd` is not installed, or this Python or system has no converter.
    """
    converter, usd = _library(_CONVERTER), _library("pxr.Usd")
    with TemporaryDirectory() as folder:
        source = Path(folder) / "robot.urdf"
        # As for Gazebo: of a link without mass, USD would take the mass from its shapes.
        text = DECLARATION + robot_element(model, gazebo=True).text()
        source.write_text(text, encoding="utf-8")
        for name, content in meshes(model.design).items():
            path = source.parent / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
        with _warnings_only():
            made = converter.Converter(scene=False).convert(str(source), f"{folder}/usd")
        stage = usd.Stage.Open(made.path)
        for prim in stage.Traverse():
            if prim.IsInstance():  # Flattening would put what they share outside the robot.
                prim.SetInstanceable(False)
            if prim.HasAPI("NewtonArticulationRootAPI"):  # As in the MJCF.
                prim.GetAttribute("newton:selfCollisionEnabled").Set(False)
        _add_drives(stage, model)
        layer = stage.Flatten(addSourceFileComment=False)
        if model.design.floating:  # The converter fixes every root to the world.
            joints = layer.GetPrimAtPath(stage.GetDefaultPrim().GetPath()).nameChildren["Physics"]
            del joints.nameChildren["root_joint"]
        return layer.ExportToString()


def _library(module: str) -> Any:
    """Module of the converter or of OpenUSD, which comes with it."""
    if not usd_possible() and find_spec(_CONVERTER) is None:
        raise DraftError(
            "USD needs Python 3.11 or 3.12 on Linux or Windows, as its converter does",
            "export `urdf`, and run urdf-usd-converter where there is such a Python",
        )
    return need(module, "usd")


@contextmanager
def _warnings_only() -> Iterator[None]:
    """Silence what OpenUSD prints about each file that it writes."""
    messages = _library("usdex.core")
    before, active = messages.getDiagnosticsLevel(), messages.isDiagnosticsDelegateActive()
    messages.activateDiagnosticsDelegate()
    messages.setDiagnosticsLevel(messages.DiagnosticsLevel.eWarning)
    try:
        yield
    finally:
        messages.setDiagnosticsLevel(before)
        if not active:
            messages.deactivateDiagnosticsDelegate()


def _add_drives(stage: Any, model: Model) -> None:
    """Add to each joint its armature, and to each driven one its servo."""
    physics, design = _library("pxr.UsdPhysics"), model.design
    found = (prim for prim in stage.Traverse() if prim.IsA(physics.Joint))
    prims = {prim.GetDisplayName() or prim.GetName(): prim for prim in found}
    for name, joint in design.joints.items():
        prim = prims[distinct_name(design, name)]
        prim.GetAttribute("newton:armature").Set(float(model.mujoco.joint(name).armature[0]))
        a = design.drive(joint)
        if a is None:  # URDF states some limit.
            prim.GetAttribute("newton:velocityLimit").Set(math.inf)
            continue
        peak, turns = scalar(a.peak_torque), joint.kind != "prismatic"
        drive = physics.DriveAPI.Apply(prim, "angular" if turns else "linear")
        degree = math.radians(1) if turns else 1.0
        drive.CreateTypeAttr("force")
        drive.CreateMaxForceAttr(peak)
        drive.CreateStiffnessAttr(0.0 if joint.rolls else STIFFNESS * peak * degree)
        drive.CreateDampingAttr(DAMPING * peak * degree)
        if joint.rolls:
            drive.CreateTargetVelocityAttr(0.0)
        else:
            drive.CreateTargetPositionAttr(scalar(joint.home) / degree)
