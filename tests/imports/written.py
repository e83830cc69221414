"""Small vendors' robots as text, and what the import makes of a text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from draft.imports.importer import Files, Imported, import_robot, translate
from draft.imports.options import Options

# An OBJ file of a box of 0.6 x 0.2 x 0.1 m.
CUBE = "\n".join(
    [f"v {x} {y} {z}" for x in (-0.3, 0.3) for y in (-0.1, 0.1) for z in (-0.05, 0.05)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)
LEGS = {"FL": (0.2, 0.1), "FR": (0.2, -0.1), "RL": (-0.2, 0.1), "RR": (-0.2, -0.1)}


def written(text: str, file: str = "beast.urdf") -> Path:
    """A text in the working directory."""
    path = Path(file)
    path.write_text(text, encoding="utf-8")
    return path


def imported(
    text: str, file: str = "beast.urdf", out: str = "mine", options: Options | None = None
) -> Imported:
    """Import a description from the working directory and into it."""
    return import_robot(written(text, file), out, options=options or Options())


def translated(
    text: str,
    options: Options | None = None,
    file: str = "beast.urdf",
    population: str | None = None,
) -> Files:
    """Translate a description in the working directory, nothing else written."""
    path = written(text, file)
    return translate(path, path.stem, population, shown=file, options=options or Options())


def notes(found: Files | Imported, word: str = "") -> list[str]:
    """Warnings of an import in which a word occurs."""
    problems = found.notes if isinstance(found, Imported) else found.reduced.notes
    return [str(note) for note in problems if word in str(note)]


def link(name: str, mass: float = 1.0, mesh: str = "", factor: float = 1.0) -> str:
    """A link with the inertia of a box of 0.4 x 0.2 x 0.1 m, perhaps with a mesh."""
    m = mass * factor
    xx, yy, zz = m / 12 * 0.05, m / 12 * 0.17, m / 12 * 0.20
    shape = f'<visual><geometry><mesh filename="{mesh}"/></geometry></visual>' if mesh else ""
    return (
        f'<link name="{name}"><inertial><mass value="{m}"/><inertia ixx="{xx}" iyy="{yy}" '
        f'izz="{zz}" ixy="0" ixz="0" iyz="0"/></inertial>{shape}</link>'
    )


def joint(
    name: str,
    parent: str,
    child: str,
    xyz: Sequence[float],
    axis: str = "0 1 0",
    limit: str = 'lower="-1" upper="1.5" effort="30" velocity="20"',
    kind: str = "revolute",
) -> str:
    """A joint with its limits."""
    at = " ".join(f"{x:g}" for x in xyz)
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/><axis xyz="{axis}"/><limit {limit}/></joint>'
    )


def bolt(name: str, parent: str, child: str, at: str = "0 0 0") -> str:
    """A joint that does not move."""
    return (
        f'<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{at}"/></joint>'
    )


def quadruped(more: str = "", factor: float = 1.0, mesh: str = "") -> str:
    """A quadruped of twelve joints, one element a line; its right hips turn the other way."""
    lines = [link("body", 8.0, mesh, factor)]
    for name, (x, y) in LEGS.items():
        side = 1 if y > 0 else -1
        roll = "1 0 0" if y > 0 else "-1 0 0"
        lines += [link(f"{name}_{part}", 1.0, "", factor) for part in ("hip", "thigh", "calf")]
        lines += [
            joint(f"{name}_roll", "body", f"{name}_hip", (x, y, 0), roll),
            joint(f"{name}_pitch", f"{name}_hip", f"{name}_thigh", (0, 0.08 * side, 0)),
            joint(
                f"{name}_knee",
                f"{name}_thigh",
                f"{name}_calf",
                (0, 0, -0.22),
                limit='lower="-2.5" upper="-0.5" effort="45" velocity="15"',
            ),
            f'<link name="{name}_foot"/>',
            bolt(f"{name}_ball", f"{name}_calf", f"{name}_foot", "0 0 -0.21"),
        ]
    return '<robot name="beast">\n' + "\n".join([*lines, more]) + "\n</robot>\n"
