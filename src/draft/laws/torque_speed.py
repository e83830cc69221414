"""Line of torque over speed of a linear motor whose current is limited.

The torque is the peak torque up to the corner speed, and falls from there to zero at the no-load
speed. With a corner speed of 0 it falls from standstill.
"""

from __future__ import annotations

from draft.values import Value, some

Line = tuple[tuple[Value, Value], ...]


def stall_torque(peak_torque: Value, no_load_speed: Value, corner_speed: Value) -> Value:
    """Torque at standstill without the limit of the current [N m]; at least the peak."""
    return peak_torque * (no_load_speed / (no_load_speed - corner_speed))


def torque_speed(peak_torque: Value, no_load_speed: Value, corner_speed: Value) -> Line:
    """Points of the line as pairs of rad/s and N m, speeds rising; straight between them."""
    ends = (0.0, peak_torque), (no_load_speed, 0.0)
    if not some(corner_speed > 0):
        return ends
    return ends[0], (corner_speed, peak_torque), ends[1]
