"""Files and answers to messages on this machine alone, behind the checks of `guard`."""

from __future__ import annotations

import mimetypes
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from draft.serving.addresses import check_free, check_port
from draft.serving.guard import Answer, judge, read_request

HOST = "127.0.0.1"
MOST = 4_000_000  # Length of a message [bytes].
_READ = 4 * MOST  # Of a longer one, so that whoever sends it hears that it is refused.
_CHUNK = 65_536
_TYPES = {".js": "text/javascript", ".gz": "application/octet-stream"}  # As browsers need them.


class MessageServer:
    """Serves some files, and answers the messages that are sent to one path, until it is closed.

    Attributes:
        port: port to open in a browser.
    """

    def __init__(
        self,
        files: Mapping[str, bytes],
        path: str,
        answer: Callable[[bytes], str],
        port: int = 0,
    ) -> None:
        """Start serving.

        Args:
            files: content by name; "index.html" is also the page of the address itself.
            path: URL path that messages are sent to, as JSON.
            answer: returns the answer to a message as JSON; called for one message at a time.
            port: port to serve on; 0 for any free one.

        Raises:
            DraftError: the port is invalid or in use.
        """
        check_port(port)
        check_free(HOST, port)

        class Handler(_Handler):
            pass

        Handler.files, Handler.path_of_messages = files, path
        Handler.answer, Handler.turn = staticmethod(answer), threading.Lock()
        self._server = _Server((HOST, port), Handler)
        self.port = int(self._server.server_port)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report an error, but not that a browser has left before its answer."""
        if not isinstance(sys.exception(), OSError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    files: Mapping[str, bytes]
    path_of_messages: str
    answer: Callable[[bytes], str]
    turn: threading.Lock
    timeout = 60  # For a browser to send what it announced [s].

    def do_GET(self) -> None:
        path = self._allowed()
        if path is None:
            return
        name = path.removeprefix("/") or "index.html"
        if name not in self.files:
            self._send(HTTPStatus.NOT_FOUND, b"There is no such file.", "text/plain")
            return
        suffix = name[name.rfind(".") :]
        kind = _TYPES.get(suffix) or mimetypes.guess_type(name)[0] or "text/plain"
        self._send(HTTPStatus.OK, self.files[name], kind)

    def do_POST(self) -> None:
        path = self._allowed()
        if path is None:
            return
        length = self.headers.get("Content-Length", "")
        # Other sites cannot send this type without asking, which nothing here permits.
        json = self.headers.get_content_type() == "application/json"
        number = length.isdecimal() and len(length) < 10
        if path != self.path_of_messages or not json or not number:
            self._send(HTTPStatus.BAD_REQUEST, b"This is no message of the page.", "text/plain")
        elif int(length) > MOST:
            left = min(int(length), _READ)
            while left > 0 and (part := self.rfile.read(min(left, _CHUNK))):
                left -= len(part)
            cause = f"A message has {MOST} bytes at most."
            self._send(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, cause.encode(), "text/plain")
        else:
            message = self.rfile.read(int(length))
            try:
                with self.turn:
                    found = self.answer(message)
            except Exception:  # A fault of Draft, which must not look like an end of the process.
                traceback.print_exc()
                cause = b"Draft failed; the terminal that serves this page says how."
                self._send(HTTPStatus.INTERNAL_SERVER_ERROR, cause, "text/plain")
                return
            self._send(HTTPStatus.OK, found.encode(), "application/json")

    def _allowed(self) -> str | None:
        """Path of a request that may be answered; any other one is refused."""
        request = read_request(self.path, self.headers.items())
        if request is None:
            judged: Answer | None = Answer(HTTPStatus.BAD_REQUEST)
        else:
            try:
                judged = judge(request, None, local_only=True)
                if judged is None:
                    return urlsplit(request.path).path
            except ValueError:  # no URL
                judged = Answer(HTTPStatus.BAD_REQUEST)
        self._send(judged.status, judged.body.encode(), "text/plain")
        return None

    def _send(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.send_response(status)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Connection", "close")
        self.send_header("Cache-Control", "no-store")
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""
