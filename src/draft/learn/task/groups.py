"""Every number of the learning tasks by group, with its unit, meaning and source.

A number is that for a leg of 0.48 m (thigh plus shank). A number with a power is multiplied by that
power of s = L / 0.48 m: speeds and times scale with sqrt(s), lengths with s. Source "paper" is
arXiv 2609.38405; the others are choices of its released code, of mjlab's velocity task, or of
Draft.
"""

from __future__ import annotations

from dataclasses import dataclass

from draft.learn.task.constants import (
    ANY,
    CONTACT_TIME,
    FRAMES,
    ITERATIONS,
    POSITIVE,
    POSITIVE_RANGE,
    RANGE,
    SHARE,
    VELOCITY_NOISE,
    choice,
    paper,
)
from draft.model.scene import DAMPING, STIFFNESS

CODE, MJLAB, DRAFT = "released code", "mjlab", "Draft"
Range = tuple[float, float]
Ramp = tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class Physics:
    """Simulation and control."""

    timestep: float = choice(0.005, "s", "physics step", MJLAB, within=POSITIVE)
    decimation: int = paper(4, "1", "physics steps per action: 50 Hz control", within=POSITIVE)
    solver_iterations: int = choice(10, "1", "Newton iterations", MJLAB, within=POSITIVE)
    line_search_iterations: int = choice(20, "1", "line-search iterations", MJLAB, within=POSITIVE)
    constraints: int = choice(500, "1", "constraint rows per world", DRAFT, within=POSITIVE)
    upper_legs_collide: bool = choice(
        True, "1", "thighs collide with the ground, so that their penalty can act", DRAFT
    )
    all_collide: bool = choice(
        False, "1", "all geoms collide with the ground that do in the robot's own model", DRAFT
    )


@dataclass(frozen=True)
class Actuation:
    """PD control to a joint target within the linear torque-speed line, at every physics step.

    Driven wheels are controlled to a speed, with the damping alone.
    """

    stiffness: float = paper(STIFFNESS, "1/rad", "kp per peak torque")
    damping: float = paper(DAMPING, "s/rad", "kd per peak torque")
    support: float = choice(
        0.0,
        "1",
        "least torque that gains of hip pitch and knee are per on four legs, over m g L",
        DRAFT,
    )
    action_scale: float = choice(
        0.175, "rad", "joint offset per unit of action", CODE, within=POSITIVE
    )
    wheel_scale: float = choice(
        0.1,
        "1",
        "speed of a driven wheel per unit of action, per no-load speed",
        DRAFT,
        within=POSITIVE,
    )
    soft_limits: float = choice(
        0.9, "1", "central share of a range without penalty", CODE, within=SHARE
    )


@dataclass(frozen=True)
class Observations:
    """Observations of the actor and their uniform noise; the critic gets them without."""

    linear_velocity: bool = choice(
        True,
        "1",
        "the actor observes the trunk's velocity, which no sensor of a robot gives",
        DRAFT,
    )
    history: int = choice(
        1,
        "1",
        "steps of gyro, gravity, joints and actions that the actor observes, the present included",
        DRAFT,
        within=FRAMES,
    )
    biased_encoders: bool = choice(
        False, "1", "observed joint positions have the bias of their encoders", DRAFT
    )
    linear_velocity_noise: float = choice(VELOCITY_NOISE, "m/s", "noise of the velocimeter", MJLAB)
    angular_velocity_noise: float = choice(0.2, "rad/s", "noise of the gyro", MJLAB)
    gravity_noise: float = choice(0.05, "1", "noise of the projected gravity", MJLAB)
    joint_position_noise: float = choice(0.01, "rad", "noise of the joint positions", MJLAB)
    joint_velocity_noise: float = choice(
        0.0104, "1", "noise of the joint velocities per no-load speed", CODE
    )
    scan_noise: float = choice(0.1, "m", "noise of the height scan", MJLAB)
    scan_range: float = choice(
        5.0, "m", "range of the height scan, and its divisor", MJLAB, within=POSITIVE
    )
    scan_size: Range = choice(
        (1.6, 1.0), "m", "sides of the height scan, forwards, sideways", MJLAB, within=POSITIVE
    )
    scan_pitch: float = choice(0.1, "m", "grid of the height scan", MJLAB, within=POSITIVE)
    map_pitch: float = choice(
        0.025, "m", "grid of the height map that the scan is read from", DRAFT, within=POSITIVE
    )
    foot_ring: float = choice(0.025, "m", "radius of the four points around a foot", CODE)
    foot_range: float = choice(1.0, "m", "range of the height of a foot", CODE, within=POSITIVE)

    def scan_points(self) -> int:
        """Number of points of the height scan."""
        along, across = (round(side / self.scan_pitch) + 1 for side in self.scan_size)
        return along * across


@dataclass(frozen=True)
class Commands:
    """Velocity commands of the base stage."""

    forward: float = choice(1.0, "m/s", "largest |vx|", CODE, 0.5)
    sideways: float = choice(0.6, "m/s", "largest |vy|", CODE, 0.5)
    turn: float = choice(0.5, "rad/s", "largest |wz|", CODE, -0.5)
    interval: Range = choice((3.0, 8.0), "s", "time between two commands", MJLAB, within=RANGE)
    standing: float = choice(0.1, "1", "share of commands that are zero", MJLAB, within=SHARE)
    heading: float = choice(0.3, "1", "share that turns towards a heading", MJLAB, within=SHARE)
    heading_stiffness: float = choice(0.5, "1/s", "yaw rate per heading error", MJLAB)
    forward_only: float = choice(0.2, "1", "share straight ahead", MJLAB, within=SHARE)
    forward_least: float = choice(0.3, "m/s", "smallest vx straight ahead", MJLAB)
    limit: float = choice(1.0, "1", "largest |vx| per estimated top speed", CODE)
    limit_sideways: float = choice(0.6, "1", "largest |vy| per that limit", CODE)


@dataclass(frozen=True)
class Rewards:
    """Reward terms, per second: weight x value, integrated over an episode."""

    linear_weight: float = paper(1.0, "1", "weight of tracking vx and vy, and vz = 0", within=ANY)
    linear_sigma: float = paper(0.5, "m/s", "width of that tracking", 0.5, within=POSITIVE)
    angular_weight: float = paper(1.0, "1", "weight of tracking wz, and wx = wy = 0", within=ANY)
    angular_sigma: float = paper(0.5, "rad/s", "width of that tracking", -0.5, within=POSITIVE)
    upright_weight: float = paper(
        1.0, "1", "weight of a trunk along the normal of the ground", within=ANY
    )
    upright_sigma: float = paper(0.45, "1", "width of that term", -0.5, within=POSITIVE)
    air_time_weight: float = paper(
        0.4, "1", "weight of feet in the air for a short time", within=ANY
    )
    air_time_most: float = paper(
        0.35, "s", "longest time in the air that counts", 0.5, within=POSITIVE
    )
    air_time_gate: float = choice(0.1, "m/s", "smallest |v_xy| + |wz| of the command", CODE, 0.5)
    height_weight: float = paper(
        0.4, "1", "weight of the trunk's height above the ground below it", within=ANY
    )
    height: float = paper(0.43, "m", "target height of the trunk", 1.0, within=POSITIVE)
    height_sigma: float = paper(0.11, "m", "width of that term", 1.0, within=POSITIVE)
    clearance_weight: float = paper(
        -2.0, "1", "weight of |foot height - target| x horizontal foot speed", within=ANY
    )
    clearance_scale: float = paper(1.0, "1", "factor of that penalty", -1.5)
    clearance: float = paper(0.10, "m", "target height of the feet", 1.0, within=POSITIVE)
    clearance_gate: float = choice(0.05, "m/s", "smallest |v_xy| + |wz| of the command", MJLAB)
    vertical_weight: float = paper(-2.0, "1", "weight of the vertical velocity squared", within=ANY)
    vertical_scale: float = paper(1.0, "1", "factor of that penalty", -1.0)
    limits_weight: float = paper(
        -1.0, "1/rad", "weight of joint positions past their soft limits", within=ANY
    )
    upper_leg_weight: float = paper(
        -1.0, "1", "weight of the number of thighs that touch the ground", within=ANY
    )
    action_rate_weight: float = paper(
        -0.05, "1", "weight of the squared change of the action", within=ANY
    )
    action_rate_ramp: int = choice(
        0, "1", "iterations over which that weight grows from zero, in stage base", DRAFT
    )
    power_weight: float = choice(
        0.0, "1", "weight of the electrical power per weight and commanded speed", DRAFT, within=ANY
    )
    power_least: float = choice(
        0.5, "m/s", "slowest command that the power is divided by", DRAFT, 0.5, within=POSITIVE
    )


@dataclass(frozen=True)
class Episodes:
    """Start, disturbances and end of an episode."""

    length: float = choice(20.0, "s", "length of an episode", CODE, 0.5, within=POSITIVE)
    tilt: float = choice(1.0, "rad", "tilt that counts as a fall", CODE, within=POSITIVE)
    low: float = choice(
        0.5, "1", "height above the feet that counts as a fall, per home height", CODE, within=SHARE
    )
    margin: float = choice(
        0.3, "m", "distance to the edge of the ground that ends an episode", MJLAB
    )
    spawn: float = choice(
        0.5, "m", "largest |x| and |y| from the origin of a patch at the start", MJLAB
    )
    drop: Range = choice((0.01, 0.05), "m", "height of the feet at the start", MJLAB, within=RANGE)
    yaw: float = choice(3.14, "rad", "largest |yaw| at the start", MJLAB)
    friction: Range = choice((0.4, 1.1), "1", "friction of all feet of a world", CODE, within=RANGE)
    contact_time: Range = choice(
        (CONTACT_TIME, CONTACT_TIME),
        "s",
        "time constant of the contacts of all feet of a world; at least two physics steps",
        DRAFT,
        within=POSITIVE_RANGE,
    )
    delay: Range = choice(
        (0.0, 0.0), "s", "delay of the joint targets, at most a control period", DRAFT, within=RANGE
    )
    motor: Range = choice(
        (1.0, 1.0), "1", "factor on the torque of each motor", DRAFT, within=POSITIVE_RANGE
    )
    joint_friction: Range = choice(
        (0.0, 0.0),
        "1",
        "viscous friction of each joint at its no-load speed, per peak torque",
        DRAFT,
        within=RANGE,
    )
    dry_friction: Range = choice(
        (0.0, 0.0), "1", "dry friction of each joint, per peak torque", DRAFT, within=RANGE
    )
    centre: float = choice(
        0.02, "m", "largest shift of the trunk's centre of mass per axis", CODE, 1.0
    )
    joints: float = choice(0.0, "rad", "largest offset of a joint at the start", DRAFT)
    encoder: float = choice(0.015, "rad", "largest encoder bias", MJLAB)
    push_linear: tuple[float, float, float] = choice(
        (0.5, 0.5, 0.4), "m/s", "largest push along x, y, z", CODE, 0.5
    )
    push_angular: tuple[float, float, float] = choice(
        (0.52, 0.52, 0.78), "rad/s", "largest push about x, y, z", CODE, -0.5
    )
    push_interval: Range = choice(
        (2.0, 5.0), "s", "time between two pushes", CODE, 0.5, within=RANGE
    )


KINDS = ("flat", "stairs", "slopes", "rough", "waves")  # Of ground, each with a share.


@dataclass(frozen=True)
class Ground:
    """Patches of gently uneven ground; row r of n has the difficulty r / (n - 1).

    The shares of its `KINDS` are relative to their sum.
    """

    rows: int = choice(10, "1", "rows of rising difficulty", MJLAB, within=POSITIVE)
    start_rows: int = choice(
        4, "1", "number of the easiest rows, where robots start", CODE, within=POSITIVE
    )
    patch: float = choice(8.0, "m", "side of a patch", MJLAB, within=POSITIVE)
    border: float = choice(20.0, "m", "width of the flat border around all patches", MJLAB)
    flat: float = choice(0.2, "1", "share of robots on flat ground", CODE, within=SHARE)
    stairs: float = choice(0.4, "1", "share on stairs", CODE, within=SHARE)
    pits: float = choice(0.5, "1", "share of the stairs that lead out of a pit", CODE, within=SHARE)
    step: Range = choice(
        (0.0, 0.14), "m", "height of a step from the easiest to the hardest row", CODE, within=RANGE
    )
    tread: float = choice(0.3, "m", "depth of a step", MJLAB, within=POSITIVE)
    platform: float = choice(
        3.0, "m", "side of the flat square amid stairs", MJLAB, within=POSITIVE
    )
    rim: float = choice(1.0, "m", "width of the flat rim around stairs", MJLAB)
    slopes: float = choice(0.2, "1", "share on slopes, half of them in a pit", CODE, within=SHARE)
    slope: Range = choice(
        (0.0, 1.0), "1", "slope from the easiest to the hardest row", MJLAB, within=RANGE
    )
    rough: float = choice(0.1, "1", "share on random heights", CODE, within=SHARE)
    roughness: Range = choice(
        (0.02, 0.10), "m", "smallest and largest random height", MJLAB, within=RANGE
    )
    waves: float = choice(0.1, "1", "share on waves", CODE, within=SHARE)
    wave: Range = choice((0.0, 0.16), "m", "amplitude of the waves", CODE, within=RANGE)


@dataclass(frozen=True)
class Velocity:
    """Stage `velocity`: commands grow far beyond the estimated top speed.

    A share of the robots may have the commands and pushes of stage `push` instead, so that one
    policy learns both.
    """

    forward: float = choice(15.0, "m/s", "largest |vx| at the end of the ramp", CODE)
    ramp: Ramp = choice(
        ((0, 0.4), (400, 0.6), (900, 0.8), (1400, 1.0)), "1", "(iteration, share of that)", CODE
    )
    sideways: float = choice(0.4, "m/s", "largest |vy|", CODE)
    turn: float = choice(0.4, "rad/s", "largest |wz|", CODE)
    growth: float = choice(
        0.0,
        "m/s",
        "increment of |vx| each time it is tracked, instead of the ramp; 0 for the ramp",
        DRAFT,
        0.5,
    )
    tracked: float = choice(
        0.8, "1", "share of a fast command that counts as tracked", DRAFT, within=SHARE
    )
    missed: float = choice(
        0.0,
        "1",
        "share of a fast command below which |vx| shrinks by that increment; 0 for never",
        DRAFT,
        within=SHARE,
    )
    pushed: float = choice(
        0.0, "1", "share of robots with commands and pushes as in push", DRAFT, within=SHARE
    )
    headroom: float = choice(1.5, "1", "v_cap per estimated top speed", CODE, within=POSITIVE)
    sigma: float = choice(
        0.4, "1", "width of the tracking of vx and vy per v_cap", CODE, within=POSITIVE
    )
    relative: float = choice(
        0.0,
        "1",
        "width of the tracking per |v*|, in quadrature with that of base; 0 for sigma v_cap",
        DRAFT,
    )
    air_time_weight: float = choice(0.3, "1", "weight of the air time", CODE, within=ANY)
    air_time_most: float = choice(
        0.5, "s", "longest time in the air that counts", CODE, within=POSITIVE
    )
    action_rate_weight: float = choice(
        -0.01, "1", "weight of the squared change of the action", CODE, within=ANY
    )
    progress: float = choice(
        0.0, "1", "weight of the speed along the command, per its size, in stage any", DRAFT
    )
    turning: float = choice(
        0.0, "1", "weight of the rate of turn along the command, per its size, in stage any", DRAFT
    )
    turning_gate: float = choice(
        0.2,
        "1",
        "share of the largest |wz*| up to which that counts no command",
        DRAFT,
        within=SHARE,
    )
    single: float = choice(
        0.0,
        "1",
        "share of commands of only vx, only vy or only wz, in stage any",
        DRAFT,
        within=SHARE,
    )
    speed_weight: float = choice(
        0.6, "1", "weight of the speed in the commanded sense, per v_cap", CODE, within=ANY
    )
    speed_gate: float = choice(0.5, "1", "smallest |vx| of the command per v_cap", CODE)


@dataclass(frozen=True)
class Climbing:
    """Stage `terrain`: robots move to harder rows as they cross easier ones.

    The shares of its `KINDS` are relative to their sum.
    """

    limit: float = choice(0.5, "1", "largest |vx| per estimated top speed", CODE)
    promotion: float = choice(
        4.0, "m", "distance from the origin that moves a robot up a row", MJLAB
    )
    demotion: float = choice(
        0.5,
        "1",
        "share of the commanded distance below which it moves down a row",
        MJLAB,
        within=SHARE,
    )
    by_way: bool = choice(
        False, "1", "up a row by the commanded distance, at most the promotion distance", DRAFT
    )
    forward: Range = choice(
        (0.0, 0.0), "m/s", "range of vx along a fixed heading; 0 for none", DRAFT, 0.5, within=RANGE
    )
    away: float = choice(
        0.7, "1", "share of robots with a fixed heading; the others as in base", DRAFT, within=SHARE
    )
    progress: float = choice(
        0.0, "1", "weight of the speed along the command, per command", DRAFT, within=ANY
    )
    clearance: float = choice(
        0.0, "m", "target height of the feet; 0 for that of all stages", DRAFT, 1.0
    )
    clearance_share: float = choice(
        1.0, "1", "weight of the penalty of other heights, per that of all stages", DRAFT
    )
    episode: float = choice(0.0, "s", "length of an episode; 0 for that of all stages", DRAFT, 0.5)
    start_rows: int = choice(
        1, "1", "number of the easiest rows, where robots start", CODE, within=POSITIVE
    )
    flat: float = choice(0.05, "1", "share of robots on flat ground", CODE, within=SHARE)
    stairs: float = choice(0.6, "1", "share on stairs", CODE, within=SHARE)
    pits: float = choice(0.5, "1", "share of the stairs that lead out of a pit", CODE, within=SHARE)
    step: Range = choice(
        (0.10, 0.50),
        "m",
        "height of a step from the easiest to the hardest row",
        CODE,
        within=RANGE,
    )
    slopes: float = choice(0.1, "1", "share on slopes, half of them in a pit", CODE, within=SHARE)
    rough: float = choice(0.1, "1", "share on random heights", CODE, within=SHARE)
    roughness: Range = choice(
        (0.02, 0.30), "m", "smallest and largest random height", CODE, within=RANGE
    )
    waves: float = choice(0.15, "1", "share on waves", CODE, within=SHARE)
    wave: Range = choice((0.0, 0.50), "m", "amplitude of the waves", CODE, within=RANGE)


@dataclass(frozen=True)
class Pushing:
    """Stage `push`: pushes of the same size for every design."""

    linear: tuple[float, float, float] = choice(
        (0.5, 0.5, 0.4), "m/s", "largest push along x, y, z before the ramp", CODE
    )
    angular: tuple[float, float, float] = choice(
        (0.52, 0.52, 0.78), "rad/s", "largest push about x, y, z before the ramp", CODE
    )
    ramp: Ramp = choice(
        ((0, 1.0), (400, 2.0), (800, 3.5), (1200, 5.0)), "1", "(iteration, factor)", CODE
    )
    interval: Range = choice((1.0, 3.0), "s", "time between two pushes", CODE, 0.5, within=RANGE)
    forward: float = choice(1.0, "m/s", "largest |vx|", CODE)
    sideways: float = choice(0.6, "m/s", "largest |vy|", CODE)
    turn: float = choice(0.5, "rad/s", "largest |wz|", CODE)
    sigma: float = choice(0.5, "m/s", "width of the tracking of vx and vy", CODE, within=POSITIVE)


@dataclass(frozen=True)
class Learning:
    """PPO of rsl-rl."""

    environments: int = choice(4096, "1", "number of worlds", CODE, within=POSITIVE)
    steps: int = choice(24, "1", "steps per iteration", CODE, within=POSITIVE)
    iterations_base: int = choice(1200, "1", "iterations of stage base", CODE, within=ITERATIONS)
    iterations_velocity: int = choice(
        1800, "1", "iterations of stage velocity", CODE, within=ITERATIONS
    )
    iterations_terrain: int = choice(
        2000, "1", "iterations of stage terrain", CODE, within=ITERATIONS
    )
    iterations_push: int = choice(1500, "1", "iterations of stage push", CODE, within=ITERATIONS)
    iterations_any: int = choice(4000, "1", "iterations of stage any", DRAFT, within=ITERATIONS)
    save_every: int = choice(250, "1", "iterations between two checkpoints", CODE, within=POSITIVE)
    hidden: tuple[int, ...] = choice(
        (512, 256, 128),
        "1",
        "units of the hidden layers of actor and critic, ELU",
        CODE,
        within=POSITIVE,
    )
    initial_std: float = choice(
        0.5, "1", "standard deviation of the first actions", CODE, within=POSITIVE
    )
    lessons: int = choice(
        0,
        "1",
        "first iterations, in which the actor imitates the exported policy that it starts from, if "
        "it observes other things",
        DRAFT,
    )
    epochs: int = choice(5, "1", "passes over an iteration's samples", CODE, within=POSITIVE)
    mini_batches: int = choice(4, "1", "mini-batches per pass", CODE, within=POSITIVE)
    discount: float = choice(0.99, "1", "gamma", CODE, within=SHARE)
    trace: float = choice(0.95, "1", "lambda of the advantages", CODE, within=SHARE)
    clip: float = choice(
        0.2, "1", "clipping range of the ratio and of the value", CODE, within=POSITIVE
    )
    value_weight: float = choice(1.0, "1", "weight of the value loss", CODE, within=ANY)
    entropy: float = choice(0.01, "1", "weight of the entropy", CODE)
    learning_rate: float = choice(
        1e-3, "1", "first learning rate, then adapted by KL", CODE, within=POSITIVE
    )
    kl: float = choice(0.01, "1", "target of the KL divergence", CODE, within=POSITIVE)
    gradient: float = choice(1.0, "1", "largest norm of a gradient", CODE, within=POSITIVE)
    least_rate: float = choice(1e-5, "1", "floor of the learning rate", "rsl-rl")
    decay: float = choice(
        0.0,
        "1",
        "last share of the iterations, in which the learning rate and the weight of the entropy "
        "fall to a twentieth",
        DRAFT,
        within=SHARE,
    )
    mirror: bool = choice(
        False, "1", "networks are kept symmetric under the left-right mirror image", DRAFT
    )
