"""Robots by the thin `mujoco` of a page's worker, in a process of its own without the real one.

Run as `thin_robots.py FOLDER`: FOLDER holds `mujoco.js`, `mujoco.wasm` and `bridge.js`, the archive
of the worker's Python unpacked as `python`, and `asked.json`; `answers.json` gets the answers.
MuJoCo for browsers runs in a browser, as in the page; only Python does not.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from types import SimpleNamespace

from benchmarks import browser as chromium

THIN = Path("draft") / "browser" / "thin"
PAGE = """<script type="module">
import loadMujoco from "./mujoco.js";
import { Bridge } from "./bridge.js";
const wasmBinary = await (await fetch("./mujoco.wasm")).arrayBuffer();
window.bridge = new Bridge(await loadMujoco({ wasmBinary, locateFile: () => "" }));
</script>"""
HOST = "http://page.invalid/"


def main(folder: Path) -> None:
    with chromium.browser() as opened:
        tab = chromium.tab(opened)

        def serve(route: object, request: object) -> None:
            name = request.url.removeprefix(HOST)  # type: ignore[attr-defined]
            if name:
                route.fulfill(path=folder / name)  # type: ignore[attr-defined]
            else:
                route.fulfill(body=PAGE, content_type="text/html")  # type: ignore[attr-defined]

        tab.route(f"{HOST}**", serve)
        tab.goto(HOST)
        tab.wait_for_function("window.bridge")
        asked = SimpleNamespace(ask=lambda text: tab.evaluate("text => bridge.ask(text)", text))
        sys.modules["mujoco_js"] = asked  # type: ignore[assignment]
        sys.path[:0] = [str(folder / "python"), str(folder / "python" / THIN)]
        answers = answer(json.loads((folder / "asked.json").read_text("utf-8")))
        (folder / "answers.json").write_text(json.dumps(answers), "utf-8")


def answer(asked: dict) -> dict:
    """Texts of the models of some designs, or what is wrong with them; and whole answers."""
    import mujoco

    import draft
    from draft.browser.designer import Designer
    from draft.errors import DraftError
    from draft.model.mjcf import robot_xml
    from draft.spec import Spec

    def text(robot: str, values: dict) -> str:
        try:
            return robot_xml(specs[robot].resolve(values))
        except DraftError as error:
            return str(error)

    def refusal(xml: str) -> str:
        try:
            mujoco.MjModel.from_xml_string(xml)
        except ValueError as error:
            return str(error).strip()
        return ""

    specs = {robot: Spec.parse(files) for robot, files in asked["robots"].items()}
    designer = Designer("walk")
    return {
        "modules": [draft.__file__, mujoco.__file__],
        "refusals": [refusal(xml) for xml in asked["wrong"]],
        "texts": [text(*one) for one in asked["designs"]],
        "answers": [designer.answer(message) for message in asked["messages"]],
    }


if __name__ == "__main__":
    main(Path(sys.argv[1]))
