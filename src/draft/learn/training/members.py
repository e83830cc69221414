"""Robots of a run as files of its folder: a family is one template and arrays."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from draft.learn.bodies.legged import LeggedRobot
from draft.model.batch_text import packed, unpacked

MEMBERS, NUMBERS = "members.json", "members.npz"


def robots_digest(members: Sequence[LeggedRobot]) -> str:
    """Hash that changes when any robot does."""
    text = json.dumps([member.as_dict() for member in members], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def files_of(members: Sequence[LeggedRobot]) -> dict[str, str | bytes]:
    """Files of the robots by name: the models of a family are one template and arrays."""
    robots = [member.as_dict() for member in members]
    found = packed([member.xml for member in members]) if len(members) > 1 else None
    files: dict[str, str | bytes] = {}
    if found is not None:
        content = io.BytesIO()
        np.savez_compressed(content, template=np.array(found[0]), numbers=found[1])
        files[NUMBERS] = content.getvalue()
        for robot in robots:
            del robot["xml"]
    return files | {MEMBERS: json.dumps(robots) + "\n"}


def read_members(folder: Path) -> tuple[LeggedRobot, ...]:
    """Robots of a run; those of an older one have their models among their numbers."""
    robots = json.loads((folder / MEMBERS).read_text(encoding="utf-8"))
    if any("xml" not in robot for robot in robots):
        try:
            with np.load(io.BytesIO((folder / NUMBERS).read_bytes())) as found:
                texts = unpacked(str(found["template"]), found["numbers"])
        except zipfile.BadZipFile as error:
            raise ValueError(f"{NUMBERS}: {error}") from None
        robots = [robot | {"xml": text} for robot, text in zip(robots, texts, strict=True)]
    return tuple(LeggedRobot.from_dict(robot) for robot in robots)
