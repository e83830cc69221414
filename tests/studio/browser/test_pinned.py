"""A pinned design beside the present one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

import draft

pytest.importorskip("viser", reason="needs the extra 'view'")

from draft.explore.comparison_tables import section
from draft.studio import panel
from draft.studio.drop import HEIGHT, Drop
from tests.studio.browser.page import load, mass, picture, press, push, turn_to
from tests.waiting import until

if TYPE_CHECKING:
    from draft.studio.server import Studio

pytestmark = pytest.mark.filterwarnings("ignore")


def test_a_pinned_design_stays_as_a_ghost_and_a_limp_robot_falls(
    tab: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    drops: list[Drop] = []

    def noted(*arguments: Any) -> Drop:
        drops.append(Drop(*arguments))
        return drops[-1]

    monkeypatch.setattr(panel, "Drop", noted)
    press(tab, "Pin")
    load(tab, "bear")
    until(lambda: tab.locator("#ds-pinned").count() == 1)
    until(lambda: "kg now" in tab.inner_text("#ds-pinned"))
    picture(tab, "pinned")
    turn_to(tab, "Pose")
    press(tab, "Limp")
    until(lambda: drops)
    start = drops[0].data.qpos[2]
    until(lambda: drops[0].data.qpos[2] < start - HEIGHT)
    picture(tab, "dropped")
    press(tab, "Stop")
    turn_to(tab, "Parameters")
    before = mass(tab)
    push(tab, "thigh_length", 2)
    until(lambda: mass(tab) != before)


def test_a_pinned_design_has_a_tab_that_says_why_the_design_differs(
    tab: Any, studio: Studio
) -> None:
    (shown, _), *_ = studio._panels.values()
    press(tab, "Pin")
    tab.get_by_role("tab", name="Pinned", exact=True).wait_for()
    turn_to(tab, "Pinned")
    tab.wait_for_selector("#ds-same")
    push(tab, "thigh_length", 10)
    tab.wait_for_selector("#ds-compared")
    session = shown._session
    until(lambda: session.design.parameters["thigh_length"] == pytest.approx(0.26))
    assert session.pinned is not None
    designs = (session.pinned.design, session.design)
    found = draft.compare(designs, ["mass", "jump_height"], names=("pinned", "now"))
    for row in section(found, found.metrics).summary.rows:
        for cell in row[2:]:
            until(lambda cell=cell: cell in tab.inner_text("body"))
    assert "knee: rated torque (leg)" in tab.inner_text("body")
    picture(tab, "pinned_why")
    press(tab, "Unpin")
    until(lambda: tab.get_by_role("tab", name="Pinned", exact=True).count() == 0)
