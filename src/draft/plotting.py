"""Style and files of all figures.

A figure is a function that returns a matplotlib figure. Columns of a page are 89 mm wide. Colours
are those of Okabe and Ito, which colour-blind readers can distinguish; markers differ as well.
matplotlib belongs to the extra `figures` and is imported on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from draft import files
from draft.extras import check as need_installed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

COLUMN = 89 / 25.4
_REMEDY = "give another `out=DIR`"
DPI = 400
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#595959"
# Colours of designs side by side, in their order.
COLORS = (BLUE, ORANGE, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#7A6A00", GREY)
KINDS = ("png", "pdf")
# Metadata that would make files of equal figures differ.
UNDATED: dict[str, dict[str, None]] = {"pdf": {"CreationDate": None}, "svg": {"Date": None}}
# Ticks of a decade of a logarithmic axis, and the ranges (high / low) up to which they are used.
_DIGITS, _FEW = tuple(map(float, range(1, 10))), 5.0
_ROUND, _MANY = (1.0, 2.0, 5.0), 150.0
_NARROW = 1.6  # Ticks are as on a linear axis.
STYLE: dict[str, object] = {
    "font.size": 7,
    "axes.labelsize": 7,
    "axes.titlesize": 7,
    "axes.labelpad": 1.5,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "xtick.major.pad": 2,
    "ytick.major.pad": 1.5,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "xtick.minor.size": 1.5,
    "ytick.minor.size": 1.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "legend.handletextpad": 0.4,
    "legend.columnspacing": 1.0,
    "axes.linewidth": 0.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "lines.linewidth": 0.9,
    "figure.constrained_layout.use": True,
    "pdf.fonttype": 42,
    "svg.hashsalt": "draft",
}


def save(
    folder: Path,
    makers: Mapping[str, Callable[[], Figure]],
    dpi: int = DPI,
    kinds: Sequence[str] = KINDS,
) -> list[Path]:
    """Draw figures in the common style and write each in the given file formats.

    Args:
        folder: folder of the files; it is created if it is missing.
        makers: function that draws each figure, by file name without suffix.
        dpi: resolution of bitmaps [dots per inch].
        kinds: file formats, such as "png".

    Returns:
        The files written.

    Raises:
        DraftError: the extra is not installed, or the folder cannot be written.
    """
    need_installed("matplotlib", "figures")
    make_folder(folder)
    import matplotlib as mpl
    from matplotlib import pyplot as plt

    paths = []
    plt.switch_backend("agg")
    with mpl.rc_context(STYLE):  # pyright: ignore[reportArgumentType]
        for name, make in makers.items():
            figure = make()
            for kind in kinds:
                path = folder / f"{name}.{kind}"
                with files.new_file(path, _REMEDY) as temporary:
                    figure.savefig(temporary, dpi=dpi, format=kind, metadata=UNDATED.get(kind))
                paths.append(path)
            plt.close(figure)
    return paths


def make_folder(folder: Path) -> None:
    """Create the folder of figures, unless it exists.

    Raises:
        DraftError: it cannot be created.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise files.cannot_write(folder, error, _REMEDY) from None


def decorate(ax: Axes, x: str, y: str) -> None:
    """Make both axes logarithmic and label them."""
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    for axis in (ax.xaxis, ax.yaxis):
        logarithmic(axis)


def logarithmic(axis: Axis) -> None:
    """Make an axis logarithmic, with ticks in plain decimals: 0.1, 1, 10, 1000.

    The ticks fit the data drawn so far, or limits that were set.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

    axes = axis.axes
    (axes.set_xscale if axis is axes.xaxis else axes.set_yscale)("log")
    low, high = sorted(axis.get_view_interval())
    steps = (_DIGITS if high / low < _FEW else _ROUND) if high / low < _MANY else (1.0,)
    axis.set_major_locator(
        MaxNLocator(5) if high / low < _NARROW else LogLocator(base=10, subs=steps)
    )
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
