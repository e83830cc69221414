"""Browser page of a policy in plain MuJoCo: sliders or a gamepad to steer, a button to kick."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from draft.learn.policy.play_options import Command
from draft.learn.policy.policy import Policy
from draft.serving.gamepad import Gamepad, Sticks
from draft.serving.server import Server

if TYPE_CHECKING:
    import mujoco

_SIDEWAYS, _TURN = 0.6, 1.0  # Ends of the sliders: share of the forward one; [rad/s].


class Steered(Protocol):
    """What a page shows and steers; see `Playback`."""

    @property
    def command(self) -> Command:
        """Commanded vx, vy [m/s], wz [rad/s]."""
        ...

    @command.setter
    def command(self, command: Command, /) -> None: ...

    @property
    def title(self) -> str:
        """What is shown, in words."""
        ...

    @property
    def policy(self) -> Policy:
        """Policy, for the fastest command."""
        ...

    @property
    def model(self) -> mujoco.MjModel:
        """Model to show."""
        ...

    @property
    def data(self) -> mujoco.MjData:
        """State of the model."""
        ...

    def step(self) -> None:
        """Advance by one physics step."""
        ...

    def reset(self) -> None:
        """Go back to the start."""
        ...

    def push(self, size: float, /) -> None:
        """Add a velocity of at most this size [m/s]."""
        ...


class PlaybackPage:
    """Browser page of a playback.

    Attributes:
        port: port of the server.
    """

    def __init__(self, playback: Steered, host: str, port: int, token: str | None) -> None:
        """Start serving.

        Args:
            playback: the playback to show.
            host: address to serve on; one that other machines reach needs a token.
            port: port to serve on; 0 for any free one.
            token: secret that visitors need; None for none.

        Raises:
            DraftError: the address cannot be used, or a token is missing.
        """
        self._playback = playback
        self._gamepad = Gamepad(self._lean)
        self._server = Server(host, port, token, self._gamepad.page)
        self.port = self._server.port
        self._controls()

    def run(self) -> None:
        """Simulate and show until interrupted.

        Raises:
            KeyboardInterrupt: on Ctrl-C.
        """
        playback = self._playback
        self._server.show(
            playback.model,
            playback.data,
            step_fn=lambda model, data: playback.step(),
            reset_fn=lambda model, data: playback.reset(),
        )

    def close(self) -> None:
        """Stop serving."""
        self._server.close()

    def _controls(self) -> None:
        gui, playback = self._server.viser.gui, self._playback
        most = playback.policy.forward
        sides = min(_SIDEWAYS * most, _SIDEWAYS)
        with gui.add_folder(f"{playback.title}: steer"):
            self._sliders = sliders = [
                gui.add_slider(label, -end, end, step=0.05, initial_value=value)
                for label, end, value in zip(
                    ("forward [m/s]", "left [m/s]", "turn left [rad/s]"),
                    (_rounded(most), _rounded(sides), _TURN),
                    playback.command,
                    strict=True,
                )
            ]
            stand = gui.add_button("Stand")
            self._size = gui.add_slider("kick [m/s]", 0.5, 5.0, step=0.5, initial_value=2.0)
            kick = gui.add_button("Kick")
            gui.add_html(self._gamepad.frame)

        def steer(_: object) -> None:
            x, y, turn = (slider.value for slider in sliders)
            playback.command = (x, y, turn)

        for slider in sliders:
            slider.on_update(steer)

        @stand.on_click
        def _(_: object) -> None:
            for slider in sliders:
                slider.value = 0.0

        @kick.on_click
        def _(_: object) -> None:
            playback.push(self._size.value)

    def _lean(self, sticks: Sticks) -> None:
        """Steer by a gamepad."""
        for slider, share in zip(self._sliders, sticks[:3], strict=True):
            slider.value = share * slider.max
        if sticks.push:
            self._playback.push(self._size.value)


def _rounded(end: float) -> float:
    """End of a slider, rounded to a multiple of its step."""
    return max(0.05, round(end / 0.05) * 0.05)
