"""`draft play`: show a policy as a video or in the browser, or write it as ONNX."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.options import DeviceOption, EngineOption, HostOption, PortOption, TokenOption
from draft.cli.play_output import FRAMES, Output, output
from draft.design.references import open_designs
from draft.errors import DraftError, Problem, suggest
from draft.extras import need
from draft.files import write
from draft.learn.machine import choose, devices
from draft.learn.policy import designs, policy, short
from draft.learn.run import is_run, open_run
from draft.learn.silence import quiet

if TYPE_CHECKING:
    from draft.learn.lab.play import Player
    from draft.learn.run import Run

MOST_ROBOTS, FASTEST = 64, 100.0
TALLEST = 0.6  # Height of steps [m].


def main(
    run: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="RUN|DESIGN",
            help="Folder of a run of 'draft train', or a shipped design that has policies: "
            f"{', '.join(designs())}.",
        ),
    ],
    /,
    skill: Annotated[
        Literal["walk", "run", "climb", "push"] | None,
        tyro.conf.arg(
            metavar="{walk,run,climb,push}",
            help="Policy of a shipped design.",
            help_behavior_hint="(default: walk)",
        ),
    ] = None,
    web: Annotated[
        bool, tyro.conf.arg(help="Show it in the browser until Ctrl-C, with sliders to steer.")
    ] = False,
    checkpoint: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N", help="Iterations of the checkpoint.", help_behavior_hint="(default: last)"
        ),
    ] = None,
    member: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="NAME",
            help="Design to show, if the run has several.",
            help_behavior_hint="(default: the first)",
        ),
    ] = None,
    ground: Annotated[
        Literal["uneven", "flat"] | None,
        tyro.conf.arg(
            metavar="{uneven,flat}",
            help="Ground of a run.",
            help_behavior_hint="(default: as in training)",
        ),
    ] = None,
    command: Annotated[
        tuple[float, float, float] | None,
        tyro.conf.arg(
            metavar="VX VY WZ",
            help="Commanded velocity [m/s, m/s, rad/s].",
            help_behavior_hint="(default: straight ahead, as fast as suits the policy)",
        ),
    ] = None,
    step: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="Height of the steps ahead [m]; for shipped policies.",
            help_behavior_hint="(default: 0.1 for climb, else no steps)",
        ),
    ] = None,
    kick: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M/S",
            help="Largest kick along x and y, every few seconds [m/s]; for shipped policies.",
            help_behavior_hint="(default: 2 for push, else no kicks)",
        ),
    ] = None,
    seconds: Annotated[float, tyro.conf.arg(metavar="S", help="Length of the video [s].")] = 8.0,
    robots: Annotated[int, tyro.conf.arg(metavar="N", help="Number of robots of a run.")] = 1,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.mp4",
            help="File of the video.",
            help_behavior_hint="(default: RUN/play.mp4 or DESIGN-SKILL.mp4)",
        ),
    ] = None,
    strip: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.png",
            help=f"File of {FRAMES} pictures side by side.",
            help_behavior_hint="(default: none)",
        ),
    ] = None,
    onnx: Annotated[
        tuple[str, ...] | None,
        tyro.conf.arg(
            metavar="[FILE]",
            help="Write the policy as ONNX with all that a controller needs, beside the video "
            "unless FILE is given; makes no video unless --out or --strip is given.",
            help_behavior_hint="(default: no ONNX)",
        ),
    ] = None,
    device: DeviceOption = "auto",
    engine: EngineOption = "auto",
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
) -> int:
    """Show what a policy can do: as a video, in the browser (--web), or as a file (--onnx)."""
    _check_numbers(robots, command, step, kick)

    def make_output(video: Path, policy: Path) -> Output:
        return output(
            video,
            policy,
            video=out,
            strip=strip,
            onnx=onnx,
            web=web,
            seconds=seconds,
            address=(host, port, token),
        )

    if not is_run(Path(run)) and short(run) in designs():
        _only_for_runs(checkpoint=checkpoint, member=member, ground=ground, robots=robots)
        return _play_skill(run, skill or "walk", (command, step, kick), make_output)
    for name, value in (("skill", skill), ("step", step), ("kick", kick)):
        if value is not None:
            known = ", ".join(designs()) or "none"
            cause = f"--{name} is for shipped policies, and '{run}' is not a design that has any"
            raise DraftError(Problem(cause, None, f"designs with policies: {known}"))
    if not is_run(Path(run)):
        cause = f"'{run}' is neither a run of 'draft train' nor a design with shipped policies"
        remedy = suggest(run, designs(), "designs with policies")
        raise DraftError(Problem(cause, None, f"{remedy}; 'draft train DESIGN' makes a run"))
    opened = open_run(Path(run))
    opened.checkpoint(checkpoint)
    asked = make_output(opened.folder / "play.mp4", opened.folder / "policy.onnx")
    chosen = devices(device)[0]
    stepped = choose(engine, [chosen])
    quiet()
    need("mjlab", "learn")
    from draft.learn.lab.play import Player

    # An exported policy needs no ground, and a plane is quick to make.
    where = ground if asked.web or asked.films else "flat"
    player = Player(opened, chosen, checkpoint, member, where, robots, command, stepped.name)
    with contextlib.closing(player):
        if asked.onnx is not None:
            _export(player, opened, asked.onnx)
        if asked.web:
            from draft.learn.lab.web import Page

            asked.serve(lambda *at: contextlib.closing(Page(player, opened, *at)))
        elif asked.films:
            asked.film(player, f"{player.member.name}, {player.iteration} iterations")
    return 0


def _play_skill(
    design: str,
    skill: str,
    given: tuple[tuple[float, float, float] | None, float | None, float | None],
    make_output: Callable[[Path, Path], Output],
) -> int:
    """Show a shipped policy in plain MuJoCo."""
    from draft.learn.playback import Playback, Scenario, usual

    name = short(design)
    chosen = policy(name, skill)
    asked = make_output(Path(f"{name}-{skill}.mp4"), Path(f"{name}-{skill}.onnx"))
    if asked.onnx is not None:
        write(asked.onnx, chosen.file.read_bytes())
        print(f"{asked.onnx}: the policy of {chosen.design} after {chosen.iterations} iterations")
    if not asked.web and not asked.films:
        return 0
    (opened,) = open_designs([name])
    command, step, kick = given
    scenario = usual(chosen)
    scenario = Scenario(
        command=command or scenario.command,
        step=scenario.step if step is None else step,
        kick=scenario.kick if kick is None else kick,
    )
    playback = Playback(chosen, opened, scenario)
    if asked.web:
        need("mjviser", "view")
        from draft.learn.playback_page import PlaybackPage

        asked.serve(lambda *at: contextlib.closing(PlaybackPage(playback, *at)))
    asked.film(playback, f"{chosen.design}, {skill}")
    return 0


def _only_for_runs(**given: object) -> None:
    """Refuse options that only runs have."""
    for name, value in given.items():
        if value not in (None, 1):
            cause = f"--{name} is for runs of 'draft train', and this is a shipped policy"
            raise DraftError(Problem(cause, None, f"omit --{name}"))


def _check_numbers(
    robots: int,
    command: tuple[float, float, float] | None,
    step: float | None,
    kick: float | None,
) -> None:
    """Refuse numbers that are out of range.

    Raises:
        DraftError: one is.
    """
    if not 0 < robots <= MOST_ROBOTS:
        cause = f"--robots {robots} is not from 1 to {MOST_ROBOTS}"
        raise DraftError(Problem(cause, None, "such as 4"))
    if command is not None and not all(
        math.isfinite(value) and abs(value) <= FASTEST for value in command
    ):
        cause = f"--command {' '.join(f'{value:g}' for value in command)} is out of range"
        remedy = f"give three numbers from {-FASTEST:g} to {FASTEST:g}"
        raise DraftError(Problem(cause, None, remedy))
    for name, value, most, unit in (("step", step, TALLEST, "m"), ("kick", kick, FASTEST, "m/s")):
        if value is not None and not 0 <= value <= most:
            cause = f"--{name} {value:g} is not from 0 to {most:g} {unit}"
            raise DraftError(Problem(cause, None, "omit it for the default of the skill"))


def _export(player: Player, run: Run, path: Path) -> None:
    from draft.learn.lab.onnx import export

    export(player, run, path)
    print(f"{path}: the policy of {player.member.name} after {player.iteration} iterations")
