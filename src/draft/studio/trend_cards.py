"""Cards of trends and of torque over speed of a design's actuators, as HTML."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import cycle

from draft.design.actuators import Actuator
from draft.design.report import used_actuators
from draft.laws.catalogue import catalogue
from draft.laws.quantities import QUANTITIES
from draft.reporting.torque_speed import Curve, plot
from draft.studio import plots
from draft.studio.session import Session
from draft.studio.walker import Load

Cloud = tuple[tuple[float, float], ...]
_DOTS = "Dots: the highest load of each joint in the last second, at speed 0 where it brakes."


# Quantities on the x and y axis of each plot.
VIEWS = (
    ("peak_torque", "mass"),
    ("peak_torque", "volume"),
    ("no_load_speed", "gear_ratio"),
    ("gear_ratio", "aspect_ratio"),
)


def torque_speed(session: Session, loads: Sequence[Load] = ()) -> str:
    """Torque-speed line of each actuator class of the robot, and loads of its joints."""
    worst = max(loads, key=lambda load: load.share, default=None)
    dots = [(load.speed, load.torque, load.joint if load is worst else "") for load in loads]
    colors = cycle((plots.OURS, *plots.PALETTE))
    curves = [
        Curve(a.name, a, color, named=True)
        for a, color in zip(used_actuators(session.design), colors, strict=False)
    ]
    if session.pinned is not None:
        pinned = used_actuators(session.pinned.design)
        curves += [Curve(a.name, a, plots.THEIRS, "4 3") for a in pinned]
    told = f'<div class="mute">{_DOTS}</div>' if loads else ""
    return f'<div class="ds"><h3>Torque over speed</h3>{told}{plot(curves, dots)}</div>'


def trends(session: Session) -> str:
    """Trends with their bands, catalogue modules, and the actuators of this design."""
    actuators = used_actuators(session.design)
    if not actuators:
        return ""
    drawn = "".join(_trend(x, y, actuators, session) for x, y in VIEWS)
    return (
        '<div class="ds"><h3>Trends</h3><div class="mute">Grey: real modules. Blue: trend, with '
        "the bands that hold 50 and 90 % of the modules of other makers. Orange: this design."
        f"</div>{drawn}</div>"
    )


def _trend(x: str, y: str, actuators: list[Actuator], session: Session) -> str:
    first = actuators[0]
    law = first.laws.trends[y]
    cloud, x_range, y_range = _modules(x, y)
    axes = plots.Axes(x_range, y_range, QUANTITIES[x].axis, QUANTITIES[y].axis)
    markers = [_marker(x, y, actuator, False) for actuator in actuators]
    if session.pinned is not None:
        pinned = used_actuators(session.pinned.design)
        markers += [_marker(x, y, actuator, True) for actuator in pinned]
    folds = (law.band(0.5), law.band(0.9))
    return plots.trend(axes, cloud, _along(x, y, first), folds, markers)


def _along(x: str, y: str, actuator: Actuator) -> Callable[[float], float]:
    """Trend along the horizontal axis; its other inputs are those of the first class."""
    law = actuator.laws.trends[y]
    others = {name: getattr(actuator, name) for name in law.inputs}

    def value(at: float) -> float:
        inputs = [at if name == x else others[name] for name in law.inputs]
        return float(law(*inputs)) * QUANTITIES[y].factor

    return value


def _marker(x: str, y: str, actuator: Actuator, pinned: bool) -> plots.Marker:
    across, up = float(getattr(actuator, x)), float(getattr(actuator, y)) * QUANTITIES[y].factor
    return plots.Marker(across, up, actuator.name, pinned)


@lru_cache(maxsize=16)
def _modules(x: str, y: str) -> tuple[Cloud, tuple[float, float], tuple[float, float]]:
    """Catalogue modules in the plane of a trend, and axis ranges that contain them."""
    cloud = tuple(
        (float(a), float(b) * QUANTITIES[y].factor)
        for part in catalogue().values()
        for a, b in [(getattr(part, x), getattr(part, y))]
        if a is not None and b is not None
    )
    xs, ys = [x for x, _ in cloud], [y for _, y in cloud]
    return cloud, (min(xs) / 1.3, max(xs) * 1.3), (min(ys) / 1.5, max(ys) * 1.8)
