"""Export of a robot for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from draft.design import Design
from draft.model.exporters import FORMATS
from draft.model.model import Model


def export(design: Design | Model, folder: str | Path, formats: Sequence[str] = FORMATS) -> Path:
    """Write a robot as URDF with an actuator table, as glTF and as MJCF, or for CAD.

        >>> folder = draft.export(draft.load("quadruped").resolve("bear"), "bear")
        >>> sorted(path.name for path in folder.iterdir())[:4]
        ['actuators.json', 'design.yaml', 'meshes', 'report.json']
        >>> (folder / "robot.urdf").is_file()
        True

    Args:
        design: a single design, or its model if that is built already.
        folder: folder to write, atomically; files that Draft wrote there before are replaced.
        formats: "urdf" (robot.urdf, meshes and actuators.json with what URDF cannot
            hold: armature [kg m2], gains [N m/rad, N m s/rad]), "glb" (robot.glb, lengths in m),
            "mjcf" (robot.xml, scene.xml), "sdf" (robot.sdf, model.config, meshes), "step"
            (robot.step in mm and bom.csv; extra `cad`), "usd" (robot.usda; extra `usd`), "mjlab"
            (mjlab_robot.py and robot.xml), "isaaclab" (isaaclab_robot.py, robot.urdf and meshes),
            and those of extensions.

    Returns:
        The folder.

    Raises:
        RefusedError: the design filter found errors.
        ModelError: MuJoCo does not accept the model, or the CAD kernel the trunk.
        DraftError: the design is N designs, a format is unknown, the folder holds files that Draft
            did not write, or cannot be written, an extra is missing or not for this Python and
            system, or an exporter of an extension fails.
    """
    model = design.build() if isinstance(design, Design) else design
    return model.save(folder, formats)


def export_ros2(design: Design | Model, folder: str | Path) -> Path:
    """Write a robot as a package for ROS 2, which colcon builds.

        >>> folder = draft.export_ros2(draft.load("hopper").resolve(), "hopper_description")
        >>> sorted(path.name for path in folder.iterdir() if path.is_dir())
        ['config', 'launch', 'meshes', 'urdf', 'worlds']

    Args:
        design: a single design, or its model if that is built already.
        folder: folder of the package, written atomically; a package that Draft wrote there before
            is replaced.

    Returns:
        The folder.

    Raises:
        RefusedError: the design filter found errors.
        ModelError: MuJoCo does not accept the model.
        DraftError: the design is N designs, or the folder holds files that Draft did not write, or
            cannot be written.
    """
    from draft.model.ros2.package import save_package

    model = design.build() if isinstance(design, Design) else design
    return save_package(model, Path(folder))
