"""What a map is asked of: chart, skin, parts and obstacles, requirements."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_pair
from borecheck.directions.chart import Chart
from borecheck.directions.skin import Skin
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True)
class Requirements:
    """What a direction must keep; lengths in [m], angles in [rad].

    Attributes:
        margin: Clearance to obstacles.
        target_error: Every target so near must be reached so.
        standoff: Length of the approach before the skin.
        max_depth: Longest way in the patient, or infinite.
        max_obliquity: Largest angle between needle and inward normal, or infinite.
        resolution: Cells are not split below it.
    """

    margin: float = 0.0
    target_error: float = 0.0
    standoff: float = 0.05
    max_depth: float = np.inf
    max_obliquity: float = np.inf
    resolution: float = np.radians(1.0)


@dataclass(frozen=True, eq=False)
class MapSetup:
    """Robot, scene and target as the refinement sees them.

    Attributes:
        chart: The robot's directions about the target.
        scene: What stands around it.
        asked: What a direction must keep.
        box: Lower and upper ends of the coordinates that are asked, (2, 2), [rad]; the
            whole chart by default.
    """

    chart: Chart
    scene: Scene
    asked: Requirements
    box: Array | None = None

    @property
    def limits(self) -> Array:
        """Lower and upper ends of the coordinates that are asked, (2, 2), [rad]."""
        return self.chart.limits if self.box is None else self.box

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.chart.robot

    @cached_property
    def skin(self) -> Skin:
        """The patient's surfaces as the target sees them."""
        patients = [o.mesh for o in self.scene.obstacles if o.role == "patient"]
        return Skin(
            self.chart.target, patients, self.needle_radius, self.asked.target_error
        )

    @cached_property
    def needle_radius(self) -> float:
        """Largest distance of the needle's triangles from its axis, [m]."""
        needle = self.robot.needle_with_tip()
        T = self.robot.placements(self.robot.home)
        axis = T[needle.tip or ""][:3, :3] @ needle.axis
        origin = T[needle.tip or ""][:3, 3]
        widest = 0.0
        for part in self.robot.parts:
            if part.link == needle.link:
                at = part.mesh.vertices @ T[part.link][:3, :3].T + T[part.link][:3, 3]
                aside = np.linalg.norm(np.cross(at - origin, axis), axis=1)
                widest = max(widest, float(aside.max()))
        return widest

    @cached_property
    def is_asked(self) -> NDArray[np.bool_]:
        """Which part against which obstacle; needle and patient have a corridor."""
        return np.array(
            [
                [
                    not self.robot.may_enter(part.link, obstacle.role)
                    for obstacle in self.scene.obstacles
                ]
                for part in self.robot.parts
            ],
            np.bool_,
        ).reshape(len(self.robot.parts), len(self.scene.obstacles))

    @cached_property
    def inserted(self) -> NDArray[np.bool_]:
        """Which parts the insertion joint moves, (parts,)."""
        links = [part.link for part in self.robot.parts]
        return np.array([self.chart.is_inserted(link) for link in links])

    @cached_property
    def boxes(self) -> Array:
        """Corners of every part's box in its link's frame, (parts, 8, 3)."""
        bounds = np.array([part.mesh.bounds for part in self.robot.parts])
        pick = np.array([(i >> 2 & 1, i >> 1 & 1, i & 1) for i in range(8)])
        return bounds[:, pick, np.arange(3)]

    @property
    def against(self) -> tuple[MovingLinks, ...]:
        """Each part against all obstacles."""
        return _against(self.robot, self.scene)


@once_per_pair
def _against(robot: Robot, scene: Scene) -> tuple[MovingLinks, ...]:
    others = PackedTrees([surface(o.mesh).tree for o in scene.obstacles])
    return tuple(
        MovingLinks.against(PackedTrees([surface(part.mesh).tree]), others)
        for part in robot.parts
    )
