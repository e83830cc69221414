"""The figures of the structure trends say what they show, and are written."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from draft.fitting.actuators.catalogue_rows import rows_of
from draft.fitting.structure import fits
from draft.fitting.structure import survey_figures as figures
from draft.fitting.structure.robots import robots
from draft.laws.catalogue import catalogue
from draft.laws.structure import link_laws, population
from draft.plotting import STYLE

pyplot = pytest.importorskip("matplotlib.pyplot")
NAMES = ("structure_by_class", "structure_predicted", "held_out_errors")
PEOPLE = figures.populations()


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    pyplot.switch_backend("agg")
    yield
    pyplot.close("all")


@pytest.mark.slow
def test_every_figure_is_written_as_png_and_pdf(tmp_path: Path) -> None:
    paths = figures.draw(tmp_path / "new", list(catalogue().values()))
    assert [path.name for path in paths] == [
        f"{name}.{end}" for name in NAMES for end in ("png", "pdf")
    ]
    for path in paths:
        start = b"\x89PNG" if path.suffix == ".png" else b"%PDF"
        assert path.read_bytes().startswith(start)
        assert path.stat().st_size > 5000


def test_every_class_with_a_law_has_a_panel() -> None:
    laws = {kind for own in PEOPLE.values() for kind in fits.structure(own).fits}
    titles = [ax.get_title().replace(" ", "_") for ax in figures.by_class(PEOPLE).axes]
    assert sorted(titles) == sorted(laws)
    own = {kind for name in PEOPLE for kind in population(name).segments}
    assert own - {"other", *link_laws()} <= laws


def test_a_panel_holds_every_row_of_its_fit() -> None:
    for ax in figures.by_class(PEOPLE).axes:
        kind = ax.get_title().replace(" ", "_")
        drawn = sum(len(np.asarray(cloud.get_offsets())) for cloud in _clouds(ax))
        assert drawn == sum(len(fits.usable_rows(own).get(kind, ())) for own in PEOPLE.values())


def test_axes_of_classes_are_logarithmic_and_named_with_units() -> None:
    figure = figures.by_class(PEOPLE)
    assert figure.get_supxlabel() == "joint-to-joint length [m]"
    assert figure.get_supylabel() == "structural mass [kg]"
    assert {(ax.get_xscale(), ax.get_yscale()) for ax in figure.axes} == {("log", "log")}


def test_a_law_is_dashed_where_its_mass_per_metre_is_held() -> None:
    law = population("quadruped").segments["thigh"]
    ax = next(ax for ax in figures.by_class(PEOPLE).axes if ax.get_title() == "thigh")
    colour, _ = figures.POPULATIONS["quadruped"]
    lines = [line for line in ax.lines if line.get_color() == colour]
    solid = [line for line in lines if line.get_linestyle() == "-"]
    dashed = [line for line in lines if line.get_linestyle() == "--"]
    assert (len(solid), len(dashed)) == (1, 2)
    assert np.asarray(solid[0].get_xdata())[[0, -1]] == pytest.approx(law.range)
    for line in dashed:
        length, mass = np.asarray(line.get_data())
        assert mass[0] / length[0] == pytest.approx(mass[1] / length[1])
        assert mass == pytest.approx(law(length))


def test_all_robots_are_predicted_by_both_methods_and_those_far_off_are_named() -> None:
    figure = figures.predicted(PEOPLE)
    assert len(figure.axes) == len(figures.METHODS)
    names = {robot.name for robot in robots().values()}
    for ax in figure.axes:
        points = [point for cloud in _clouds(ax) for point in np.asarray(cloud.get_offsets())]
        assert len(points) == 49
        far = [p for p in points if not 1 / figures.NAMED <= p[1] / p[0] <= figures.NAMED]
        named = [text.get_text().replace("\n", " ") for text in ax.texts]
        assert len([name for name in named if name in names]) == len(far)
        assert ax.get_xlabel() == "true total mass [kg]"
    assert figure.axes[0].get_ylabel() == "predicted total mass [kg]"


def test_held_out_errors_are_those_of_the_shipped_trends() -> None:
    figure = figures.held_out_errors(rows_of(list(catalogue().values())))
    assert figure.get_supxlabel() == "mean fold error of what is held out [1]"
    drawn = {
        str(line.get_label()): list(np.asarray(line.get_xdata())) for line in figure.axes[3].lines
    }
    scores = [population(name).held_out for name in figures.POPULATIONS]
    assert drawn["Draft's"] == [
        value for one in scores for value in (one.draft, one.draft_maker_out)
    ]
    assert drawn["published"] == [
        value for one in scores for value in (one.paper, one.paper_maker_out)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["by_class", "predicted"])
def test_type_can_be_read_at_the_width_of_a_page(name: str) -> None:
    with pyplot.rc_context(STYLE):
        figure = getattr(figures, name)(PEOPLE)
        figure.canvas.draw()
    assert figure.get_size_inches()[0] == pytest.approx(7.0)
    texts = [text for text in figure.findobj(pyplot.Text) if text.get_text().strip()]
    assert min(text.get_fontsize() for text in texts) >= 7.0


def _clouds(ax):
    """The scattered points of a panel; bands are collections too."""
    from matplotlib.collections import PathCollection

    return [one for one in ax.collections if isinstance(one, PathCollection)]
