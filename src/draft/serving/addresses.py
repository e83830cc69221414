"""Addresses that a page is served at."""

from __future__ import annotations

import socket

from draft.errors import DraftError, Problem

MAX_PORT = 65535


def check_port(port: int) -> None:
    """Check that a port is a port's number.

    Raises:
        DraftError: it is not.
    """
    if not 0 <= port <= MAX_PORT:
        problem = Problem(f"there is no port {port}", None, f"choose one from 0 to {MAX_PORT}")
        raise DraftError(problem)


def check_free(host: str, port: int) -> None:
    """Check that a page can be served at an address.

    Raises:
        DraftError: the port is taken, or the host is not this machine's.
    """
    try:
        family, kind, _, _, address = socket.getaddrinfo(
            host.strip("[]"), port, type=socket.SOCK_STREAM
        )[0]
        with socket.socket(family, kind) as made:
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            made.bind(address)
    except (OSError, UnicodeError) as error:
        words = getattr(error, "strerror", None) or str(error)
        cause = f"cannot serve on {host} port {port}: {words}"
        raise DraftError(Problem(cause, None, "choose another --port or --host")) from None


def address(host: str, port: int, token: str | None = None) -> str:
    """The page's address as a browser takes it."""
    shown = f"[{host}]" if ":" in host and not host.startswith("[") else host
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
