"""A vendor's robot and its twin: the same geometry, torques and speeds, masses by the trends.

Source: arXiv 2609.38405, twins; here with joint axes as they are.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from draft.description.segments import CLOSE
from draft.design import Design
from draft.design.references import DesignChoice, find_design
from draft.design.widened import ExpectedMass
from draft.errors import DraftError, Problem, counted, quoted
from draft.files import Content
from draft.fitting.structure.survey_refit import structure_trends
from draft.imports import names
from draft.imports.expected import expected_mass
from draft.imports.importer import DEFAULTS, Files, check_population, spec_of, translate
from draft.imports.notes import merged
from draft.imports.options import KneeDrive, Options
from draft.imports.reduce import Body, Reduced
from draft.imports.sources import find_source
from draft.laws.structure import USES, population, read_population
from draft.model import Model
from draft.spec import Spec
from draft.twins.causes import LARGE, MOVES, Cause, OtherKnees, causes, change
from draft.twins.dynamics import POSES, SEED, Errors, Machine, errors
from draft.twins.dynamics import poses as draw_poses
from draft.twins.links import Pair, pairs
from draft.twins.vendor import body_name, vendor_model
from draft.values import Array, brief, scalar

LISTED = 4
LEG_ROLES = ("hip", "knee", "ankle", "flexion", "wheel")


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Result of comparing a twin with the vendor's robot.

    Attributes:
        name: the description's file, without its ending.
        files: the import behind it.
        model: the twin, built.
        vendor: the vendor's robot as a MuJoCo model.
        joints: the twin's hinges by the vendor's names: those that both have.
        unmatched: hinges of the vendor that the twin does not have.
        links: rigid bodies side by side.
        inertia, gravity: errors of M(q) and g(q) over the poses.
        stance: height of the trunk's origin over the lowest point of the feet in the twin's home
            pose [m]: vendor's, nan where its description has no shapes, and twin's.
        causes: errors of M(q) by group of links, largest first; none where M(q) is within 40 %.
        other_knees: the twin with its knees' motors in their other place; None where that moves
            M(q) by 10 % or less.
    """

    name: str
    files: Files
    model: Model
    vendor: mujoco.MjModel
    joints: Mapping[str, str]
    unmatched: tuple[str, ...]
    links: tuple[Pair, ...]
    inertia: Errors
    gravity: Errors
    stance: tuple[float, float]
    causes: tuple[Cause, ...] = ()
    other_knees: OtherKnees | None = None

    def __repr__(self) -> str:
        theirs = "unknown" if self.unstated else f"{brief(self.vendor_mass)} kg"
        masses = f"twin {brief(self.design.mass)} kg, vendor {theirs}"
        return f"Comparison('{self.name}', {masses}, {counted(len(self.joints), 'joint')})"

    @property
    def design(self) -> Design:
        """The twin's numbers."""
        return self.model.design

    @property
    def population(self) -> str:
        """Population whose structure trends apply."""
        return self.design.spec.population

    @property
    def vendor_mass(self) -> float:
        """Total mass by the vendor [kg]; nan where the file does not state all of it."""
        return math.nan if self.unstated else self.files.reduced.description.mass

    @cached_property
    def unstated(self) -> tuple[str, ...]:
        """Bodies of which the vendor's file states no mass, or only a part of it."""
        return unstated(self.files.reduced)

    @cached_property
    def expected(self) -> ExpectedMass:
        """The twin's mass and its 90 % band [kg], wider where the import guessed."""
        return expected_mass(self.design, self.files)

    @property
    def mass_ratio(self) -> float:
        """The twin's total mass over the vendor's; nan where that is not known."""
        return scalar(self.design.mass) / self.vendor_mass

    def groups(self) -> dict[str, tuple[float, float]]:
        """Vendor's and twin's mass of each anatomical group [kg], trunk first.

        The vendor's is nan where the file does not state all of it.
        """
        found: dict[str, tuple[float, float]] = {}
        for pair in self.links:
            a, b = found.get(pair.group, (0.0, 0.0))
            theirs = math.nan if pair.name in self.unstated else pair.vendor.mass
            found[pair.group] = (a + theirs, b + pair.twin.mass)
        return found


def compare_twin(
    file: str | Path,
    spec: Spec | str | Path | None = None,
    *,
    population: str | None = None,
    without: Collection[str] = (),
    options: Options = DEFAULTS,
    poses: int = POSES,
    seed: int = SEED,
    key: str = "",
) -> Comparison:
    """Compare a vendor's robot with its twin: the same robot with masses predicted by Draft.

        >>> vendor = draft.export(draft.load("quadruped").resolve(), "vendor") / "robot.urdf"
        >>> found = draft.compare_twin(vendor, poses=10)
        >>> len(found.joints), found.unmatched
        (12, ())
        >>> 0.5 < found.mass_ratio < 2
        True

    Args:
        file: the vendor's URDF, MJCF or xacro file, or a robot's name; as `draft.import_robot`.
        spec: the twin's spec, or a reference to it or to one of its designs, as
            `draft.design.references.find_design` takes it; None for the spec that
            `draft.import_robot` makes.
        population: "humanoid" or "quadruped"; None for that of the spec, or as imported.
        without: keys of surveyed robots to hold out of the structure trends and of guesses.
        options: torques, speeds and other decisions that overrule the import's.
        poses: number of poses at which M(q) [kg m2] and g(q) [N m] are compared.
        seed: seed of the poses.
        key: key of the robot in the survey, whose rules for its joints then hold; "" for none.

    Returns:
        Masses [kg] of both robots, in all and by link, and the errors of M(q) and g(q).

    Raises:
        DraftError: the description or the spec cannot be used, they share no joint, or an argument
            is out of range.
    """
    check_population(population)
    check_poses(poses, seed)
    source = find_source(file)
    path = source.path
    own = None if spec is None else find_design(spec)
    if own is not None and own.spec.floating:  # One on a fixed base is no robot of a population.
        population = population or own.spec.population
    options = replace(options, without=frozenset((*options.without, *without)))
    files = translate(
        source, names.valid(source.name, "robot"), population, options=options, key=key
    )
    twin = own or DesignChoice(spec_of(files))
    joints, unmatched = _shared(files, twin.spec, path)
    _check_masses(files, path)
    model = resolve_without(twin, options.without).build()
    vendor = vendor_model(files.reduced.description, joints)
    pair = _machines(files, vendor, model, joints)
    q = draw_poses(*pair, poses, seed)
    inertia, gravity = errors(*pair, q)
    if unstated(files.reduced) or files.reduced.description.unplaced:
        inertia, gravity = Errors(np.full(poses, np.nan)), Errors(np.full(poses, np.nan))
    files.reduced.notes[:] = merged(files.reduced.notes)
    found = Comparison(
        name=source.name,
        files=files,
        model=model,
        vendor=vendor,
        joints=joints,
        unmatched=unmatched,
        links=tuple(pairs(files.reduced, vendor, model.mujoco, joints)),
        inertia=inertia,
        gravity=gravity,
        stance=_stance(files, vendor, model.design, joints),
    )
    large, known = inertia.median > LARGE, not math.isnan(inertia.median)
    return replace(
        found,
        causes=causes(found, pair[0], q) if large else (),
        other_knees=_other_knees(found, options, pair, q) if own is None and known else None,
    )


def _other_knees(
    found: Comparison, options: Options, pair: tuple[Machine, Machine], q: Array
) -> OtherKnees | None:
    """The twin with its knees' motors in their other place, where that moves M(q)."""
    files = found.files
    if files.population != "quadruped" or files.knees.place is None:
        return None
    place: KneeDrive = "knee" if files.knees.place == "hip" else "hip"
    other = replace(options, knee_drive=place)
    name = names.valid(files.source.name, "robot")
    changed = translate(files.source, name, files.population, options=other)
    model = resolve_without(DesignChoice(spec_of(changed)), options.without).build()
    machine = _machines(changed, found.vendor, model, found.joints)[1]
    moved = change(pair[1], machine, q)
    if moved <= MOVES:
        return None
    return OtherKnees(place, moved, *errors(pair[0], machine, q))


def check_poses(poses: int, seed: int) -> None:
    """Refuse a number of poses or a seed that is out of range.

    Raises:
        DraftError: it is.
    """
    if not 2 <= poses <= 100_000:
        raise DraftError(f"`poses` {poses} is not from 2 to 100000", "such as 300")
    if seed < 0:
        raise DraftError(f"`seed` {seed} is below 0", "such as 0")


def resolve_without(choice: DesignChoice, without: Collection[str]) -> Design:
    """Resolve a design by structure trends that have not seen some of the surveyed robots.

    Raises:
        DraftError: the survey has no such robot.
    """
    if not without:
        return choice.resolve()
    own = choice.spec.structure
    # With a file of its own, the spec is held out of the shipped survey all the same.
    of = choice.spec.population
    laws = population(of, own) if isinstance(own, str) else read_population(of, own)
    table = {USES: laws.uses, **_trends_without(frozenset(without), of)}
    file = Content(f"without_{len(without)}.json", json.dumps(table).encode())
    return replace(choice, spec=replace(choice.spec, structure=file)).resolve()


@lru_cache(maxsize=4)
def _trends_without(without: frozenset[str], population: str) -> dict[str, Any]:
    """Structure trends of a population without some robots; a twin with other knees asks again."""
    return structure_trends(without=without, of=(population,))


def _shared(files: Files, spec: Spec, path: Path) -> tuple[dict[str, str], tuple[str, ...]]:
    """Joints of the vendor that the spec has, and those that it has not."""
    own = {body.prefix + body.link.joint.name for body in spec.bodies if body.link.joint}
    joints = {theirs: ours for theirs, ours in files.joints.items() if ours in own}
    if not joints:
        cause = f"the spec '{spec.name}' has none of the joints of {path.name}"
        wanted = ", ".join(list(files.joints.values())[:4])
        raise DraftError(cause, f"a twin's joints are named {wanted}, ...")
    base = files.reduced.root
    while (below := _toward_base(base, files.reduced.description.root)) is not None:
        base = below
        name = base.joint.name if base.joint else ""
        if name not in joints:
            cause = f"the spec '{spec.name}' lacks '{files.joints.get(name, name)}', which lies "
            cause += "between the maker's base and the trunk"
            raise DraftError(cause, "name that joint as the import does")
    return joints, tuple(name for name in files.joints if name not in joints)


def _toward_base(body: Body, link: str) -> Body | None:
    """Child of a body on the way to a link that is below it; None at the link's own body."""
    for child in body.children:
        if any(link in one.links for one in child.all()):
            return child
    return None


def _check_masses(files: Files, path: Path) -> None:
    """Refuse a robot without masses, and note bodies of unknown mass.

    Raises:
        DraftError: the file states no mass.
    """
    reduced = files.reduced
    if reduced.description.mass <= 0:
        cause = f"{path.name} gives no masses: there is nothing to compare with"
        raise DraftError(cause, "import it, without a comparison")
    names = unstated(reduced)
    if names:
        links = "link" if len(names) == 1 else "links"
        cause = f"the maker's file states no mass for {len(names)} {links}, "
        cause += f"{quoted(names, LISTED)}: totals are not compared"
        where = reduced.description.links[names[0]].where
        remedy = "state them in a copy of the file, by <inertial>"
        reduced.notes.append(Problem(cause, where, remedy))


def unstated(reduced: Reduced) -> tuple[str, ...]:
    """Bodies of which the file states no mass, or only a part of it.

    Empty links between joints of one place, as of a universal joint, have none.
    """
    found: list[str] = []
    links = reduced.description.links
    for body in reduced.root.all():
        own = [links[name] for name in body.links]
        mass = sum(link.inertial.mass for link in own if link.inertial)
        empty = not any(link.geometries for link in own) and any(
            float(np.linalg.norm(child.anchor - body.anchor)) < CLOSE for child in body.children
        )
        if (mass <= 0 and not empty) or not reduced.description.unweighed.isdisjoint(body.links):
            found.append(body.name)
    return tuple(found)


def _machines(
    files: Files, vendor: Any, model: Model, joints: Mapping[str, str]
) -> tuple[Machine, Machine]:
    """Both robots with the vendor's base held still, upright as the vendor has it.

    Slides stay at zero: their entries are in kilograms and newtons, and would drown the hinges'.
    """
    reduced = files.reduced
    description = reduced.description
    base = 1
    for body in reduced.root.all()[1:]:
        if description.root in body.links and body.joint is not None:
            base = int(model.mujoco.jnt_bodyid[model.mujoco.joint(joints[body.joint.name]).id])
    upright = reduced.base[1]
    limits = {one.joint.name: one.limits for one in reduced.root.all() if one.joint}
    turning = {a: b for a, b in joints.items() if description.joints[a].type != "prismatic"}
    theirs = Machine(vendor, list(turning), 1, np.eye(3))
    theirs.limits = np.array([limits[name] for name in turning])
    return theirs, Machine(model.mujoco, list(turning.values()), base, upright)


def _stance(
    files: Files, vendor: Any, design: Design, joints: Mapping[str, str]
) -> tuple[float, float]:
    """Stance heights of vendor and twin [m]; see `Comparison.stance`."""
    reduced = files.reduced
    at, turn = reduced.base
    trunk = 1
    if reduced.description.root not in reduced.root.links:
        trunk = vendor.body(body_name(reduced.root.name)).id
    data = mujoco.MjData(vendor)
    data.qpos[3] = 1.0
    mujoco.mj_kinematics(vendor, data)
    offset = -turn.T @ at - data.xpos[trunk]
    for theirs, ours in joints.items():
        data.qpos[vendor.joint(theirs).qposadr] = design.joints[ours].home
    mujoco.mj_kinematics(vendor, data)
    axes = data.xmat[trunk].reshape(3, 3)
    origin, axes = data.xpos[trunk] + axes @ offset, axes @ turn.T
    heights: list[float] = []
    for body in reduced.root.all()[1:]:
        if body.children or body.joint is None or body.joint.name not in joints:
            continue
        points = files.shapes.points(body.links) if body.role in LEG_ROLES else ()
        if len(points):
            i = vendor.jnt_bodyid[vendor.joint(body.joint.name).id]
            # Bodies of the vendor's model have its base's axes at zero, shapes the trunk's.
            placed = data.xpos[i] + (points - body.anchor) @ turn @ data.xmat[i].reshape(3, 3).T
            heights.append(float(((placed - origin) @ axes)[:, 2].min()))
    lowest = min(heights) if heights else float("nan")
    return -lowest, scalar(design.lowest(home=True))
