"""Where a needle is plainly clear of its patient, as any other part must be.

On its way a needle passes beside the patient, and is not near the corridor's line at
all. There it is asked what every part is asked: whether it stays farther away than the
margin, and neither holds the other. Only where that is not shown its corridor matters.
"""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.containment import held_at, left_of_path

if TYPE_CHECKING:
    from borecheck.motion.problem import Motion, Pair
    from borecheck.robots.kinematics.chain import JointChain

Stretch = tuple[float, float]


def not_beside(
    chain: "JointChain", pair: "Pair", motion: "Motion", rows: NDArray[np.float64]
) -> list[Stretch]:
    """Stretches in which a needle is not shown to be plainly clear, in order.

    Args:
        chain: The robot's joints.
        pair: Needle and patient.
        motion: The whole motion.
        rows: Where the surfaces may come as near as the margin: (begin, end, ...),
            times in waypoints.

    Returns:
        (begin, end) in waypoints; all of the motion where a surface is open, which has
        no inside.
    """
    span = len(motion.theta) - 1.0
    if not (pair.moving.topology.is_closed and pair.standing.topology.is_closed):
        return [(0.0, span)]
    near = [(float(row[0]), float(row[1])) for row in rows]
    clear = [
        stretch
        for stretch in left_of_path(near, span)
        if held_at(chain, pair, motion, stretch[0]).kind == "none"
    ]
    return left_of_path(clear, span)
