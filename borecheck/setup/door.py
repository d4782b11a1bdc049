"""The Python door: `bc.setup(robot, scene, plans)`."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from borecheck.plans.needle_plan import NeedlePlan
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.setup.answer import Setup
from borecheck.setup.proven import MOST_BOXES
from borecheck.setup.requirements import Requirements, requirements
from borecheck.setup.solve import GAP, setups


def setup(
    robot: Robot,
    scene: Scene,
    plans: str | Path | NeedlePlan | Iterable[NeedlePlan],
    *,
    margin: float | str = Requirements.padding,
    force: float = Requirements.force,
    moment: float = Requirements.moment,
    cone: float = Requirements.cone,
    depth: float | str | None = None,
    weights: Mapping[str, float] | None = None,
    excluded: Iterable[tuple[str, str]] = (),
    solver: str | None = None,
    gap: float = GAP,
    boxes: int = MOST_BOXES,
) -> tuple[Setup, ...]:
    """The best configuration for each needle plan, or that there is none.

    Args:
        robot: From `load_robot`, with a needle that has a tip.
        scene: From `load_scene`.
        plans: A file of plans, a plan, or several.
        margin: Distance kept from obstacles, [m] or "10mm".
        force: Along the needle that the joints must hold, [N].
        moment: On the needle about any axis, [Nm].
        cone: How far the needle can be tilted to all sides, [rad]; 0: not at all.
        depth: How far the insertion joint must reach; default: as deep as the plan.
        weights: Of the cost: dexterity, scanner, patient, motion.
        excluded: Pairs of link and obstacle that need not keep the margin.
        solver: Of a redundant arm with a closed form: "grid" or "proven".
        gap: Of `proven`: how much cheaper another configuration may be.
        boxes: Of `proven`: how many are looked at before it is given up.

    Raises:
        UsageError: No needle, a number that is none, an obstacle of guessed unit.
        UnknownNameError: No such solver, link or obstacle.
        PlanError: The file of plans cannot be used.
    """
    pairs = tuple(excluded)
    asked = requirements(margin, force, moment, cone, depth, weights, pairs)
    return setups(robot, scene, plans, asked, solver, gap=gap, most_boxes=boxes)
