"""Frame of the HTML pages that Draft writes: one document without external resources."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape

_POLICY = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; "
_PICTURES = "img-src data:"
# Plotly saves pictures as blobs.
_SCRIPTS = "script-src 'unsafe-inline'; img-src data: blob:"
_MODULES = "script-src 'self' data:"
# Compiling WebAssembly; MuJoCo's bindings make functions from strings, which are their own.
_COMPILES = "script-src 'unsafe-eval'"


def webpage(
    title: str,
    style: str,
    body: str,
    scripts: Sequence[str] = (),
    requests: bool = False,
    modules: Mapping[str, str] | None = None,
    compiles: bool = False,
    frames: bool = False,
) -> str:
    """Text of an HTML page whose content policy forbids a browser to load anything else.

    Args:
        title: title as plain text.
        style: CSS.
        body: HTML of the body, without its scripts.
        scripts: JavaScript that runs at the end of the body; without any, scripts are forbidden.
        requests: whether scripts may send requests to the server of the page.
        modules: address of each module by the name that `import` gives it; None without modules.
        compiles: whether modules may compile WebAssembly.
        frames: whether the body embeds such pages as `srcdoc`, which inherit this policy.
    """
    policy = _POLICY + (_SCRIPTS if scripts else _PICTURES)
    policy = policy.replace("script-src", _MODULES) if modules is not None or frames else policy
    policy = policy.replace("script-src", _COMPILES) if compiles or frames else policy
    policy += "; connect-src 'self'" if requests else ""
    return "\n".join(
        [
            '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
            f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
            '<meta name="viewport" content="width=device-width, initial-scale=1">',
            '<link rel="icon" href="data:,">',
            f"<title>{escape(title)}</title>",
            f"<style>\n{style}</style>",
            *([] if modules is None else [_imports(modules)]),
            "</head>\n<body>",
            body,
            *(f"<script>{script}</script>" for script in scripts),
            "</body>\n</html>\n",
        ]
    )


def _imports(modules: Mapping[str, str]) -> str:
    """Import map of modules."""
    return f'<script type="importmap">{json.dumps({"imports": dict(modules)})}</script>'
