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
from draft.model.texts import Text, of_template

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
    """Files of the robots by name: models that differ in numbers are one template and arrays."""
    templates = list(dict.fromkeys(member.text.template for member in members))
    shared = len(templates) < len(members)
    robots = [member.as_dict(text=not shared) for member in members]
    files: dict[str, str | bytes] = {MEMBERS: json.dumps(robots) + "\n"}
    if shared:
        content = io.BytesIO()
        arrays: dict[str, np.ndarray] = {}
        for k, template in enumerate(templates):
            own = [member.text for member in members if member.text.template == template]
            arrays[_nth("template", k)] = np.array(template)
            arrays[_nth("numbers", k)] = np.stack([text.numbers for text in own])
        if len(templates) > 1:
            arrays["of"] = np.array([templates.index(member.text.template) for member in members])
        np.savez_compressed(content, **arrays)  # pyright: ignore[reportArgumentType]
        files[NUMBERS] = content.getvalue()
    return files


def _nth(name: str, k: int) -> str:
    """Name of the array of a template; that of the first has no number."""
    return f"{name}_{k}" if k else name


def read_members(folder: Path) -> tuple[LeggedRobot, ...]:
    """Robots of a run; those of an older one have their models among their numbers."""
    robots = json.loads((folder / MEMBERS).read_text(encoding="utf-8"))
    if all("xml" in robot for robot in robots):
        return with_one_template([LeggedRobot.from_dict(robot) for robot in robots])
    try:
        with np.load(io.BytesIO((folder / NUMBERS).read_bytes())) as found:
            places = found["of"] if "of" in found else np.zeros(len(robots), dtype=int)
            texts: list[Text] = [Text("", np.zeros(0))] * len(robots)
            for k in range(int(places.max()) + 1):
                own = of_template(str(found[_nth("template", k)]), found[_nth("numbers", k)])
                for row, text in zip(np.flatnonzero(places == k), own, strict=True):
                    texts[row] = text
    except zipfile.BadZipFile as error:
        raise ValueError(f"{NUMBERS}: {error}") from None
    each = zip(robots, texts, strict=True)
    return tuple(LeggedRobot.from_dict(robot, text) for robot, text in each)
