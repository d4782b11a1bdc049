"""What must hold besides for a cell to be clear: nothing in another, nothing in doubt.

Solids. In cells that hang together, at all their stations, no surface of the robot
meets another. What is outside a solid in one of their poses is therefore outside in
all: one pose of every region answers for it.
"""

from dataclasses import replace

import numpy as np

from borecheck.contact.containment import of_itself, of_obstacles
from borecheck.contact.verdict import UNKNOWN
from borecheck.directions.grid import Grid
from borecheck.directions.leaves import (
    IS_CLEAR,
    IS_CONTACT,
    IS_UNDECIDED,
    Cause,
    Causes,
    Leaves,
)
from borecheck.directions.setup import MapSetup
from borecheck.motion.joint_box import pairs_that_may_meet


def settled(setup: MapSetup, leaves: Leaves, causes: Causes) -> Leaves:
    """The cells with what `refine` does not look at."""
    clear = leaves.state == IS_CLEAR
    state, cause = leaves.state.copy(), leaves.cause.copy()
    doubt = _doubt(setup)
    if doubt is not None:
        state[clear] = IS_UNDECIDED
        cause[clear] = causes.number(doubt)
        return replace(leaves, state=state, cause=cause)
    for region in Grid(leaves, setup.limits).regions(IS_CLEAR):
        found = _held(setup, leaves, int(region[0]))
        if found is not None:
            state[region] = found[0]
            cause[region] = causes.number(found[1])
    return replace(leaves, state=state, cause=cause)


def _doubt(setup: MapSetup) -> Cause | None:
    """Why nothing may be called clear in any direction."""
    robot = setup.robot
    if setup.scene.doubt is not None:
        return Cause("scene", (), setup.scene.doubt)
    for obstacle in setup.scene.obstacles:
        if obstacle.assumed is not None:
            # whether what is assumed is nearest is not asked of cells
            text = f"{obstacle.assumed.reason}: assumed, not seen; ask check --plan"
            return Cause("scene", (), text)
    may_meet = pairs_that_may_meet(robot)
    if may_meet:
        first, second = (robot.parts[k].mesh.name for k in may_meet[0])
        text = f"{first} and {second} are not proven apart over the joints' limits"
        return Cause("pair", (first, second), text)
    return None


def _held(setup: MapSetup, leaves: Leaves, cell: int) -> tuple[int, Cause] | None:
    """What holds what in a cell, and whether that is certain."""
    robot, scene = setup.robot, setup.scene
    station = leaves.depth[cell, 1] + 0.5 * setup.asked.standoff
    own = setup.chart.own(leaves.centre[cell : cell + 1], np.array([station]))
    placements = robot.placements(setup.chart.in_urdf(own)[0])
    corridor = [
        (part.mesh.name, obstacle.name)
        for part in robot.parts
        for obstacle in scene.obstacles
        if robot.may_enter(part.link, obstacle.role)
    ]
    found = of_obstacles(robot, scene, placements, corridor)
    found += of_itself(robot, placements)
    for held in found:
        cause = Cause("pair", (held.link, held.obstacle), held.reason)
        if held.state != UNKNOWN:
            return IS_CONTACT, cause
    return (IS_UNDECIDED, cause) if found else None
