"""`draft play`: a trained policy as a video, in the browser, or as ONNX."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.engine_option import EngineOption
from draft.cli.page_options import HostOption, PortOption, TokenOption
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
TALLEST = 0.6  # Of steps [m].


def main(
    run: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="RUN|DESIGN",
            help="Folder of a run of 'draft train', or a design whose policies are shipped.",
        ),
    ],
    /,
    skill: Annotated[
        Literal["walk", "run", "climb", "push"] | None,
        tyro.conf.arg(
            metavar="{walk,run,climb,push}",
            help="Which of a shipped design's policies.",
            help_behavior_hint="(default: walk)",
        ),
    ] = None,
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
        tyro.conf.arg(
            metavar="{uneven,flat}",
            help="The ground.",
            help_behavior_hint="(default: as it was trained)",
        ),
    ] = None,
    command: Annotated[
        tuple[float, float, float] | None,
        tyro.conf.arg(
            metavar="VX VY WZ",
            help="Velocity to walk at [m/s, m/s, rad/s].",
            help_behavior_hint="(default: what shows the policy, straight ahead)",
        ),
    ] = None,
    step: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M",
            help="Steps of this height lie ahead [m]; for shipped policies.",
            help_behavior_hint="(default: 0.1 where the skill is climb)",
        ),
    ] = None,
    kick: Annotated[
        float | None,
        tyro.conf.arg(
            metavar="M/S",
            help="A kick every few seconds, up to this along x and y; for shipped policies.",
            help_behavior_hint="(default: 2 where the skill is push)",
        ),
    ] = None,
    seconds: Annotated[float, tyro.conf.arg(metavar="S", help="Length of the video.")] = 8.0,
    robots: Annotated[int, tyro.conf.arg(metavar="K", help="Robots at once.")] = 1,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="FILE.mp4",
            help="The video.",
            help_behavior_hint="(default: RUN/play.mp4 or DESIGN-SKILL.mp4)",
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
            "beside the video; no video then, unless --out or --strip asks.",
            help_behavior_hint="",
        ),
    ] = None,
    device: Annotated[str, tyro.conf.arg(help="auto, cpu, cuda, cuda:1.")] = "auto",
    engine: EngineOption = "auto",
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
) -> int:
    """Show what a policy can do: a short video, the browser with --web, or a file with --onnx."""
    _check_numbers(robots, command, step, kick)

    def written(video: Path, policy: Path) -> Output:
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
        return _play_skill(run, skill or "walk", (command, step, kick), written)
    for name, value in (("skill", skill), ("step", step), ("kick", kick)):
        if value is not None:
            known = ", ".join(designs()) or "none"
            cause = f"--{name} is for a shipped design's policies, and '{run}' is not one of those"
            raise DraftError(Problem(cause, None, f"designs with policies: {known}"))
    if not is_run(Path(run)):
        cause = f"'{run}' is neither a run of 'draft train' nor a design with shipped policies"
        remedy = suggest(run, designs(), "designs with policies")
        raise DraftError(Problem(cause, None, f"{remedy}; 'draft train DESIGN' makes a run"))
    opened = open_run(Path(run))
    opened.checkpoint(checkpoint)
    asked = written(opened.folder / "play.mp4", opened.folder / "policy.onnx")
    chosen = devices(device)[0]
    stepped = choose(engine, [chosen])
    quiet()
    need("mjlab", "learn")
    from draft.learn.lab.play import Player

    # What is exported has no ground; a plane is made at once.
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
    word: str,
    skill: str,
    given: tuple[tuple[float, float, float] | None, float | None, float | None],
    written: Callable[[Path, Path], Output],
) -> int:
    """Show a shipped policy in plain MuJoCo."""
    from draft.learn.playback import Playback, Scenario, usual

    name = short(word)
    chosen = policy(name, skill)
    asked = written(Path(f"{name}-{skill}.mp4"), Path(f"{name}-{skill}.onnx"))
    if asked.onnx is not None:
        write(asked.onnx, chosen.file.read_bytes())
        print(f"{asked.onnx}: the policy of {chosen.design} after {chosen.iterations} iterations")
    if not asked.web and not asked.films:
        return 0
    (design,) = open_designs([name])
    command, step, kick = given
    scenario = usual(chosen)
    scenario = Scenario(
        command=command or scenario.command,
        step=scenario.step if step is None else step,
        kick=scenario.kick if kick is None else kick,
    )
    playback = Playback(chosen, design, scenario)
    if asked.web:
        need("mjviser", "view")
        from draft.learn.playback_page import PlaybackPage

        asked.serve(lambda *at: contextlib.closing(PlaybackPage(playback, *at)))
    asked.film(playback, f"{chosen.design}, {skill}")
    return 0


def _only_for_runs(**given: object) -> None:
    """Refuse options that a shipped policy does not have."""
    for name, value in given.items():
        if value not in (None, 1):
            cause = f"--{name} is for runs of 'draft train', and this is a shipped policy"
            raise DraftError(Problem(cause, None, f"leave --{name} away"))


def _check_numbers(
    robots: int,
    command: tuple[float, float, float] | None,
    step: float | None,
    kick: float | None,
) -> None:
    """Refuse numbers that make no sense.

    Raises:
        DraftError: one does.
    """
    if not 0 < robots <= MOST_ROBOTS:
        cause = f"--robots {robots} is not from 1 to {MOST_ROBOTS}"
        raise DraftError(Problem(cause, None, "such as 4"))
    if command is not None and not all(
        math.isfinite(value) and abs(value) <= FASTEST for value in command
    ):
        cause = f"--command {' '.join(f'{value:g}' for value in command)} cannot be walked at"
        raise DraftError(Problem(cause, None, f"three numbers from {-FASTEST:g} to {FASTEST:g}"))
    for name, value, most, unit in (("step", step, TALLEST, "m"), ("kick", kick, FASTEST, "m/s")):
        if value is not None and not 0 <= value <= most:
            cause = f"--{name} {value:g} is not from 0 to {most:g} {unit}"
            raise DraftError(Problem(cause, None, "leave it away for what shows the skill"))


def _export(player: Player, run: Run, path: Path) -> None:
    from draft.learn.lab.onnx import export

    export(player, run, path)
    print(f"{path}: the policy of {player.member.name} after {player.iteration} iterations")
