"""The tree of an imported spec: chains of links, mirrored uses, motors where convention puts them.

All frames have the trunk's axes in the zero pose, so that no link is rotated and every joint's axis
is written as it stands in the vendor's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from draft.imports import ends, names
from draft.imports.anatomy import ROLLING, WHEEL, run
from draft.imports.attachments import Attachments, opposite, side_of
from draft.imports.bends import held_bends
from draft.imports.ends import FINGER, Node
from draft.imports.formatting import NAMED, Parameters, Record, along, direction, tidy, vector
from draft.imports.home import home_pose
from draft.imports.knees import Knees
from draft.imports.motors import Motor
from draft.imports.reduce import Body, Reduced
from draft.imports.shapes import Shapes
from draft.imports.symmetry import Copy, families, groups
from draft.imports.trunk import trunk_name
from draft.imports.volumes import Volumes
from draft.laws import structure
from draft.laws.catalogue import SERVO
from draft.values import Array

CHAINS = {
    "finger": "finger",
    "hip": "leg",
    "shoulder": "arm",
    "waist": "waist",
    "neck": "neck",
    "knee": "leg",
}
INSTEAD = {"ankle_link": "foot", "neck_link": "head", "knee_link": "shank", "elbow_link": "forearm"}
OTHER = "other"
BESIDE = 0.003  # What lies nearer to the axis of a hinge gives no direction [m].


@dataclass
class Tree:
    """Content of tree.yaml.

    Attributes:
        chains: links of every chain.
        children: what the trunk carries.
        joints: name of every joint in the built model, by the vendor's name.
        copies: number of limbs that have a counterpart.
    """

    chains: dict[str, list[Node]] = field(default_factory=dict)
    children: list[Node] = field(default_factory=list)
    joints: dict[str, str] = field(default_factory=dict)
    copies: int = 0


class Writer:
    """Turns a reduced robot into a `Tree`, naming its lengths on the way."""

    def __init__(
        self,
        reduced: Reduced,
        shapes: Shapes,
        population: str,
        knees: Knees,
        motors: Sequence[Motor],
        parameters: Parameters,
        volumes: Volumes,
        cranks: Mapping[str, str] | None = None,
        link_class: str = "",
    ) -> None:
        self.reduced, self.shapes, self.parameters = reduced, shapes, parameters
        self.population, self.knees, self.cranks = population, knees, cranks or {}
        self.volumes = volumes
        self.classes = {joint: motor.name for motor in motors for joint in motor.joints}
        self.servos = {joint for one in motors if one.kind == SERVO for joint in one.joints}
        self.known = set(structure.population(population).segments) - {OTHER}
        self.link_class = link_class  # of all links of a machine without legs; "" by their kinds
        self.links = names.Unique([trunk_name(reduced)])
        self.joint_names = names.Unique()
        self.chain_names = names.Unique()
        self.sites: set[str] = set()
        self.prefixes: list[str] = [""]
        self.followers: list[Node] = []
        self.tree = Tree()

    def write(self) -> Tree:
        """Write all limbs."""
        for body in self.reduced.root.all():
            own = FINGER if body.role == FINGER else self.link_class
            body.kind = own or INSTEAD.get(body.kind, body.kind)
        self.tree.children = self.uses(self.reduced.root)
        for follows in self.followers:  # of joints of other chains, which have full names
            follows["joint"] = self.tree.joints[str(follows["joint"])]
        return self.tree

    def uses(self, body: Body) -> list[Node]:
        """Chains that a body carries, each set of copies written once."""
        found: list[Node] = []
        for family in families(groups(body.children, self.classes, body.anchor)):
            found += self.family(family, body.anchor)
        return found

    def family(self, family: list[list[Copy]], origin: Array) -> list[Node]:
        """Write counterparts, such as two legs that are alike but for millimetres.

        Each has a chain of its own with its exact geometry; dimensions that are equal within the
        tolerance are one parameter.
        """
        ways = [run(copy.limb) for group in family for copy in group]
        prefixes, links, joints = self.names(ways)
        if len(ways) > 1:
            word = self.word(ways[0][0])
            links = self.distinct(prefixes, links, word, self.links)
            joints = self.distinct(prefixes, joints, word, self.joint_names)
        found: list[Node] = []
        records: list[Record] = []
        for group in family:
            own, prefixes = prefixes[: len(group)], prefixes[len(group) :]
            side = side_of(group, family, self.population == "quadruped")
            with self.parameters.chain(side, records) as record:
                found += self.group(group, origin, (own, links, joints), family, side)
            records.append(record)
        self.tree.copies += len(ways) - 1
        return found

    def word(self, first: Body) -> str:
        """Name of the chain that a body begins, without its side."""
        if self.population == "quadruped":
            return {"sensor": "limb", "arm": "arm", "spine": "spine"}.get(first.role, "leg")
        return CHAINS.get(first.role, "limb")

    @staticmethod
    def distinct(
        prefixes: Sequence[str], rests: Sequence[str], word: str, taken: names.Unique
    ) -> list[str]:
        """Names of a chain that no prefix turns into a name that another chain has."""
        found: list[str] = []
        for rest in rests:
            tried = (rest, f"{word}_{rest}", *(f"{word}_{rest}_{k}" for k in range(2, 1000)))
            name = next(
                one for one in tried if not any(prefix + one in taken.taken for prefix in prefixes)
            )
            taken.taken.update(prefix + name for prefix in prefixes)
            found.append(name)
        return found

    def group(
        self,
        group: list[Copy],
        origin: Array,
        named: tuple[list[str], list[str], list[str]],
        family: list[list[Copy]],
        side: str,
    ) -> list[Node]:
        """Write one chain and its uses."""
        first = group[0].limb
        ways = [run(copy.limb) for copy in group]
        prefixes, links, joints = named
        word = self.word(first)
        chain = self.chain_names(side + word)
        self.prefixes = prefixes
        nodes, homes = self.links_of(ways[0], links, joints)
        self.tree.chains[chain] = nodes
        label = word if len(family) > 1 else chain
        signs = opposite(first, family[0][0].limb, origin)
        attached = Attachments(self.parameters, label, origin)
        found: list[Node] = []
        for copy, way, prefix in zip(group, ways, prefixes, strict=True):
            use: Node = {"chain": chain}
            if prefix:
                use["prefix"] = prefix
            use["at"] = attached.at(copy, prefix, signs)
            if copy.mirror:
                use["mirror"] = copy.mirror
            changes = self.changes(copy, ways[0], way, joints, homes)
            if changes:
                use["joints"] = changes
            found.append(use)
            for body, name in zip(way, joints, strict=True):
                if body.joint is not None:
                    self.tree.joints[body.joint.name] = prefix + name
        return found

    def names(self, ways: list[list[Body]]) -> tuple[list[str], list[str], list[str]]:
        """Prefixes of copies, and names of a chain's links and joints."""
        links = [[body.name for body in way] for way in ways]
        joints = [[body.joint.name if body.joint else "" for body in way] for way in ways]
        if len(ways) == 1:
            return (
                [""],
                [self.links(names.valid(name)) for name in links[0]],
                [self.joint_names(names.valid(name)) for name in joints[0]],
            )
        cut = names.factor([[*a, *b] for a, b in zip(links, joints, strict=True)])
        if cut is not None:
            prefixes, rests = cut
            return prefixes, rests[: len(links[0])], rests[len(links[0]) :]
        by_joint = names.factor(joints)
        four = self.population == "quadruped"
        bodies = names.shared(links)
        if by_joint is not None:
            return by_joint[0], bodies, by_joint[1]
        unique = names.Unique()
        prefixes = [
            unique(names.side((1, 1, 1), list(way[-1].anchor), four)[:-1]) + "_" for way in ways
        ]
        own = names.Unique()
        rests = [own(name) for name in names.shared(joints)]
        return prefixes, bodies, rests

    def changes(
        self,
        copy: Copy,
        original: list[Body],
        way: list[Body],
        joints: Sequence[str],
        homes: Sequence[float],
    ) -> Node:
        """Changes of a copy to the joints of its chain."""
        found: Node = {}
        own = home_pose(way, copy.mirror in ("x", "xy"))
        for i, (a, b) in enumerate(zip(original, way, strict=True)):
            change: Node = {}
            if copy.reverse[i]:
                change["reverse"] = True
            fixed = a.role in ROLLING or a.coupled
            if not fixed and vector(a.limits, 4) != vector(b.limits, 4):
                change["range"] = vector(b.limits, 4)
            if not fixed and own[i] != homes[i]:
                change["home"] = own[i]
            if change:
                found[joints[i]] = change
        return found

    def links_of(
        self, way: list[Body], links: Sequence[str], joints: Sequence[str]
    ) -> tuple[list[Node], list[float]]:
        """Nodes of a chain, from the housing of its first motor, if it has one, to its end."""
        homes = home_pose(way)
        nodes: list[Node] = [self.housing(way[0], links[0])] if way[0].driven else []
        own = {body.joint.name: name for body, name in zip(way, joints, strict=True) if body.joint}
        for i, body in enumerate(way):
            node: Node = {"name": links[i]}
            if i and body.merged:
                node["at"] = vector(body.anchor - way[i - 1].anchor, self.parameters.digits)
            node["joint"] = self.joint(body, joints[i], homes[i], own)
            first = len(nodes)
            nodes.append(node)
            if i + 1 < len(way):
                self.middle(nodes, body, way[i + 1], links[i])
            else:
                node.update(self.end(body, links[i]))
            self.weigh(nodes[first:], body, links[i])
        return nodes, homes

    def weigh(self, nodes: Sequence[Node], body: Body, name: str) -> None:
        """State the structure's mass where a body's visible volume is too small for its length.

        The expression grows with the lengths of its members.
        """
        members = [one for one in (node.get("link") for node in nodes) if isinstance(one, dict)]
        mass = self.volumes.structure(body) if members else None
        if mass is None:
            return
        lengths = [str(member["length"]) for member in members]
        long = sum(self.parameters.value(length) for length in lengths)
        if mass >= float(
            structure.population(self.population).segments[str(members[0]["segment"])](long)
        ):
            return
        doc = f"Structure of '{name}' per metre, by its visible volume: it is slim."
        word = names.valid(name.removesuffix("_link"))
        each = self.parameters.add(f"{word}_per_metre", mass / long, doc, 3, "kg/m")
        for member, length in zip(members, lengths, strict=True):
            member["mass"] = f"{each} * {f'({length})' if ' ' in length else length}"

    def housing(self, body: Body, name: str) -> Node:
        """Link on the trunk with the motor of a limb's first hinge."""
        motor: Node = {"actuator": self.drive(body), "axis": direction(body.axis)}
        if body.role == "abduction":
            inward = -float(np.sign(body.anchor @ body.axis)) * body.axis
            motor["shift"] = along(inward, f"{self.drive(body)}.length / 2")
        return {"name": f"{name}_housing", "motor": motor | self.away(body)}

    def away(self, body: Body) -> Node:
        """Direction of the box of a servo that no member holds: away from what its hinge moves.

        Empty for a module, and where nothing beyond the hinge lies across its axis.
        """
        ways = (one.anchor - body.anchor for one in run(body))
        beyond = [way - (way @ body.axis) * body.axis for way in ways]
        far = [way for way in beyond if np.linalg.norm(way) > BESIDE]
        if not far or body.joint is None or body.joint.name not in self.servos:
            return {}
        nearest = min(NAMED, key=lambda named: float(far[-1] @ named))
        return {"long": NAMED[nearest]}

    def joint(self, body: Body, name: str, home: float, own: Mapping[str, str]) -> Node:
        """Joint of a link; `own`: names of the joints of its chain by those of the maker."""
        axis = direction(body.axis, self.reduced.digits + 1)
        if body.role in ROLLING:
            return {"name": name, "axis": axis, "actuator": self.drive(body)}
        joint: Node = {"name": name}
        if body.slides:
            joint["type"] = "slide"
        elif body.joint is not None and body.joint.limits is None and not body.coupled:
            joint["type"] = "continuous"
        if body.joint is not None and body.joint.mimics:
            leader, ratio = body.joint.mimics, tidy(body.joint.ratio, 6)
            follows: Node = {"joint": own.get(leader, leader), "ratio": ratio}
            if body.joint.offset:
                follows["offset"] = tidy(body.joint.offset, 6)
            if leader not in own:
                self.followers.append(follows)
            return joint | {"axis": axis, "follows": follows}
        joint |= {"axis": axis, "range": vector(body.limits, 4)}
        if not body.slides:
            joint["actuator"] = self.drive(body)
        if home:
            joint["home"] = home
        return joint

    def drive(self, body: Body) -> str:
        """Actuator class of a body's hinge."""
        return self.classes[body.joint.name if body.joint else ""]

    def middle(self, nodes: list[Node], body: Body, below: Body, name: str) -> None:
        """Add to the last node the member to the next joint, and that joint's motor."""
        node, way = nodes[-1], below.anchor - body.anchor
        if not below.driven:
            if below.slides or not below.merged:
                node["link"] = self.member(body, way, name)
            return
        bends = [] if body.slides else held_bends(self.reduced, body, below)
        motor: Node = {"actuator": self.drive(below), "axis": direction(below.axis)}
        if below.merged:
            if np.any(way):
                motor["shift"] = vector(way)
            node["motor"] = motor | self.away(below)
            return
        if below.role == "knee" and self.remote(body):
            motor["shift"] = along(self.inward(below), f"{self.drive(below)}.length / 2")
            node["motor"] = motor
            nodes.append({"name": f"{name}_beam", "at": [0.0, 0.0, 0.0]})
            self.members(nodes, body, (*bends, below.anchor), name)
            return
        if below.role == "flexion":
            room = f"{self.drive(below)}.length / 2"
            knee = below.children[0] if below.children else None
            if knee is not None and knee.role == "knee" and self.remote(below):
                room += f" + {self.drive(knee)}.length"
            motor["shift"] = along(self.inward(below), room)
        place = self.crank(body, below)
        if place is not None:
            motor["shift"] = vector(place - below.anchor)
        self.members(nodes, body, (*bends, below.anchor), name)
        nodes[-1]["motor"] = motor

    def crank(self, body: Body, below: Body) -> Array | None:
        """Hinge on a body of the crank that moves the next joint [m]; None for no crank there."""
        name = self.cranks.get(below.joint.name if below.joint is not None else "")
        joint = self.reduced.description.joints[name] if name is not None else None
        if joint is None or joint.parent not in body.links:
            return None
        at, turn = self.reduced.poses[joint.child]
        return at + turn @ np.array(joint.anchor)

    def members(self, nodes: list[Node], body: Body, points: Sequence[Array], name: str) -> None:
        """Add the members from a body's hinge through points, the first to the last node."""
        start = body.anchor
        for i, point in enumerate(points):
            word = f"{name}_bend{'' if i == 1 else f'_{i}'}" if i else name
            if i:
                nodes.append({"name": word})
            nodes[-1]["link"] = self.member(body, point - start, name, "_bend" if i else "")
            start = point

    def member(self, body: Body, way: Array, name: str, part: str = "") -> Node:
        """Structural member along a way, with a named length; `part`: ending of that name."""
        length = float(np.linalg.norm(way))
        repeated = (
            bool(self.link_class) or body.kind.endswith("_link") or body.kind not in self.known
        )
        word = names.valid(name.removesuffix("_link"))
        label = self.parameters.add(
            f"{word if repeated else body.kind}{part}_length",
            length,
            f"Length of '{name}', joint to joint{', beyond a joint that is held' if part else ''}.",
        )
        axis = direction(way / length, self.reduced.digits + 1)
        member: Node = {"axis": axis, "length": label}
        member["segment"] = body.kind if body.kind in self.known else OTHER
        return member

    def inward(self, body: Body) -> Array:
        """Unit vector along a hinge's axis, towards the robot's middle plane."""
        axis = body.axis
        return axis if float(axis[1] * body.anchor[1]) < 0 else -axis

    def remote(self, thigh: Body) -> bool:
        """Whether the knee of a thigh is driven from the hip."""
        return self.knees.place == "hip" and not thigh.slides

    def site(self) -> str:
        """Name of a foot's site that no copy of the chain shares with another's foot."""
        name, k = "foot", 2
        while any(prefix + name in self.sites for prefix in self.prefixes):
            name, k = f"foot_{k}", k + 1
        self.sites.update(prefix + name for prefix in self.prefixes)
        return name

    def end(self, body: Body, name: str) -> Node:
        """End of a chain's last link: limbs, a foot, a hand, a head or a wheel."""
        if body.children:
            ways = [child.anchor - body.anchor for child in body.children]
            middle = np.mean(ways, axis=0)
            if np.linalg.norm(middle) < 0.01:
                middle = max(ways, key=lambda way: float(np.linalg.norm(way)))
            # Where all begin at its own joint there is no member: the limbs' housings weigh.
            found: Node = {"link": self.member(body, middle, name)} if middle.any() else {}
            return found | {"children": self.uses(body)}  # type: ignore[dict-item]
        if body.role in ROLLING:
            site = self.site() if body.role == WHEEL else None
            return ends.wheel(body, site, self.shapes, self.parameters)
        if body.role == "ankle" and body.kind in self.known and self.population == "humanoid":
            return ends.plate_foot(body, self.site(), self.shapes, self.parameters)
        if body.role in ("knee", "hip", "ankle") and body.kind in self.known:
            return ends.sphere_foot(body, body.kind, self.site(), self.shapes, self.parameters)
        word = {"neck": "head", "finger": "tip"}.get(
            body.role, "hand" if body.role in ("wrist", "elbow") else "end"
        )
        node = ends.ball_end(body, word, self.shapes, self.parameters)
        member = node["link"]
        assert isinstance(member, dict)
        if body.kind not in self.known:
            member["segment"] = OTHER
        return node
