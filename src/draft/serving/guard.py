"""Guard in front of viser: a proxy that checks every request.

viser serves its page to every client and has no access control. It therefore listens on 127.0.0.1
at a port of its own, which answers only requests with a secret that the guard adds
(`draft.serving.inner`). The guard reads the head of each request and either answers it or connects
the client to viser. Without the token it sends nothing of viser, no page and no session. It also
denies requests from pages of other sites (a foreign Origin) and, if only loopback is served,
requests with a host name that is not of loopback. A connection carries one request, so that none
passes behind another that was permitted.

There is no encryption: on an open network, use a TLS proxy or an SSH tunnel.
"""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import ipaddress
import re
import threading
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import cast
from urllib.parse import parse_qs, urlsplit

from draft.errors import DraftError, Problem
from draft.serving.inner import HEADER
from draft.webpage import webpage

MIN_TOKEN = 16
COOKIE = "draft_page"
_TOKEN = re.compile(rf"[A-Za-z0-9_-]{{{MIN_TOKEN},}}")
_MAX_HEAD = 32 * 1024
_TIMEOUT = 15.0  # for the head of a request [s]
_CHUNK = 64 * 1024
_DENIED = webpage(
    "Draft",
    "",
    "<p>This page requires its token: open the printed address, <code>...?token=TOKEN</code>.</p>",
)


@dataclass(frozen=True)
class Request:
    """Head of an HTTP request; header names are in lower case."""

    method: str
    path: str
    headers: dict[str, str]

    @property
    def query(self) -> dict[str, list[str]]:
        """Query of the URL."""
        return parse_qs(urlsplit(self.path).query)


@dataclass(frozen=True)
class Answer:
    """HTTP response of the guard."""

    status: str
    body: str = ""
    headers: tuple[str, ...] = ()

    def data(self) -> bytes:
        """Bytes of the response."""
        body = self.body.encode()
        head = [
            f"HTTP/1.1 {self.status}",
            "Content-Type: text/html; charset=utf-8",
            f"Content-Length: {len(body)}",
            "Connection: close",
            "Cache-Control: no-store",
            "X-Content-Type-Options: nosniff",
            "Referrer-Policy: no-referrer",
            *self.headers,
        ]
        return "\r\n".join([*head, "", ""]).encode() + body


def is_loopback(host: str) -> bool:
    """Tell whether a name or address can be reached from this machine only."""
    if host.strip("[]").lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def check_address(host: str, token: str | None) -> None:
    """Check that an address which other machines can reach has a valid token.

    Raises:
        DraftError: the token is missing or invalid.
    """
    if token is not None and not _TOKEN.fullmatch(token):
        cause = "the token is too short, or has characters that a URL cannot contain"
        remedy = f"give at least {MIN_TOKEN} letters, digits, '-' and '_'"
        raise DraftError(Problem(cause, None, remedy))
    if not is_loopback(host) and token is None:
        cause = f"'{host}' can be reached from other machines, and there is no --token"
        raise DraftError(Problem(cause, None, f"give --token with {MIN_TOKEN} characters"))


def parse_head(data: bytes) -> Request | None:
    """Parse the head of a request; None if it is invalid."""
    first, *lines = data.decode("latin-1").split("\r\n")
    parts = first.split(" ")
    if len(parts) != 3 or not parts[1].startswith("/"):
        return None
    headers: dict[str, str] = {}
    for line in lines:
        name, colon, value = line.partition(":")
        key = name.strip().lower()
        # The guard and viser could interpret a header that is given twice differently.
        if colon and key in headers and key in ("host", "origin", "cookie"):
            return None
        if colon:
            headers[key] = value.strip()
    return Request(parts[0], parts[1], headers)


def judge(request: Request, token: str | None, local_only: bool) -> Answer | None:
    """Decide whether a request may reach viser.

    Args:
        request: its head.
        token: secret that it must contain; None for none.
        local_only: whether only loopback is served, so that only names of loopback are valid.

    Returns:
        The answer to send instead; None if viser may answer.
    """
    if request.method not in ("GET", "HEAD"):
        return Answer("405 Method Not Allowed", "", ("Allow: GET, HEAD",))
    host = request.headers.get("host", "")
    name = urlsplit(f"//{host}").hostname or ""
    if local_only and not is_loopback(name):
        return Answer("403 Forbidden", "This page is served at 127.0.0.1 and localhost only.")
    origin = request.headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return Answer("403 Forbidden", "Pages of other sites may not use this page.")
    if token is None or _matches(_cookie(request), token):
        return None
    if _matches(request.query.get("token", [""])[0], token):
        cookie = f"Set-Cookie: {COOKIE}={token}; Path=/; HttpOnly; SameSite=Lax"
        return Answer("303 See Other", "", ("Location: /", cookie))
    return Answer("401 Unauthorized", _DENIED)


def _matches(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def _cookie(request: Request) -> str:
    for part in request.headers.get("cookie", "").split(";"):
        name, _, value = part.strip().partition("=")
        if name == COOKIE:
            return value
    return ""


class Guard:
    """Listens at an address and forwards permitted requests to a port of 127.0.0.1.

    Attributes:
        port: port that it listens at.
        page: returns the HTML of a URL path, or None for the paths of viser.
    """

    def __init__(
        self,
        host: str,
        port: int,
        inner: int,
        token: str | None,
        page: Callable[[str], str | None] = lambda _: None,
        secret: str = "",
    ) -> None:
        """Start listening.

        Args:
            host: address to serve on.
            port: port to serve on; 0 for any free one.
            inner: port of viser on 127.0.0.1.
            token: secret that requests must contain; None for none.
            page: returns the HTML of a URL path, or None for the paths of viser.
            secret: sent to viser with every permitted request.

        Raises:
            DraftError: the address requires a token, or it is not available.
        """
        check_address(host, token)
        self.page = page
        self._inner, self._token, self._local = inner, token, is_loopback(host)
        self._secret = secret
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task[None]] = set()
        ready: Future[int] = Future()
        self._thread = threading.Thread(
            target=self._serve, args=(host, port, ready), name="draft-guard", daemon=True
        )
        self._thread.start()
        try:
            self.port = ready.result()
        except OSError as error:
            cause = f"cannot serve on {host} port {port}: {error.strerror or error}"
            raise DraftError(Problem(cause, None, "choose another --port or --host")) from None

    def close(self) -> None:
        """Stop listening and close all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(timeout=5)

    def _serve(self, host: str, port: int, ready: Future[int]) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            start = asyncio.start_server(self._handle, host.strip("[]"), port, limit=_MAX_HEAD)
            server = self._loop.run_until_complete(start)
        except OSError as error:
            self._loop.close()
            ready.set_exception(error)
            return
        ready.set_result(server.sockets[0].getsockname()[1])
        self._loop.run_forever()
        server.close()
        for task in self._tasks:
            task.cancel()
        self._loop.run_until_complete(asyncio.gather(*self._tasks, return_exceptions=True))
        self._loop.close()

    async def _handle(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = cast("asyncio.Task[None]", asyncio.current_task())
        self._tasks.add(task)
        try:
            await self._answer(reader, writer)
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            pass  # the client is gone, or does not speak HTTP
        except asyncio.CancelledError:
            pass  # the guard closes
        finally:
            self._tasks.discard(task)
            writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _TIMEOUT)
        request = parse_head(head[:-4])
        answer = Answer("400 Bad Request")
        with contextlib.suppress(ValueError):  # an invalid address: answered with 400
            if request is not None:
                judged = judge(request, self._token, self._local)
                path = urlsplit(request.path).path
                # A report takes long: it must not block the other tabs.
                loop = asyncio.get_running_loop()
                html = None if judged else await loop.run_in_executor(None, self.page, path)
                answer = Answer("200 OK", html) if html is not None else judged
        if answer is not None:
            writer.write(answer.data())
            await writer.drain()
            return
        if request is not None:
            await self._forward(request, head, reader, writer)

    async def _forward(
        self,
        request: Request,
        head: bytes,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        """Connect a permitted request to viser: a WebSocket both ways, a page one way."""
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", self._inner)
        try:
            inner_writer.write(head[:-2] + f"{HEADER}: {self._secret}\r\n\r\n".encode())
            if request.headers.get("upgrade", "").lower() == "websocket":
                await asyncio.gather(_pipe(reader, inner_writer), _pipe(inner_reader, writer))
            else:
                await _pipe(inner_reader, writer)
        finally:
            inner_writer.close()


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Forward bytes until one end closes, then close the other."""
    try:
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()
    finally:
        writer.close()
