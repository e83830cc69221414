"""The studio's door: who may pass, and that nobody passes who may not."""

from __future__ import annotations

import http.client
import socket
import sys
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer

import pytest

from draft.cli import main
from draft.errors import DraftError
from draft.extras import remedy
from draft.serving.guard import COOKIE, Guard, Request, check_address, is_loopback, judge

TOKEN = "a-token-of-20-chars_"


class Inner(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"what viser shows")

    def log_message(self, format: str, *args: object) -> None:
        pass


@pytest.fixture
def inner() -> Iterator[int]:
    server = HTTPServer(("127.0.0.1", 0), Inner)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.server_port
    server.shutdown()
    server.server_close()
    thread.join()


def ask(port: int, path: str = "/", **headers: str) -> tuple[int, str, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, answer.read().decode(), dict(answer.getheaders())
    connection.close()
    return found


def test_the_door_passes_on_and_has_pages_of_its_own(inner: int) -> None:
    guard = Guard("127.0.0.1", 0, inner, None, {"/report": "mine"}.get)
    assert ask(guard.port)[:2] == (200, "what viser shows")
    assert ask(guard.port, "/report")[:2] == (200, "mine")
    assert ask(guard.port, Host="evil.example")[0] == 403
    assert ask(guard.port, Origin="http://evil.example")[0] == 403
    guard.close()
    with pytest.raises(OSError, match="refused"):
        ask(guard.port)


def test_without_the_token_nothing_comes_out(inner: int) -> None:
    guard = Guard("127.0.0.1", 0, inner, TOKEN, {"/report": "mine"}.get)
    try:
        for path in ("/", "/report", "/?token=", "/?token=wrong", f"/?tokens={TOKEN}"):
            status, text, _ = ask(guard.port, path)
            assert status == 401
            assert "viser" not in text
            assert "mine" not in text
        assert ask(guard.port, Cookie=f"{COOKIE}=wrong")[0] == 401
        assert ask(guard.port, Connection="Upgrade", Upgrade="websocket")[0] == 401
        status, _, headers = ask(guard.port, f"/?token={TOKEN}")
        assert (status, headers["Location"]) == (303, "/")
        assert "HttpOnly" in headers["Set-Cookie"]
        cookie = headers["Set-Cookie"].split(";")[0]
        assert ask(guard.port, Cookie=cookie)[:2] == (200, "what viser shows")
    finally:
        guard.close()


def test_a_taken_port_is_explained(inner: int) -> None:
    with pytest.raises(DraftError, match=f"cannot serve on 127.0.0.1 port {inner}"):
        Guard("127.0.0.1", inner, inner, None)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.2", "example.org", ""])
def test_a_public_address_needs_a_token(host: str) -> None:
    assert not is_loopback(host)
    with pytest.raises(DraftError, match="no --token"):
        check_address(host, None)
    check_address(host, TOKEN)
    for bad in ("short", "x" * 15, "with space, and;more", ""):
        with pytest.raises(DraftError, match="token is too short"):
            check_address(host, bad)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.9"])
def test_loopback_needs_none(host: str) -> None:
    check_address(host, None)


def test_a_foreign_page_may_not_use_it_even_with_the_cookie() -> None:
    headers = {"host": "robot.example:8080", "cookie": f"x=1; {COOKIE}={TOKEN}"}
    assert judge(Request("GET", "/", headers), TOKEN, False) is None
    refused = judge(
        Request("GET", "/", {**headers, "origin": "https://evil.example"}), TOKEN, False
    )
    assert refused is not None
    assert refused.status.startswith("403")


def test_the_command_refuses_a_public_address_without_a_token(
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("viser")
    assert main(["studio", "--host", "0.0.0.0", "--no-browser"]) == 2
    assert "there is no --token" in capsys.readouterr().err
    assert main(["studio", "--port", "99999"]) == 2
    assert "there is no port 99999" in capsys.readouterr().err
    assert main(["studio", "no_such_robot", "--no-browser"]) == 2
    assert "names no robot or design" in capsys.readouterr().err


def test_without_the_extra_the_command_says_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in [name for name in sys.modules if name.startswith("draft.studio")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    assert main(["studio", "--no-browser"]) == 2
    assert remedy("view") in capsys.readouterr().err


@pytest.mark.parametrize(
    "head", ["GET //[ HTTP/1.1\r\nHost: 127.0.0.1", "GET / HTTP/1.1\r\nHost: ["]
)
def test_an_address_that_is_none_gets_400(head: str) -> None:
    guard = Guard("127.0.0.1", 0, 1, None, {}.get)
    try:
        with socket.create_connection(("127.0.0.1", guard.port)) as visitor:
            visitor.sendall(f"{head}\r\n\r\n".encode())
            assert visitor.recv(100).startswith(b"HTTP/1.1 400")
    finally:
        guard.close()
