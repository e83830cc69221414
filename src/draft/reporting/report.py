"""Reports of designs as files: one page, and its figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from draft import files
from draft.design import Design
from draft.design.references import open_designs
from draft.learn.policy.reduced import open_any
from draft.reporting.page import page
from draft.reporting.subjects import Subject, subjects
from draft.spec import Spec


def report(
    designs: Sequence[Design | Spec | str | Path],
    out: str | Path = "report.html",
    figures: str | Path | None = None,
    walk: bool = False,
    policies: Sequence[str | Path] = (),
) -> list[Path]:
    """Write one HTML page about a few designs, which opens without a network.

        >>> bear = draft.load("quadruped").resolve("bear")
        >>> draft.report(["quadruped:cheetah", bear], "report.html")
        [PosixPath('report.html')]

    Args:
        designs: 1 to 12 single designs, or their references: "quadruped:bear", a model's folder.
        out: the page.
        figures: folder for the figures as PNG and PDF; None for none.
        walk: whether the robots of the page walk; a design that no policy drives stands, and the
            page says why.
        policies: ONNX files of policies to walk with before those that ship.

    Returns:
        The files written, the page first.

    Raises:
        DraftError: a reference names no design, there are too many, a file cannot be written, or
            the extra `report` (with `figures`, `figures`) is not installed.
    """
    given = [designs] if isinstance(designs, (Design, Spec, str, Path)) else designs
    own = [open_any(file) for file in policies]
    return write_report(subjects(open_designs(given), walk, own), Path(out), figures)


def write_report(
    found: Sequence[Subject], out: Path, figures: str | Path | None = None
) -> list[Path]:
    """Write the page, and the figures if they have a folder; errors as `report`."""
    files.check_output(out, ".html")
    drawn = []
    if figures is not None:
        from draft.reporting.figures import draw

        drawn = draw(Path(figures), found)
    files.write(out, page(found))
    return [out, *drawn]
