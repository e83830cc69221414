"""Addresses of pages that Draft serves."""

from __future__ import annotations

import errno
import socket
import sys

from draft.errors import DraftError, Problem

MAX_PORT = 65535


def check_port(port: int) -> None:
    """Check that a number is that of a port.

    Raises:
        DraftError: it is not.
    """
    if not 0 <= port <= MAX_PORT:
        problem = Problem(f"there is no port {port}", None, f"choose one from 0 to {MAX_PORT}")
        raise DraftError(problem)


def check_free(host: str, port: int) -> None:
    """Check that a page can be served at an address.

    Raises:
        DraftError: the port is taken, or the host is not of this machine.
    """
    try:
        family, kind, _, _, address = socket.getaddrinfo(
            host.strip("[]"), port, type=socket.SOCK_STREAM
        )[0]
        with socket.socket(family, kind) as probe:
            if sys.platform != "win32":  # where it would share a port that is taken
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address)
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise not_served(host, port, reason, getattr(error, "errno", None)) from None


def not_served(host: str, port: int, reason: str, number: int | None) -> DraftError:
    """Error of a page that cannot be served, with what to do about it.

    Args:
        host: address to serve on.
        port: port to serve on.
        reason: what the system says.
        number: its number, such as `errno.EADDRINUSE`; None if it has none.
    """
    if number == errno.EADDRINUSE:
        cause = f"cannot serve on {host} port {port}: another page or program uses it"
        another = port + 1 if port < MAX_PORT else port - 1
        remedy = f"end that one, or pass `port={another}`, or `port=0` for any free port"
        return DraftError(cause, remedy)
    cause = f"cannot serve on {host} port {port}: {reason}"
    return DraftError(cause, "choose another `port` or `host`")


def address(host: str, port: int, token: str | None = None) -> str:
    """URL of the page for a browser."""
    shown = f"[{host}]" if ":" in host and not host.startswith("[") else host
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
