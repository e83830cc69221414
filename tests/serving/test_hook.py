"""viser's server: nobody passes the guard."""

from __future__ import annotations

import asyncio
import functools
import logging
import os
import sys
import warnings
from collections.abc import Callable, Coroutine, Iterator
from concurrent.futures import ThreadPoolExecutor
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

import pytest

viser = pytest.importorskip("viser", reason="needs the extra `view`")

from websockets.asyncio.client import connect  # noqa: E402
from websockets.exceptions import InvalidStatus  # noqa: E402
from websockets.typing import Origin, Subprotocol  # noqa: E402

from draft.errors import DraftError  # noqa: E402
from draft.serving.hook import OnePerMinute, check_denied  # noqa: E402
from draft.serving.server import Server  # noqa: E402

T = TypeVar("T")
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:websockets.*")


@pytest.fixture
def server() -> Iterator[Server]:
    made = Server("127.0.0.1", 0, page={"/report": "a report"}.get)
    yield made
    made.close()


def run(asked: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine in a thread of its own: a browser's tests leave an event loop in theirs."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, asked).result()


def listening() -> set[int]:
    """Ports that this process listens on, from /proc."""
    inodes = set()
    for entry in Path("/proc/self/fd").iterdir():
        try:
            inodes.add(os.readlink(entry))
        except OSError:  # closed since
            continue
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/self/net/{table}").read_text().splitlines()[1:]:
            cells = line.split()
            if cells[3] == "0A" and f"socket:[{cells[9]}]" in inodes:
                found.add(int(cells[1].rpartition(":")[2], 16))
    return found


async def opened(port: int, origin: str) -> int:
    """Status of a WebSocket as viser's page opens it."""
    version = Subprotocol(f"viser-v{viser.__version__}")
    try:
        async with connect(
            f"ws://127.0.0.1:{port}/", subprotocols=[version], origin=Origin(origin)
        ) as w:
            await w.recv()
            return 101
    except InvalidStatus as error:
        return error.response.status_code


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_no_port_of_the_process_answers_a_page_of_another_site(server: Server) -> None:
    others = listening() - {server.port}
    assert server.port == server.viser.get_port()
    made = Server("127.0.0.1", 0)
    assert listening() - others == {server.port, made.port}  # One port each.
    made.close()
    assert run(opened(server.port, "http://evil.example")) == 403
    assert run(opened(server.port, f"http://127.0.0.1:{server.port}")) == 101


def test_a_second_request_of_a_connection_is_not_answered(
    server: Server, capfd: pytest.CaptureFixture[str]
) -> None:
    async def ask() -> bytes:
        reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
        first = f"GET /nothing HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n"
        second = "GET / HTTP/1.1\r\nHost: evil.example\r\nOrigin: http://evil.example\r\n\r\n"
        writer.write(f"{first}{second}".encode())
        found = await reader.read()
        writer.close()
        return found

    found = run(ask())
    assert found.count(b"HTTP/1.1") <= 1
    assert b"viser" not in found
    assert capfd.readouterr().err == ""


def test_garbage_is_reported_in_one_line_and_the_next_browser_is_served(
    server: Server, capfd: pytest.CaptureFixture[str]
) -> None:
    async def send() -> None:
        version = Subprotocol(f"viser-v{viser.__version__}")
        address = f"ws://127.0.0.1:{server.port}/"
        for garbage in (b"\x00\xff", "text", b"", b"\x81\xa4type\xa4none") * 3:
            async with connect(address, subprotocols=[version]) as w:
                await w.send(garbage)
                await w.wait_closed()

    run(send())
    assert run(opened(server.port, f"http://127.0.0.1:{server.port}")) == 101
    said = capfd.readouterr().err
    assert said == "a browser sent what viser cannot read; its connection was closed\n"


def test_lines_about_garbage_come_once_a_minute_and_faults_of_ours_always() -> None:
    now = [0.0]
    once = OnePerMinute(lambda: now[0])

    def ws_handler(fault: Exception) -> None:
        raise fault

    def _message_consumer() -> None:
        raise ValueError("unreadable")

    def record(raises: Callable[[], None]) -> logging.LogRecord:
        try:
            raises()
        except Exception:
            return logging.LogRecord("x", logging.ERROR, "", 0, "failed", (), sys.exc_info())
        raise AssertionError

    garbage = functools.partial(record, _message_consumer)
    assert once.filter(garbage())
    assert [once.filter(garbage()) for _ in range(5)] == [False] * 5
    assert once.filter(record(lambda: ws_handler(KeyError("ours"))))
    now[0] = 61.0
    last = garbage()
    assert once.filter(last)
    assert last.getMessage().endswith("(5 more since the last such line)")
    assert last.exc_info is None


def test_what_comes_too_late_for_a_closed_tab_is_dropped_in_silence() -> None:
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        server = Server("127.0.0.1", 0)
        shown = server.viser.gui.add_number("speed", 0.0)
        server.close()
        shown.value = 1.0
    assert [str(one.message) for one in seen if "closed connection" in str(one.message)] == []


def test_a_viser_that_cannot_be_guarded_is_refused() -> None:
    class Open(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Open) as answering:
        thread = Thread(target=answering.handle_request)
        thread.start()
        with pytest.raises(DraftError, match="cannot be served safely"):
            check_denied(answering.server_port)
        thread.join()
