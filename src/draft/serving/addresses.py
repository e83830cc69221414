"""Addresses of pages that Draft serves."""

from __future__ import annotations

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
        raise taken(host, port, getattr(error, "strerror", None) or str(error)) from None


def taken(host: str, port: int, reason: str) -> DraftError:
    """Error for an address that cannot be served, with the reason of the operating system."""
    cause = f"cannot serve on {host} port {port}: {reason}"
    return DraftError(Problem(cause, None, "choose another --port or --host"))


def address(host: str, port: int, token: str | None = None) -> str:
    """URL of the page for a browser."""
    shown = f"[{host}]" if ":" in host and not host.startswith("[") else host
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")
