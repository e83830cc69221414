"""Robots that walk in the site: pages of `draft page` for its front and for its gallery.

python -m docs.live --out build/live  # the pages alone; `docs.site` writes them into the site
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco

import draft
from draft.browser.page import single_page
from draft.browser.robots import driven, robot
from draft.plotting import COLORS
from draft.validation.arms import by_maker

DOCS = Path(__file__).resolve().parent
DESCRIPTIONS = DOCS.parent / "examples" / "descriptions"
OUT = DOCS.parent / "build" / "live"
REAL = ("unitree_go2", "unitree_a1", "unitree_aliengo", "unitree_b2", "deeprobotics_x30")
PAGES: dict[str, dict[str, Any]] = {
    "quadrupeds": {
        "designs": ["cheetah", "bear", "giraffe"],
        "vary": [
            "thigh_length=*0.9:*1.1",
            "shank_length=*0.9:*1.1",
            "actuators.leg.peak_torque=*0.8:*1.3",
        ],
    },
    "legs": {"designs": ["hexapod", "biped", "humanoid", "hopper"]},
    "others": {"designs": ["wheeled", "arm", "hand"]},
}


def write(out: Path) -> list[Path]:
    """Write all pages, each one file, which opens from the disk too.

    Raises:
        DraftError: the extra `page` is not installed.
    """
    written = []
    for name, options in PAGES.items():
        written += draft.page(out=out / f"{name}.html", single=True, **options)
    with tempfile.TemporaryDirectory() as folder:
        designs = []
        for name in REAL:
            (description,) = (DESCRIPTIONS / name).glob("*.urdf")
            imported = draft.import_robot(description, Path(folder) / name)
            designs.append(imported.spec)
        written += draft.page(designs, out / "real.html", single=True)
    for name in REAL:
        written.append(out / f"{name}.html")
        written[-1].write_text(beside_its_maker(name), encoding="utf-8")
    return written


def beside_its_maker(name: str) -> str:
    """Text of a page with a real robot as Draft predicts it, and with the masses of its maker.

    The robot is held out of the trends that predict it.
    """
    (description,) = (DESCRIPTIONS / name).glob("*.urdf")
    twin = draft.compare_twin(description, without=(name,), key=name)
    made = by_maker(twin).xml
    theirs = replace(twin.model, xml=made, mujoco=mujoco.MjModel.from_xml_string(made))
    title = description.stem.title()
    models = {f"{title}, as predicted": twin.model, f"{title}, maker's masses": theirs}
    return single_page(
        [
            robot(model, words, color, driven([model], "walk", ()))
            for (words, model), color in zip(models.items(), COLORS, strict=False)
        ]
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the pages and print their names."""
    parser = argparse.ArgumentParser(prog="python -m docs.live", description=write.__doc__)
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the pages")
    for path in write(parser.parse_args(arguments).out):
        print(path)


if __name__ == "__main__":
    main()
