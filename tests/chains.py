"""Chains of one joint, from which motions are made whose answer is known by hand."""

import numpy as np

from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import SLIDES, TURNS


def chain_of_one(kind: int, axis: tuple[float, float, float]) -> JointChain:
    """A joint through the world's origin, which takes its number as it is."""
    return JointChain(
        parent=np.array([-1]),
        origin=np.eye(4)[None],
        kind=np.array([kind]),
        axis=np.array([axis]),
        source=np.array([0]),
        factor=np.ones(1),
        offset=np.zeros(1),
    )


def slider(axis: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> JointChain:
    """It slides, along x unless said."""
    return chain_of_one(SLIDES, axis)


def hinge() -> JointChain:
    """It turns about z."""
    return chain_of_one(TURNS, (0.0, 0.0, 1.0))
