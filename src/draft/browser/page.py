"""Web pages in which robots walk under live physics: a folder for any static host, or one file."""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files as resources
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from draft import drawing, files
from draft.browser import pyodide
from draft.browser.designer import source
from draft.browser.engine import MOST, engine
from draft.browser.grid import Grid, grid
from draft.browser.robots import PageRobot, compiled, driven, network_part, robot
from draft.design import Design
from draft.design.references import open_designs
from draft.errors import DraftError
from draft.explore.comparison import titles
from draft.extras import own_version
from draft.learn.policy.reduced import open_any
from draft.learn.policy.validity import check_used
from draft.plotting import COLORS
from draft.serving import messages
from draft.spec import Spec
from draft.variation.axes import Vary
from draft.webpage import webpage

SKILLS = ("walk", "run", "push")
_MODULES = (
    *("asking", "bodies", "compressed", "designer", "element", "inertia", "limits", "load"),
    *("network", "picture", "robot", "steer"),
)
_GAP = 0.5  # Room between two robots, per width of the wider one.
_REMEDY = "choose another `out`"
_MARK = "draft-page.json"  # File by which a folder is known as a page of Draft.


def page(
    designs: Sequence[Design | Spec | str | Path],
    out: str | Path | None = None,
    skill: str = "walk",
    single: bool = False,
    policies: Sequence[str | Path] = (),
    vary: Vary = (),
    live: bool = False,
    python: bool = False,
) -> list[Path]:
    """Write a web page in which designs walk side by side, under live physics.

        >>> draft.page(["cheetah", "bear"], "site")
        [PosixPath('site/index.html'), ...]

    Args:
        designs: 1 to 6 single designs, or their references: "quadruped:bear", a model's folder. A
            design that no policy drives stands, and the page says why.
        out: folder of the page; with `single` the file. By default "page" or "page.html".
        skill: what the shipped policies can do: "walk", "run" or "push".
        single: whether to write one file that opens from the disk, without a server or a network.
        policies: ONNX files of policies to walk with before those that ship.
        vary: ranges of up to 5 numbers of the designs, which become sliders: words such as
            "thigh_length=0.2:0.3" or `thigh_length=*0.8:*1.2`, factors of each design's own number,
            or (low, high) by name. A slider moves all designs.
        live: whether visitors can change any number and the files of the designs, answered by a
            process of this machine (`draft.browser.live.serve`).
        python: whether they can with Python that a button of the page loads into their browser
            from a public host.

    Returns:
        The files written, the page first.

    Raises:
        DraftError: a reference names no design, there are none or too many, MuJoCo does not accept
            one, the folder holds other files, a file cannot be written, or the extra `page` is not
            installed or is another MuJoCo.
    """
    given = [designs] if isinstance(designs, (Design, Spec, str, Path)) else designs
    if skill not in SKILLS:
        cause = f"a page shows no skill '{skill}': its ground is a plane"
        raise DraftError(cause, f"skills: {', '.join(SKILLS)}")
    _check_designer(live, python, single, len(policies) > 0)
    target = Path(out if out is not None else "page.html" if single else "page")
    if single:
        files.check_output(target, ".html")
    else:
        _check_folder(target)
    engine()
    opened = open_designs(given)
    _check(opened)
    own = [open_any(file) for file in policies]
    models = [compiled(design) for design in opened]
    check_used(models, own)
    varied = [grid(model, vary, skill, own) for model in models] if len(vary) else []
    by = [one.by for one in varied] or [driven([model], skill, own) for model in models]
    rows = zip(models, titles(opened), COLORS, by, strict=False)  # There are more colours.
    robots = [robot(*row) for row in rows]
    kind = "live" if live else "python" if python else ""
    designer: dict[str, Any] = {"kind": kind, "most": messages.MOST}
    if live or python:
        for one, design in zip(robots, opened, strict=True):
            one.plain["source"] = source(design)
    if python:
        designer |= {"skill": skill, **pyodide.settings()}
    contents = _contents(robots, varied, single, designer)
    if single:
        files.write(target, contents["index.html"])
        return [target]
    with files.new_folder(target, _REMEDY) as folder:
        for name, content in contents.items():
            (folder / name).write_bytes(content.encode() if isinstance(content, str) else content)
    return [target / name for name in contents]


def single_page(robots: Sequence[PageRobot]) -> str:
    """Text of a page in one file in which robots walk.

    Raises:
        DraftError: the extra `page` is not installed or is another MuJoCo.
    """
    return cast(str, _contents(robots, [], True)["index.html"])


def _check(designs: Sequence[Design]) -> None:
    if not 1 <= len(designs) <= MOST:
        cause = f"a page shows 1 to {MOST} designs, not {len(designs)}"
        raise DraftError(cause, "name fewer, or write several pages")
    if any(design.count is not None for design in designs):
        raise DraftError("a page shows single designs", "select one: design[0]")


def _check_designer(live: bool, python: bool, single: bool, own: bool) -> None:
    if live and python:
        raise DraftError("`live` and `python` both let a page change designs", "give one of them")
    if single and (live or python):
        cause = "a page of one file changes no designs: browsers start nothing beside such a page"
        raise DraftError(cause, f"omit `single`, or `{'live' if live else 'python'}`")
    if python and own:
        cause = "Python in a browser has only the policies that ship with Draft"
        raise DraftError(cause, "pass `live` for policies of your own")


def _check_folder(folder: Path) -> None:
    """Refuse to replace what is not a page written by Draft."""
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise DraftError(f"'{folder}' exists and is not a folder", f"{_REMEDY}, or give `single`")
    if folder.is_dir() and any(folder.iterdir()) and not (folder / _MARK).is_file():
        cause = f"'{folder}' is not a page that Draft wrote: it has no {_MARK}; it is kept"
        raise DraftError(cause, f"{_REMEDY}, or empty the folder")


def _contents(
    robots: Sequence[PageRobot],
    varied: Sequence[Grid],
    single: bool,
    designer: Mapping[str, Any] | None = None,
) -> dict[str, str | bytes]:
    """Contents of the files by name, the page first."""
    modules, designer = _modules(), dict(designer or {"kind": ""})
    parts = {"mujoco.wasm": gzip.compress(engine().wasm, 6, mtime=0)}
    plain = []
    for one in robots:
        record = dict(one.plain)
        if one.fit is not None:
            record["network"], numbers = network_part(one.fit.policy)
            parts.setdefault(record["network"], gzip.compress(numbers, 6, mtime=0))
        plain.append(record)
    for i, one in enumerate(varied):
        parts[f"bodies-{i}"] = gzip.compress(one.numbers.astype("<f4").tobytes(), 6, mtime=0)
    data = {
        "vary": [one.plain for one in varied],
        "mujoco": engine().version,
        "lanes": _lanes(robots),
        "designer": designer,
        "robots": plain,
    }
    body = (resources("draft.browser") / "body.html").read_text("utf-8")
    body += _inside("draft-page", "application/json", json.dumps(data, allow_nan=False))
    title = ", ".join(str(one["title"]) for one in plain)
    style = (resources("draft.browser") / "page.css").read_text("utf-8")
    if single:
        inlined = {name: drawing.inlined(text) for name, text in modules.items()}
        for name, content in parts.items():
            body += _inside(f"part-{name}", "text/plain", base64.b64encode(content).decode())
        found = webpage(
            title, style, body, ['import("draft/main");'], modules=inlined, compiles=True
        )
        return {"index.html": found}
    more: dict[str, str | bytes] = {}
    if designer["kind"] == "python":
        for name in ("designer-worker", "bridge"):
            more[f"{name}.js"] = (resources("draft.browser") / f"{name}.js").read_text("utf-8")
        parts[pyodide.ARCHIVE] = gzip.compress(pyodide.archive(), 6, mtime=0)
    addresses = {name: f"./{_file(name)}" for name in modules}
    found = webpage(title, style, body, [_SERVED], requests=True, modules=addresses, compiles=True)
    mark = json.dumps({"draft": own_version(), "mujoco": engine().version})
    return {
        "index.html": found,
        **{_file(name): text for name, text in modules.items()},
        **more,
        **{f"{name}.gz": content for name, content in parts.items()},
        "LICENSES": _licences(),
        _MARK: mark + "\n",
    }


# Browsers load no modules from the disk.
_SERVED = """if (location.protocol === "file:") document.getElementById("note").textContent =
  "Browsers run a page of several files only from a server: python -m http.server in its folder, \
or write it as one file.";
else import("draft/main");"""


def _modules() -> dict[str, str]:
    """Texts of all modules of a page, by the name that `import` gives them."""
    folder = resources("draft.browser")
    own = {
        f"draft/{name}": (folder / f"{name}.js").read_text("utf-8") for name in (*_MODULES, "main")
    }
    return {**own, "mujoco": engine().script, **drawing.modules()}


def _file(module: str) -> str:
    return f"{module.removeprefix('draft/').replace('/', '.')}.js"


def _inside(name: str, kind: str, text: str) -> str:
    """A text within the page, from which no tag can lead out."""
    return f'<script id="{name}" type="{kind}">{text.replace("<", chr(92) + "u003c")}</script>\n'


def _lanes(robots: Sequence[PageRobot]) -> list[float]:
    """Places of the robots to the left [m], the first on the left, around 0."""
    places = [0.0]
    for before, one in pairwise(robots):
        a, b = (float(each.plain["width"]) for each in (before, one))
        places.append(places[-1] - (a + b) / 2 - _GAP * max(a, b))
    middle = (places[0] + places[-1]) / 2
    return [place - middle for place in places]


def _licences() -> str:
    return (
        "mujoco.js and mujoco.wasm: MuJoCo, Copyright DeepMind Technologies Limited, "
        "Apache License 2.0, https://www.apache.org/licenses/LICENSE-2.0\n\n"
        f"three.js and three.core.js:\n\n{drawing.licence()}"
    )
