"""Pairs that are asked when some are left out by name."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Names = tuple[str, str]


def pairs_without(
    robot: Robot, scene: Scene, skip: Sequence[Names], itself: bool
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of part and obstacle, and of parts, that are to be asked, (p, 2) each.

    Args:
        robot: The robot.
        scene: The scene.
        skip: Pairs of names to leave out: links, parts or obstacles.
        itself: Whether parts are asked against parts at all.

    Raises:
        UsageError, UnknownNameError: What is to be left out is no pair that is there.
    """
    parts = [(part.link, part.mesh.name) for part in robot.parts]
    others = [(obstacle.name,) for obstacle in scene.obstacles]
    known = {name for names in (*parts, *others) for name in names}
    for pair in skip:
        if isinstance(pair, str) or len(pair) != 2:
            raise UsageError(f"skip holds {pair!r}, not a pair of names")
        for name in pair:
            if name not in known:
                raise UnknownNameError("link or obstacle", name, sorted(known))
        if all((name,) in others for name in pair):
            raise UsageError(f"skip holds {pair!r}: two obstacles are never asked")

    def is_asked(a: tuple[str, ...], b: tuple[str, ...]) -> bool:
        return not any((x in a and y in b) or (y in a and x in b) for x, y in skip)

    against = [
        (i, j)
        for i, part in enumerate(parts)
        for j, other in enumerate(others)
        if is_asked(part, other)
    ]
    among = [(i, j) for i, j in robot.self_pairs if is_asked(parts[i], parts[j])]
    return (
        np.array(against, np.int64).reshape(-1, 2),
        np.array(among if itself else [], np.int64).reshape(-1, 2),
    )
