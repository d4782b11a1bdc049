"""Links that are joined: they need not be kept from touching each other."""

from collections.abc import Collection, Mapping

from borecheck.robots.model import RobotModel


class Joined:
    """Which links of a robot are of one rigid body, or neighbours in the chain.

    Neighbours are bodies with no body with geometry between them.

    Args:
        model: The robot's links and joints.
        shaped: Links with geometry.
    """

    def __init__(self, model: RobotModel, shaped: Collection[str]) -> None:
        self._body = rigid_bodies(model)
        with_geometry = {self._body[link] for link in shaped}
        self._neighbours = neighbours(model, self._body, with_geometry)

    def holds(self, links: frozenset[str]) -> bool:
        """Whether two links are joined so."""
        bodies = frozenset(self._body[link] for link in links)
        return len(bodies) == 1 or bodies in self._neighbours


def rigid_bodies(model: RobotModel) -> dict[str, str]:
    """For every link the topmost link it is fixed to."""
    fixed_to = {j.child: j.parent for j in model.tree.joints if j.type == "fixed"}
    bodies = {}
    for link in model.link_names:
        top = link
        while top in fixed_to:
            top = fixed_to[top]
        bodies[link] = top
    return bodies


def neighbours(
    model: RobotModel, body: Mapping[str, str], with_geometry: set[str]
) -> set[frozenset[str]]:
    """Pairs of bodies with no other body with geometry between them in the chain."""
    parent = {
        body[joint.child]: body[joint.parent]
        for joint in model.tree.joints
        if joint.type != "fixed"
    }
    pairs = set()
    for start in with_geometry:
        above = parent.get(start)
        while above is not None and above not in with_geometry:
            above = parent.get(above)
        if above is not None:
            pairs.add(frozenset((start, above)))
    return pairs
