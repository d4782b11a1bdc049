"""The constraints and the cost of a set-up, of many configurations at once.

[CRANE] eqs. (17), (21) and (25) for any robot with a needle in any scene. Clearances
count with their certified lower bound, so a cost is never told too good.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import NO, Queries, queries
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.setup.mechanics import efforts, twists
from borecheck.setup.requirements import Requirements

Array = NDArray[np.float64]

# What can stand against a configuration, in the order it is asked.
NOTHING, NO_ANSWER, LIMITS, TORQUE, OBSTACLES, PATIENT, ITSELF, CONE = range(8)
NAMES = (
    *("nothing", "kinematics", "joint limits", "torque", "scanner and couch"),
    *("patient", "robot itself", "cone"),
)
# Farther away than this nothing more is gained, [m]: a term of the cost stays finite
# where there is nothing to be near to.
FAR = 1.0


@dataclass(frozen=True, eq=False)
class Costs:
    """The cost of configurations (n,) and what it is made of.

    Attributes:
        total: f of eq. (25).
        manipulability: mu.
        scanner: Distance of the robot to the scanner, lower bound, [m].
        patient: Of the robot without its insertion mechanism to the patient, likewise.
        motion: Way from home, metres and radians together.
    """

    total: Array
    manipulability: Array
    scanner: Array
    patient: Array
    motion: Array


class Terms:
    """What is asked of configurations of one robot in one scene.

    Args:
        robot: A robot with a needle that has a tip.
        scene: Where it stands.
        asked: The requirements.

    Raises:
        UsageError: No needle, or an obstacle of guessed unit.
        UnknownNameError: A pair that is excluded is not there.
    """

    def __init__(self, robot: Robot, scene: Scene, asked: Requirements) -> None:
        self.robot, self.scene, self.asked = robot, scene, asked
        self.needle = robot.needle_with_tip()
        self.efforts = efforts(robot)
        if scene.doubt is not None:
            raise UsageError(scene.doubt)

    @cached_property
    def mechanism(self) -> frozenset[str]:
        """Links that the insertion joint moves, and the needle."""
        return mechanism(self.robot)

    @cached_property
    def padded(self) -> Queries:
        """Asks of contact, and of obstacles nearer than the padding."""
        asked = self.asked
        skip = [*self._into_patient, *asked.excluded]
        return queries(self.robot, self.scene, asked.padding, skip=skip)

    @cached_property
    def _bare(self) -> Queries:
        """Asks of contact alone, what is excluded from the padding with it."""
        return queries(self.robot, self.scene, skip=self._into_patient)

    @cached_property
    def _to_scanner(self) -> Queries:
        return self._towards(("scanner", "other"), frozenset())

    @cached_property
    def _to_patient(self) -> Queries:
        return self._towards(("patient",), self.mechanism)

    def _towards(self, roles: Collection[str], without: Collection[str]) -> Queries:
        """Asks of distances to obstacles of these roles, without some links."""
        skip = [
            (part.link, obstacle.name)
            for part in self.robot.parts
            for obstacle in self.scene.obstacles
            if part.link in without or obstacle.role not in roles
        ]
        return queries(self.robot, self.scene, skip=skip, itself=False, solids=False)

    @cached_property
    def _into_patient(self) -> list[tuple[str, str]]:
        patients = [o.name for o in self.scene.obstacles if o.role == "patient"]
        return [(self.needle.link, name) for name in patients]

    @cached_property
    def _answer_of_pair(self) -> NDArray[np.int8]:
        """What the contact of each pair of `padded` stands for."""
        role = {o.name: o.role for o in self.scene.obstacles}
        asked = self.padded
        found = [
            PATIENT if role[other] == "patient" else OBSTACLES
            for _, other in asked.pairs[: asked.with_obstacles]
        ]
        found += [ITSELF] * (len(asked.pairs) - asked.with_obstacles)
        return np.array([*found, NOTHING], np.int8)

    def broken(self, qs: Array) -> NDArray[np.int8]:
        """The first constraint that stands against each configuration, (n,).

        The cone is not asked here. Rows that are not finite are `NO_ANSWER`.
        """
        codes = np.full(len(qs), NO_ANSWER, np.int8)
        there = np.flatnonzero(np.isfinite(qs).all(axis=1))
        if not len(there):
            return codes
        given = np.ascontiguousarray(qs[there])
        found = np.zeros(len(there), np.int8)
        found[self.robot.model.beyond_limits(given)] = LIMITS
        for ask in (self._torques, self._contacts):
            rows = np.flatnonzero(found == NOTHING)
            if len(rows):
                found[rows] = ask(given[rows])
        codes[there] = found
        return codes

    def _torques(self, qs: Array) -> NDArray[np.int8]:
        beyond = (self.torques(qs) > self.efforts).any(axis=1)
        return np.where(beyond, TORQUE, NOTHING).astype(np.int8)

    def _contacts(self, qs: Array) -> NDArray[np.int8]:
        rows = self.padded.touching_pair(qs)
        found = np.asarray(self._answer_of_pair[rows])
        if self.asked.excluded:
            free = np.flatnonzero(found == NOTHING)
            touch = self._bare.touches(qs[free]) if len(free) else np.zeros(0, bool)
            found[free[touch]] = OBSTACLES
        return found

    def stand_without(self, qs: Array, moved: Collection[str]) -> NDArray[np.bool_]:
        """Whether something stands against configurations without some links, (n,).

        Args:
            qs: Configurations, (n, joints), within the limits.
            moved: Links that are left out of the question.
        """
        links = {part.link for part in self.robot.parts}
        left_out = links & set(moved)
        skip = [(a, o.name) for a in left_out for o in self.scene.obstacles]
        skip += [(a, b) for a in left_out for b in links if a != b]
        skip += [*self._into_patient, *self.asked.excluded]
        asked = queries(self.robot, self.scene, self.asked.padding, skip=skip)
        return np.asarray(asked.touches(qs) | (self._torques(qs) == TORQUE))

    def torques(self, qs: Array) -> Array:
        """What the needle's forces ask of every joint, (n, joints), [Nm] or [N]."""
        return twists(self.robot, qs).torques(self.asked.force, self.asked.moment)

    def keeps_padding(self, q: Array) -> bool:
        """Whether q (joints,) is shown to keep the padding, excluded pairs left out."""
        return bool(self.padded.nearer_than(q[None], self.asked.padding)[0] == NO)

    def costs(self, qs: Array, within: float = 0.1) -> Costs:
        """The cost of configurations (n, joints) within the limits.

        Args:
            qs: Configurations.
            within: Relative width of clearances that is good enough.
        """
        mu = twists(self.robot, qs).manipulability
        scanner = self._room(self._to_scanner, qs, within)
        patient = self._room(self._to_patient, qs, within)
        motion = np.linalg.norm(qs - self.robot.home, axis=1)
        w = self.asked.weights
        total = w.motion * motion - w.dexterity * mu
        total = total - w.scanner * scanner - w.patient * patient
        return Costs(total, mu, scanner, patient, motion)

    def without_scanner(self, qs: Array) -> Array:
        """The cost without its dearest term, the distance to the scanner, (n,)."""
        w = self.asked.weights
        motion = np.linalg.norm(qs - self.robot.home, axis=1)
        mu = twists(self.robot, qs).manipulability
        room = self._room(self._to_patient, qs, 0.1)
        return w.motion * motion - w.dexterity * mu - w.patient * room

    @staticmethod
    def _room(asked: Queries, qs: Array, within: float) -> Array:
        if not len(qs) or not asked.with_obstacles:
            return np.full(len(qs), FAR)
        return np.minimum(asked.clearance(qs, within)[:, 0], FAR)


def mechanism(robot: Robot) -> frozenset[str]:
    """Links that a robot's insertion joint moves, and its needle.

    Raises:
        UnknownNameError: The insertion joint is not there.
    """
    needle = robot.needle_with_tip()
    if needle.insertion is None:
        return frozenset((needle.link,))
    return links_moved_by(robot, needle.insertion) | {needle.link}


def links_moved_by(robot: Robot, name: str) -> frozenset[str]:
    """Links that a joint moves, and those that mimic joints of it move.

    Raises:
        UnknownNameError: There is no such joint.
    """
    if name not in robot.model.joint_names:
        raise UnknownNameError("joint", name, robot.model.joint_names)
    index = robot.model.joint_names.index(name)
    below: dict[str, list[str]] = {}
    driven = []
    for joint in robot.model.tree.joints:
        below.setdefault(joint.parent, []).append(joint.child)
        if robot.model.driver(joint.name, joint.type)[0] == index:
            driven.append(joint.child)
    moved: set[str] = set()
    while driven:
        link = driven.pop()
        moved.add(link)
        driven += below.get(link, ())
    return frozenset(moved)
