"""Reading of robot descriptions into the table of segments.

The survey continues past problems: invalid files, excluded robots, and joints without an actuator
mass are reported in the summary, with file and line.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from draft.description.description import Description, Joint
from draft.description.read import describe
from draft.description.segments import Segment, segments
from draft.description.xmlfile import DescriptionError
from draft.errors import DraftError, Location, Problem
from draft.fitting.structure.attribution import machine
from draft.fitting.structure.robots import Robot, hosts, read_manifest, robots
from draft.laws import joint_roles as roles
from draft.laws import segment_classes as classes
from draft.laws.survey import Row, usable

SUFFIXES = (".urdf", ".xml", ".mjcf")
HEAVIEST = 0.65


@dataclass(frozen=True, slots=True)
class Parsed:
    """One robot whose description was read.

    Attributes:
        robot: its row in the table of robots.
        description: content of its file.
        rows: its segments; none if it is neither humanoid nor quadruped.
        notes: joints without a role or a mass and the like, with file and line.
    """

    robot: Robot
    description: Description
    rows: tuple[Row, ...]
    notes: tuple[Problem, ...]


@dataclass
class Survey:
    """Robots of a folder or manifest.

    Attributes:
        parsed: robots that were read, used in fits or not.
        failed: robots that could not be read, with the error.
    """

    parsed: list[Parsed] = field(default_factory=list)
    failed: list[tuple[Robot, DraftError]] = field(default_factory=list)

    @property
    def used(self) -> list[Parsed]:
        """Robots that the fits use."""
        return [one for one in self.parsed if one.robot.used]

    @property
    def rows(self) -> list[Row]:
        """Segments of the robots that the fits use."""
        return [row for one in self.used for row in one.rows]


def parse(source: Path) -> Survey:
    """Read every description of a folder, or every row of a manifest (.csv).

    Raises:
        DescriptionError: the folder or manifest cannot be read, or lists no file.
    """
    survey = Survey()
    for robot, path in listed(source):
        try:
            survey.parsed.append(parse_file(path, robot))
        except DraftError as error:
            survey.failed.append((robot, error))
    return survey


def listed(source: Path) -> list[tuple[Robot, Path]]:
    """Robots and files of a folder or manifest (.csv); errors as `parse`."""
    if source.is_dir():
        files = list(_of_folder(source))
    elif source.suffix == ".csv":
        files = read_manifest(source)
    else:
        cause = "this is neither a folder nor a manifest (.csv)"
        raise DescriptionError(Problem(cause, Location(str(source))))
    if not files:
        remedy = f"the survey reads {', '.join(SUFFIXES)}"
        raise DescriptionError(Problem("no descriptions here", Location(str(source)), remedy))
    return files


def parse_file(path: Path, robot: Robot) -> Parsed:
    """Read one description.

    Raises:
        DescriptionError: it is invalid; the message gives file and line.
    """
    description = describe(path)
    if description.mass <= 0.0:
        cause = "it has no inertials: nothing in it has a mass"
        raise DescriptionError(Problem(cause, Location(description.file)))
    notes = list(description.notes)
    rows: list[Row] = []
    if robot.population in ("humanoid", "quadruped"):
        rows = rows_of(description, robot, notes)
        _check_robot(rows, robot, description.file, notes)
    return Parsed(robot, description, tuple(rows), tuple(notes))


def rows_of(description: Description, robot: Robot, notes: list[Problem]) -> list[Row]:
    """Segments of a robot with their classes; adds joints without an actuator mass to `notes`."""
    role: dict[str, str] = {}
    for joint in description.moving:
        role[joint.name] = roles.role(joint.name, robot.key, robot.population) or ""
        _check_joint(joint, role[joint.name], notes)
    pieces = segments(description)
    below: dict[str, set[str]] = {piece.name: set() for piece in pieces}
    for piece in pieces[1:]:
        below[piece.parent or ""].add(role[piece.joints[0].name])
    return [_row(piece, role, below[piece.name], robot) for piece in pieces]


def _check_joint(joint: Joint, role: str, notes: list[Problem]) -> None:
    """Note a joint without a role, or with an invalid torque."""
    if not role:
        notes.append(Problem(f"joint '{joint.name}' has no role: it is not priced", joint.where))
    elif roles.priced(role) and (joint.effort is None or not usable(joint.effort)):
        effort = "no effort" if joint.effort is None else f"an effort of {joint.effort:g} N m"
        cause = f"joint '{joint.name}' declares {effort}: it is not priced"
        notes.append(Problem(cause, joint.where, "usable: above 0, at most 1000 N m"))


def _check_robot(rows: list[Row], robot: Robot, file: str, notes: list[Problem]) -> None:
    """Note doubts about a robot that the fits use."""
    if not robot.used:
        return
    share = machine(rows).share
    if share > HEAVIEST:
        cause = f"its declared torques imply actuators of {share:.0%} of its mass"
        notes.append(Problem(cause, Location(file), "the survey omits robots above 65 %"))
    if robot.population == "quadruped" and robot.key not in hosts():
        cause = "actuator_hosts.csv does not say which segments carry its drives"
        remedy = "add a row to it; until then each is added to the segment that it moves"
        notes.append(Problem(cause, Location(file), remedy))


def _row(segment: Segment, role: dict[str, str], below: set[str], robot: Robot) -> Row:
    own = tuple(role[joint.name] for joint in segment.joints)
    if segment.parent is None:
        kind = classes.BASE
    elif robot.population == "humanoid":
        kind = classes.humanoid(own, below)
    else:
        kind = classes.quadruped(own)
    inertia = segment.body.inertia
    return Row(
        robot=robot.key,
        population=robot.population,
        segment=_plain(segment.name),
        parent=_plain(segment.parent or ""),
        kind=kind,
        joints=tuple(_plain(joint.name) for joint in segment.joints),
        roles=own,
        efforts=tuple(_limit(joint.effort) for joint in segment.joints),
        velocities=tuple(_limit(joint.velocity) for joint in segment.joints),
        mass=segment.mass,
        length=segment.length,
        box=segment.box,
        com=segment.body.com,
        inertia=(
            *(inertia[i][i] for i in range(3)),
            inertia[0][1],
            inertia[0][2],
            inertia[1][2],
        ),
        centre=segment.centre,
    )


def _plain(name: str) -> str:
    """Replace white space in a name, since names in a cell are separated by spaces."""
    return "_".join(name.split())


def _limit(value: float | None) -> float:
    return float("nan") if value is None else value


def _of_folder(folder: Path) -> Iterable[tuple[Robot, Path]]:
    """Descriptions of a folder; the shipped table has the robots by the stems of the files."""
    known = robots()
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in SUFFIXES or not path.is_file():
            continue
        key = path.stem
        if key in known:
            yield known[key], path
        else:
            reason = "not in the survey's table of robots"
            yield Robot(key, key, "", "", False, reason, "", "", ""), path
