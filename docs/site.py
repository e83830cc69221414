"""Builds the documentation site, without a network: python -m docs.site [--out build/site]."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

DOCS = Path(__file__).resolve().parent
OUT = DOCS.parent / "build" / "site"


def main(arguments: Sequence[str] | None = None) -> int:
    """Build the site; return 0, or 1 after any warning."""
    parser = argparse.ArgumentParser(prog="python -m docs.site", description="Build the site.")
    parser.add_argument("--out", type=Path, default=OUT, help="folder of the pages")
    parser.add_argument("--fresh", action="store_true", help="read every page again")
    options = parser.parse_args(arguments)
    from sphinx.cmd.build import build_main

    from docs import live
    from draft.browser.engine import available

    fresh = ["--fresh-env", "--write-all"] if options.fresh else []
    command = ["-b", "html", "-q", "--fail-on-warning", *fresh, str(DOCS), str(options.out)]
    failed = build_main(command)
    if not failed:
        if available():
            live.write(options.out / "live")
        else:
            print("no robots walk in it: that needs the extra `page`")
        print(f"open {options.out / 'index.html'}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
