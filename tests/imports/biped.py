"""A small vendor's biped as text, for tests of the import."""

from __future__ import annotations

from collections.abc import Mapping

from tests.imports.written import joint, link

TORQUES = {"hip": 60.0, "knee": 70.0, "ankle": 25.0, "shoulder": 20.0, "elbow": 15.0}


def biped(
    efforts: Mapping[str, float | None] | None = None,
    right_thigh: float = 0.25,
    right_hip: float = -0.08,
    more: str = "",
    height: float = 1.0,
    torso: str = "",
) -> str:
    """A biped with arms of 18 joints, in which sides may differ.

    Args:
        efforts: torque by the joint's role [N m]; None for a joint without one.
        right_thigh: length of the right thigh [m]; the left one's is 0.25.
        right_hip: y of the right hip [m]; the left one's is 0.08.
        more: further elements.
        height: factor on all lengths.
        torso: shapes of the torso.
    """
    table = {**TORQUES, **(efforts or {})}

    def limit(role: str) -> str:
        effort = table[role]
        tail = "" if effort is None else f' effort="{effort:g}"'
        return f'lower="-1.5" upper="1.5"{tail} velocity="12"'

    def turn(name: str, role: str, parent: str, child: str, xyz: tuple, axis: str) -> str:
        at = tuple(height * x for x in xyz)
        return link(child) + "\n" + joint(name, parent, child, at, axis, limit(role))

    lines = [link("torso", 10.0).replace("</link>", f"{torso}</link>")]
    for side, sign in (("left", 1), ("right", -1)):
        thigh = 0.25 if sign > 0 else right_thigh
        y = 0.08 if sign > 0 else right_hip
        chain = (
            ("hip_yaw", "hip", (0, y, -0.1), "0 0 1"),
            ("hip_roll", "hip", (0, 0, -0.06), "1 0 0"),
            ("hip_pitch", "hip", (0, 0, 0), "0 1 0"),
            ("knee", "knee", (0, 0, -thigh), "0 1 0"),
            ("ankle_pitch", "ankle", (0, 0, -0.24), "0 1 0"),
        )
        arm = (
            ("shoulder_pitch", "shoulder", (0, 0.15 * sign, 0.3), "0 1 0"),
            ("shoulder_roll", "shoulder", (0, 0.04 * sign, 0), "1 0 0"),
            ("elbow", "elbow", (0, 0, -0.2), "0 1 0"),
        )
        for limb in (chain, arm):
            parent = "torso"
            for name, role, xyz, axis in limb:
                child = f"{side}_{name}_link"
                lines.append(turn(f"{side}_{name}_joint", role, parent, child, xyz, axis))
                parent = child
    return '<robot name="walker">\n' + "\n".join([*lines, more]) + "\n</robot>\n"
