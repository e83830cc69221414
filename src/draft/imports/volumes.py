"""Structure of robots slimmer than the surveyed ones: by their visible volume, not by length.

The laws of structure by length describe limbs that are as wide as the drives of surveyed robots.
On robots whose limbs are too slim for a third of the usual torque they give a thigh of 0.15 kg as
1.8 kg. There no link weighs more than its visible volume times a density, drives included: the mean
of other makers' links (docs/twins.md). No mass of the robot at hand is read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from draft.imports.drives import Drive, leg_length
from draft.imports.reduce import Body, Reduced
from draft.imports.shapes import Shapes, Slice, volume
from draft.laws import structure
from draft.laws.actuators import laws
from draft.laws.structure import LEGS

# Mass over visible volume [kg/m3], drives included, by class of segment: geometric means over 29
# robots with meshes, one median per robot (docs/twins.md). None is one of ODRI's slim robots. ln of
# it has a standard deviation of 0.3 to 0.6 from robot to robot.
DENSITIES = {"thigh": 1270.0, "shank": 1140.0, "hip_link": 2130.0}
OTHER_DENSITY = 1350.0
TRUNK_DENSITY = 725.0
# Least share of structure in a link full of drives.
LEAST = 0.25


class Volumes:
    """Visible volumes of a robot, with what they weigh where lengths say little."""

    def __init__(self, reduced: Reduced, shapes: Shapes, drives: Mapping[str, Drive]) -> None:
        self.reduced, self.shapes, self.drives = reduced, shapes, drives
        self.slim = is_slim(drives)

    def structure(self, body: Body) -> float | None:
        """Structure of a rigid body of a slim robot [kg], without the drives that it carries.

        Bodies above that share its structural segment count with it. None where its length is to
        decide: the robot is not slim, or no mesh can be read.
        """
        if not self.slim:
            return None
        own = [body]
        while own[0].merged and own[0].parent is not None and own[0].parent.joint is not None:
            own.insert(0, own[0].parent)
        visible = sum(volume(self.shapes.triangles(one.links)) for one in own)
        whole = visible * DENSITIES.get(body.kind, OTHER_DENSITY)
        if not whole:
            return None
        return max(whole - sum(map(self._carried, own)), LEAST * whole)

    def trunk_density(self, sections: Sequence[Slice], population: str, legs: int) -> float | None:
        """Density of the structure of a slim robot's trunk [kg/m3].

        Args:
            sections: those of the trunk.
            population: "humanoid" or "quadruped".
            legs: number of legs.

        Returns:
            The density where it is below what the structure law gives the trunk, else None.
        """
        drawn = sectional_volume(sections)
        if not self.slim or not drawn:
            return None
        left = TRUNK_DENSITY - self._carried(self.reduced.root) / drawn
        density = max(left, LEAST * TRUNK_DENSITY)
        law, leg = structure.population(population), leg_length(self.reduced)
        usual = law.trunk_density
        if leg and legs == LEGS[population]:
            usual = float(law.calibrated(drawn, leg))
        return density if density < usual else None

    def _carried(self, body: Body) -> float:
        """Mass of the drives of the next joints, which sit on a body [kg]."""
        named = [child.joint.name for child in body.children if child.joint and child.driven]
        mass = laws().trends["mass"]
        return sum(float(mass(self.drives[name].torque)) for name in named)


def is_slim(drives: Mapping[str, Drive]) -> bool:
    """Whether most limbs of a robot are slimmer than the drives of surveyed robots."""
    return 2 * sum(one.slim for one in drives.values()) > len(drives)


def sectional_volume(sections: Sequence[Slice]) -> float:
    """Volume between sections [m3]; 0 for less than two."""
    if len(sections) < 2:
        return 0.0
    areas = [one.area for one in sections]
    return float(np.trapezoid(areas, [one.at for one in sections]))
