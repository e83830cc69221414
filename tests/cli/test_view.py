"""Looking at a robot: what is served, to whom, and what is said where that cannot be."""

from __future__ import annotations

import contextlib
import shutil
import socket
import sys
import types
from typing import Any

import glfw
import numpy as np
import pytest

from draft.learn.policy.policy import FAMILY
from draft.serving import server
from draft.spec.load import find
from tests.commands import Command

PAGES = ("view robot --web", "play cheetah --web", "studio --no-browser")
TOKEN = "--token a-token-of-20-chars_"


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A browser view without its libraries: what it was asked to serve, and where."""
    asked: dict[str, Any] = {}

    class Server:
        def __init__(self, **options: Any) -> None:
            asked.update(options)
            asked["camera"] = self.initial_camera = types.SimpleNamespace()

        def get_port(self) -> int:
            return asked["port"]

        def stop(self) -> None:
            asked["stopped"] = True

    class Viewer:
        def __init__(self, model: Any, data: Any, **options: Any) -> None:
            asked["bodies"] = model.nbody

        def run(self) -> None:
            raise KeyboardInterrupt

    # No port is opened that could be asked; tests/serving asks viser's own.
    monkeypatch.setattr(server, "guarded", lambda guard: contextlib.nullcontext())
    monkeypatch.setattr(server, "check_denied", lambda port, host: None)
    monkeypatch.setitem(sys.modules, "viser", types.SimpleNamespace(ViserServer=Server))
    monkeypatch.setitem(sys.modules, "mjviser", types.SimpleNamespace(Viewer=Viewer))
    return asked


def test_the_page_is_served_to_this_machine_only(served: dict[str, Any], command: Command) -> None:
    said = command("view robot --web --port 8123", code=130)
    assert (served["host"], served["port"]) == ("127.0.0.1", 8123)
    assert served["stopped"]
    assert served["bodies"] == 5
    assert "http://127.0.0.1:8123" in said.out


def test_the_camera_is_near_a_small_robot_and_far_from_a_large_one(
    served: dict[str, Any], command: Command
) -> None:
    away = {}
    for name in ("hand", "humanoid"):
        command(f"view {name} --web --port 8123", code=130)
        camera = served["camera"]
        away[name] = float(np.linalg.norm(camera.position - camera.look_at))
    assert away["hand"] < 1.2
    assert 2.0 < away["humanoid"] < 6.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        *(
            (f"{page} --port={n}", f"there is no port {n}\n  choose one from 0 to 65535\n")
            for page in PAGES
            for n in (-5, 65536)
        ),
        *((f"{page} --host 0.0.0.0", "and there is no --token") for page in PAGES[1:]),
        *(
            (f"{page} --host 192.0.2.1 {TOKEN}", "cannot serve on 192.0.2.1 port 8080")
            for page in PAGES[1:]
        ),
        ("studio no_such_robot --no-browser", "names no robot or design"),
        ("studio quadruped:bear.yaml", "is a file, and the studio starts from named designs\n"),
        (f"studio humanoid --policy {FAMILY}", "does not drive the joints of humanoid"),
    ],
)
def test_a_page_that_cannot_be_served_is_refused(words: str, said: str, command: Command) -> None:
    pytest.importorskip("mjviser")
    shutil.copy(find("quadruped") / "designs/bear.yaml", "bear.yaml")
    assert said in command(words, code=2).err


@pytest.mark.parametrize("page", PAGES)
def test_a_port_that_is_taken_is_explained(page: str, command: Command) -> None:
    pytest.importorskip("mjviser")
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        err = command(f"{page} --port={port}", code=2).err
    assert err.endswith(
        f"error: cannot serve on 127.0.0.1 port {port}: another page or program uses it\n"
        f"  end that one, or pass --port {port + 1}, or --port 0 for any free port\n"
    )


def test_without_a_screen_the_window_names_the_page(
    monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    monkeypatch.setattr(glfw, "init", lambda: False)
    err = command("view robot", code=2).err
    assert "there is no screen for MuJoCo's viewer" in err
    assert "add --web to use a browser" in err
