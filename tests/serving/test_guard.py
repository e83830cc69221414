"""The studio's door: who may pass, and that nobody passes who may not."""

from __future__ import annotations

import http.client
import socket
from collections.abc import Callable, Iterator, Mapping
from http import HTTPStatus

import pytest

from draft.errors import DraftError
from draft.serving.guard import COOKIE, Request, check_address, is_loopback, judge
from draft.serving.server import Server

TOKEN = "a-token-of-20-chars_"


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    """Serve with viser at a free port of this machine."""
    pytest.importorskip("viser", reason="needs the extra `view`")
    made: list[Server] = []

    def start(token: str | None = None, pages: Mapping[str, str] | None = None) -> Server:
        made.append(Server("127.0.0.1", 0, token, (pages or {}).get))
        return made[-1]

    yield start
    for server in made:
        server.close()


def ask(port: int, path: str = "/", **headers: str) -> tuple[int, str, dict[str, str]]:
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", path, headers=headers)
    answer = connection.getresponse()
    found = answer.status, answer.read().decode(), dict(answer.getheaders())
    connection.close()
    return found


def test_the_door_passes_on_and_has_pages_of_its_own(serve: Callable[..., Server]) -> None:
    server = serve(None, {"/report": "mine"})
    status, text, _ = ask(server.port)
    assert status == 200
    assert "viser" in text.lower()
    assert ask(server.port, "/report")[:2] == (200, "mine")
    assert ask(server.port, Host="evil.example")[0] == 403
    assert ask(server.port, Origin="http://evil.example")[0] == 403
    server.close()
    with pytest.raises(OSError, match="refused"):
        ask(server.port)


def test_without_the_token_nothing_comes_out(serve: Callable[..., Server]) -> None:
    server = serve(TOKEN, {"/report": "mine"})
    for path in ("/", "/report", "/?token=", "/?token=wrong", f"/?tokens={TOKEN}"):
        status, text, _ = ask(server.port, path)
        assert status == 401
        assert "viser" not in text
        assert "mine" not in text
    assert ask(server.port, Cookie=f"{COOKIE}=wrong")[0] == 401
    assert ask(server.port, Connection="Upgrade", Upgrade="websocket")[0] == 401
    status, _, headers = ask(server.port, f"/?token={TOKEN}")
    assert (status, headers["Location"]) == (303, "/")
    assert "HttpOnly" in headers["Set-Cookie"]
    cookie = headers["Set-Cookie"].split(";")[0]
    status, text, _ = ask(server.port, Cookie=cookie)
    assert status == 200
    assert "viser" in text.lower()


@pytest.mark.parametrize("seen_before", [True, False])
def test_a_taken_port_is_explained(
    seen_before: bool, serve: Callable[..., Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    server = serve()
    if not seen_before:  # Taken between the check and viser, which then tries the next one.
        monkeypatch.setattr("draft.serving.server.check_free", lambda host, port: None)
    with pytest.raises(DraftError, match=f"cannot serve on 127.0.0.1 port {server.port}"):
        Server("127.0.0.1", server.port)
    with pytest.raises(DraftError, match=rf"pass `port={server.port + 1}`, or `port=0` for any"):
        Server("127.0.0.1", server.port)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.2", "example.org", ""])
def test_a_public_address_needs_a_token(host: str) -> None:
    assert not is_loopback(host)
    check_address(host, TOKEN)
    for bad in (None, "short", "x" * 15, "with space, and;more", ""):
        with pytest.raises(DraftError, match="no `token`" if bad is None else "token is too short"):
            check_address(host, bad)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.9"])
def test_loopback_needs_none(host: str) -> None:
    check_address(host, None)


def test_a_foreign_page_may_not_use_it_even_with_the_cookie() -> None:
    headers = {"host": "robot.example:8080", "cookie": f"x=1; {COOKIE}={TOKEN}"}
    assert judge(Request("/", headers), TOKEN, False) is None
    refused = judge(Request("/", {**headers, "origin": "https://evil.example"}), TOKEN, False)
    assert refused is not None
    assert refused.status == HTTPStatus.FORBIDDEN


LOCAL = "Host: 127.0.0.1"


@pytest.mark.parametrize(
    ("head", "answer"),
    [
        (f"GET //[ HTTP/1.1\r\n{LOCAL}", b"HTTP/1.1 400"),
        ("GET / HTTP/1.1\r\nHost: [", b"HTTP/1.1 400"),
        (f"GET / HTTP/1.1\r\n{LOCAL}\r\nHost: evil.example", b"HTTP/1.1 400"),
        (f"GET / HTTP/1.1\r\n{LOCAL}\r\nCookie: a=1\r\ncookie: a=2", b"HTTP/1.1 400"),
        (f"POST / HTTP/1.1\r\n{LOCAL}", b""),
        ("nothing", b""),
        ("\x00", b""),
    ],
)
def test_what_is_no_request_for_a_page_or_ambiguous_gets_400_or_no_answer(
    head: str, answer: bytes, serve: Callable[..., Server], capfd: pytest.CaptureFixture[str]
) -> None:
    with socket.create_connection(("127.0.0.1", serve().port)) as visitor:
        visitor.sendall(f"{head}\r\n\r\n".encode())
        assert visitor.recv(100)[:12] == answer
    assert capfd.readouterr().err == ""
