"""Contact of round shapes: said only where polyhedra within the shapes touch as well.

Surfaces are searched as polyhedra round the shapes, so `clear` is true of the shapes.
What they say is contact is asked again of the polyhedra within the shapes, which is
true of the shapes too. Between the two stands `unknown`, with the width of that band.
"""

from collections.abc import Callable
from dataclasses import replace

from borecheck.contact.decision import worse_of
from borecheck.contact.verdict import UNKNOWN, Answer, Verdict
from borecheck.core.once import once_per_pair
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene


def confirmed(
    around: Verdict, robot: Robot, scene: Scene, examine: Callable[..., Verdict]
) -> Verdict:
    """The verdict for the shapes, from that for the polyhedra round them.

    Obstacles and the robot itself are asked apart: a contact that is sure in one hides
    none that is not in the other.

    Args:
        around: What was found of those.
        robot: The robot.
        scene: The scene.
        examine: Gives the verdict for surfaces as they are, of robot and scene.
    """
    unsure = [
        own
        for own in (False, True)
        if _part_of(around, own).contact and not is_sure(around, robot, scene, own)
    ]
    shapes = within(robot, scene) if unsure else None
    if shapes is None:
        return around
    inside = examine(*shapes)
    for own in unsure:
        around = between(around, inside, robot, scene, own)
    return around


def _part_of(verdict: Verdict, own: bool) -> Answer:
    return verdict.itself if own else verdict.obstacles


@once_per_pair
def within(robot: Robot, scene: Scene) -> tuple[Robot, Scene] | None:
    """Robot and scene of polyhedra within the round shapes; None: there are none."""
    meshes = [*(p.mesh for p in robot.parts), *(o.mesh for o in scene.obstacles)]
    if all(mesh.inner is mesh for mesh in meshes):
        return None
    parts = tuple(replace(part, mesh=part.mesh.inner) for part in robot.parts)
    obstacles = tuple(replace(o, mesh=o.mesh.inner) for o in scene.obstacles)
    return replace(robot, parts=parts), replace(scene, obstacles=obstacles)


def is_sure(around: Verdict, robot: Robot, scene: Scene, own: bool) -> bool:
    """Whether contact rests on a pair of which neither is round.

    Args:
        around: The verdict.
        robot: The robot.
        scene: The scene.
        own: Of the robot with itself, not with obstacles.
    """
    parts = {part.mesh.name: part.mesh.excess for part in robot.parts}
    others = parts if own else {o.name: o.mesh.excess for o in scene.obstacles}
    touching = around.self_contacts if own else around.contacts
    pairs = [(pair.link, pair.obstacle) for pair in touching]
    pairs += [
        (c.link, c.obstacle)
        for c in around.contained
        if c.state != UNKNOWN and (c.role == "self") == own
    ]
    return any(parts[a] == others[b] == 0.0 for a, b in pairs)


def between(
    around: Verdict, inside: Verdict, robot: Robot, scene: Scene, own: bool
) -> Verdict:
    """The verdict where polyhedra round the shapes touch.

    Args:
        around: Of those; it is contact.
        inside: Of the polyhedra within the shapes.
        robot: The robot, with its shapes.
        scene: The scene.
        own: Whether the robot with itself is meant, or with obstacles.
    """
    if _part_of(inside, own).contact:
        return around
    answer = Answer(UNKNOWN, _reason(around, robot, scene, own))
    obstacles, itself = around.obstacles, around.itself
    closest = around.closest
    if own:
        itself = answer
    else:
        obstacles = answer
        if closest is None and inside.closest is not None:
            closest = replace(inside.closest, distance=0.0)
    whole = worse_of(obstacles, itself)
    return replace(
        around,
        verdict=whole.verdict,
        reason=whole.reason,
        qualifiers=whole.qualifiers,
        clearance_m=None if closest is None else closest.distance,
        closest=closest,
        contacts=around.contacts if own else (),
        self_contacts=() if own else around.self_contacts,
        contained=tuple(
            found
            for verdict, is_own in ((around, not own), (inside, own))
            for found in verdict.contained
            if (found.role == "self") == is_own
        ),
        obstacles=obstacles,
        itself=itself,
    )


def _reason(around: Verdict, robot: Robot, scene: Scene, own: bool) -> str:
    """Which pair, how wide the band is, and whose."""
    first, second = _pair(around, own)
    excess = {part.mesh.name: part.mesh.excess for part in robot.parts}
    others = excess if own else {o.name: o.mesh.excess for o in scene.obstacles}
    widths = {first: excess[first], second: others[second]}
    known = " and ".join(
        f"{name} is round and known to {1e3 * width:.3f} mm"
        for name, width in widths.items()
        if width > 0.0
    )
    more = "apart"
    if around.margin_m > 0.0 and not own:
        more = f"more than the margin of {1e3 * around.margin_m:g} mm apart"
    width = excess[first] + others[second]
    return f"{first} and {second}: 0 to {1e3 * width:.3f} mm {more}; {known}"


def _pair(around: Verdict, own: bool) -> tuple[str, str]:
    """The first pair said to be in contact."""
    touching = around.self_contacts if own else around.contacts
    if touching:
        return touching[0].link, touching[0].obstacle
    for held in around.contained:
        if (held.role == "self") == own:
            return held.link, held.obstacle
    assert around.closest is not None  # what a part grew to holds the obstacle
    return around.closest.link, around.closest.obstacle
