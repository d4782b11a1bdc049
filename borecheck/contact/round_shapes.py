"""Contact of round shapes: said only where polyhedra within the shapes touch as well.

Surfaces are searched as polyhedra round the shapes, so `clear` is true of the shapes.
What they say is contact is asked again of the polyhedra within the shapes, which is
true of the shapes too. Between the two stands `unknown`, with the width of that band.
"""

from collections.abc import Callable
from dataclasses import replace

from borecheck.contact.verdict import UNKNOWN, Verdict
from borecheck.core.once import once_per_pair
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene


def confirmed(
    around: Verdict, robot: Robot, scene: Scene, examine: Callable[..., Verdict]
) -> Verdict:
    """The verdict for the shapes, from that for the polyhedra round them.

    Args:
        around: What was found of those.
        robot: The robot.
        scene: The scene.
        examine: Gives the verdict for surfaces as they are, of robot and scene.
    """
    if not around.contact or is_sure(around, robot, scene):
        return around
    shapes = within(robot, scene)
    if shapes is None:
        return around
    return between(around, examine(*shapes), robot, scene)


@once_per_pair
def within(robot: Robot, scene: Scene) -> tuple[Robot, Scene] | None:
    """Robot and scene of polyhedra within the round shapes; None: there are none."""
    meshes = [*(p.mesh for p in robot.parts), *(o.mesh for o in scene.obstacles)]
    if all(mesh.inner is mesh for mesh in meshes):
        return None
    parts = tuple(replace(part, mesh=part.mesh.inner) for part in robot.parts)
    obstacles = tuple(replace(o, mesh=o.mesh.inner) for o in scene.obstacles)
    return replace(robot, parts=parts), replace(scene, obstacles=obstacles)


def is_sure(around: Verdict, robot: Robot, scene: Scene) -> bool:
    """Whether a verdict of contact rests on a pair of which neither is round."""
    parts = {part.mesh.name: part.mesh.excess for part in robot.parts}
    obstacles = {o.name: o.mesh.excess for o in scene.obstacles}
    pairs = [(p.link, p.obstacle, obstacles) for p in around.contacts]
    pairs += [(p.link, p.obstacle, parts) for p in around.self_contacts]
    pairs += [
        (c.link, c.obstacle, parts if c.role == "self" else obstacles)
        for c in around.contained
        if c.state != UNKNOWN
    ]
    return any(parts[a] == others[b] == 0.0 for a, b, others in pairs)


def between(around: Verdict, inside: Verdict, robot: Robot, scene: Scene) -> Verdict:
    """The verdict where polyhedra round the shapes touch.

    Args:
        around: Of those; it is contact.
        inside: Of the polyhedra within the shapes.
        robot: The robot, with its shapes.
        scene: The scene.
    """
    if inside.contact:
        return around
    closest = around.closest
    if closest is None and inside.closest is not None:
        closest = replace(inside.closest, distance=0.0)
    return replace(
        around,
        verdict=UNKNOWN,
        reason=_reason(around, robot, scene),
        qualifiers=(),
        clearance_m=None if closest is None else closest.distance,
        closest=closest,
        contacts=(),
        self_contacts=(),
        contained=inside.contained,
    )


def _reason(around: Verdict, robot: Robot, scene: Scene) -> str:
    """Which pair, how wide the band is, and whose."""
    first, second, is_self = _pair(around)
    excess = {part.mesh.name: part.mesh.excess for part in robot.parts}
    others = excess if is_self else {o.name: o.mesh.excess for o in scene.obstacles}
    widths = {first: excess[first], second: others[second]}
    known = " and ".join(
        f"{name} is round and known to {1e3 * width:.3f} mm"
        for name, width in widths.items()
        if width > 0.0
    )
    more = "apart"
    if around.margin_m > 0.0 and not is_self:
        more = f"more than the margin of {1e3 * around.margin_m:g} mm apart"
    width = excess[first] + others[second]
    return f"{first} and {second}: 0 to {1e3 * width:.3f} mm {more}; {known}"


def _pair(around: Verdict) -> tuple[str, str, bool]:
    """The first pair said to be in contact, and whether both are parts of the robot."""
    if around.contacts:
        return around.contacts[0].link, around.contacts[0].obstacle, False
    if around.self_contacts:
        return around.self_contacts[0].link, around.self_contacts[0].obstacle, True
    if around.contained:
        held = around.contained[0]
        return held.link, held.obstacle, held.role == "self"
    assert around.closest is not None  # what a part grew to holds the obstacle
    return around.closest.link, around.closest.obstacle, False
