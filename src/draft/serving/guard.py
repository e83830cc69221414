"""Who may see a page: every request is judged before viser answers it.

viser serves its page to every client and has no access control. `draft.serving.hook` puts the guard
into viser's own server, in front of every page and every WebSocket. Without the token nothing of
viser is sent, no page and no session. Requests from pages of other sites (a foreign Origin) are
denied, and, if only loopback is served, requests with a host name that is not of loopback. A
connection carries one request, so that none passes behind another that was permitted.

There is no encryption: on an open network, use a TLS proxy or an SSH tunnel.
"""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from draft.errors import DraftError
from draft.webpage import webpage

MIN_TOKEN = 16
COOKIE = "draft_page"
_TOKEN = re.compile(rf"[A-Za-z0-9_-]{{{MIN_TOKEN},}}")
_DENIED = webpage(
    "Draft",
    "",
    "<p>This page requires its token: open the printed address, <code>...?token=TOKEN</code>.</p>",
)


@dataclass(frozen=True)
class Request:
    """Head of a GET request; header names are in lower case."""

    path: str
    headers: dict[str, str]

    @property
    def query(self) -> dict[str, list[str]]:
        """Query of the URL."""
        return parse_qs(urlsplit(self.path).query)


@dataclass(frozen=True)
class Answer:
    """HTTP response of the guard."""

    status: HTTPStatus
    body: str = ""
    headers: tuple[tuple[str, str], ...] = ()

    def all_headers(self) -> tuple[tuple[str, str], ...]:
        """Names and values of its headers, the length of the body included."""
        return (
            ("Content-Type", "text/html; charset=utf-8"),
            ("Content-Length", str(len(self.body.encode()))),
            ("Connection", "close"),
            ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"),
            ("Referrer-Policy", "no-referrer"),
            *self.headers,
        )


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
        raise DraftError(cause, remedy)
    if not is_loopback(host) and token is None:
        cause = f"'{host}' can be reached from other machines, and there is no `token`"
        raise DraftError(cause, f"give `token` with {MIN_TOKEN} characters")


def read_request(path: str, headers: Iterable[tuple[str, str]]) -> Request | None:
    """Read the head of a request; None if it is ambiguous.

    Args:
        path: path and query of its URL.
        headers: names and values, as often as each was given.
    """
    found: dict[str, str] = {}
    for name, value in headers:
        key = name.lower()
        # Of two values, the guard and viser could each take another one.
        if key in found and key in ("host", "origin", "cookie"):
            return None
        found[key] = value
    return Request(path, found) if path.startswith("/") else None


def judge(request: Request, token: str | None, local_only: bool) -> Answer | None:
    """Decide whether a request may reach viser.

    Args:
        request: its head.
        token: secret that it must contain; None for none.
        local_only: whether only loopback is served, so that only names of loopback are valid.

    Returns:
        The answer to send instead; None if viser may answer.
    """
    host = request.headers.get("host", "")
    name = urlsplit(f"//{host}").hostname or ""
    if local_only and not is_loopback(name):
        return Answer(HTTPStatus.FORBIDDEN, "This page is served at 127.0.0.1 and localhost only.")
    origin = request.headers.get("origin")
    if origin is not None and urlsplit(origin).netloc != host:
        return Answer(HTTPStatus.FORBIDDEN, "Pages of other sites may not use this page.")
    if token is None or _matches(_cookie(request), token):
        return None
    if _matches(request.query.get("token", [""])[0], token):
        cookie = f"{COOKIE}={token}; Path=/; HttpOnly; SameSite=Lax"
        return Answer(HTTPStatus.SEE_OTHER, "", (("Location", "/"), ("Set-Cookie", cookie)))
    return Answer(HTTPStatus.UNAUTHORIZED, _DENIED)


def _matches(given: str, token: str) -> bool:
    return hmac.compare_digest(given.encode("utf-8", "replace"), token.encode())


def _cookie(request: Request) -> str:
    for part in request.headers.get("cookie", "").split(";"):
        name, _, value = part.strip().partition("=")
        if name == COOKIE:
            return value
    return ""


class Guard:
    """Answers requests that may not reach viser, and those for pages of Draft's own.

    Attributes:
        token: secret that requests must contain; None for none.
        page: function from a URL path to HTML, or to None for the paths of viser.
    """

    def __init__(self, host: str, token: str | None, page: Callable[[str], str | None]) -> None:
        """Guard an address.

        Args:
            host: address that is served.
            token: secret that requests must contain; None for none.
            page: function from a URL path to HTML, or to None for the paths of viser.

        Raises:
            DraftError: the address requires a token.
        """
        check_address(host, token)
        self.token, self.page = token, page
        self._local = is_loopback(host)

    async def answer(self, path: str, headers: Iterable[tuple[str, str]]) -> Answer | None:
        """Answer a request; None if viser may answer it.

        Args:
            path: path and query of its URL.
            headers: its headers, as often as each was given.
        """
        request = read_request(path, headers)
        if request is None:
            return Answer(HTTPStatus.BAD_REQUEST)
        try:
            judged = judge(request, self.token, self._local)
            url = urlsplit(request.path).path
        except ValueError:  # no URL
            return Answer(HTTPStatus.BAD_REQUEST)
        if judged is not None:
            return judged
        # A report takes long: it must not block the other tabs.
        html = await asyncio.get_running_loop().run_in_executor(None, self.page, url)
        return None if html is None else Answer(HTTPStatus.OK, html)
