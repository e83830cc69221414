"""Robots of a run as files of its folder: a family is one template and arrays."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from draft.learn.bodies.legged import LeggedRobot, with_one_template
from draft.model.texts import of_template

MEMBERS, NUMBERS = "members.json", "members.npz"


def robots_digest(members: Sequence[LeggedRobot]) -> str:
    """Hash that changes when any robot does."""
    digest = hashlib.sha256(b"[")
    for k, member in enumerate(members):  # One text at a time: a family's are large.
        text = json.dumps(member.as_dict(), sort_keys=True)
        digest.update(f"{', ' if k else ''}{text}".encode())
    digest.update(b"]")
    return digest.hexdigest()[:16]


def files_of(members: Sequence[LeggedRobot]) -> dict[str, str | bytes]:
    """Files of the robots by name: the models of a family are one template and arrays."""
    template = members[0].text.template
    family = len(members) > 1 and all(one.text.template == template for one in members)
    robots = [member.as_dict(text=not family) for member in members]
    files: dict[str, str | bytes] = {MEMBERS: json.dumps(robots) + "\n"}
    if family:
        content = io.BytesIO()
        numbers = np.stack([member.text.numbers for member in members])
        np.savez_compressed(content, template=np.array(template), numbers=numbers)
        files[NUMBERS] = content.getvalue()
    return files


def read_members(folder: Path) -> tuple[LeggedRobot, ...]:
    """Robots of a run; those of an older one have their models among their numbers."""
    robots = json.loads((folder / MEMBERS).read_text(encoding="utf-8"))
    if all("xml" in robot for robot in robots):
        return with_one_template([LeggedRobot.from_dict(robot) for robot in robots])
    try:
        with np.load(io.BytesIO((folder / NUMBERS).read_bytes())) as found:
            texts = of_template(str(found["template"]), found["numbers"])
    except zipfile.BadZipFile as error:
        raise ValueError(f"{NUMBERS}: {error}") from None
    each = zip(robots, texts, strict=True)
    return tuple(LeggedRobot.from_dict(robot, text) for robot, text in each)
