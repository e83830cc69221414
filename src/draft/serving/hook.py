"""A guard inside viser's own server: it answers first, pages as well as WebSockets.

viser has no setting for this; it starts its server with `websockets.asyncio.server.serve`, which is
replaced while it does.
"""

from __future__ import annotations

import contextlib
import http.client
import logging
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from http import HTTPStatus
from typing import Any

from draft.errors import DraftError
from draft.serving.guard import Guard

# For the head of a request, its answer, which may be a report, and to send it [s].
_PATIENCE = 300.0
_FOREIGN = "http://another-site.invalid"
_lock = threading.Lock()


@contextlib.contextmanager
def guarded(guard: Guard) -> Iterator[None]:
    """Let a guard answer first in the server that viser starts meanwhile."""
    from websockets.asyncio import server as websockets
    from websockets.datastructures import Headers
    from websockets.http11 import Response

    serve: Any = websockets.serve
    logger = logging.Logger("draft.serving")
    if logging.lastResort is not None:  # to the stderr of the time of writing
        logger.addHandler(logging.lastResort)
    logger.addFilter(OnePerMinute())

    def guarding(
        handler: Any, *address: Any, process_request: Callable[..., Any] | None, **options: Any
    ) -> Any:
        async def check(connection: Any, request: Any) -> Any:
            answer = await guard.answer(request.path, request.headers.raw_items())
            if answer is not None:
                headers = Headers(answer.all_headers())
                status = answer.status
                return Response(status, status.phrase, headers, answer.body.encode())
            return None if process_request is None else process_request(connection, request)

        options |= {"open_timeout": _PATIENCE, "close_timeout": _PATIENCE, "logger": logger}
        return serve(handler, *address, process_request=check, **options)

    with _lock:
        websockets.serve = guarding
        try:
            yield
        finally:
            websockets.serve = serve


def check_denied(port: int, host: str = "127.0.0.1") -> None:
    """Check that a port of this machine denies requests from pages of other sites.

    Raises:
        DraftError: it answers; this version of viser starts its server in another way.
    """
    connection = http.client.HTTPConnection(host, port, timeout=60)
    try:
        connection.request("GET", "/", headers={"Host": "localhost", "Origin": _FOREIGN})
        answer = connection.getresponse()
        answer.read()
    finally:
        connection.close()
    if answer.status != HTTPStatus.FORBIDDEN:
        import viser

        cause = f"viser {viser.__version__} cannot be served safely: its port answers everyone"
        raise DraftError(cause, "install the version of viser in uv.lock")


class OnePerMinute(logging.Filter):
    """Keeps one line a minute of messages from browsers that viser cannot read.

    Other errors pass as they are, with their traceback.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with nothing counted.

        Args:
            clock: returns the time [s].
        """
        super().__init__()
        self._clock, self._last, self._dropped = clock, -1e9, 0

    def filter(self, record: logging.LogRecord) -> bool:
        """Shorten or drop a record; see `logging.Filter`."""
        if record.levelno < logging.WARNING:
            return False
        read = _functions(record)
        if "_message_consumer" not in read:
            # Of handshakes that fail, only the faults in our own check are worth a line.
            return not read & {"conn_handler", "handshake"} or bool(read & {"ws_handler", "check"})
        if self._clock() - self._last < 60.0:
            self._dropped += 1
            return False
        more = f" ({self._dropped} more since the last such line)" if self._dropped else ""
        record.msg = f"a browser sent what viser cannot read; its connection was closed{more}"
        record.args, record.exc_info = (), None
        self._last, self._dropped = self._clock(), 0
        return True


def _functions(record: logging.LogRecord) -> set[str]:
    """Names of the functions that the error of a record passed through."""
    error = record.exc_info[1] if record.exc_info else None
    return {frame.name for frame in traceback.extract_tb(error.__traceback__ if error else None)}
