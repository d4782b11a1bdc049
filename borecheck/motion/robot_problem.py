"""Robot and scene as the certified search sees them: chain, bodies, pairs, passages.

`motion.search` knows frames and surfaces only. Here a robot's joints become its chain,
its parts and the scene's obstacles become bodies, and needle and patient become a
passage: they may touch within the plan's corridor, and nowhere else.
"""

from borecheck.contact.margin import check_size
from borecheck.core.once import once_per_pair
from borecheck.motion.problem import Body, Passage, PathProblem
from borecheck.plans.corridor import Corridor
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene


def path_problem(
    robot: Robot,
    scene: Scene,
    margin: float = 0.0,
    corridor: Corridor | None = None,
) -> PathProblem:
    """Robot and scene as the certified search sees them.

    With a corridor, needle and patient are a passage: they may touch in it alone.
    Without one the same robot and scene give the same problem: a planner asks for one
    edge after the other.

    Raises:
        UsageError: A margin that is none, or so large that its unit is mistaken.
    """
    check_size(margin)
    if corridor is None:
        return _usual_problem(robot, scene, margin)
    return _problem(robot, scene, margin, corridor)


@once_per_pair
def _usual_problem(robot: Robot, scene: Scene, margin: float) -> PathProblem:
    return _problem(robot, scene, margin, None)


def _problem(
    robot: Robot, scene: Scene, margin: float, corridor: Corridor | None
) -> PathProblem:
    frame_of, chain = chain_of(robot)
    parts = tuple(
        Body(part.mesh.name, part.mesh, frame_of[part.link]) for part in robot.parts
    )
    obstacles = tuple(Body(o.name, o.mesh, role=o.role) for o in scene.obstacles)
    passages = tuple(
        Passage(i, j, corridor)
        for i, part in enumerate(robot.parts)
        for j, obstacle in enumerate(scene.obstacles)
        if corridor is not None and robot.may_enter(part.link, obstacle.role)
    )
    return PathProblem(
        chain,
        parts,
        obstacles,
        robot.self_pairs,
        margin,
        passages=passages,
        allowed=_allowed(robot),
        doubt=scene.doubt,
    )


def _allowed(robot: Robot) -> tuple[tuple[int, int, str], ...]:
    """Pairs of parts whose links may touch, with reason and source."""
    reasons = {p.links: f"{p.reason} ({p.source})" for p in robot.allowed_contacts}
    links = [part.link for part in robot.parts]
    return tuple(
        (i, j, reasons[frozenset((links[i], links[j]))])
        for j in range(len(links))
        for i in range(j)
        if frozenset((links[i], links[j])) in reasons
    )


def left_out(problem: PathProblem) -> tuple[str, ...]:
    """The pairs that nothing was asked about."""
    return tuple(
        f"{problem.parts[i].name} and {problem.obstacles[j].name}: not examined"
        for i, j in sorted(problem.excluded)
    )
