"""`draft play`: show a policy as a video or in the browser, or write it as ONNX."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from draft.cli.options import (
    DESIGN_FORMS,
    HostOption,
    OwnPolicies,
    PortOption,
    ShippedSkill,
    TokenOption,
)
from draft.cli.play_output import FRAMES, Output, output
from draft.cli.settings_options import with_options
from draft.cli.spelling import spelt
from draft.design import Design
from draft.design.references import find_design
from draft.errors import DraftError, counted, suggest
from draft.extras import need
from draft.files import write
from draft.learn.engine.machine import choose, devices
from draft.learn.measuring.evaluation_options import OnDevice
from draft.learn.policy.play_options import Course, PlaySettings
from draft.learn.policy.policy import designs, short
from draft.learn.silence import quiet
from draft.learn.training.run import is_run, open_run

if TYPE_CHECKING:
    from draft.learn.policy.policy import Policy
    from draft.learn.training.run import Run
    from draft.learn.watching.play import Player

MOST_ROBOTS = 64
_SPECIAL = ", ".join(designs())  # Designs with policies of their own.


@with_options(OnDevice)
@with_options(PlaySettings, without=("seed",))
def main(
    run: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(
            metavar="RUN|DESIGN",
            help=f"Folder of a run of 'draft train', or the robot: {DESIGN_FORMS}; {_SPECIAL} have "
            "policies of their own.",
        ),
    ],
    /,
    *,
    skill: ShippedSkill = None,
    policy: OwnPolicies = (),
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
    settings: PlaySettings,
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
            help=f"File of the last {FRAMES} pictures, a moment apart, cut to the robot.",
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
    on: OnDevice,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
) -> int:
    """Show what a policy can do: as a video, in the browser (--web), or as a file (--onnx)."""
    if not 0 < robots <= MOST_ROBOTS:
        raise DraftError(f"--robots {robots} is not from 1 to {MOST_ROBOTS}", "such as 4")

    def make_output(video: Path, policy: Path) -> Output:
        return output(
            video,
            policy,
            video=out,
            strip=strip,
            onnx=onnx,
            web=web,
            seconds=settings.seconds,
            address=(host, port, token),
        )

    if not is_run(Path(run)):
        opened = _design(run)
        _only_for_runs(checkpoint=checkpoint, member=member, ground=ground, robots=robots)
        return _play_design(opened, skill, policy, settings, make_output)
    of_designs = {"skill": skill, "policy": policy, "step": settings.step, "kick": settings.kick}
    for name, value in of_designs.items():
        if value not in (None, ()):
            cause = f"--{name} is for designs, and '{run}' is a run of 'draft train'"
            raise DraftError(cause, f"omit --{name}, or name a design")
    opened = open_run(Path(run))
    iteration, _ = opened.checkpoint(checkpoint)
    asked = make_output(opened.folder / "play.mp4", opened.folder / "policy.onnx")
    if opened.plan.mixed:
        _only_of_one_topology(ground=ground, robots=robots)
        return _play_mixed(opened, iteration, member, settings, asked)
    chosen = devices(on.device)[0]
    stepped = choose(on.engine, [chosen])
    quiet()
    need("mjlab", "learn")
    print(spelt(opened.policy_line(iteration)), flush=True)
    from draft.learn.watching.play import Player

    # An exported policy needs no ground, and a plane is quick to make.
    where = ground if asked.web or asked.films else "flat"
    player = Player(
        opened, chosen, checkpoint, member, where, robots, settings.command, stepped.name
    )
    with contextlib.closing(player):
        if asked.onnx is not None:
            _export(player, opened, asked.onnx)
        if asked.web:
            from draft.learn.watching.web import Page

            asked.serve(lambda *at: contextlib.closing(Page(player, opened, *at)))
        elif asked.films:
            asked.film(player, f"{player.member.name}, {counted(player.iteration, 'iteration')}")
    return 0


def _design(reference: str) -> Design:
    """Open a design.

    Raises:
        DraftError: there is none, or its values are out of range.
    """
    try:
        choice = find_design(reference)
    except DraftError:
        cause = f"'{reference}' is neither a run of 'draft train' nor a design"
        remedy = suggest(reference, designs(), "designs with policies")
        raise DraftError(cause, f"{remedy}; 'draft train DESIGN' makes a run") from None
    return choice.resolve()


def _play_design(
    design: Design,
    skill: str | None,
    own: Sequence[str],
    course: Course,
    make_output: Callable[[Path, Path], Output],
) -> int:
    """Show a design in plain MuJoCo with the policy that fits it best."""
    from draft.learn.policy.playback import playback

    name = short(design.reference)
    stem = "-".join([Path(name).name.replace(":", "-"), *([] if own else [skill or "walk"])])
    asked = make_output(Path(f"{stem}.mp4"), Path(f"{stem}.onnx"))
    robot, warning = playback(design, skill, own, course)
    chosen = robot.policy
    if asked.onnx is not None:
        write(asked.onnx, _exported(chosen, design, own))
        _print_export(asked.onnx, chosen.design, chosen.iterations)
    if not asked.web and not asked.films:
        return 0
    if warning:
        print(f"warning: {warning}", file=sys.stderr)
    if asked.web:
        need("mjviser", "view")
        from draft.learn.policy.playback_page import PlaybackPage

        asked.serve(lambda *at: contextlib.closing(PlaybackPage(robot, *at)))
    asked.film(robot, f"{design.reference}, {chosen.file if own else skill or 'walk'}")
    return 0


def _exported(policy: Policy, design: Design, own: Sequence[str]) -> bytes:
    """File of the policy of a design: the shipped one, or what that of all legs is for it.

    Raises:
        DraftError: it is a policy with the joints of another robot.
    """
    from draft.learn.bodies.legged import legged_robot
    from draft.learn.policy.onnx_write import of_policy
    from draft.learn.policy.reduced import LegsPolicy, open_any

    if short(design.reference) in designs() and not own:
        return policy.file.read_bytes()
    legs = open_any(policy.file)
    if isinstance(legs, LegsPolicy):
        member = legged_robot(design)
        return of_policy(policy, member, legs.commands_for(member).tolist())
    cause = f"--onnx is for runs, for {_SPECIAL}, and for robots that the policy of any legs drives"
    raise DraftError(cause, "omit --onnx: this policy has the joints of another robot")


def _play_mixed(run: Run, iteration: int, member: str | None, course: Course, asked: Output) -> int:
    """Show a run of several topologies: one robot, or in the browser one of each topology."""
    quiet()
    need("mjlab", "learn")
    print(spelt(run.policy_line(iteration)), flush=True)
    from draft.learn.policy.playback import Playback, usual
    from draft.learn.policy.playback_page import PlaybackPage
    from draft.learn.training.ppo.legs_onnx import export_legs, legs_of
    from draft.learn.watching.play import member_of
    from draft.learn.watching.side_by_side import SideBySide, SideBySidePage

    if asked.onnx is not None:
        export_legs(run, asked.onnx, iteration)
        _print_export(asked.onnx, "all legs", iteration)
    if asked.web and member is None:
        shown = SideBySide(run, iteration)
        shown.command = course.command or shown.command
        asked.serve(lambda *at: contextlib.closing(SideBySidePage(shown, run, *at)))
    elif asked.web or asked.films:
        chosen = member_of(run, member)
        policy = legs_of(run, iteration).of_robot(chosen)
        usually = usual(policy, run.plan.stage)
        scenario = replace(usually, command=course.command or usually.command)
        robot = Playback(policy, chosen, scenario)
        if asked.web:
            asked.serve(lambda *at: contextlib.closing(PlaybackPage(robot, *at)))
        asked.film(robot, f"{chosen.name}, {counted(iteration, 'iteration')}")
    return 0


def _only_of_one_topology(**given: object) -> None:
    """Refuse options that runs of several topologies lack: they are played in plain MuJoCo."""
    for name, value in given.items():
        if value not in (None, 1, "flat"):
            cause = f"--{name} is for runs of one topology, and this one has several"
            raise DraftError(cause, f"omit --{name}")


def _only_for_runs(**given: object) -> None:
    """Refuse options that only runs have."""
    for name, value in given.items():
        if value not in (None, 1):
            cause = f"--{name} is for runs of 'draft train', and this is a design"
            raise DraftError(cause, f"omit --{name}")


def _export(player: Player, run: Run, path: Path) -> None:
    from draft.learn.training.ppo.onnx import export

    export(player, run, path)
    _print_export(path, player.member.name, player.iteration)


def _print_export(path: Path, design: str, iterations: int) -> None:
    print(f"{path}: the policy of {design} after {counted(iterations, 'iteration')}")
