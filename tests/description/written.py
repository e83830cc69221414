"""Small robot descriptions for tests, as text."""

from __future__ import annotations


def urdf(body: str) -> str:
    """A URDF around some elements."""
    return f'<?xml version="1.0"?>\n<robot name="tester">\n{body}\n</robot>\n'


def link(name: str, mass: float | None = 1.0, com: str = "0 0 0", inertia: float = 0.01) -> str:
    """A link with a round inertia, or without an inertial."""
    if mass is None:
        return f'<link name="{name}"/>'
    moments = f'ixx="{inertia}" iyy="{inertia}" izz="{inertia}" ixy="0" ixz="0" iyz="0"'
    return (
        f'<link name="{name}"><inertial><origin xyz="{com}"/><mass value="{mass}"/>'
        f"<inertia {moments}/></inertial></link>"
    )


def joint(
    name: str,
    parent: str,
    child: str,
    xyz: str = "0 0 -0.3",
    kind: str = "revolute",
    effort: str = "20",
) -> str:
    """A joint about y."""
    limit = f'<limit effort="{effort}" velocity="10" lower="-1" upper="1"/>'
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="0 1 0"/>{limit}</joint>'
    )


def leg() -> str:
    """A base with one leg: hip, knee and ankle."""
    return urdf(
        "\n".join(
            (
                link("pelvis", 5.0),
                link("thigh", 3.0, "0 0 -0.15"),
                link("shank", 2.0, "0 0 -0.15"),
                link("foot", 1.0),
                joint("hip", "pelvis", "thigh", "0 0.1 -0.05"),
                joint("knee", "thigh", "shank"),
                joint("ankle", "shank", "foot"),
            )
        )
    )
