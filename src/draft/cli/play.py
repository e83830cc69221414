"""`draft play`: a trained policy as a video, in the browser, or as ONNX."""

from __future__ import annotations

import contextlib
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.serving import address, check_free, check_port
from draft.errors import DraftError, Problem
from draft.explore.studio.guard import is_loopback
from draft.extras import need
from draft.learn.devices import devices
from draft.learn.engine import choose
from draft.learn.quiet import quiet

if TYPE_CHECKING:
    from draft.learn.lab.play import Outcome, Player
    from draft.learn.run import Run

MOST_SECONDS, MOST_ROBOTS, FASTEST = 600.0, 64, 100.0
FRAMES = 6  # Of a strip.


def main(
    run: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(metavar="RUN", help="Folder of a run of 'draft train'."),
    ],
    /,
    web: Annotated[
        bool, tyro.conf.arg(help="Show it in the browser until Ctrl-C, with sliders to steer.")
    ] = False,
    checkpoint: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="After N iterations.", help_behavior_hint="(default: the last)"
        ),
    ] = None,
    member: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="NAME",
            help="Design to show, of a run of several.",
            help_behavior_hint="(default: the first)",
        ),
    ] = None,
    ground: Annotated[
        Literal["uneven", "flat"] | None,
        tyro.conf.arg(help="The ground.", help_behavior_hint="(default: as it was trained)"),
    ] = None,
    command: Annotated[
        tuple[float, float, float] | None,
        tyro.conf.arg(
            metavar="VX VY WZ",
            help="Velocity to walk at [m/s, m/s, rad/s].",
            help_behavior_hint="(default: half of the largest in stage base, straight ahead)",
        ),
    ] = None,
    seconds: Annotated[float, tyro.conf.arg(metavar="S", help="Length of the video.")] = 8.0,
    robots: Annotated[int, tyro.conf.arg(metavar="K", help="Robots at once.")] = 1,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.mp4", help="The video.", help_behavior_hint="(default: RUN/play.mp4)"
        ),
    ] = None,
    strip: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.png",
            help=f"{FRAMES} pictures side by side too.",
            help_behavior_hint="(default: none)",
        ),
    ] = None,
    onnx: Annotated[
        tuple[str, ...] | None,
        tyro.conf.arg(
            metavar="[FILE]",
            help="Write the policy with all that a controller needs to know as ONNX, by default "
            "to RUN/policy.onnx; no video then, unless --out or --strip asks.",
            help_behavior_hint="",
        ),
    ] = None,
    device: Annotated[str, tyro.conf.arg(help="auto, cpu, cuda, cuda:1.")] = "auto",
    engine: EngineOption = "auto",
    host: Annotated[
        str, tyro.conf.arg(help="Address of the page; who reaches it can steer.")
    ] = "127.0.0.1",
    port: Annotated[int, tyro.conf.arg(help="Port of the page; 0 for any free one.")] = 8080,
) -> int:
    """Show what a run has learnt: a short video, the browser with --web, or a file with --onnx."""
    _check_numbers(seconds, robots, command, port)
    from draft.learn.run import open_run

    opened = open_run(Path(run))
    opened.checkpoint(checkpoint)
    model = _onnx_file(opened.folder, onnx)
    video = _file(out or str(opened.folder / "play.mp4"), ".mp4", "--out")
    pictures = _file(strip, ".png", "--strip") if strip is not None else None
    if web:
        check_free(host, port)
    chosen = devices(device)[0]
    stepped = choose(engine, [chosen])
    quiet()
    need("mjlab", "learn")
    from draft.learn.lab.play import Player

    asked = web or onnx is None or out is not None or strip is not None
    # What is exported has no ground; a plane is made at once.
    where = ground if asked else "flat"
    player = Player(opened, chosen, checkpoint, member, where, robots, command, stepped.name)
    with contextlib.closing(player):
        if model is not None:
            _export(player, opened, model)
        if web:
            _serve(player, opened, host, port)
        elif asked:
            _film(player, seconds, video, pictures)
    return 0


def _check_numbers(
    seconds: float, robots: int, command: tuple[float, float, float] | None, port: int
) -> None:
    """Refuse numbers that make no sense.

    Raises:
        DraftError: one does.
    """
    if not 0 < seconds <= MOST_SECONDS:
        cause = f"--seconds {seconds:g} is not above 0 and at most {MOST_SECONDS:g}"
        raise DraftError(Problem(cause, None, "such as 8"))
    if not 0 < robots <= MOST_ROBOTS:
        cause = f"--robots {robots} is not from 1 to {MOST_ROBOTS}"
        raise DraftError(Problem(cause, None, "such as 4"))
    if command is not None and not all(
        math.isfinite(value) and abs(value) <= FASTEST for value in command
    ):
        cause = f"--command {' '.join(f'{value:g}' for value in command)} cannot be walked at"
        raise DraftError(Problem(cause, None, f"three numbers from {-FASTEST:g} to {FASTEST:g}"))
    check_port(port)


def _file(name: str, suffix: str, option: str) -> Path:
    """A file to write, looked at before the work begins.

    Raises:
        DraftError: it cannot be one.
    """
    path = Path(name)
    if path.suffix.lower() != suffix:
        cause = f"{option} '{name}' does not end in {suffix}"
        raise DraftError(Problem(cause, None, f"such as walk{suffix}"))
    if path.is_dir():
        raise DraftError(Problem(f"{option} '{name}' is a folder", None, "name a file in it"))
    for parent in path.absolute().parents:
        if parent.is_dir():
            break
        if parent.exists():
            cause = f"{option} '{name}': {parent} is no folder"
            raise DraftError(Problem(cause, None, "give another place"))
    return path


def _onnx_file(folder: Path, onnx: tuple[str, ...] | None) -> Path | None:
    """Where the policy is written."""
    if onnx is None:
        return None
    if len(onnx) > 1:
        raise DraftError(Problem("--onnx takes one file", None, f"not {' '.join(onnx)}"))
    return _file(onnx[0] if onnx else str(folder / "policy.onnx"), ".onnx", "--onnx")


def _export(player: Player, run: Run, path: Path) -> None:
    from draft.learn.lab.onnx import export

    export(player, run, path)
    print(f"{path}: the policy of {player.member.name} after {player.iteration} iterations")


def _film(player: Player, seconds: float, path: Path, pictures: Path | None) -> None:
    from draft.learn.lab.video import film

    asked = ", ".join(f"{value:.2f}" for value in player.command[:2])
    print(
        f"{player.member.name}, {player.iteration} iterations: {seconds:g} s at "
        f"({asked}) m/s and {player.command[2]:.2f} rad/s",
        flush=True,
    )
    outcome = film(player, seconds, path, pictures, FRAMES)
    print(_told(outcome))
    print(path if pictures is None else f"{path}, {pictures}")


def _told(outcome: Outcome) -> str:
    """What happened, in a line."""
    falls = {0: "no falls", 1: "1 fall"}.get(outcome.falls, f"{outcome.falls} falls")
    who = "" if outcome.robots == 1 else f" of {outcome.robots} robots"
    return (
        f"walked at {outcome.speed:.2f} of {outcome.command[0]:.2f} m/s, "
        f"tracking error {outcome.error:.2f} m/s, {falls}{who} in {outcome.seconds:.1f} s"
    )


def _serve(player: Player, run: Run, host: str, port: int) -> None:
    from draft.learn.lab.web import Page

    if not is_loopback(host):
        print(f"warning: everybody who reaches {host} can look, and steer", file=sys.stderr)
    with contextlib.closing(Page(player, run, host, port)) as page:
        print(f"open {address(host, page.port)} in a browser; Ctrl-C ends it", flush=True)
        page.run()
