"""Addresses that a page is served at."""

from __future__ import annotations

import socket

from draft.errors import DraftError, Problem


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


def address(host: str, port: int) -> str:
    """The page's address as a browser takes it."""
    shown = f"[{host}]" if ":" in host and not host.startswith("[") else host
    return f"http://{shown}:{port}/"
