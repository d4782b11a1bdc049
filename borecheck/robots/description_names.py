"""Whether what a description names is in its URDF: links, joints, roles, the needle."""

from collections.abc import Iterator

import numpy as np

from borecheck.errors import UsageError
from borecheck.robots.description import (
    ROLES,
    Description,
    RobotDescription,
    ScannerDescription,
)
from borecheck.robots.description_fields import not_among
from borecheck.robots.model import RobotModel

_PARALLEL = 1e-6  # sine of the angle between insertion and needle


def check_names(description: Description, model: RobotModel) -> None:
    """Nothing, if every name is there.

    Raises:
        UsageError: The first that is not, with those that are.
    """
    kind = "robot" if isinstance(description, RobotDescription) else "scanner"
    for problem in _problems(description, model):
        raise UsageError(f"{kind} package {description.name}: {problem}")


def _problems(description: Description, model: RobotModel) -> Iterator[str]:
    links, joints = list(model.link_names), list(model.joint_names)
    for field, link in _links(description):
        if link not in links:
            yield not_among(field, link, "link of its URDF", links)
    for field, joint in _joints(description):
        if joint not in joints:
            yield not_among(field, joint, "free joint of its URDF", joints)
    if isinstance(description, RobotDescription):
        yield from _insertion(description, model)
    if isinstance(description, ScannerDescription):
        for body in model.tree.links:
            shaped = body.collisions or body.visuals
            if shaped and body.name not in description.roles:
                listed = ", ".join(ROLES)
                yield f"roles has no {body.name!r}, a link with geometry: {listed}"


def _links(description: Description) -> Iterator[tuple[str, str]]:
    if isinstance(description, RobotDescription):
        for field in ("needle_link", "tool_frame", "base_frame"):
            link = getattr(description, field)
            if link is not None:
                yield field, link
        for frame, link in description.frames.items():
            yield f"frames[{frame!r}]", link
        for one, other, _ in description.allowed_contacts:
            yield "allowed_contacts", one
            yield "allowed_contacts", other
    if isinstance(description, ScannerDescription):
        # a link may be there with another choice only: its role is then unused
        if not any(argument.choices for argument in description.arguments.values()):
            yield from (("roles", link) for link in description.roles)
        yield from (("points", link) for link in description.points)


def _joints(description: Description) -> Iterator[tuple[str, str]]:
    if isinstance(description, RobotDescription):
        yield from (("home", joint) for joint in description.home)
        yield from (("joints", joint.name) for joint in description.joints)
        if description.insertion_joint is not None:
            yield "insertion_joint", description.insertion_joint
    if isinstance(description, ScannerDescription):
        yield from (("joints", joint) for joint in description.joints)


def _insertion(description: RobotDescription, model: RobotModel) -> Iterator[str]:
    """The insertion joint drives the needle along itself."""
    name = description.insertion_joint
    if name is None:
        return
    joint = next(joint for joint in model.tree.joints if joint.name == name)
    if joint.type != "prismatic":
        yield f"insertion_joint {name!r} is {joint.type}, not prismatic"
    if description.tool_frame is not None:
        placed = model.placements(np.zeros(len(model.free_joints)))
        way = placed[joint.child][:3, :3] @ joint.axis
        needle = placed[description.tool_frame][:3, 2]
        aside = float(np.linalg.norm(np.cross(way, needle)))
        if aside > _PARALLEL:
            yield (
                f"insertion_joint {name!r} moves along {np.round(way, 6).tolist()}, "
                f"not along the needle, {np.round(needle, 6).tolist()}: z of "
                f"tool_frame {description.tool_frame!r}"
            )
