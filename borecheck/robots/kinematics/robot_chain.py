"""The chain of a robot: the joints of its URDF from the root outwards."""

from collections import deque

import numpy as np

from borecheck.core.once import once_per_record
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS, WORLD
from borecheck.robots.robot import Robot
from borecheck.robots.urdf.tree import UrdfTree


@once_per_record
def chain_of(robot: Robot) -> tuple[dict[str, int], JointChain]:
    """Frame number of every link, and the chain; the root stands fixed in the scene."""
    model = robot.model
    order, frame_of = breadth_first(model.tree)
    joints = [model.tree.joints[index] for index in order]
    drivers = [model.driver(joint.name, joint.type) for joint in joints]
    kinds = {"fixed": FIXED, "prismatic": SLIDES}
    chain = JointChain(
        parent=np.array([WORLD, *(frame_of[joint.parent] for joint in joints)]),
        origin=np.array([robot.T_scene_root, *(joint.origin for joint in joints)]),
        kind=np.array([FIXED, *(kinds.get(joint.type, TURNS) for joint in joints)]),
        axis=np.array([(1.0, 0.0, 0.0), *(joint.axis for joint in joints)]),
        source=np.array([-1, *(source for source, _, _ in drivers)]),
        factor=np.array([1.0, *(factor for _, factor, _ in drivers)]),
        offset=np.array([0.0, *(offset for _, _, offset in drivers)]),
    )
    return frame_of, chain


def breadth_first(tree: UrdfTree) -> tuple[list[int], dict[str, int]]:
    """Joints from the root outwards, as rows of `tree.joints`; frames of all links.

    Frame 0 is the root, and the child of the k-th joint in this order has frame k + 1.
    """
    below: dict[str, list[int]] = {}
    for index, joint in enumerate(tree.joints):
        below.setdefault(joint.parent, []).append(index)
    order: list[int] = []
    frame_of = {tree.root.name: 0}
    waiting = deque([tree.root.name])
    while waiting:
        for index in below.get(waiting.popleft(), ()):
            child = tree.joints[index].child
            order.append(index)
            frame_of[child] = len(order)
            waiting.append(child)
    return order, frame_of
