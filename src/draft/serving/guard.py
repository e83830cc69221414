"""The only way to a page: what reaches viser has been looked at here first.

viser serves its page to whoever asks and has no notion of a visitor's rights. So it listens on
127.0.0.1 at a port of its own, and this door stands in front: it reads the head of each connection
and then either answers itself or joins the two ends. Without the token nothing of viser is sent, no
page and no session. Requests that another site's page makes (a foreign Origin), or that come under
another name than a loopback one where only loopback is served, are refused too.

There is no encryption here: on an open network, put a TLS proxy or an SSH tunnel in front. Other
users of the same machine can reach viser's own port.
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
from urllib.parse import parse_qs, urlsplit

from draft.errors import DraftError, Problem
from draft.webpage import webpage

SHORTEST_TOKEN = 16
COOKIE = "draft_page"
_TOKEN = re.compile(rf"[A-Za-z0-9_-]{{{SHORTEST_TOKEN},}}")
_LONGEST_HEAD = 32 * 1024
_PATIENCE = 15.0  # for the head of a request [s]
_CHUNK = 64 * 1024
_DENIED = webpage(
    "Draft",
    "",
    "<p>This page requires its token: open the printed address, <code>...?token=TOKEN</code>.</p>",
)


@dataclass(frozen=True)
class Request:
    """The head of a request; header names in lower case."""

    method: str
    path: str
    headers: dict[str, str]

    @property
    def query(self) -> dict[str, list[str]]:
        """What stands behind the question mark."""
        return parse_qs(urlsplit(self.path).query)


@dataclass(frozen=True)
class Answer:
    """What is sent instead of viser's answer."""

    status: str
    body: str = ""
    headers: tuple[str, ...] = ()

    def data(self) -> bytes:
        """Bytes on the wire."""
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
    """Tell whether a name or address is this machine's own only."""
    if host.strip("[]").lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def check_address(host: str, token: str | None) -> None:
    """Refuse to serve the world without a token.

    Raises:
        DraftError: the token is missing or too short.
    """
    if token is not None and not _TOKEN.fullmatch(token):
        cause = "the token is too short, or has characters that an address cannot hold"
        remedy = f"give {SHORTEST_TOKEN} letters, digits, '-' and '_', or more"
        raise DraftError(Problem(cause, None, remedy))
    if not is_loopback(host) and token is None:
        cause = f"'{host}' can be reached from other machines, and there is no --token"
        raise DraftError(Problem(cause, None, f"give --token with {SHORTEST_TOKEN} characters"))


def parse_head(data: bytes) -> Request | None:
    """Read the head of a request; None where it is none."""
    first, *lines = data.decode("latin-1").split("\r\n")
    words = first.split(" ")
    if len(words) != 3 or not words[1].startswith("/"):
        return None
    headers: dict[str, str] = {}
    for line in lines:
        name, colon, value = line.partition(":")
        key = name.strip().lower()
        # A header given twice could be read one way here and another way behind the door.
        if colon and key in headers and key in ("host", "origin", "cookie"):
            return None
        if colon:
            headers[key] = value.strip()
    return Request(words[0], words[1], headers)


def judge(request: Request, token: str | None, local_only: bool) -> Answer | None:
    """Decide about a request.

    Args:
        request: its head.
        token: what a visitor must know; None where loopback is guard enough.
        local_only: whether only loopback is served, so that only its names are right.

    Returns:
        What to answer instead; None where viser may answer.
    """
    host = request.headers.get("host", "")
    name = urlsplit(f"//{host}").hostname or ""
    if local_only and not is_loopback(name):
        return Answer("403 Forbidden", "This page answers to 127.0.0.1 and localhost only.")
    origin = request.headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return Answer("403 Forbidden", "A page of another site may not use this page.")
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
    """Listens at an address, and lets through to a port of 127.0.0.1 what may pass.

    Attributes:
        port: the port that it listens at.
        page: HTML of a path of Draft's own; None for viser's paths.
    """

    def __init__(
        self,
        host: str,
        port: int,
        inner: int,
        token: str | None,
        page: Callable[[str], str | None] = lambda _: None,
    ) -> None:
        """Start listening.

        Raises:
            DraftError: there is no token where one is needed, or the address cannot be had.
        """
        check_address(host, token)
        self.page = page
        self._inner, self._token, self._local = inner, token, is_loopback(host)
        self._loop = asyncio.new_event_loop()
        self._tasks: set[asyncio.Task] = set()
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
        """Stop listening, and end all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join(timeout=5)

    def _serve(self, host: str, port: int, ready: Future[int]) -> None:
        asyncio.set_event_loop(self._loop)
        try:
            start = asyncio.start_server(self._visit, host.strip("[]"), port, limit=_LONGEST_HEAD)
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

    async def _visit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            await self._answer(reader, writer)
        except (OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, TimeoutError):
            pass  # whoever asked has gone, or never spoke HTTP
        except asyncio.CancelledError:
            pass  # the page closes
        finally:
            self._tasks.discard(task)
            writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), _PATIENCE)
        request = parse_head(head[:-4])
        answer = Answer("400 Bad Request")
        with contextlib.suppress(ValueError):  # addresses that are none: answered with 400
            if request is not None:
                judged = judge(request, self._token, self._local)
                path = urlsplit(request.path).path
                # A report takes long: other tabs must not wait for it.
                loop = asyncio.get_running_loop()
                own = None if judged else await loop.run_in_executor(None, self.page, path)
                answer = Answer("200 OK", own) if own is not None else judged
        if answer is not None:
            writer.write(answer.data())
            await writer.drain()
            return
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", self._inner)
        try:
            inner_writer.write(head)
            await asyncio.gather(_pipe(reader, inner_writer), _pipe(inner_reader, writer))
        finally:
            inner_writer.close()


async def _pipe(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass bytes on until one end closes, then close the other."""
    try:
        while data := await reader.read(_CHUNK):
            writer.write(data)
            await writer.drain()
    finally:
        writer.close()
