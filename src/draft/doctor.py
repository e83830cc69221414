"""Description of an installation: versions, extras, extensions, GPU, drawing, browser, learning.

Nothing large is imported: versions come from the metadata of packages, and each renderer is tried
in a process of its own, since MuJoCo loads only one of them and a broken driver may crash.
"""

from __future__ import annotations

import contextlib
import ctypes.util
import importlib.util
import os
import platform
import re
import shutil
import subprocess
import sys
import webbrowser
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft import extensions, extras, offscreen
from draft.errors import DraftError
from draft.learn.engine.machine import Machine, free_memory, gpu_possible, this_machine

if TYPE_CHECKING:
    from draft.learn.training.estimate import Outlook

CORE = ("mujoco", "numpy", "pydantic", "PyYAML", "rich", "tyro")
# Required by the libraries of the extra `learn`, and part of most questions about it.
LEARNING = ("torch", "mujoco-warp", "warp-lang", "rsl-rl-lib", "mjbatch")
_CUDA_PACKAGES = ("nvidia-", "triton")
RENDERERS = {"linux": ("egl", "osmesa", "glfw"), "darwin": ("cgl",), "win32": ("wgl",)}
DRAWS = "draws"
# A driver that has not drawn 16 by 16 pixels by then never will [s].
_PATIENCE = 30.0
_DRAWING = """
import mujoco
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><light pos="0 0 3"/><geom size="1"/></worldbody></mujoco>'
)
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
with mujoco.Renderer(model, 16, 16) as renderer:
    renderer.update_scene(data)
    print("bright" if renderer.render().max() > 0 else "black")
"""


@dataclass(frozen=True)
class Row:
    """A line of the table.

    Attributes:
        item: what it describes.
        text: what was found.
        record: the same as plain data, for JSON.
    """

    item: str
    text: str
    record: Any


def examine(ask: bool = False) -> list[Row]:
    """Describe this installation and machine.

    Args:
        ask: import PyTorch to ask it for GPUs, which takes seconds where there may be one.
    """
    return [
        _draft(),
        Row("python", f"{platform.python_version()} ({platform.python_implementation()})", None),
        Row("system", platform.platform(), None),
        _libraries(),
        *_extras(),
        *_extensions(),
        _gpu(),
        _rendering(),
        _browser(),
        *_learning(ask),
    ]


def _draft() -> Row:
    found, checkout = extras.own_version(), extras.checkout() is not None
    text = f"{found}, {'checkout' if checkout else 'package'}"
    return Row("draft", text, {"version": found, "checkout": checkout})


def _libraries() -> Row:
    found = {name: extras.installed(name) for name in CORE}
    return Row("libraries", _versions(found), found)


def _versions(found: Mapping[str, str | None]) -> str:
    return ", ".join(f"{name} {version or 'missing'}" for name, version in found.items())


def _extras() -> Iterator[Row]:
    for extra, needed in sorted(extras.required().items()):
        names = [*needed, *(LEARNING if extra == "learn" else ())]
        found = {name: extras.installed(name) for name in names}
        missing = [name for name in needed if found[name] is None]
        present = {name: version for name, version in found.items() if version is not None}
        command = extras.remedy(extra) if missing else None
        text = _versions(present)
        if missing:
            text = f"missing {', '.join(missing)}: {command}"
        record = {"installed": present, "missing": missing, "install": command}
        yield Row(f"extra {extra}", text, record)


def _extensions() -> Iterator[Row]:
    """What installed extensions have added, or why they are not used."""
    for one in extensions.load():
        added = extensions.added(one)
        words = [f"{kind} {', '.join(names)}" for kind, names in added.items()]
        text = f"not used: {one.problem}" if one.problem else "; ".join(words) or "adds nothing"
        record = asdict(one) | {"added": added}
        yield Row(f"extension {one.name}", f"{one.package} {one.version}, {text}", record)


# --- drawing -----------------------------------------------------------------------------------


def _rendering() -> Row:
    tried = renderers()
    given = os.environ.get("MUJOCO_GL")
    used = given or _default()
    text = ", ".join(f"{name} {answer}" for name, answer in tried.items())
    text += f"; used: {used}{' (MUJOCO_GL)' if given else ''}"
    works = [name for name, answer in tried.items() if answer == DRAWS]
    if works and used not in works:
        text += f", set MUJOCO_GL={works[0]}"
    return Row("drawing", text, {"renderers": tried, "used": used})


def _default() -> str:
    """Renderer that is used where the environment names none."""
    if sys.platform == "linux":
        return "glfw" if offscreen.has_screen() else offscreen.preferred()
    return RENDERERS.get(sys.platform, ("none",))[0]


def renderers() -> dict[str, str]:
    """Return what each renderer of this system does: "draws", or why it does not."""
    names = RENDERERS.get(sys.platform, ())
    # All at once: each spends most of its time on loading libraries.
    started = {name: _start(name) for name in names if not _obstacle(name)}
    return {
        name: _answer(name, started[name]) if name in started else _obstacle(name) or ""
        for name in names
    }


def _obstacle(name: str) -> str | None:
    if name == "glfw" and sys.platform == "linux" and not offscreen.has_screen():
        return "has no screen"
    return None


def _start(name: str) -> subprocess.Popen[str]:
    # -P: no module of the current folder may stand for one of a library.
    return subprocess.Popen(
        [sys.executable, "-P", "-c", _DRAWING],
        env={**os.environ, "MUJOCO_GL": name},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
    )


def _answer(name: str, process: subprocess.Popen[str]) -> str:
    try:
        out, err = process.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return f"does not answer in {_PATIENCE:.0f} s"
    if process.returncode == 0:
        return DRAWS if "bright" in out else "draws black pictures"
    if process.returncode < 0:
        return f"crashes (signal {-process.returncode})"
    library = {"egl": "EGL", "osmesa": "OSMesa"}.get(name)
    if library is not None and ctypes.util.find_library(library) is None:
        return "is not installed"
    reason = (err.strip().splitlines() or ["no message"])[-1]
    return f"fails ({reason[:100]})"


def _browser() -> Row:
    try:
        found = webbrowser.get()
    except webbrowser.Error:
        return Row("browser", "none opens from here: open the printed address elsewhere", None)
    name = os.path.basename(getattr(found, "name", "") or type(found).__name__)
    return Row("browser", name, name)


# --- learning ----------------------------------------------------------------------------------


def _gpu() -> Row:
    found = _nvidia()
    driver = gpu_possible()
    torch = extras.installed("torch")
    text = ", ".join(found) or ("a driver, no nvidia-smi" if driver else "none")
    if driver and torch is not None and "+cpu" in torch:
        text += f"; PyTorch {torch} cannot use it"
    cuda = _cuda() if torch is not None else None
    if cuda is not None and not driver and not found:
        size = f"{_cuda_size() / 1e9:.1f} GB"
        text += f"; PyTorch {torch} is a build for CUDA {cuda}, with {size} of libraries that "
        text += "nothing here uses: to take the CPU build, see docs/reference/installing.md"
    return Row("gpu", text, {"found": found, "driver": driver, "torch": torch, "cuda": cuda})


def _cuda() -> str | None:
    """Version of CUDA that PyTorch is built for, without importing it; None for a CPU build."""
    spec = importlib.util.find_spec("torch")
    if spec is None or spec.origin is None:
        return None
    try:
        text = (Path(spec.origin).parent / "version.py").read_text(encoding="utf-8")
    except OSError:
        return None
    stated = re.search(r"""^cuda\b[^=\n]*= *['"]([\w.]+)['"]""", text, re.MULTILINE)
    return stated[1] if stated else None


def _cuda_size() -> int:
    """Size of the libraries of CUDA that packages of their own bring [bytes]."""
    packages = (one for one in metadata.distributions() if one.name.startswith(_CUDA_PACKAGES))
    return sum(file.size or 0 for one in packages for file in one.files or ())


def _nvidia() -> list[str]:
    """Name, memory and driver of each GPU of NVIDIA."""
    program = shutil.which("nvidia-smi")
    if program is None:
        return []
    done = None
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        done = subprocess.run(
            [program, "--query-gpu=name,memory.total,driver_version", "--format=csv,noheader"],
            capture_output=True,
            text=True,
            timeout=_PATIENCE,
            check=False,
        )
    if done is None or done.returncode != 0:
        return ["nvidia-smi fails"]
    parts = [line.split(", ") for line in done.stdout.strip().splitlines()]
    return [f"{name} ({', '.join(more)})" for name, *more in parts]


def _learning(ask: bool) -> Iterator[Row]:
    try:
        here, plan = _outlook(ask)
    except (DraftError, ImportError, OSError, RuntimeError) as error:
        # What is broken is what is asked for: report it beside the rest.
        yield Row("learning", f"cannot be examined: {error}", {"error": str(error)})
        return
    logical, free = os.cpu_count(), free_memory()
    text = f"{here.cores} physical for this process, {logical or '?'} logical"
    text += "" if free is None else f"; {free / 1e9:.1f} GB of memory free"
    yield Row("cores", text, {"physical": here.cores, "logical": logical, "free_bytes": free})
    text = plan.engine_line()
    if not here.on_cpu and not ask:
        text += "; assumed from the driver, `torch` asks PyTorch"
    yield Row("learning", text, plan.record() | {"asked": ask})
    for stage in plan.stage_lines():
        yield Row("", f"recipe {plan.recipe}: {stage}", None)


def _outlook(ask: bool) -> tuple[Machine, Outlook]:
    given = os.environ.get("MUJOCO_GL")
    # To load a renderer would take as long as all the rest, and the user's may be the problem.
    os.environ["MUJOCO_GL"] = "disabled"
    try:
        from draft.learn.task.recipes import default
        from draft.learn.training.estimate import outlook
    finally:
        del os.environ["MUJOCO_GL"]
        if given is not None:
            os.environ["MUJOCO_GL"] = given
    here = this_machine(ask=ask)
    return here, outlook(here, default(here.devices))
