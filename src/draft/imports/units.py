"""Whether a mesh is in the robot's units: a thousand times too large or small is put right.

A robot's joints say how large it is. A mesh in millimetres beside joints in metres, or one that
was scaled to metres twice, differs from them by 1000; centimetres and inches cannot be told apart.
"""

from __future__ import annotations

from collections.abc import Sequence

# Longest edge of a mesh over the span of the robot's joints. A body is at most a few times as
# long as its robot's joints lie apart, and what shapes a robot is no smaller than 1/500 of it.
LARGEST, SMALLEST = 10.0, 1 / 500
# A mesh of the same scale as one that is in millimetres is so too if it is longer than the robot.
LIKEWISE = 2.0
# What is read as millimetres is at most so many times the robot, and at least so much of the
# distance between its own joints: a trunk in centimetres fails here.
LONGEST, SHORTEST = 3.0, 0.4
THOUSAND = 1000.0
# A scale as small as this says that its author thought the mesh was in millimetres.
SHRUNK = 0.01


def factors(
    extents: Sequence[float],
    scales: Sequence[tuple[float, ...]],
    span: float,
    reach: float,
    known: set[tuple[float, ...]],
) -> list[float]:
    """Factors that bring the meshes of one body to the robot's units.

    Args:
        extents: longest edge of each mesh as the description scales it [m].
        scales: scale that the description gives each.
        span: distance across the robot's joints [m].
        reach: distance across the body's own joints [m]; 0 if it has but one.
        known: scales of meshes that were found to be in millimetres; grows.

    Returns:
        1, 0.001, 1000, or 0 for a mesh that is not to be used.
    """
    found = [1.0] * len(extents)
    if not span > 0:
        return found
    least = max(extents, default=0.0)
    for i in sorted(range(len(extents)), key=lambda i: -extents[i]):
        share, scale = extents[i] / span, scales[i]
        if share > LARGEST:
            fits = scale in known or extents[i] / THOUSAND >= SHORTEST * reach
            found[i] = 1 / THOUSAND if fits and share / THOUSAND <= LONGEST else 0.0
        elif share > LIKEWISE and scale in known:
            found[i] = 1 / THOUSAND
        elif SMALLEST / THOUSAND < share < SMALLEST:
            shrunk = max(map(abs, scale)) <= SHRUNK or least < SMALLEST * span
            found[i] = THOUSAND if shrunk else 1.0
        if found[i] == 1 / THOUSAND:
            known.add(scale)
    return found


def words(factor: float, extent: float, span: float) -> tuple[str, str]:
    """Cause and remedy for a mesh of implausible size."""
    sizes = f"{extent:.3g} m long on a robot whose joints span {span:.3g} m"
    if factor == 0:
        return f"{sizes}: it is not used", "give it the scale that makes it metres"
    remedy = f"multiply its scale by {factor:g}, or by what else makes it metres"
    if factor < 1:
        return f"{sizes}: taken as millimetres", remedy
    return f"{sizes}: taken as 1000 times as large", remedy
