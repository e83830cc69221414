"""A robot as a person writes it: three files of text that a test can spoil at a known place."""

from __future__ import annotations

from pathlib import Path

PARAMETERS = """\
name: monoped
doc: A trunk on one leg, for tests.
population: quadruped
parameters:
  thigh_length: {value: 0.30, unit: m, range: [0.1, 0.6], doc: Hip axis to knee axis.}
  shank_length: {value: 0.25, unit: m, range: [0.1, 0.6], doc: Knee axis to foot.}
  trunk_length: {value: 0.40, unit: m, range: [0.2, 1.0], doc: Size of the trunk along x.}
  foot_radius: {value: 0.5 * leg.radius, unit: m, doc: Radius of the foot sphere.}
actuators:
  leg:
    peak_torque: 60
    no_load_speed: 20
    gear_ratio: 15
"""
TREE = """\
chains:
  leg:
    - name: housing
      motor: {actuator: leg, axis: x}
    - name: thigh
      joint: {name: hip, axis: x, range: [-1.0, 1.0], actuator: leg}
      link: {axis: -z, length: thigh_length, segment: thigh}
      motor: {actuator: leg, axis: y}
    - name: shank
      type: sphere
      joint: {name: knee, axis: y, range: [-2.0, 2.0], actuator: leg}
      link: {axis: -z, length: shank_length, segment: shank}
      sphere: {radius: foot_radius, site: foot}
tree:
  name: trunk
  type: root
  children:
    - {chain: leg, at: [0, 0, -0.2]}
"""
ROOT = """\
axis: x
sections:
  - {at: -trunk_length / 2, rectangle: [0.2, 0.1]}
  - {at: trunk_length / 2, rectangle: [0.2, 0.1]}
"""
LONG = """\
doc: The same with a long thigh.
values:
  thigh_length: 0.45
"""


def write_robot(folder: Path) -> Path:
    """Write the sound robot with one named design, `long`."""
    (folder / "designs").mkdir(parents=True)
    files = {
        "parameters.yaml": PARAMETERS,
        "tree.yaml": TREE,
        "root.yaml": ROOT,
        "designs/long.yaml": LONG,
    }
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def edit(folder: Path, file: str, old: str, new: str) -> None:
    """Replace the one place where a file says `old`."""
    path = folder / file
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, f"{file} says '{old}' {text.count(old)} times"
    path.write_text(text.replace(old, new), encoding="utf-8")


def append(folder: Path, file: str, text: str) -> None:
    """Add text at the end of a file."""
    with (folder / file).open("a", encoding="utf-8") as stream:
        stream.write(text)


def files_below(folder: Path) -> set[str]:
    """Every file and folder below one, for 'nothing was written'."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}
