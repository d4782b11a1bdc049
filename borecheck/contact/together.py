"""All pairs of a pose in a few compiled calls: the quick road of `contact.check`.

It answers what the pair-by-pair road of `contact.examine`, `contact.containment` and
`contact.clearance` answers, for the usual settings; tests hold them together field by
field. Where a solid may hold another, the pair-by-pair road is asked for the reason.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.contact import containment
from borecheck.contact.clearance import closest_of
from borecheck.contact.decision import Findings
from borecheck.contact.examine import note
from borecheck.contact.pose_batch import PoseBatch, prepared
from borecheck.contact.settings import Settings
from borecheck.contact.verdict import Closest, Containment, pairs_of
from borecheck.geometry.surfaces import Found, surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.plans.corridor import Corridor
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def is_usual(chosen: Settings, corridor: Corridor | None) -> bool:
    """Whether the quick road can answer: no corridor, our own tests, nothing grown."""
    return (
        corridor is None
        and chosen.pruning == "bvh"
        and chosen.checker != "coal"
        and not chosen.margin.enlarges
        and not chosen.link_clearance
    )


@dataclass(frozen=True, eq=False)
class Together:
    """A pose of a robot in a scene.

    Attributes:
        robot: The robot.
        scene: The scene.
        batch: Both, packed.
        placements: T_scene_link of every link.
        posed: Those of the parts, as kernels take them, (1, parts, 4, 4).
    """

    robot: Robot
    scene: Scene
    batch: PoseBatch
    placements: dict[str, Array]
    posed: Array

    @classmethod
    def of(cls, robot: Robot, scene: Scene, placements: dict[str, Array]) -> "Together":
        """The pose with these placements."""
        posed = np.array([[placements[part.link] for part in robot.parts]])
        return cls(robot, scene, prepared(robot, scene), placements, posed)

    def examine(self, checker: str, around: Findings, within: Findings) -> None:
        """Asks every pair of surfaces, of obstacles and of the robot itself."""
        parts = [part.mesh.name for part in self.robot.parts]
        others = [obstacle.name for obstacle in self.scene.obstacles]
        self._gather(self.batch.obstacles, checker, around, parts, others)
        self._gather(self.batch.itself, checker, within, parts, parts)

    def _gather(
        self,
        moving: MovingLinks,
        checker: str,
        findings: Findings,
        names: list[str],
        other_names: list[str],
    ) -> None:
        rows, examined = moving.contacts_counted(self.posed, checker)
        findings.examined += examined
        findings.total += moving.triangle_pairs
        if len(rows) == 0:
            return
        borders = np.flatnonzero(np.diff(rows[:, 1])) + 1
        for of_pair in np.split(rows, borders):
            a, b = moving.pairs[of_pair[0, 1]].tolist()
            pairs = np.ascontiguousarray(of_pair[:, 2:])
            own, T_a = surface(self.robot.parts[a].mesh), self.posed[0, a]
            if moving is self.batch.itself:
                other, T_b = surface(self.robot.parts[b].mesh), self.posed[0, b]
            else:
                other, T_b = surface(self.scene.obstacles[b].mesh), np.eye(4)
            certain = np.zeros(len(pairs), dtype=bool)
            found = Found(pairs, certain, len(pairs))
            note(findings, found, ~certain, own, T_a, other, T_b)
            findings.contacts += pairs_of(names[a], other_names[b], pairs)

    def held_around(self, *, unseen: bool) -> list[Containment]:
        """As `containment.of_obstacles`; `unseen`: the checker has blind spots."""
        among = self.batch.may_hold(self.posed, unseen=unseen)
        if not among:
            return []
        robot, scene, placed = self.robot, self.scene, self.placements
        return containment.of_obstacles(robot, scene, placed, among=among)

    def held_within(self, *, unseen: bool) -> list[Containment]:
        """As `containment.of_itself`."""
        among = self.batch.may_hold(self.posed, itself=True, unseen=unseen)
        if not among:
            return []
        return containment.of_itself(self.robot, self.placements, among)

    def closest(self) -> Closest | None:
        """As `clearance.to_obstacles`; of pairs at equal distance maybe another one."""
        row, found = self.batch.obstacles.closest(self.posed)
        if found is None:
            return None
        a, b = self.batch.obstacles.pairs[row].tolist()
        part, obstacle = self.robot.parts[a], self.scene.obstacles[b]
        return closest_of(part, obstacle, found)
