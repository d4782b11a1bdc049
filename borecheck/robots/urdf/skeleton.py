"""A robot's joints and links as plain URDF text, for Pinocchio.

Pinocchio's parser prints to stderr about shapes it does not know (a capsule), refuses
colours, versions and white space that no placement depends on, and reads names that
are no names. It is handed what it is asked about: the joints, links called by number.
"""

from collections import defaultdict, deque
from collections.abc import Iterator, Sequence
from dataclasses import replace

from borecheck.robots.urdf.tree import Joint, UrdfTree

# Limits are borecheck's to keep, and Pinocchio's parser wants them.
_LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


def skeleton(tree: UrdfTree) -> str:
    """URDF text without shapes: link n of the tree is `l<n>`, joint n is `j<n>`.

    Numbers are written so that the same float64 is read again.
    """
    number = {link.name: index for index, link in enumerate(tree.links)}
    links = [f'<link name="l{index}"/>' for index in number.values()]
    joints = [
        _joint(index, joint, number[joint.parent], number[joint.child])
        for index, joint in enumerate(tree.joints)
    ]
    return "\n".join(('<robot name="r">', *links, *joints, "</robot>"))


def pieces(tree: UrdfTree, most: int) -> Iterator[UrdfTree]:
    """The tree in pieces of at most so many joints, those near the root first.

    Each is a tree whose root is a link of a piece before; a tree that is small enough
    is one piece, with its links and joints in the file's order.
    """
    if len(tree.joints) <= most:
        yield tree
        return
    link_of = {link.name: link for link in tree.links}
    below = defaultdict(list)
    for joint in tree.joints:
        below[joint.parent].append(joint)
    roots = deque([tree.root.name])
    while roots:
        root = roots.popleft()
        joints: list[Joint] = []
        near = deque(below.pop(root, []))
        while near and len(joints) < most:
            joints.append(near.popleft())
            near.extend(below.pop(joints[-1].child, []))
        for joint in near:
            below[joint.parent].append(joint)
        roots.extend(dict.fromkeys(joint.parent for joint in near))
        if joints:
            names = (root, *(joint.child for joint in joints))
            links = tuple(link_of[name] for name in names)
            yield replace(tree, links=links, joints=tuple(joints))


def _joint(index: int, joint: Joint, parent: int, child: int) -> str:
    return (
        f'<joint name="j{index}" type="{joint.type}">'
        f'<origin xyz="{_numbers(joint.xyz)}" rpy="{_numbers(joint.rpy)}"/>'
        f'<parent link="l{parent}"/><child link="l{child}"/>'
        f'<axis xyz="{_numbers(joint.axis.tolist())}"/>{_LIMIT}</joint>'
    )


def _numbers(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
