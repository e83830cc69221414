"""Outputs of `draft play`: a video, a strip of pictures, the browser, or ONNX."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from draft.cli.interrupted import NOTHING, if_interrupted
from draft.errors import DraftError
from draft.extras import need
from draft.files import check_output
from draft.serving.addresses import address, check_free, check_port
from draft.serving.guard import check_address

if TYPE_CHECKING:
    from draft.learn.policy.playback import Outcome
    from draft.learn.policy.video import Filmable

FRAMES = 6  # Pictures of a strip.


@dataclass(frozen=True)
class Output:
    """Outputs that were asked for.

    Attributes:
        video: file of the video.
        strip: file of the strip; None for none.
        onnx: file of the policy; None for none.
        web: whether to show the policy in the browser instead.
        films: whether to make a video.
        seconds: length of the video [s].
        host: address of the page.
        port: port of the page.
        token: secret of the page; None for none.
    """

    video: Path
    strip: Path | None
    onnx: Path | None
    web: bool
    films: bool
    seconds: float
    host: str
    port: int
    token: str | None

    def film(self, player: Filmable, title: str) -> None:
        """Make the video, and print what happened in it.

        Raises:
            DraftError: it cannot be drawn or written.
        """
        need("imageio_ffmpeg", "view")
        from draft.learn.policy.video import film

        x, y, turn = player.command
        asked = f"({x:.2f}, {y:.2f}) m/s and {turn:.2f} rad/s"
        print(f"{title}: {self.seconds:g} s at {asked}", flush=True)
        with if_interrupted(NOTHING):
            print(_summary(film(player, self.seconds, self.video, self.strip, FRAMES)))
        print(self.video if self.strip is None else f"{self.video}, {self.strip}")

    def serve(self, page: Callable[[str, int, str | None], AbstractContextManager[Any]]) -> None:
        """Show a policy in the browser until interrupted.

        Args:
            page: opens the page, for a host, a port and a token.

        Raises:
            KeyboardInterrupt: always; nothing else ends it.
        """
        with page(self.host, self.port, self.token) as opened:
            where = address(self.host, opened.port, self.token)
            print(f"open {where} in a browser; Ctrl-C ends it", flush=True)
            opened.run()


def output(
    default_video: Path,
    default_onnx: Path,
    *,
    video: str | None,
    strip: str | None,
    onnx: tuple[str, ...] | None,
    web: bool,
    seconds: float,
    address: tuple[str, int, str | None],
) -> Output:
    """Check the outputs before any work is done.

    Args:
        default_video: default file of the video.
        default_onnx: default file of the policy.
        video: file of the video; None for the default.
        strip: file of the strip; None for none.
        onnx: file of the policy; empty for the default, None for none.
        web: whether to show the policy in the browser.
        seconds: length of the video [s].
        address: host, port and token of the page.

    Raises:
        DraftError: an output cannot be made.
    """
    host, port, token = address
    check_port(port)
    if onnx is not None and len(onnx) > 1:
        raise DraftError("--onnx takes one file", f"not {' '.join(onnx)}")
    policy = None
    if onnx is not None:
        policy = check_output(onnx[0] if onnx else str(default_onnx), ".onnx", "--onnx")
    found = Output(
        video=check_output(video or str(default_video), ".mp4", "--out"),
        strip=None if strip is None else check_output(strip, ".png", "--strip"),
        onnx=policy,
        web=web,
        films=not web and (onnx is None or video is not None or strip is not None),
        seconds=seconds,
        host=host,
        port=port,
        token=token,
    )
    if web:
        check_address(host, token)
        check_free(host, port)
    return found


def _summary(outcome: Outcome) -> str:
    """Return what happened, in a line."""
    falls = {0: "no falls", 1: "1 fall"}.get(outcome.falls, f"{outcome.falls} falls")
    who = "" if outcome.robots == 1 else f" of {outcome.robots} robots"
    return (
        f"walked at {outcome.speed:.2f} of {outcome.command[0]:.2f} m/s, "
        f"tracking error {outcome.error:.2f} m/s, {falls}{who} in {outcome.seconds:.1f} s"
    )
