"""Model: one design as MJCF, compiled by MuJoCo and checked by Draft."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.design import Design
from draft.errors import ModelError, Problem, RefusedError
from draft.model import mjcf
from draft.model.scene import scene_xml
from draft.values import brief

TOLERANCE = 1e-6
# Where MuJoCo says that a fault is, and the name of an element.
_LINE = re.compile(r"\bline (\d+)")
_NAME = re.compile(r'\bname="([^"]*)"')


@dataclass(frozen=True, eq=False, repr=False)
class Model:
    """A compiled design.

        >>> model = draft.load("quadruped").resolve("cheetah").build()
        >>> model.mujoco.nv, model.xml.splitlines()[0]
        (18, '<mujoco model="quadruped">')
        >>> model.save("cheetah").name
        'cheetah'

    Attributes:
        design: the design.
        xml: MJCF text of the robot, from which MuJoCo compiled the model.
        mujoco: the compiled model.
    """

    design: Design
    xml: str
    mujoco: mujoco.MjModel

    def __repr__(self) -> str:
        mass = f"{brief(self.design.mass)} kg"
        return f"Model('{self.design.reference}', {mass}, nq={self.mujoco.nq}, nv={self.mujoco.nv})"

    @cached_property
    def scene_xml(self) -> str:
        """MJCF text of the scene with floor, light, home pose and servos; includes `robot.xml`."""
        return scene_xml(self.design, self.mujoco)

    def scene(self) -> mujoco.MjModel:
        """Compile the scene.

        Raises:
            ModelError: MuJoCo does not accept it.
        """
        try:
            return mujoco.MjModel.from_xml_string(
                self.scene_xml, assets={"robot.xml": self.xml.encode()}
            )
        except ValueError as error:
            raise _not_accepted(error, self.scene_xml) from None

    def simulate(self) -> Design:
        """Let the servos of the scene hold the home pose on its floor for two seconds.

            >>> weak = draft.load("quadruped").resolve({"actuators.leg.peak_torque": 6}).build()
            >>> {"weak_servo", "falls"} <= {finding.id for finding in weak.simulate().findings}
            True

        Returns:
            The design with the findings of the simulation added: `start_penetration`,
            `unstable_servo` (an error), `weak_servo` and `falls`.

        Raises:
            ModelError: MuJoCo does not accept the scene.
        """
        from draft.design.filter import with_allowance
        from draft.model.simulate import simulate

        found = simulate(self.design, self.scene())
        more = tuple(with_allowance(finding, self.design) for finding in found)
        return replace(self.design, findings=(*self.design.findings, *more))

    def save(
        self,
        folder: str | Path,
        formats: Sequence[str] = ("mjcf",),
        more: Mapping[str, str] | None = None,
    ) -> Path:
        """Write the model's folder atomically; see `draft.model.folder.save`.

        Args:
            folder: folder to write.
            formats: formats to write: "mjcf", "urdf", "sdf", "glb", "step", "usd", or
                those of extensions.
            more: text of further files by name, such as report.html.

        Returns:
            The folder.

        Raises:
            DraftError: a format is unknown, the folder holds other files, or it cannot be written.
            ModelError: MuJoCo does not accept the scene.
        """
        from draft.model.folder import save

        return save(self, Path(folder), formats, more or {})


def build(design: Design) -> Model:
    """Compile one design and check its masses.

    Raises:
        RefusedError: the design filter found errors; one problem per error.
        ModelError: MuJoCo does not accept the model, or computes other masses than the design.
    """
    errors = [finding for finding in design.findings if finding.severity == "error"]
    if errors:
        raise RefusedError([Problem(f"{f.id}: {f.message}", None, f.remedy) for f in errors])
    model = preview(design)
    _check_masses(design, model.mujoco)
    return model


def preview(design: Design) -> Model:
    """Compile one design for viewing, even if the design filter refuses it.

    The masses of the model are not checked.

    Raises:
        ModelError: MuJoCo does not accept the model.
    """
    xml = mjcf.robot_xml(design)
    try:
        return Model(design, xml, mujoco.MjModel.from_xml_string(xml))
    except ValueError as error:
        raise _not_accepted(error, xml) from None


def _check_masses(design: Design, model: mujoco.MjModel) -> None:
    expected = mjcf.body_masses(design)
    compiled = model.body_mass[1:]
    wrong = np.abs(compiled - expected) > TOLERANCE * np.maximum(expected, 1e-9)
    if not wrong.any():
        return
    k = int(np.argmax(wrong))
    raise ModelError(
        f"the mass of '{design.bodies[k].name}' is {compiled[k]:.9g} kg in MuJoCo and "
        f"{expected[k]:.9g} kg in the design",
        "this is a bug in Draft: report it with the spec",
    )


def _not_accepted(error: ValueError, xml: str) -> ModelError:
    """Error of a model that MuJoCo refuses; it names the body where MuJoCo names a line alone."""
    said = " ".join(str(error).split())
    name = at_fault(said, xml)
    where = f" (in '{name}')" if name and f"'{name}'" not in said else ""
    return ModelError(
        f"MuJoCo does not accept the model: {said}{where}",
        "check the link or joint named in the message",
    )


def at_fault(message: str, xml: str) -> str:
    """Name of the element on the line that MuJoCo's message gives, or of the body around it.

    Args:
        message: such as "number is too large in attribute 'size' Element 'geom', line 22".
        xml: the text that MuJoCo read.

    Returns:
        The name; "" if the message gives no line.
    """
    found = _LINE.search(message)
    lines = xml.splitlines()[: int(found[1])] if found else []
    for element in reversed(lines):
        own = element is lines[-1] or element.lstrip().startswith("<body ")
        if own and (name := _NAME.search(element)):
            return name[1]
    return ""
