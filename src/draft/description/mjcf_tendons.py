"""Fixed tendons of an MJCF model with an actuator: the joints that one drive moves together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from draft.description.description import Joint
from draft.description.xmlfile import Element


def pulled(
    root: Element, joints: Mapping[str, Joint], forces: Mapping[str, float]
) -> dict[str, Joint]:
    """Joints, with those that a tendon moves: the first has the drive, the others follow it.

    A tendon of length sum c q that is pulled by a force F turns a joint by F c. Joints that nothing
    else couples are taken to move in proportion to their coefficients, the least motion for a
    length. The torque of the drive at its joint is then F |sum c r|, r the ratios to that joint.

    Args:
        root: the model.
        joints: its joints, with those that equalities couple.
        forces: largest force of each tendon that has an actuator [N or N m].
    """
    found = dict(joints)
    for section in root.all("tendon"):
        for tendon in section.all("fixed"):
            force = forces.get(tendon.attributes.get("name", ""))
            members = {
                one.attributes.get("joint", ""): one.number("coef", 1.0)
                for one in tendon.all("joint")
            }
            members = {name: c for name, c in members.items() if name in found and c}
            free = [name for name in members if not found[name].mimics]
            if force is None or not free:
                continue
            first, *others = free
            ratios = {first: 1.0}
            for name in others:
                ratio = members[name] / members[first]
                found[name] = replace(found[name], mimics=first, ratio=ratio, offset=0.0)
            for name in members:
                if found[name].mimics == first:
                    ratios[name] = found[name].ratio
            gain = sum(c * ratios.get(name, 0.0) for name, c in members.items())
            found[first] = replace(found[first], effort=force * abs(gain), driven=True)
    return found
