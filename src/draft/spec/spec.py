"""The Spec: the files of a robot, typed and checked, with every expression compiled once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from draft.errors import Location, counted
from draft.files import Readable
from draft.lazy import verb
from draft.spec.expressions import Expression
from draft.spec.primitives.base import Written
from draft.spec.primitives.mesh import Mesh
from draft.spec.primitives.root import WrittenRoot
from draft.spec.primitives.shape import Shape
from draft.spec.tree import Body

if TYPE_CHECKING:
    from draft.design import Design
    from draft.design.law_errors import LawErrors
    from draft.values import Value


@dataclass(frozen=True, slots=True)
class Parameter:
    """A declared number: its default or expression, unit, bounds and description."""

    name: str
    value: Expression
    unit: str
    bounds: tuple[float, float] | None
    doc: str
    where: Location


@dataclass(frozen=True, slots=True)
class ActuatorClass:
    """An actuator class, with its stated quantities by name; `by_trend` names those to predict.

    `kind` is None for that of `like`, else "module".
    """

    name: str
    doc: str
    like: str | None
    stated: Mapping[str, Expression]
    where: Location
    like_where: Location
    by_trend: frozenset[str] = frozenset()
    kind: str | None = None
    shape: Written[Shape] | None = None


@dataclass(frozen=True, slots=True)
class NamedDesign:
    """A named design: values by name, with the places of keys and values in its file."""

    name: str
    doc: str
    values: Mapping[str, float | str | None]
    keys: Mapping[str, Location] = field(repr=False)
    places: Mapping[str, Location] = field(repr=False)


@dataclass(frozen=True, eq=False, repr=False)
class Spec:
    """A robot as written: three files and its named designs, with no number resolved.

        >>> spec = draft.load("quadruped")
        >>> list(spec.designs), spec.parameters["thigh_length"].unit
        (['bear', 'cheetah', 'giraffe'], 'm')
        >>> spec.resolve("bear", {"thigh_length": 0.35})
        Design('quadruped:bear_custom', 112 kg, 12 joints, accepted)

    Attributes:
        name: name of the robot.
        folder: where it was read from; None if it was made of files in memory.
        files: the files that determine its designs, by name: the three, and the laws, the table and
            the parts that they name.
        population: "humanoid" or "quadruped", the population whose structure trends apply.
        trends: actuator laws: "draft", "paper" or a coefficients file.
        structure: structure trends of the shipped survey, with the trunk by the law "calibrated"
            or "paper"; or a coefficients file.
        catalogue: table of modules besides the shipped ones; None without.
        parameters: declared numbers by name, in the order of the file.
        actuators: actuator classes by name.
        bodies: the expanded tree, depth first; body 0 is the trunk.
        root: the loft of the trunk; None for a fixed base.
        designs: named designs.
        allow: errors of the design filter to accept as warnings, with their places.
        payload: index of the body that is a payload on the trunk; None without one.
        battery: stated energy [Wh] and mass [kg] of the battery, by name.
        electronics_power: stated power of computers, sensors and idle drives [W].
        meshes: parts of one's own, by file and unit.
    """

    name: str
    doc: str
    folder: Path | None
    files: Mapping[str, Readable]
    population: str
    trends: str | Readable
    structure: str | Readable
    catalogue: Readable | None
    parameters: Mapping[str, Parameter]
    actuators: Mapping[str, ActuatorClass]
    bodies: tuple[Body, ...]
    root: WrittenRoot | None
    designs: Mapping[str, NamedDesign]
    allow: Mapping[str, Location]
    payload: int | None = None
    battery: Mapping[str, Expression] = field(default_factory=dict)
    electronics_power: Expression | None = None
    meshes: Mapping[tuple[str, str | None], Mesh] = field(default_factory=dict)

    @classmethod
    def parse(cls, files: Mapping[str, str | bytes | Mapping[str, object]]) -> Spec:
        """Make a robot of files in memory; nothing is written.

            >>> box = [{"at": x, "rectangle": [0.2, 0.1]} for x in (-0.2, 0.2)]
            >>> numbers = {"parameters": {}, "actuators": {}}
            >>> draft.Spec.parse({
            ...     "parameters.yaml": {"name": "crate", "population": "quadruped", **numbers},
            ...     "tree.yaml": "tree: {name: trunk, type: root}",
            ...     "root.yaml": {"axis": "x", "sections": box},
            ... })
            Spec('crate', 0 parameters, 0 actuator classes, 0 joints, 0 named designs)

        Args:
            files: texts, or mappings of plain data, by the name that each has in a robot's folder:
                `parameters.yaml`, `tree.yaml`, `root.yaml` unless the base is fixed, any
                `designs/NAME.yaml`, the laws and the table that `parameters.yaml` names, and parts.

        Raises:
            SpecError: listing every problem found, each with the name of its file and its line and
                column; in a mapping, with the keys that lead to it.
        """
        from draft.spec.load import from_files

        return from_files(files)

    @property
    def floating(self) -> bool:
        """Whether its base floats; else it is bolted to the world."""
        return self.root is not None

    @property
    def origin(self) -> str:
        """Name of the folder that it was read from; its own name without one."""
        return self.folder.name if self.folder else self.name

    def __repr__(self) -> str:
        joints = sum(body.link.joint is not None for body in self.bodies)
        counts = {
            "parameter": len(self.parameters),
            "actuator class": len(self.actuators),
            "joint": joints,
            "named design": len(self.designs),
        }
        return f"Spec('{self.name}', {', '.join(counted(n, what) for what, n in counts.items())})"

    @verb
    def resolve(
        self,
        values: Mapping[str, Value | str | None] | str | Path | None = None,
        more: Mapping[str, Value | str | None] | None = None,
        *,
        errors: LawErrors | None = None,
        judge: bool = True,
    ) -> Design:
        """Evaluate every number: size actuators, weigh links, run the design filter.

        Args:
            values: a number, an expression, an array of shape (N,) or None by parameter
                (`thigh_length`) or actuator quantity (`actuators.leg.peak_torque`), in the unit of
                that number; or the name of a named design; or a design file. An expression may
                read the number that it replaces: `"1.2*thigh_length"`, or `"*1.2"`. `payload` [kg]
                puts a block on the trunk, see `draft.spec.payload`.
            more: further values, which override those, and may refer to them.
            errors: errors of the laws, see `draft.design.law_errors`; None for none.
            judge: whether to run the design filter, which takes most of the time. A design that is
                not judged has no findings, and is for its numbers alone.

        Returns:
            The design; with arrays, N designs of this topology at once.

        Raises:
            ResolveError: a name is unknown, a value is out of bounds, or an expression has no
                value.
            SpecError: the design file cannot be read.
        """
        from draft.design import resolve
        from draft.spec.load import read_design
        from draft.spec.payload import with_payload
        from draft.spec.relative import merged

        places: Mapping[str, Location] = {}
        if isinstance(values, (str, Path)):
            named = read_design(self, values)
            table: dict[str, Value | str | None] = dict(named.values)
            places = named.places
            label = f"{named.name}_custom" if more else named.name
        else:
            table = dict(values or {})
            label = "custom" if table or more else "default"
        if more:
            table = merged(table, more)
        spec = with_payload(self, table)
        return resolve(spec, table, label=label, places=places, errors=errors, judge=judge)
