"""Looking at a robot: on this machine only, and in words where that cannot be."""

from __future__ import annotations

import contextlib
import socket
import sys
import types
from typing import Any

import glfw
import pytest

from draft.cli import main
from draft.extras import remedy
from draft.serving import server


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """A browser view without its libraries: what it was asked to serve, and where."""
    asked: dict[str, Any] = {}

    class Server:
        def __init__(self, **options: Any) -> None:
            asked.update(options)

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


def test_the_page_is_served_to_this_machine_only(
    served: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "robot", "--web", "--port", "8123"]) == 130
    assert (served["host"], served["port"]) == ("127.0.0.1", 8123)
    assert served["stopped"]
    assert served["bodies"] == 5
    assert "http://127.0.0.1:8123" in capsys.readouterr().out


@pytest.mark.parametrize("port", ["99999999", "65536", "-5"])
def test_a_port_out_of_range_is_refused(
    port: str, served: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["view", "robot", "--web", f"--port={port}"]) == 2
    assert capsys.readouterr().err == (
        f"error: there is no port {port}\n  choose one from 0 to 65535\n"
    )
    assert not served


def test_a_port_that_is_taken_is_explained(
    served: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert main(["view", "robot", "--web", f"--port={port}"]) == 2
    assert capsys.readouterr().err == (
        f"error: cannot serve on 127.0.0.1 port {port}: another page or program uses it\n"
        f"  end that one, or pass --port {port + 1}, or --port 0 for any free port\n"
    )


@pytest.mark.parametrize("module", ["viser", "mjviser"])
def test_without_the_extra_the_page_says_how_to_get_it(
    module: str,
    served: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert main(["view", "robot", "--web"]) == 2
    assert remedy("view") in capsys.readouterr().err


def test_without_a_screen_the_window_names_the_page(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(glfw, "init", lambda: False)
    assert main(["view", "robot"]) == 2
    err = capsys.readouterr().err
    assert "there is no screen for MuJoCo's viewer" in err
    assert "add --web to use a browser" in err
