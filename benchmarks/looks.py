"""How do walks look, in numbers and in pictures?

    python -m benchmarks.looks                                    # ten bodies of every kind
    python -m benchmarks.looks --pictures DIR                     # the same, with film strips
    python -m benchmarks.looks --out examples/results/looks.json

Robots walk ahead at half of their fastest command in plain MuJoCo: bodies of every kind of the
generator by the policy of all legs, drawn with another seed than those of the training, and shipped
robots by the policies that ship for them, as a yardstick. It measures what an engineer would not
believe: feet that skate, knees on the ground, joints that vibrate, arms that flail, a trunk that
leans. It takes half a minute, and with strips some twenty.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

import mujoco  # noqa: E402
import numpy as np  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from benchmarks.any_legs import TRAINED_SEED, half  # noqa: E402
from benchmarks.roll_outs import WIDTH, number, record_of, run_as_command, save  # noqa: E402
from draft.design.references import find_design  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.features import GRAVITY  # noqa: E402
from draft.learn.bodies.generated import KINDS, generate_kind  # noqa: E402
from draft.learn.bodies.legged import LeggedRobot, legged_robot  # noqa: E402
from draft.learn.policy.playback import SETTLING, Playback, Scenario  # noqa: E402
from draft.learn.policy.policy import ANY, Policy  # noqa: E402
from draft.learn.policy.policy import policy as shipped  # noqa: E402
from draft.learn.policy.reduced import open_legs_policy  # noqa: E402
from draft.learn.policy.strip import INTERVAL, Shot, moments  # noqa: E402
from draft.learn.policy.strip import save as save_strip  # noqa: E402
from draft.values import Array  # noqa: E402

SECONDS, SHOTS, SIZE, SIDE = 6.0, 6, (640, 360), 90.0
SLIDING = 0.25  # Speed of a foot that slides, of the commanded one.
VIBRATION = 15.0  # Frequency above which motion counts as vibration [Hz].
SHIPPED = ("cheetah", "bear", "giraffe")
COLUMNS = {
    "speed": "speed",
    "skating": "skating",
    "clearance": "thighs above ground",
    "vibration": "vibration",
    "nose": "nose down [deg]",
    "others": "other joints [deg]",
}
HEADINGS = ("kind", "robots", "fell", *COLUMNS.values())


@dataclass(frozen=True)
class Looks:
    """What is seen of a robot that walks ahead.

    Attributes:
        speed: mean speed ahead, per sqrt(g L).
        skating: share of the load that feet carry while they slide: while the point of contact
            moves along the ground at more than a quarter of the commanded speed.
        clearance: least distance of a thigh from the ground, per leg length.
        vibration: share of the power of the joints' velocities above 15 Hz.
        nose: mean angle of the trunk's x axis below the horizon [deg].
        others: largest range of a joint outside the legs, from the 5th to the 95th percentile
            [deg]; None without one.
    """

    speed: float
    skating: float
    clearance: float
    vibration: float
    nose: float
    others: float | None


def main(
    policy: Path = ANY,
    bodies: int = 10,
    seed: int = 11,
    pictures: Path | None = None,
    out: Path | None = None,
) -> None:
    """Let robots walk, and print.

    Args:
        policy: policy of all legs.
        bodies: number of bodies of each kind.
        seed: seed of the draws, not that of the training.
        pictures: folder for a film strip of each robot, from the side.
        out: JSON file for the numbers.
    """
    if seed == TRAINED_SEED:
        raise DraftError(f"bodies of seed {seed} are those of the training", "use another one")
    if pictures is not None:
        pictures.mkdir(parents=True, exist_ok=True)
    legs = open_legs_policy(policy)
    found: dict[str, list[Looks | None]] = {"shipped": []}
    for name in SHIPPED:
        member = legged_robot(find_design(name).resolve())
        found["shipped"].append(_walked(shipped(name, "walk"), member, pictures))
    for kind in KINDS:
        members = generate_kind(kind, bodies, seed).members
        found[kind] = [_walked(legs.of_robot(member), member, pictures) for member in members]
    rows = [row_of(kind, looks) for kind, looks in found.items()]
    show(rows, Console(width=WIDTH))
    if out is not None:
        save(out, {"policy": record_of(legs), "seed": seed, "seconds": SECONDS, "kinds": rows})


def _walked(policy: Policy, member: LeggedRobot, pictures: Path | None) -> Looks | None:
    """Let a robot walk at half of its fastest command; None if it falls."""
    root = math.sqrt(GRAVITY * member.leg_length)
    player = Playback(policy, member, Scenario((float(half(len(member.feet))) * root, 0.0, 0.0)))
    if pictures is None:
        return looks_of(player)
    file = pictures / f"{member.name.replace(':', '-')}.png"
    with film(player, file, SECONDS, SIDE) as shoot:
        return looks_of(player, shoot)


def looks_of(player: Playback, shoot: Any = lambda _: None) -> Looks | None:
    """Measure a robot that walks; None if it falls.

    Args:
        player: the robot with its policy.
        shoot: called with the number of actions done.
    """
    model, data, member = player.model, player.data, player.member
    root = math.sqrt(GRAVITY * member.leg_length)
    dofs = [model.joint(name).dofadr[0] for name in member.joints]
    ours = {i for leg in member.leg_joints for i in leg}
    others = [i for i in range(len(member.joints)) if i not in ours]
    thighs = [model.geom(name).id for leg in member.upper_legs for name in leg]
    feet = {model.geom(name).id for name in member.foot_geoms}
    trunk, floor = model.body(member.trunk).id, model.geom("floor").id
    player.reset()
    player.falls = 0
    rate, angles, ahead, nose, loads = [], [], [], [], []
    least = math.inf
    substeps = round(player.period / model.opt.timestep)
    for action in range(1, player.steps(SECONDS) + 1):
        for _ in range(substeps):
            player.step()
            if player.falls:
                return None
            if action * player.period <= SETTLING:
                continue
            rate.append(data.qvel[dofs].copy())
            loads += contacts(model, data, feet, floor)
        if action * player.period > SETTLING:
            angles.append(data.qpos[7:][others].copy())
            ahead.append(player.controller.velocity(data)[0])
            nose.append(-math.degrees(math.asin(data.xmat[trunk][6])))
            gaps = (mujoco.mj_geomDistance(model, data, one, floor, 1.0, None) for one in thighs)
            least = min(least, *gaps)
        shoot(action)
    force, slip = np.array(loads).T
    sliding = slip > SLIDING * player.command[0]
    ranges = np.ptp(np.percentile(np.array(angles), (5, 95), axis=0), axis=0) if others else None
    return Looks(
        speed=round(float(np.mean(ahead)) / root, 3),
        skating=round(float(force[sliding].sum() / force.sum()), 3),
        clearance=round(least / member.leg_length, 3),
        vibration=round(vibration(np.array(rate), model.opt.timestep), 3),
        nose=round(float(np.mean(nose)), 1),
        others=None if ranges is None else round(math.degrees(float(ranges.max())), 1),
    )


def contacts(
    model: mujoco.MjModel, data: mujoco.MjData, feet: set[int], floor: int
) -> list[tuple[float, float]]:
    """Normal force [N] of each contact of a foot with the floor, and its speed [m/s].

    The speed is that of the point of contact along the ground: a ball that rolls has none.
    """
    found = []
    wrench = np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        pair = set(contact.geom.tolist())
        if floor not in pair or not (own := pair & feet):
            continue
        mujoco.mj_contactForce(model, data, i, wrench)
        body = model.geom_bodyid[own.pop()]
        arm = contact.pos - data.subtree_com[model.body_rootid[body]]
        turn, along = data.cvel[body][:3], data.cvel[body][3:]
        found.append((float(wrench[0]), float(np.hypot(*(along + np.cross(turn, arm))[:2]))))
    return found


def vibration(rates: Array, timestep: float) -> float:
    """Share of the power of signals above `VIBRATION`, their means left out.

    Args:
        rates: shape (samples, signals).
        timestep: time between two samples [s].
    """
    moving = (rates - rates.mean(axis=0)) * np.hanning(len(rates))[:, None]
    power = (np.abs(np.fft.rfft(moving, axis=0)) ** 2).sum(axis=1)
    fast = np.fft.rfftfreq(len(rates), timestep) > VIBRATION
    return float(power[fast].sum() / power.sum())


@contextlib.contextmanager
def film(player: Playback, file: Path, seconds: float, azimuth: float) -> Iterator[Any]:
    """Draw a film strip of the last moments of a walk, unless the robot falls.

    Args:
        player: the robot with its policy.
        file: PNG file.
        seconds: duration of the walk [s].
        azimuth: of the camera [deg].

    Yields:
        A function to call with the number of actions done.
    """
    from draft.learn.policy.video import Film

    wanted = moments(player.steps(seconds), SHOTS, player.period)
    shots: list[Shot] = []
    with contextlib.closing(Film(player, SIZE, azimuth)) as camera:

        def shoot(step: int) -> None:
            if step in wanted:
                camera.frame(INTERVAL)
                shots.append(camera.shot(step * player.period))

        yield shoot
    if not player.falls:
        save_strip(file, shots)


def row_of(kind: str, looks: Sequence[Looks | None]) -> dict[str, Any]:
    """Medians of a kind and its worst robot, over those that stay up."""
    rows = [asdict(one) for one in looks if one is not None]
    known = {name: [row[name] for row in rows if row[name] is not None] for name in COLUMNS}
    return {
        "kind": kind,
        "robots": len(looks),
        "fell": len(looks) - len(rows),
        "median": {name: float(np.median(of)) if of else None for name, of in known.items()},
        "least": {name: min(of, default=None) for name, of in known.items()},
        "most": {name: max(of, default=None) for name, of in known.items()},
    }


def cells(row: Mapping[str, Any]) -> list[str]:
    """Texts of a row: the median of each column, and its range."""
    first = [row["kind"], str(row["robots"]), str(row["fell"])]
    return first + [_cell(row, name) for name in COLUMNS]


def _cell(row: Mapping[str, Any], name: str) -> str:
    if row["median"][name] is None:
        return ""
    least, most = number(row["least"][name]), number(row["most"][name])
    return f"{number(row['median'][name])} ({least} to {most})"


def show(rows: Sequence[Mapping[str, Any]], console: Console) -> None:
    """Print the table."""
    table = Table(*HEADINGS, box=None)
    for row in rows:
        table.add_row(*cells(row))
    console.print(table)


if __name__ == "__main__":
    run_as_command(main, __doc__)
