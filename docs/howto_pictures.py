"""Pictures of the how-to pages: each page is followed in an empty folder, and what it made drawn.

python -m docs.howto_pictures            # docs/images/howto/PAGE.png, all of them
python -m docs.howto_pictures arm biped  # only these
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

from docs import blocks, cad_figure, howto_figures  # noqa: E402
from docs.pictures import IMAGES, row, shrink  # noqa: E402
from draft.design.references import open_design  # noqa: E402
from draft.spec import Spec, load  # noqa: E402

OUT = IMAGES / "howto"
SIZE = (900, 560)


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the pictures of some pages, or of all."""
    parser = argparse.ArgumentParser(prog="python -m docs.howto_pictures")
    parser.add_argument("pages", nargs="*", choices=[[], *PICTURES], help="pages to draw")
    pages = parser.parse_args(arguments).pages or list(PICTURES)
    for page in pages:
        with tempfile.TemporaryDirectory() as folder:
            blocks.copy_examples(Path(folder))
            blocks.follow(blocks.DOCS / "howto" / f"{page}.md", Path(folder))
            PICTURES[page](Path(folder), OUT / f"{page}.png")
        shrink(OUT / f"{page}.png", SIZE[0])


def _robots(*references: str) -> Callable[[Path, Path], None]:
    return partial(_draw_robots, references)


def _draw_robots(references: Sequence[str], folder: Path, path: Path) -> None:
    with contextlib.chdir(folder):
        models = [open_design(reference).build() for reference in references]
    row(models, path, SIZE)


def _copy(source: str) -> Callable[[Path, Path], None]:
    def copy(folder: Path, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(folder / source, path)

    return copy


def _walk(folder: Path, path: Path) -> None:
    """Copy the strip of the walking cheetah that docs.learning_pictures drew."""
    shutil.copyfile(IMAGES / "walk.png", path)


def _studio(folder: Path, path: Path) -> None:
    """Take a picture of the walking robot in the studio."""
    from docs.studio_picture import take, walk

    take(path, walk, (1280, 900))


def _motors(folder: Path, path: Path) -> None:
    """Draw the page's robot with each of its motors."""
    named = {
        "predicted by trends": "hopper",
        "like MIT U12": "jumper",
        "from a data sheet": "jumper:datasheet",
    }
    with contextlib.chdir(folder):
        howto_figures.motors({k: open_design(name).build() for k, name in named.items()}, path)


def _ros(folder: Path, path: Path) -> None:
    """Draw what the page exports."""
    howto_figures.exported(folder / "bear_ros", path)


def _machine(folder: Path, path: Path) -> None:
    """Draw what a CAD kernel reads from the page's export, and its bill of materials."""
    cad_figure.assembly(folder / "machine", path)


def _swing(folder: Path, path: Path) -> None:
    """Draw the page's swing test."""
    howto_figures.swing(folder, path)


def _own_parts(folder: Path, path: Path) -> None:
    """Draw the page's robot, and the one that it began as."""
    with contextlib.chdir(folder):
        row([open_design(name).build() for name in ("quadruped", "dog")], path, SIZE)


def _padded(folder: Path, path: Path) -> None:
    """Draw the hopper on its ball, and on the pad of the example of an extension."""
    sys.path.insert(0, str(folder / "examples" / "extension"))
    importlib.import_module("draft_example.pad")
    hopper = load("hopper")
    files = {name: file.read_bytes().decode() for name, file in hopper.files.items()}
    tree = files["tree.yaml"].replace("type: sphere", "type: pad")
    pad = "pad: {radius: 0.05, thickness: 0.02, site: foot}"
    files["tree.yaml"] = re.sub(r"sphere: \{.*\}", pad, tree)
    row([one.resolve().build() for one in (hopper, Spec.parse(files))], path, SIZE)


def _page(folder: Path, path: Path) -> None:
    """Take a picture of the page in one file, once its robot walks."""
    from benchmarks import browser

    with browser.browser() as opened:
        tab = browser.tab(opened, viewport={"width": 1280, "height": 720})
        tab.goto((folder / "cheetah.html").as_uri() + "#forward=0.8&thigh_length=0.27")
        tab.wait_for_function("window.draftPage?.count.simulated > 4")
        tab.screenshot(path=path)


PICTURES: dict[str, Callable[[Path, Path], None]] = {
    "quadruped": _robots("courier:courier/search/designs/front_001.yaml"),
    "arm": _robots("arm_dog"),
    "biped": _robots("biped"),
    "hexapod": _robots("hexapod"),
    "fixed-arm": _robots("arm"),
    "hand": _robots("hand"),
    "wheeled": _robots("roller"),
    "payload": _robots("courier"),
    "motors": _motors,
    "import": _robots("go2", "go2:long"),
    "levers": _copy("levers.png"),
    "explore": _copy("search/front.png"),
    "train": _walk,
    "walk": _studio,
    "page": _page,
    "ros": _ros,
    "to-a-machine": _machine,
    "before-you-switch-it-on": _swing,
    "own-parts": _own_parts,
    "extend": _padded,
}

if __name__ == "__main__":
    main()
