"""Numbers of a description that no robot has: refused before anything is made of them."""

from __future__ import annotations

from draft.description.description import Description, Joint, Link
from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem
from draft.imports.reduce import Body
from draft.spec.tree import MAX_DEPTH

# The longest arms are a few metres: beyond these the file is in other units, or damaged.
FURTHEST = 10.0
HEAVIEST = 1e5
MOST_INERTIA = 1e7
LISTED = 2


def check(description: Description) -> list[Problem]:
    """Refuse distances, masses and inertias that cannot be, and note links that weigh nothing.

    Raises:
        DescriptionError: something is far too long or heavy; the message names the line.
    """
    for joint in description.joints.values():
        _check_joint(joint)
    for link in description.links.values():
        _check_link(link)
    return _weightless(description)


def check_depth(root: Body) -> None:
    """Refuse a chain of more joints than a spec has links in series.

    Raises:
        DescriptionError: a limb is too long; the message names the first joint beyond.
    """
    depths = {root: 0}
    for body in root.all()[1:]:
        assert body.parent is not None
        depths[body] = depth = depths[body.parent] + 1
        # The housing of a limb's first drive is a link too.
        if depth >= MAX_DEPTH and body.joint is not None:
            cause = f"joint '{body.joint.name}' is the {depth}th in series: a spec has at most "
            cause += f"{MAX_DEPTH - 1}"
            remedy = "hold some of them: make them fixed in the file"
            raise DescriptionError(Problem(cause, body.joint.where, remedy))


def _check_joint(joint: Joint) -> None:
    far = max(map(abs, (*joint.position, *joint.anchor)))
    if far > FURTHEST:
        _refuse(f"joint '{joint.name}' lies {far:g} m from its parent", joint.where)


def _check_link(link: Link) -> None:
    body = link.inertial
    if body is not None:
        far = max(map(abs, body.com))
        most = max(abs(x) for row in body.inertia for x in row)
        if body.mass > HEAVIEST:
            cause = f"link '{link.name}' weighs {body.mass:g} kg"
            raise DescriptionError(Problem(cause, link.where, f"at most {HEAVIEST:g} kg"))
        if far > FURTHEST:
            _refuse(f"the centre of mass of link '{link.name}' lies {far:g} m from it", link.where)
        if not most <= MOST_INERTIA:
            cause = f"link '{link.name}' has an inertia of {most:g} kg m2"
            raise DescriptionError(Problem(cause, link.where, f"at most {MOST_INERTIA:g} kg m2"))
    for shape in link.geometries:
        far = max(map(abs, (*shape.position, *shape.size)))
        if far > FURTHEST:
            _refuse(f"a shape of link '{link.name}' is {far:g} m long or away", link.where)


def _refuse(cause: str, where: Location) -> None:
    remedy = f"lengths are in metres, at most {FURTHEST:g} m"
    raise DescriptionError(Problem(cause, where, remedy))


def _weightless(description: Description) -> list[Problem]:
    """Note links that move and have a mass of zero."""
    moved = {joint.child for joint in description.moving}
    found = [
        link
        for link in description.links.values()
        if link.name in moved and link.inertial is not None and link.inertial.mass == 0
    ]
    remedy = "Draft predicts masses: it is not used"
    notes = [
        Problem(f"link '{link.name}' moves and weighs 0 kg", link.where, remedy)
        for link in found[:LISTED]
    ]
    if len(found) > LISTED:
        cause = f"{len(found) - LISTED} more links move and weigh 0 kg"
        notes.append(Problem(cause, found[LISTED].where))
    return notes
