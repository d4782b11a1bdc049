"""What the live view holds and answers, without any window: robot, scene, plan, margin.

Two answers are given about a configuration: `glance` in a few milliseconds, which sees
surfaces meet and tells the clearance, and `judge`, the full check. Only the full check
ever says clear.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact import clearance
from borecheck.contact.check import check_with
from borecheck.contact.settings import Settings, settings
from borecheck.contact.verdict import CONTACT, Closest, TrianglePair, Verdict
from borecheck.motion.needle_motion import needle_motion
from borecheck.motion.samples import configurations_at
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_motion import PlanMotion
from borecheck.report.display import MOST_LIT, contact_corners
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, read_obstacle

Array = NDArray[np.float64]

CHECKING = "checking"


@dataclass(frozen=True, eq=False)
class Shown:
    """What is shown about a configuration.

    Attributes:
        q: The configuration.
        placements: T_scene_link of every link.
        state: clear, contact, unknown, or checking while only a glance was taken.
        reason: One sentence.
        closest: Closest points of robot and obstacles.
        touching: Names of parts and obstacles whose surfaces meet.
        lit: Corners of triangles in contact, (n, 2, 3, 3), the robot's first, [m].
    """

    q: Array
    placements: dict[str, Array]
    state: str
    reason: str
    closest: Closest | None
    touching: frozenset[str]
    lit: Array = field(default_factory=lambda: np.zeros((0, 2, 3, 3)))


@dataclass(frozen=True, eq=False)
class Session:
    """Robot, scene, plan and margin; every change gives a new session.

    Attributes:
        robot: The robot.
        scene: The scene.
        plan: The needle plan that the handles show.
        margin: Required clearance, [m].
    """

    robot: Robot
    scene: Scene
    plan: NeedlePlan
    margin: float = 0.0

    @property
    def follows_plans(self) -> bool:
        """Whether the robot has a needle that can follow plans."""
        needle = self.robot.needle
        return needle is not None and needle.tip is not None

    @property
    def chosen(self) -> Settings:
        """Exact, with the margin as true distance."""
        return settings("exact", "bvh", self.margin)

    def motion(self) -> PlanMotion:
        """The plan as the robot drives it.

        Raises:
            UnreachableError: It is out of reach.
            UsageError: The robot has no inverse kinematics.
        """
        return needle_motion(self.robot, self.scene, self.plan)

    def at(self, motion: PlanMotion, fraction: float) -> Array:
        """The configuration at a fraction of a motion."""
        return configurations_at(motion.waypoints, np.array([fraction]))[0]

    def glance(self, q: Array, corridor: Corridor | None = None) -> Shown:
        """Clearance and closest points; contact if surfaces meet or the margin breaks.

        Does not look for contact within the robot or for solids inside others.
        """
        placements = self.robot.placements(q)
        closest, _ = clearance.to_obstacles(
            self.robot, self.scene, placements, corridor
        )
        if closest is None:
            reason = "there is no obstacle"
            return Shown(q, placements, CHECKING, reason, None, frozenset())
        where = f"{closest.link} to {closest.obstacle}"
        names = frozenset({closest.link, closest.obstacle})
        if closest.upper <= 0.0:
            reason = f"{closest.link} meets {closest.obstacle}"
            pair = TrianglePair(closest.link, closest.obstacle, *closest.triangles)
            lit = self._lit(placements, [pair])
            return Shown(q, placements, CONTACT, reason, closest, names, lit)
        told = f"{where}: {1e3 * closest.distance:.1f} mm"
        if closest.upper <= self.margin:
            reason = f"{told} is within the margin of {1e3 * self.margin:g} mm"
            return Shown(q, placements, CONTACT, reason, closest, names)
        return Shown(q, placements, CHECKING, told, closest, frozenset())

    def judge(self, q: Array, corridor: Corridor | None = None) -> Shown:
        """The full check of one configuration."""
        verdict = check_with(self.robot, self.scene, q, self.chosen, corridor)
        placements = self.robot.placements(q)
        return Shown(
            q,
            placements,
            verdict.verdict,
            _reason(verdict),
            verdict.closest,
            _touching(verdict),
            self._lit(placements, [*verdict.contacts, *verdict.self_contacts]),
        )

    def _lit(
        self, placements: dict[str, Array], pairs: Sequence[TrianglePair]
    ) -> Array:
        """Corners of the first of the pairs, as they were checked."""
        some = [asdict(pair) for pair in pairs[:MOST_LIT]]
        return contact_corners(self.robot, self.scene, placements, some)

    def with_plan(self, entry: Any, target: Any) -> "Session":
        """The session with another plan.

        Raises:
            GeometryError: Entry and target make no plan.
        """
        plan = NeedlePlan(self.plan.name, entry, target)
        return replace(self, plan=plan)

    def with_mount(self, mount: str) -> "Session":
        """The session with the robot mounted on the other side.

        Raises:
            UnknownNameError, UsageError: The robot has no such mount.
        """
        arguments: dict[str, Any] = {**self.robot.arguments, "mount": mount}
        robot = load_robot(
            self.robot.name,
            level=self.robot.level,
            base=self.robot.T_scene_base,
            package_paths=self.robot.roots.folders,
            allow_outside=self.robot.roots.allow_outside,
            **arguments,
        )
        robot = replace(robot, stated_needle=self.robot.stated_needle)
        return replace(self, robot=robot.allowing(self.robot.allowances))

    def with_patient(self, file: str) -> "Session":
        """The session with a patient's surface instead of the one that was there.

        Args:
            file: `FILE[:unit][:frame][@x,y,z[,r,p,y]]`.

        Raises:
            MeshError: The file cannot be read.
            UsageError: An unknown unit or a pose that is none.
        """
        found = read_obstacle(file, "patient")
        kept = tuple(o for o in self.scene.obstacles if o.role != "patient")
        gone = {o.source for o in self.scene.obstacles} - {o.source for o in kept}
        warnings = tuple(
            text
            for text in self.scene.warnings
            if not any(text.startswith(f"{source}: ") for source in gone)
        )
        scene = replace(self.scene, obstacles=kept, warnings=warnings)
        more = scene.with_obstacles(found.obstacles, found.warnings, found.not_modelled)
        return replace(self, scene=more)

    def save_plan(self, path: Path) -> None:
        """Writes the plan as CSV or JSON, by the file's suffix.

        Raises:
            BorecheckError: It cannot be written.
        """
        from borecheck.core.whole_files import check_writable, write_whole
        from borecheck.plans.plan_file import plans_csv, plans_json

        check_writable(path)
        text = plans_json if path.suffix == ".json" else plans_csv
        write_whole(path, text([self.plan]))

    def write_report(self, path: Path, q: Array, samples: int = 21) -> str:
        """Writes a page about the plan's motion, or about q where no plan is followed.

        Returns:
            The verdict on it.

        Raises:
            UnreachableError: The plan is out of reach.
            BorecheckError: The page cannot be written.
        """
        from borecheck.core.whole_files import check_writable, write_whole
        from borecheck.report.display import display_block
        from borecheck.report.page import page

        check_writable(path)
        document = self._document(q, samples)
        document["display"] = display_block(self.robot, self.scene, document)
        write_whole(path, page(document))
        return str(document["verdict"])

    def _document(self, q: Array, samples: int) -> dict[str, Any]:
        from borecheck.contact.checked import checked
        from borecheck.motion.check import check_motion
        from borecheck.report.document import (
            about_block,
            allowed_block,
            header,
            motion_block,
            verdict_block,
        )

        chosen = replace(self.chosen, link_clearance=True)
        names = self.robot.model.joint_names
        plans = self.follows_plans
        about = checked(self.robot, self.scene, chosen.margin, with_plan=plans)
        document: dict[str, Any] = {
            **header("check", ["view", self.robot.name, self.scene.name], None),
            **about_block(self.robot, self.scene, about),
        }
        if not self.follows_plans:
            verdict = check_with(self.robot, self.scene, q, chosen)
            pose = verdict_block(verdict, names)
            return document | pose | allowed_block(self.robot, pose["itself"])
        motion = self.motion()
        answer = check_motion(
            self.robot,
            self.scene,
            motion.waypoints,
            chosen,
            corridor=motion.corridor,
            samples=samples,
        )
        block = motion_block(answer, names)
        plan = {
            "name": self.plan.name,
            "entry": self.plan.entry.tolist(),
            "target": self.plan.target.tolist(),
            "reachable": True,
        }
        document |= allowed_block(self.robot, block["itself"])
        return document | block | {"plans": [{**plan, **block}]}


def _reason(verdict: Verdict) -> str:
    """The reason; what the robot does to itself hides nothing of the obstacles."""
    if verdict.itself.clear:
        return verdict.reason
    obstacles = f"obstacles: {verdict.obstacles.verdict}, {verdict.obstacles.reason}"
    return f"itself: {verdict.itself.reason}; {obstacles}"


def _touching(verdict: Verdict) -> frozenset[str]:
    pairs = [*verdict.contacts, *verdict.self_contacts]
    names = {name for pair in pairs for name in (pair.link, pair.obstacle)}
    if verdict.verdict == CONTACT and not names:
        names |= {n for c in verdict.contained for n in (c.link, c.obstacle)}
        if verdict.closest is not None and not names:
            names = {verdict.closest.link, verdict.closest.obstacle}
    return frozenset(names)
