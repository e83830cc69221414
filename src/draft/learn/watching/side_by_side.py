"""One robot of each topology of a run side by side, each in a simulation of its own."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence

import mujoco
import numpy as np

from draft.learn.bodies.legged import by_topology
from draft.learn.bodies.payload import model_spec
from draft.learn.policy.play_options import Command
from draft.learn.policy.playback import Playback, usual
from draft.learn.policy.playback_page import PlaybackPage
from draft.learn.policy.scenery import dress
from draft.learn.training.ppo.legs_onnx import legs_of
from draft.learn.training.run import Run

_POLL = 1.0  # Time between two looks for a new checkpoint [s].
_APART = 0.2  # Distance between robots, besides their leg lengths [m].


class SideBySide:
    """Robots that walk at one command, and one model that shows them next to each other.

    Attributes:
        robots: the robots.
        iteration: iterations of the checkpoint.
        policy: policy of the robot that was commanded the fastest.
        model: MuJoCo model of all robots on a plane, to be shown and not to be simulated.
        data: its state.
    """

    def __init__(self, run: Run, iteration: int | None = None) -> None:
        """Put the first robot of each topology next to the last one.

        Args:
            run: a run of several topologies.
            iteration: iterations of the checkpoint; None for the last.

        Raises:
            DraftError: it has no such checkpoint.
        """
        members = [group[0] for group in by_topology(run.plan.members)]
        self._run = run
        self.iteration, _ = run.checkpoint(iteration)
        legs = legs_of(run, self.iteration)
        policies = [legs.of_robot(member) for member in members]
        self.robots = [
            Playback(policy, member, usual(policy, "base"))
            for policy, member in zip(policies, members, strict=True)
        ]
        self.policy = max(policies, key=lambda policy: policy.forward)
        slow = min(robot.command[0] for robot in self.robots)
        self.command = (slow, 0.0, 0.0)
        lengths = np.array([member.leg_length for member in members])
        gaps = lengths[1:] + lengths[:-1] + _APART
        left = np.concatenate([[0.0], -gaps.cumsum()])
        self._home = np.stack([np.zeros(len(left)), left - left.mean()], axis=1)
        self._at = self._home.copy()
        self.model, self._qpos = _together(self.robots)
        self.model.opt.timestep = self.policy.timestep
        self.data = mujoco.MjData(self.model)
        self._show()

    @property
    def title(self) -> str:
        """What is shown, in words."""
        return f"{len(self.robots)} robots"

    @property
    def command(self) -> Command:
        """Commanded vx, vy [m/s], wz [rad/s]; of each robot at most what it was trained at."""
        return self._command

    @command.setter
    def command(self, command: Command) -> None:
        self._command = command
        for robot in self.robots:
            most = robot.policy.forward
            x, y = (min(max(value, -most), most) for value in command[:2])
            robot.command = (x, y, command[2])

    def step(self) -> None:
        """Advance all robots by one physics step; one that falls restarts where it is."""
        for i, robot in enumerate(self.robots):
            place, falls = robot.data.qpos[:2].copy(), robot.falls
            robot.step()
            if robot.falls > falls:
                self._at[i] += place - robot.data.qpos[:2]
        self.data.time += self.model.opt.timestep
        self._show()

    def reset(self) -> None:
        """Put all robots back to the start."""
        for robot in self.robots:
            robot.reset()
        self._at[:] = self._home
        self._show()

    def push(self, size: float) -> None:
        """Kick all robots; see `Playback.push`."""
        for robot in self.robots:
            robot.push(size)

    def load(self, iteration: int) -> None:
        """Go on with the policy of another checkpoint."""
        legs = legs_of(self._run, iteration)
        policies = [legs.of_robot(robot.member) for robot in self.robots]
        for robot, policy in zip(self.robots, policies, strict=True):
            robot.policy = robot.controller.policy = policy
        self.iteration = iteration

    def _show(self) -> None:
        for robot, at, place in zip(self.robots, self._qpos, self._at, strict=True):
            self.data.qpos[at : at + robot.model.nq] = robot.data.qpos
            self.data.qpos[at : at + 2] += place
        mujoco.mj_kinematics(self.model, self.data)


def _together(robots: Sequence[Playback]) -> tuple[mujoco.MjModel, list[int]]:
    """Model of robots on a plane, and the first entry of `qpos` of each."""
    spec = mujoco.MjSpec()
    ground = spec.worldbody.add_body(name="terrain")
    ground.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0, 0, 0.05))
    for i, robot in enumerate(robots):
        frame = spec.worldbody.add_frame()
        spec.attach(model_spec(robot.member), frame=frame, prefix=f"{i}/")
    dress(spec)
    model = spec.compile()
    trunks = [model.body(f"{i}/{robot.member.trunk}") for i, robot in enumerate(robots)]
    return model, [int(model.jnt_qposadr[trunk.jntadr[0]]) for trunk in trunks]


class SideBySidePage(PlaybackPage):
    """Browser page of robots side by side."""

    def __init__(
        self,
        shown: SideBySide,
        run: Run,
        host: str,
        port: int,
        token: str | None = None,
        follow: bool = False,
    ) -> None:
        """Start serving.

        Args:
            shown: the robots.
            run: their run.
            host: address to serve on; one that other machines reach needs a token.
            port: port to serve on; 0 for any free one.
            token: secret that visitors need; None for none.
            follow: whether to change to each new checkpoint.
        """
        super().__init__(shown, host, port, token)
        self._status = self._server.viser.gui.add_markdown(_line(shown))
        if follow:
            threading.Thread(target=self._renew, args=(shown, run), daemon=True).start()

    def _renew(self, shown: SideBySide, run: Run) -> None:
        """Go on with each new checkpoint."""
        while True:
            time.sleep(_POLL)
            newest = run.checkpoints()[-1][0]
            if newest != shown.iteration:
                shown.load(newest)
                self._status.content = _line(shown)


def _line(shown: SideBySide) -> str:
    names = ", ".join(robot.title for robot in shown.robots)
    return f"policy of iteration {shown.iteration}; from left to right: {names}"
