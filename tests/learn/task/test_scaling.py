"""docs/learning.md names every number of the tasks that is the same for all sizes of robots."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

from draft.learn.task.config import Config

DOCS = Path(__file__).resolve().parents[3] / "docs" / "learning.md"
DIMENSIONS = ("m", "s", "m/s", "rad/s")


def test_the_numbers_that_do_not_scale_are_told() -> None:
    config = Config()
    same = {
        name: {
            one.name
            for one in fields(group)
            if one.metadata["unit"] in DIMENSIONS and not one.metadata["power"]
        }
        for name, group in config.groups().items()
    }
    text = DOCS.read_text(encoding="utf-8").partition("are:\n\n")[2].partition("\n\nSo the")[0]
    told = {
        name: set(re.split(r",\s+", numbers.strip()))
        for name, numbers in re.findall(r"- `(\w+)`: ([^`]+?)(?=\n- |\Z)", text)
    }
    assert told == {name: numbers for name, numbers in same.items() if numbers}


def test_it_is_told_why_second_stages_differ_between_designs() -> None:
    config, text = Config(), " ".join(DOCS.read_text(encoding="utf-8").split())
    assert "lengths, speeds and times of the task grow with s" not in text
    assert "second stages are not identical across designs" in text
    assert f"by v_cap, {config.velocity.headroom:g} times an estimated top speed" in text
    assert (config.terrain.limit, config.velocity.forward) == (0.5, 15.0)
    assert "limits its commands by half of that estimate" in text
