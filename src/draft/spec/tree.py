"""Expansion of tree.yaml into a flat list of bodies: chains, prefixes and mirrors.

No number is evaluated here. Copies of a chain share one `Link`, so that its numbers are evaluated
once and left and right cannot differ; a body adds its name, its parent and the signs of its mirror
planes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from draft.errors import Location, Problem, SpecError, suggest
from draft.spec import schema
from draft.spec.expressions import Triple, parse
from draft.spec.field_types import Model
from draft.spec.links import Joint, Link, read_link
from draft.spec.primitives.base import Written, compile_part, read_triple
from draft.spec.primitives.basic import CoupledJoint
from draft.spec.primitives.fixed import FixedBase, PedestalPart
from draft.spec.primitives.root import Trunk
from draft.spec.primitives.wheel import WheelJoint
from draft.spec.reader import Path_, Source

Signs = tuple[float, float, float]

MAX_BODIES = 500
MAX_DEPTH = 200  # bodies from the trunk to a tip
MAX_NESTING = 64  # chains inside chains
UNMIRRORED: Signs = (1.0, 1.0, 1.0)
MIRRORS: dict[str | None, Signs] = {
    None: UNMIRRORED,
    "x": (-1.0, 1.0, 1.0),
    "y": (1.0, -1.0, 1.0),
    "xy": (-1.0, -1.0, 1.0),
}


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Frame of a link in that of its parent, as written; shared like a `Link`."""

    at: Triple | None
    rpy: Triple | None


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """One body of the expanded tree.

    Attributes:
        name: unique name, prefix included.
        prefix: prefix of the names of its joint and sites.
        parent: index of its parent among the bodies; None for the trunk or a fixed base.
        link: the link it is a copy of.
        placement: its frame in that of the parent, before mirroring.
        signs: product of the signs of the mirrors above it, per axis.
    """

    name: str
    prefix: str
    parent: int | None
    link: Link
    placement: Placement
    signs: Signs


@dataclass(frozen=True, slots=True)
class _Changes:
    """Changes of joints in one use of a chain, and their place."""

    path: Path_
    table: Mapping[str, schema.JointChange]


def expand(file: schema.TreeFile, source: Source) -> tuple[Body, ...]:
    """Expand a tree into bodies in depth-first order; the trunk or the fixed base is body 0.

    Raises:
        SpecError: a chain does not exist or contains itself, or the tree is too large or too deep.
    """
    return _Expander(file, source).run()


class _Expander:
    def __init__(self, file: schema.TreeFile, source: Source) -> None:
        self.file = file
        self.source = source
        self.bodies: list[Body] = []
        self.depths: list[int] = [0]
        self.links: dict[Path_, Link] = {}
        self.changed: dict[tuple[Path_, Path_], Link] = {}
        self.uses: dict[tuple[str, str], Location] = {}
        self.placements: dict[Path_, Placement] = {}

    def run(self) -> tuple[Body, ...]:
        root, path = self.file.tree, ("tree",)
        end_type: type[PedestalPart] | None = None
        end: Written[Model] | None = None
        placement, shape = Placement(None, None), None
        if isinstance(root, Trunk) and root.shape is not None:
            shape = compile_part(root.shape, (*path, "shape"), self.source)
        if isinstance(root, FixedBase):
            placement = self.placement(root, path)
            if root.pedestal is not None:
                end_type = PedestalPart
                end = compile_part(root.pedestal, (*path, end_type.key), self.source)
        where = self.source.at((*path, "name"))
        link = Link(root.name, None, None, None, None, end_type, end, where, shape)
        self.bodies.append(Body(root.name, "", None, link, placement, UNMIRRORED))
        for i, child in enumerate(root.children):
            self.node(child, ("tree", "children", i), 0, "", UNMIRRORED, ())
        return tuple(self.bodies)

    def node(
        self,
        node: schema.Node,
        path: Path_,
        parent: int,
        prefix: str,
        signs: Signs,
        open_chains: tuple[str, ...],
        placement: Placement | None = None,
        changes: _Changes | None = None,
    ) -> int:
        """Add a link or a chain with all below it; return the index of its last link."""
        if isinstance(node, schema.ChainUse):
            return self.chain(node, path, parent, prefix, signs, open_chains, placement)
        self.check_size(path, parent)
        link = self.links.get(path)
        if link is None:
            link = self.links[path] = read_link(node, path, self.source)
        if changes is not None and link.joint is not None and link.joint.name in changes.table:
            link = self.change(link, path, changes)
        own = _over(placement, self.placement(node, path))
        index = len(self.bodies)
        self.depths.append(self.depths[parent] + 1)
        self.bodies.append(Body(prefix + node.name, prefix, parent, link, own, signs))
        for i, child in enumerate(node.children):
            below = (*path, "children", i)
            self.node(child, below, index, prefix, signs, open_chains, changes=changes)
        return index

    def check_size(self, path: Path_, parent: int) -> None:
        """Refuse a tree that is too large or too deep."""
        where = self.source.at(path)
        if len(self.bodies) >= MAX_BODIES:
            raise SpecError(Problem(f"more than {MAX_BODIES} bodies", where, "use fewer chains"))
        if self.depths[parent] >= MAX_DEPTH:
            cause = f"more than {MAX_DEPTH} links in series"
            raise SpecError(Problem(cause, where, "attach some of them to the root of the tree"))

    def change(self, link: Link, path: Path_, changes: _Changes) -> Link:
        """Link with its joint changed for one use of its chain."""
        known = self.changed.get((path, changes.path))
        if known is None:
            known = replace(link, joint=_changed_joint(link.joint, changes, self.source))
            self.changed[path, changes.path] = known
        return known

    def chain(
        self,
        use: schema.ChainUse,
        path: Path_,
        parent: int,
        prefix: str,
        signs: Signs,
        open_chains: tuple[str, ...],
        placement: Placement | None,
    ) -> int:
        where = self.source.at((*path, "chain"))
        self.check_chain(use.chain, open_chains, where)
        prefix += use.prefix
        other = self.uses.setdefault((use.chain, prefix), where)
        if other is not where:
            raise SpecError(
                Problem(
                    f"chain '{use.chain}' is used twice with prefix '{prefix}'",
                    where,
                    f"the other use is at {other}; give each its own 'prefix'",
                )
            )
        mirror = MIRRORS[use.mirror]
        signs = (signs[0] * mirror[0], signs[1] * mirror[1], signs[2] * mirror[2])
        placement = _over(placement, self.placement(use, path))
        changes = _Changes((*path, "joints"), use.joints) if use.joints else None
        if changes is not None:
            self.refuse_unknown(use, changes)
        for i, item in enumerate(self.file.chains[use.chain]):
            parent = self.node(
                item,
                ("chains", use.chain, i),
                parent,
                prefix,
                signs,
                (*open_chains, use.chain),
                placement if i == 0 else None,
                changes,
            )
        return parent

    def check_chain(self, name: str, open_chains: tuple[str, ...], where: Location) -> None:
        """Refuse a chain that does not exist, contains itself, or is nested too deeply."""
        if name not in self.file.chains:
            remedy = suggest(name, self.file.chains, "chains")
            raise SpecError(Problem(f"there is no chain '{name}'", where, remedy))
        if name in open_chains:
            loop = " -> ".join((*open_chains, name))
            raise SpecError(
                Problem(f"a chain contains itself: {loop}", where, "remove one of these uses")
            )
        if len(open_chains) >= MAX_NESTING:
            cause = f"more than {MAX_NESTING} nested chains"
            raise SpecError(Problem(cause, where, "list some of their links directly"))

    def refuse_unknown(self, use: schema.ChainUse, changes: _Changes) -> None:
        """Refuse changes of joints that the chain does not have."""
        known = set(_joint_names(self.file.chains[use.chain]))
        for name in use.joints:
            if name not in known:
                where = self.source.at((*changes.path, name), key=True)
                cause = f"chain '{use.chain}' has no joint '{name}' to change"
                raise SpecError(Problem(cause, where, suggest(name, known, "joints")))

    def placement(self, node: schema.Node | FixedBase, path: Path_) -> Placement:
        known = self.placements.get(path)
        if known is None:
            at, rpy = (
                None if value is None else read_triple(value, (*path, key), self.source)
                for key, value in (("at", node.at), ("rpy", node.rpy))
            )
            known = self.placements[path] = Placement(at, rpy)
        return known


def _over(outer: Placement | None, inner: Placement) -> Placement:
    """Placement of the use of a chain; what it omits, its first link states."""
    if outer is None or (outer.at is None and outer.rpy is None):
        return inner
    return Placement(
        outer.at if outer.at is not None else inner.at,
        outer.rpy if outer.rpy is not None else inner.rpy,
    )


def _joint_names(nodes: Sequence[schema.Node]) -> list[str]:
    """Names of the joints of a chain, without those of chains inside it."""
    names: list[str] = []
    for node in nodes:
        if not isinstance(node, schema.ChainUse):
            names += [node.joint.name] if node.joint is not None else []
            names += _joint_names(node.children)
    return names


def _changed_joint(joint: Joint | None, changes: _Changes, source: Source) -> Joint | None:
    """Joint with the range, home position and axis of one use of its chain.

    Raises:
        SpecError: the range or home of a joint is to change that has none: that of a wheel, or one
            that follows another.
    """
    if joint is None:
        return None
    change, path = changes.table[joint.name], (*changes.path, joint.name)
    if joint.range is None and (turned := change.model_fields_set - {"reverse"}):
        key = min(turned)
        where = source.at((*path, key), key=True)
        kind, remedies = "of a wheel", WheelJoint.absent
        if joint.follows is not None:
            kind, remedies = f"follows '{joint.follows.joint}' and", CoupledJoint.absent
        cause = f"joint '{joint.name}' {kind} has no '{key}' to change"
        raise SpecError(Problem(cause, where, remedies[key]))
    if change.range is not None:
        low, high = (
            parse(value, source.at((*path, "range", i))) for i, value in enumerate(change.range)
        )
        joint = replace(joint, range=(low, high))
    if change.home is not None:
        joint = replace(joint, home=parse(change.home, source.at((*path, "home"))))
    if change.reverse:
        x, y, z = (parse(f"-({e.text})", e.where) for e in joint.axis)
        joint = replace(joint, axis=(x, y, z))
    return joint
