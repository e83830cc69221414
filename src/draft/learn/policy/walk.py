"""A robot that a policy walks in plain MuJoCo, whose body can be replaced while it walks."""

from __future__ import annotations

from collections import deque

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.learn.policy.controller import Controller, start_offsets
from draft.learn.policy.validity import Fit
from draft.learn.task.groups import Episodes
from draft.model import Model
from draft.model.scene import home_position
from draft.model.swap import swapped

Command = tuple[float, float, float]
Array = NDArray[np.float64]
DOWN = 1.0  # Time that a fallen robot lies before it starts again [s].
WINDOW = 1.0  # Time over which loads of joints are compared [s].
_CLEAR = 0.005  # Height above the floor of a robot that starts within it [m].
_EVEN = 1e-4  # Depth in the floor by which a new body may exceed the last one [m].
_FULL = 0.999  # Share of the largest torque that counts as the limit.
_ROUNDING = 1e-9  # Share of the peak torque by which torques at a limit may be off it.
_BAD = ("mjWARN_BADQPOS", "mjWARN_BADQVEL", "mjWARN_BADQACC")
_DIVERGED = [int(getattr(mujoco.mjtWarning, name)) for name in _BAD]
FLOOR = "floor"
FALL = Episodes()  # Criteria of a fall are those of training.


class Walk:
    """One robot on a plane, driven by a policy.

    The filter may have refused the design. Bodies are numbered as in the robot alone.

    Attributes:
        fit: the policy and its region of validity.
        model: MuJoCo model of robot and plane.
        data: state of the model.
        home: position `qpos` of the home pose [m, rad], shape (nq,).
        command: commanded vx, vy [m/s], wz [rad/s]; may be changed at any time.
        falls: number of falls so far.
        first_fall: time of the first of them [s]; None before it.
    """

    def __init__(self, model: Model, fit: Fit, command: Command = (0, 0, 0), seed: int = 0) -> None:
        """Put a robot near its home pose.

        Args:
            model: the robot.
            fit: policy for it.
            command: commanded velocity.
            seed: seed of joint offsets at the start.

        Raises:
            DraftError: the policy does not fit the robot.
        """
        self.command, self.falls = command, 0
        self.first_fall: float | None = None
        self._seed = seed
        self._robot: mujoco.MjModel | None = None  # Without the plane.
        self._loads: deque[tuple[Array, Array]] = deque(maxlen=1)
        self._place(model, fit)
        self.restart()

    @property
    def down(self) -> bool:
        """Whether the robot has fallen and lies."""
        return self._down_since is not None

    def restart(self) -> None:
        """Put the robot back to its home pose, where it stands now."""
        place = self.data.qpos[:2].copy()
        time = self.data.time
        self.controller.reset(self.data, self._seed)
        self.data.qpos[: len(self.home)] = self.home
        self.data.qpos[:2] = place
        self._offset_joints()
        self.data.time = time
        self._down_since: float | None = None
        mujoco.mj_forward(self.model, self.data)
        self._lift(0.0, _CLEAR)

    def swap(self, model: Model, fit: Fit) -> None:
        """Replace the body; position, velocity, command and last action are carried over.

        A body that reaches deeper into the floor than the last one is lifted by the difference.
        Loads so far are forgotten if the motors' limits differ.

        Raises:
            DraftError: the policy does not fit the robot.
        """
        data, controller, down = self.data, self.controller, self._down_since
        mujoco.mj_fwdPosition(self.model, data)  # Its contacts are those before the last step.
        depth, limits = self._depth(), _limits(self.fit)
        self._place(model, fit)
        if not np.array_equal(_limits(fit), limits):
            self._loads.clear()  # Nobody should judge them by the new motors.
        self.controller.resume(controller)
        self.data.time, self._down_since = data.time, down
        self.data.qpos[:], self.data.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(self.model, self.data)
        self._lift(depth)

    def advance(self, seconds: float) -> None:
        """Simulate for a while; a robot that falls lies for a moment and starts again."""
        for _ in range(round(seconds / self.model.opt.timestep)):
            self.step()

    def step(self) -> None:
        """Advance by one physics step; a simulation that diverges counts as a fall."""
        time, place = self.data.time, self.data.qpos[:2].copy()
        speeds = self.data.qvel[self.controller.dofs].copy()
        try:
            self.controller.step(self.data, self.command)
            sound = not self._diverged()
        except DraftError:
            sound = False
        if not sound:
            self._fall(time)
            mujoco.mj_resetData(self.model, self.data)
            self.data.time, self.data.qpos[:2] = time, place
            self.restart()
            return
        self._loads.append((self.data.qfrc_applied[self.controller.dofs].copy(), speeds))
        if self._down_since is None:
            if self._fallen():
                self._fall(self.data.time)
                self._down_since = self.data.time
        elif self.data.time - self._down_since > DOWN:
            self.restart()

    def push(self, forward: float, left: float) -> None:
        """Add a velocity to the robot, in the heading frame of its trunk [m/s]."""
        x, y = self.heading
        self.data.qvel[:2] += (forward * x - left * y, forward * y + left * x)

    @property
    def heading(self) -> tuple[float, float]:
        """Unit vector of the direction that the trunk faces, on the floor."""
        x, y = self.data.xmat[self._trunk][[0, 3]]
        length = max(float(np.hypot(x, y)), 1e-9)
        return float(x) / length, float(y) / length

    @property
    def velocity(self) -> Array:
        """Velocity of the trunk in its own frame [m/s], shape (3,)."""
        return self.controller.velocity(self.data)

    def loads(self) -> tuple[Array, Array]:
        """Torques [N m] and speeds [rad/s] of the last second, each of shape (steps, joints)."""
        joints = len(self.fit.policy.joints)
        if not self._loads:
            return np.zeros((0, joints)), np.zeros((0, joints))
        torques, speeds = zip(*self._loads, strict=True)
        return np.array(torques), np.array(speeds)

    def _place(self, model: Model, fit: Fit) -> None:
        """Put the robot on a plane; one of the same topology takes the place of the last."""
        last = self._robot
        compiled = None if last is None else swapped(self.model, last, model.mujoco)
        if compiled is None:
            compiled = _on_plane(model)
        data = mujoco.MjData(compiled)
        mujoco.mj_setConst(compiled, data)  # What a swapped robot lacks.
        self.controller = Controller(fit.policy, compiled)
        self.fit, self.model, self.data = fit, compiled, data
        self._robot = model.mujoco
        self.home = start_position(model, fit)
        self._trunk = compiled.body(model.design.bodies[0].name).id
        self._floor = compiled.geom(FLOOR).id
        steps = round(WINDOW / fit.policy.timestep)
        if self._loads.maxlen != steps:
            self._loads = deque(maxlen=steps)

    def _offset_joints(self) -> None:
        """Offset the joints as `Controller.reset` does, from the home pose of the design."""
        offsets = start_offsets(self.fit.policy, self._seed)
        self.data.qpos[self.controller.positions] += offsets

    def _depth(self) -> float:
        """How deep the robot reaches into the floor, as a standing foot does [m]."""
        touching = (self.data.contact.geom == self._floor).any(axis=1)
        return -float(self.data.contact.dist[touching].min(initial=0.0))

    def _lift(self, allowed: float, clear: float = 0.0) -> None:
        """Lift the robot where it reaches deeper into the floor than allowed.

        Args:
            allowed: depth that it keeps [m].
            clear: height by which it is lifted above that [m].
        """
        deeper = self._depth() - allowed
        if deeper > _EVEN:
            self.data.qpos[2] += deeper + clear
            mujoco.mj_forward(self.model, self.data)

    def _diverged(self) -> bool:
        """Whether values are not finite or were too large, for which MuJoCo resets the state."""
        too_large = self.data.warning.number[_DIVERGED].any()
        return bool(too_large) or not np.isfinite(self.data.qpos).all()

    def _fall(self, time: float) -> None:
        self.falls += 1
        if self.first_fall is None:
            self.first_fall = time

    def _fallen(self) -> bool:
        up = float(self.data.xmat[self._trunk][8])
        low = float(self.data.xpos[self._trunk, 2]) < FALL.low * self.home[2]
        return low or up < np.cos(FALL.tilt)


def start_position(model: Model, fit: Fit) -> Array:
    """Position `qpos` at which a robot starts to walk [m, rad], shape (nq,)."""
    home = home_position(model.design)
    if not home[7:].any():  # No home pose is stated: that of the policy is the crouch.
        joints = [model.mujoco.joint(name).qposadr[0] for name in fit.policy.joints]
        home[joints] = fit.policy.home
        home[2] = fit.height
    return home


def plane_xml(model: Model) -> str:
    """MJCF text of a robot on a plane, the first geom, which is called `FLOOR`."""
    floor = f'<worldbody>\n    <geom name="{FLOOR}" type="plane" size="0 0 0.05"/>'
    return model.xml.replace("<worldbody>", floor, 1)


def _on_plane(model: Model) -> mujoco.MjModel:
    """Compile a robot on a plane."""
    try:
        return mujoco.MjModel.from_xml_string(plane_xml(model))
    except ValueError as error:
        cause = f"MuJoCo does not accept the robot on a plane: {' '.join(str(error).split())}"
        raise DraftError(cause, "undo the change") from None


def _limits(fit: Fit) -> Array:
    """Numbers of the torque-speed lines of all joints, shape (3, joints)."""
    policy = fit.policy
    return np.array([policy.peak_torque, policy.stall_torque, policy.no_load_speed])


def share_of_limit(fit: Fit, torques: Array, speeds: Array) -> Array:
    """Torques over the largest that the motors give at their speeds.

    Args:
        fit: the policy, which has the motors' lines.
        torques: joint torques [N m], shape (..., joints).
        speeds: joint speeds [rad/s], shape (..., joints).

    Returns:
        Shares from 0 to 1, shape (..., joints): 1 on the torque-speed line, also where it goes on
        beyond the no-load speed, or at the peak torque where the motor brakes.
    """
    least, most = fit.policy.torque_bounds(speeds)
    rounding = _ROUNDING * fit.policy.peak_torque
    bound = np.where(torques < 0, -least, most)
    share = np.abs(torques) / np.maximum(bound, rounding)
    limited = (torques >= most - rounding) | (torques <= least + rounding)
    return np.where(limited, 1.0, np.minimum(share, 1.0))


def on_line(fit: Fit, torques: Array, speeds: Array) -> tuple[Array, Array]:
    """Loads as points below the torque-speed lines of their motors.

    A motor that brakes gives its peak torque at any speed, as at standstill, so its point is at
    speed 0. A joint that is driven beyond its no-load speed is at torque 0.

    Args:
        fit: the policy, which has the motors' lines.
        torques: joint torques [N m], shape (..., joints).
        speeds: joint speeds [rad/s], shape (..., joints).

    Returns:
        Speeds [rad/s] and torques [N m], zero or more, each of shape (..., joints).
    """
    least, most = fit.policy.torque_bounds(speeds)
    rounding = _ROUNDING * fit.policy.peak_torque
    beyond = ((most < 0) & (torques >= most - rounding)) | (
        (least > 0) & (torques <= least + rounding)
    )
    brakes = (torques * speeds < 0) & ~beyond
    return np.where(brakes, 0.0, np.abs(speeds)), np.where(beyond, 0.0, np.abs(torques))


def limiting(walk: Walk) -> tuple[str, str, float]:
    """Joint that was at its limit for the longest time of the last second.

    Returns:
        Name of the joint; "torque" or "speed", whichever limits it; and the share of the time.
        Where no joint reaches its limit, the joint with the highest load, "" and its largest share
        of the limit.
    """
    torques, speeds = walk.loads()
    names = walk.fit.policy.joints
    if not len(torques):
        return names[0], "", 0.0
    shares = share_of_limit(walk.fit, torques, speeds)
    full = shares >= _FULL
    often = full.mean(axis=0)
    joint = int(often.argmax())
    if often[joint] == 0:
        joint = int(shares.max(axis=0).argmax())
        return names[joint], "", float(shares[:, joint].max())
    fast = _by_speed(walk.fit, torques, speeds)[full[:, joint], joint]
    return names[joint], "speed" if fast.mean() > 0.5 else "torque", float(often[joint])


def _by_speed(fit: Fit, torques: Array, speeds: Array) -> NDArray[np.bool_]:
    """Whether torques at their limits are limited by the speed, shape (..., joints).

    Below its peak torque, a motor is on the slope of its line, where more torque would help more
    up to half of the no-load speed, and more speed from there.
    """
    below = np.abs(torques) < _FULL * fit.policy.peak_torque
    return below & (np.abs(speeds) > 0.5 * fit.policy.no_load_speed)
