"""Style of figures."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (26, 95, ["30", "40", "50", "60", "70", "80", "90"]),
        (0.3, 4, ["0.5", "1", "2"]),
        (0.2, 20, ["0.2", "0.5", "1", "2", "5", "10", "20"]),
        (0.001, 2, ["0.001", "0.01", "0.1", "1"]),
        (60, 70, ["60", "62", "64", "66", "68", "70"]),
        (1000, 90_000, ["1000", "2000", "5000", "10000", "20000", "50000"]),
    ],
)
def test_the_ticks_of_a_logarithmic_axis_are_plain_numbers(
    low: float, high: float, shown: list[str]
) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    from draft.plotting import logarithmic

    figure = Figure()
    ax = figure.subplots()
    ax.set_xlim(low, high)
    logarithmic(ax.xaxis)
    figure.draw_without_rendering()
    assert ax.get_xscale() == "log"
    words = [text.get_text() for text in ax.get_xticklabels() if text.get_text()]
    places = [tick for tick in ax.get_xticks() if low <= tick <= high]
    assert [word for word in words if low <= float(word) <= high] == shown
    assert places == pytest.approx([float(word) for word in shown])
    assert not [text for text in ax.get_xticklabels(minor=True) if text.get_text()]


def test_every_logarithmic_axis_has_plain_ticks() -> None:
    own = re.compile(r"""[xy]scale\(?=?["']log|set_[xy]scale|semilog|loglog""")
    files = [path for name in ("src", "docs", "examples") for path in (ROOT / name).rglob("*.py")]
    found = {path.stem for path in files if own.search(path.read_text(encoding="utf-8"))}
    assert found == {"plotting"}


def test_the_plots_of_examples_have_the_common_style() -> None:
    for path in (ROOT / "examples").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        if "savefig" in text:
            assert "plt.style.use(plotting.STYLE)" in text, path.name
            assert not re.search(r'"#[0-9a-f]{6}"', text), path.name
