"""Packages that extend Draft, as an installer leaves them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import draft
from draft.design.checks import CHECKS
from draft.laws.actuators import ACTUATOR_LAWS
from draft.metrics import METRICS
from draft.model.exporters import EXPORTERS
from draft.spec.primitives import LINKS

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "extension"
HOPPER = Path(draft.__file__).parent / "robots" / "hopper"
METRIC = '''
from draft.extend import metric

@metric(unit="kg", formula="m", source="a test", better="less")
def {name}(design):
    """A mass [kg]."""
    {body}
'''
Install = Callable[..., None]


def write(folder: Path, package: str, text: str, entry: str = "") -> None:
    """Write an installed package of one module.

    Args:
        folder: folder of packages.
        package: name of the package and of its module.
        text: the module.
        entry: what its entry point names; the module if empty.
    """
    (folder / f"{package}.py").write_text(text, encoding="utf-8")
    record = folder / f"{package}-2.5.dist-info"
    record.mkdir()
    (record / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 2.5\n")
    points = f"[draft.extensions]\nof_{package} = {entry or package}\n"
    (record / "entry_points.txt").write_text(points)


def left() -> list[str]:
    """Everything that is no item of Draft."""
    registries = (METRICS, LINKS, CHECKS, EXPORTERS, ACTUATOR_LAWS)
    return [name for one in registries for name in one if one.origin(name)]
