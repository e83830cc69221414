"""Frame of the HTML pages that Draft writes: one document without external resources."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
_PICTURES = "img-src data:"
# Plotly saves pictures as blobs.
_SCRIPTS = "script-src 'unsafe-inline'; img-src data: blob:"


def webpage(
    title: str, style: str, body: str, scripts: Sequence[str] = (), requests: bool = False
) -> str:
    """Text of an HTML page whose content policy forbids a browser to load anything else.

    Args:
        title: title as plain text.
        style: CSS.
        body: HTML of the body, without its scripts.
        scripts: JavaScript that runs at the end of the body; without any, scripts are forbidden.
        requests: whether scripts may send requests to the server of the page.
    """
    policy = _POLICY + (_SCRIPTS if scripts else _PICTURES)
    policy += "; connect-src 'self'" if requests else ""
    return "\n".join(
        [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(title)}</title>",
            f"<style>\n{style}</style>\n</head>\n<body>",
            body,
            *(f"<script>{script}</script>" for script in scripts),
            "</body>\n</html>\n",
        ]
    )
