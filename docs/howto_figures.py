"""Pictures with numbers for the how-to pages: motors, an exported URDF, a swing test."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from docs.pictures import ROW, TURN, line_up
from draft import plotting
from draft.design.actuators import Actuator
from draft.model.model import Model
from draft.model.picture import Exhibit, Pixels, draw
from draft.spec import load
from draft.values import scalar

DPI = 200
WIDTH = 4.5  # [in], as the pictures without numbers: 900 pixels
DARK, LIGHT = (0.24, 0.25, 0.28, 1.0), (0.62, 0.63, 0.66, 1.0)
# Half length of the axes of a joint's frame, and radius [m].
AXIS, THIN = 0.19, 0.007
COLORS = ((0.85, 0.15, 0.15, 1.0), (0.15, 0.6, 0.2, 1.0), (0.15, 0.3, 0.85, 1.0))
# Rows of the table of actuators: key of actuators.json -> unit.
ROWS = {
    "range": "rad",
    "home": "rad",
    "peak_torque": "N m",
    "no_load_speed": "rad/s",
    "gear_ratio": "",
    "armature": "kg m²",
    "friction_loss": "N m",
    "damping": "N m s/rad",
    "kp": "N m/rad",
    "kd": "N m s/rad",
}


def motors(models: dict[str, Model], path: Path) -> None:
    """Draw robots that differ by their motor, and below each its motor, enlarged.

    Args:
        models: robots with one class of actuators, by what is known of it.
        path: PNG to write.
    """
    save(path, partial(_motors, models))


def _motors(models: dict[str, Model]) -> Figure:
    classes = [next(iter(model.design.actuators.values())) for model in models.values()]
    upper = draw(line_up(models.values(), gap=0.25), ROW, (1200, 480))
    lower = draw(_cylinders(classes), (180, -8), (1200, 300))
    figure, (above, below) = plt.subplots(2, 1, figsize=(WIDTH, 3.5), height_ratios=(48, 30))
    _show(above, upper)
    _show(below, lower)
    for i, (title, model, motor) in enumerate(zip(models, models.values(), classes, strict=True)):
        middle = (2 * i + 1) / (2 * len(models))
        _write(above, (middle, 1.0), f"{title}\nrobot {scalar(model.design.mass):.2f} kg", "bottom")
        text = (
            f"motor {scalar(motor.mass):.2f} kg\n"
            f"⌀ {2000 * scalar(motor.radius):.0f} x {1000 * scalar(motor.length):.0f} mm\n"
            f"armature {scalar(motor.armature):.4f} kg m²"
        )
        _write(below, (middle, -0.02), text, "top")
    return figure


def _write(ax: Any, place: tuple[float, float], text: str, align: str) -> None:
    ax.annotate(text, place, xycoords="axes fraction", ha="center", va=align)


def _cylinders(classes: Sequence[Actuator]) -> list[Exhibit]:
    """Exhibits of actuators on the floor, each with its output in front."""
    wide = 2.3 * max(scalar(one.radius) for one in classes)
    found = []
    for i, one in enumerate(classes):
        r, h = scalar(one.radius), scalar(one.length) / 2
        spec = mujoco.MjSpec()
        body = spec.worldbody.add_body(name="motor")
        body.add_freejoint(name="base")
        for radius, half, ahead, color in ((r, h, 0.0, DARK), (0.6 * r, 0.15 * h, 1.15 * h, LIGHT)):
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_CYLINDER,
                size=(radius, half, 0),
                pos=(ahead, 0, 0),
                quat=(np.sqrt(0.5), 0, np.sqrt(0.5), 0),
                rgba=color,
            )
        found.append(Exhibit(spec, "base", r, {}, (0.0, i * 1.5 * wide), 0.5))
    return found


def exported(folder: Path, path: Path) -> None:
    """Draw an exported robot: its URDF with the frames of the joints, and its actuators.

    Args:
        folder: folder of `draft export`.
        path: PNG to write.
    """
    save(path, partial(_exported, folder))


def _exported(folder: Path) -> Figure:
    actuators = json.loads((folder / "actuators.json").read_text(encoding="utf-8"))
    joints = actuators["joints"]
    figure, (left, right) = plt.subplots(1, 2, figsize=(WIDTH, 2.15), width_ratios=(1.15, 1.15))
    spec = mujoco.MjSpec.from_file(str(folder / "robot.urdf"))
    spec.worldbody.first_body().add_freejoint(name="base")
    for joint in list(spec.joints):
        if joint.name in joints:
            _add_frame(joint.parent, joint.axis)
    home = {name: joint["home"] for name, joint in joints.items()}
    shown = Exhibit(spec, "base", actuators["base_height_at_home"], home, yaw=TURN - 0.25)
    _show(left, draw([shown], ROW, (1000, 900)))
    left.set_title("robot.urdf, frame of every joint (x y z)")
    own = list(joints)[:3]
    cells = [[_text(joints[name][key]) for name in own] for key in ROWS]
    right.set_axis_off()
    right.set_title(f"actuators.json, {len(own)} of {len(joints)} joints")
    table = right.table(
        cells,
        rowLabels=[f"{key} [{unit}]" if unit else key for key, unit in ROWS.items()],
        colLabels=own,
        cellLoc="center",
        bbox=(0.32, 0.05, 0.68, 0.9),
        edges="horizontal",
    )
    table.auto_set_font_size(False)
    table.set_fontsize(5)
    for cell in table.get_celld().values():
        cell.set_linewidth(0.4)
    return figure


def swing(folder: Path, path: Path) -> None:
    """Draw a swing test: its record, and the swing of the design and of what was measured.

    Args:
        folder: folder of the page, with the log and the robot.
        path: PNG to write.
    """
    save(path, partial(_swing, folder))


def _swing(folder: Path) -> Figure:
    xml = re.search(r"<mujoco>.*</mujoco>", (folder / "log_swing.py").read_text(), re.DOTALL)
    time, angle, _ = np.loadtxt(folder / "swing.csv", delimiter=",", skiprows=1).T
    figure, ax = plt.subplots(figsize=(WIDTH, 2.6))
    ax.plot(time, angle, color="0.75", linewidth=3, label="record")
    spec = load(folder / "dog")
    for name, design in {"as designed": None, "as measured": "measured"}.items():
        motor = spec.resolve(design).actuators["leg"]
        model = mujoco.MjModel.from_xml_string(xml[0] if xml else "")
        model.dof_armature, model.dof_damping = scalar(motor.armature), scalar(motor.damping)
        model.dof_frictionloss = scalar(motor.friction_loss)
        data = mujoco.MjData(model)
        data.qpos[0] = angle[0]
        found = []
        for _ in time:
            found.append(data.qpos[0])
            mujoco.mj_step(model, data)
        text = (
            f"{name}: {data.model.dof_armature[0]:.3f} kg m², {model.dof_frictionloss[0]:.3f} N m"
        )
        ax.plot(time, found, linewidth=0.8, label=f"{text}, {model.dof_damping[0]:.3f} N m s/rad")
    ax.set(xlabel="time [s]", ylabel="angle from hanging [rad]")
    ax.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    return figure


def _text(value: float | Sequence[float]) -> str:
    """Text of a number, or of the ends of a range."""
    values = value if isinstance(value, Sequence) else [value]
    return " to ".join(f"{x:.4g}" for x in values)


def _add_frame(body: Any, axis: Any) -> None:
    """Add the axes of a joint's frame; that of the joint is longer and goes through."""
    for k in range(3):
        end = np.zeros(3)
        end[k] = AXIS
        own = abs(axis[k]) > 0.9
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            fromto=(*(-2.0 * end * own), *(end * (2.0 if own else 1.0))),
            size=(THIN * (1.6 if own else 1.0), 0, 0),
            rgba=COLORS[k],
            mass=0,
            contype=0,
            conaffinity=0,
        )


def _show(ax: Any, pixels: Pixels) -> None:
    ax.imshow(pixels)
    ax.set_axis_off()


def save(path: Path, make: Any) -> None:
    """Write a figure as PNG."""
    plotting.save(path.parent, {path.stem: make}, DPI, ("png",))
