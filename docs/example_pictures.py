"""Pictures of the examples: each script draws NAME.png, which is copied to docs/images/examples.

python -m docs.example_pictures               # all of them
python -m docs.example_pictures mass_matrix   # only these
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from docs.generated_pages import IMAGES, examples
from docs.pictures import IMAGES as PICTURES
from docs.pictures import shrink

WIDTH = 900  # [pixels]


def main(arguments: Sequence[str] | None = None) -> None:
    """Run examples, and keep their pictures."""
    names = [path.stem for path in examples()]
    parser = argparse.ArgumentParser(prog="python -m docs.example_pictures")
    parser.add_argument("examples", nargs="*", choices=[[], *names], help="scripts to run")
    chosen = parser.parse_args(arguments).examples or names
    IMAGES.mkdir(parents=True, exist_ok=True)
    for script in examples():
        if script.stem not in chosen:
            continue
        picture = IMAGES / f"{script.stem}.png"
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([sys.executable, str(script)], cwd=folder, check=True)
            drawn = Path(folder) / picture.name
            # run_policy draws none: its picture is the strip of docs.learning_pictures.
            shutil.copyfile(drawn if drawn.is_file() else PICTURES / "walk.png", picture)
        shrink(picture, WIDTH)


if __name__ == "__main__":
    main()
