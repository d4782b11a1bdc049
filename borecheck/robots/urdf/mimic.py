"""Mimic joints resolved down to the joints that are free, chains included."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple, Protocol

from borecheck.errors import UrdfError


class MimicLike(Protocol):
    """What stands in `<mimic joint multiplier offset>`."""

    @property
    def joint(self) -> str:
        """The joint that is followed."""

    @property
    def multiplier(self) -> float:
        """Factor on the followed joint's position."""

    @property
    def offset(self) -> float:
        """Added after the factor, [rad] or [m]."""


class JointLike(Protocol):
    """A joint as far as its mimic relation is concerned."""

    @property
    def name(self) -> str:
        """The joint's name."""

    @property
    def mimic(self) -> MimicLike | None:
        """What it follows, if anything."""


class Follow(NamedTuple):
    """position(joint) = multiplier * position(leader) + offset; the leader is free."""

    leader: str
    multiplier: float
    offset: float


class MimicProblem(NamedTuple):
    """Why a mimic relation has no meaning.

    `kind` is "self", "missing" or "cycle"; `names` is the road that was followed,
    beginning with the joint.
    """

    joint: str
    kind: str
    names: tuple[str, ...]

    @property
    def text(self) -> str:
        """One line that says what is wrong."""
        if self.kind == "self":
            return f"joint {self.joint!r} mimics itself"
        if self.kind == "missing":
            return f"{self.names[-2]!r} mimics {self.names[-1]!r}, which is no joint"
        return "mimic relations form a circle: " + " -> ".join(self.names)


def resolve(joints: Iterable[JointLike], file: str = "robot") -> dict[str, Follow]:
    """For every mimic joint its free leader, with factor and offset composed.

    Args:
        joints: All joints of the robot.
        file: Named in the error.

    Returns:
        `{joint: Follow(leader, multiplier, offset)}`, in the order of the joints;
        joints that mimic nothing are not in it.

    Raises:
        UrdfError: A joint mimics itself, a joint that does not exist, or a circle.
    """
    follows, problems = try_resolve(joints)
    if problems:
        element = f"robot/joint[@name={problems[0].joint!r}]/mimic"
        raise UrdfError(file, problems[0].text, element)
    return follows


def try_resolve(
    joints: Iterable[JointLike],
) -> tuple[dict[str, Follow], list[MimicProblem]]:
    """As `resolve`, with what is wrong as values: nothing is raised."""
    mimics = {joint.name: joint.mimic for joint in joints}
    follows: dict[str, Follow] = {}
    problems: list[MimicProblem] = []
    for name, mimic in mimics.items():
        if mimic is None:
            continue
        outcome = _follow(name, mimics)
        if isinstance(outcome, Follow):
            follows[name] = outcome
        else:
            problems.append(outcome)
    return follows, problems


def _follow(name: str, mimics: Mapping[str, MimicLike | None]) -> Follow | MimicProblem:
    multiplier, offset = 1.0, 0.0
    road, current = [name], name
    while (mimic := mimics[current]) is not None:
        offset += multiplier * mimic.offset
        multiplier *= mimic.multiplier
        current = mimic.joint
        road.append(current)
        if current not in mimics:
            return MimicProblem(name, "missing", tuple(road))
        if current in road[:-1]:
            kind = "self" if len(road) == 2 else "cycle"
            return MimicProblem(name, kind, tuple(road))
    return Follow(current, multiplier, offset)
