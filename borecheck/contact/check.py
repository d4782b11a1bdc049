"""Will the robot touch anything at this configuration: one verdict from all pairs.

A verdict is `clear` only if every pair of part and obstacle was examined, and every
pair of parts that may not touch; no surface meets another, no solid holds another, the
certified distance exceeds the margin, and no obstacle's unit was guessed. What the
numbers leave open is `unknown`.
"""

import time
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact import clearance, containment, round_shapes
from borecheck.contact.decision import (
    Findings,
    about_itself,
    about_obstacles,
    worse_of,
)
from borecheck.contact.examine import examine_itself, examine_obstacles
from borecheck.contact.margin import NO_MARGIN, SECURITY
from borecheck.contact.settings import Settings, settings
from borecheck.contact.together import Together, is_usual
from borecheck.contact.unseen import why_unseen_at
from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Answer,
    Closest,
    Verdict,
)
from borecheck.plans.corridor import Corridor
from borecheck.robots.given import Given, length, positions, refuse_others
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]


def check(
    robot: Robot,
    scene: Scene,
    q: Given,
    *,
    margin: float | str = 0.0,
    margin_kind: str | None = None,
    checker: str = "exact",
    pruning: str = "bvh",
    corridor: Corridor | None = None,
) -> Verdict:
    """The verdict for one configuration.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        q: Joint positions, [m] and [rad]: in the order of `robot.model.joint_names`,
            by name (a dictionary, a row of a table), or "home".
        margin: Required clearance to every obstacle, [m], or "20mm". Parts of the
            robot need not keep it among themselves.
        margin_kind: offset (true distance), enlarge-axes, enlarge-axes:world, or
            security (Coal's); each checker has a default.
        checker: exact, two-sided, paper, paper:robot, paper:scanner or coal.
        pruning: none, coal or bvh; all give the same triangle pairs.
        corridor: Where the needle may be in the patient; None: nowhere.

    Raises:
        JointLimitError: q is beyond a joint limit.
        UnknownNameError, UsageError: Settings that do not exist or do not fit.
    """
    refuse_others(robot, scene)
    chosen = settings(checker, pruning, length(margin, "margin"), margin_kind)
    return check_with(robot, scene, positions(robot, q), chosen, corridor)


def check_with(
    robot: Robot,
    scene: Scene,
    q: ArrayLike,
    chosen: Settings,
    corridor: Corridor | None = None,
) -> Verdict:
    """As `check`, with settings made before."""
    start = time.perf_counter()
    q = robot.model.check_limits(q)

    def examine(bodies: Robot, surroundings: Scene) -> Verdict:
        return _examined(bodies, surroundings, q, chosen, corridor)

    verdict = examine(robot, scene)
    verdict = round_shapes.confirmed(verdict, robot, scene, examine)
    return replace(verdict, seconds=time.perf_counter() - start)


@dataclass(frozen=True, eq=False)
class _Pose:
    """A configuration, and what is found about both questions while it is examined."""

    robot: Robot
    scene: Scene
    q: Array
    chosen: Settings
    corridor: Corridor | None
    placements: dict[str, Array]
    around: Findings = field(default_factory=Findings)
    within: Findings = field(default_factory=Findings)

    @cached_property
    def together(self) -> Together:
        """The pose as compiled calls take it."""
        return Together.of(self.robot, self.scene, self.placements)

    def is_quick(self, chosen: Settings) -> bool:
        """Whether compiled calls can answer what these settings ask."""
        return not chosen.pair_by_pair and is_usual(chosen, self.corridor)

    def examine(self, chosen: Settings) -> None:
        """Asks every pair of surfaces."""
        robot, placed = self.robot, self.placements
        if self.is_quick(chosen):
            self.together.examine(chosen.checker, self.around, self.within)
            return
        scene, corridor = self.scene, self.corridor
        examine_obstacles(robot, scene, placed, chosen, corridor, self.around)
        examine_itself(robot, placed, chosen, self.within)

    def look_inside(self) -> None:
        """Asks which solid holds another, of surfaces that do not meet."""
        around, within = self.around, self.within
        quick, unseen = self.is_quick(self.chosen), self.chosen.checker != "exact"
        if not around.contacts and quick:
            around.contained += self.together.held_around(unseen=unseen)
        elif not around.contacts:
            around.contained += containment.of_obstacles(
                self.robot, self.scene, self.placements, around.punctured
            )
        if not within.contacts and quick:
            within.contained += self.together.held_within(unseen=unseen)
        elif not within.contacts:
            within.contained += containment.of_itself(self.robot, self.placements)

    def measure(self) -> tuple[Closest | None, dict[str, float] | None]:
        """Nearest points of robot and obstacles; clearances of all parts if asked."""
        links = self.chosen.link_clearance
        if self.around.contacts and not links:
            return None, None
        if self.is_quick(self.chosen):
            return self.together.closest(), None
        return clearance.to_obstacles(
            self.robot, self.scene, self.placements, self.corridor, every_link=links
        )


def _examined(
    robot: Robot,
    scene: Scene,
    q: Array,
    chosen: Settings,
    corridor: Corridor | None,
) -> Verdict:
    """The verdict for surfaces as they are, round shapes or not."""
    pose = _Pose(robot, scene, q, chosen, corridor, robot.placements(q))
    pose.examine(chosen)
    pose.look_inside()
    closest, links = pose.measure()
    if pose.around.held:
        closest, links = None, _without_held(links, pose.around)
    obstacles, itself = _answers(pose, closest)
    return _verdict(pose, obstacles, itself, closest, links)


def _answers(pose: _Pose, closest: Closest | None) -> tuple[Answer, Answer]:
    """What is said about the obstacles, and about the robot itself."""
    robot, chosen = pose.robot, pose.chosen
    obstacles = about_obstacles(pose.around, chosen.checker, chosen.margin, closest)
    unasked = len(robot.unexamined)
    itself = about_itself(pose.within, len(robot.self_pairs), unasked)
    if chosen.checker != "exact" and CLEAR in (obstacles.verdict, itself.verdict):
        obstacles, itself = _asked_again(pose, obstacles, itself)
    doubt = pose.scene.doubt
    if obstacles.verdict == CLEAR and doubt is not None:
        obstacles = replace(
            obstacles, verdict=UNKNOWN, reason=f"{doubt}; {obstacles.reason}"
        )
    if obstacles.verdict == CLEAR and closest is not None:
        unseen = why_unseen_at(
            robot, pose.scene, pose.placements, pose.corridor, closest
        )
        if unseen is not None:
            obstacles = replace(obstacles, verdict=UNKNOWN, reason=unseen)
    link_of = {part.mesh.name: part.link for part in robot.parts}
    # parts have numbers where a link has several; an obstacle may be called like one
    around = {(link_of[part], obstacle) for part, obstacle in obstacles.pairs}
    within = {(link_of[first], link_of[second]) for first, second in itself.pairs}
    return (
        replace(obstacles, pairs=tuple(sorted(around))),
        replace(itself, pairs=tuple(sorted(within))),
    )


def _asked_again(
    pose: _Pose, obstacles: Answer, itself: Answer
) -> tuple[Answer, Answer]:
    """Answers of another checker than `exact`, after that was asked the same."""
    margin = pose.chosen.margin
    margin = NO_MARGIN if margin.kind == SECURITY else margin
    again = replace(pose, around=Findings(), within=Findings())
    long = pose.chosen.pair_by_pair
    again.examine(Settings("exact", "bvh", margin, pair_by_pair=long))
    checker = pose.chosen.checker
    missed = [(p.link, p.obstacle) for p in again.around.contacts]
    missed += again.around.within_growth
    own = [(p.link, p.obstacle) for p in again.within.contacts]
    return _unless(obstacles, missed, checker), _unless(itself, own, checker)


def _unless(answer: Answer, missed: list[tuple[str, str]], checker: str) -> Answer:
    """A `clear` that stays one only if `exact` saw nothing either."""
    if not missed or answer.verdict != CLEAR:
        return answer
    return replace(
        answer,
        verdict=UNKNOWN,
        reason=f"{checker} sees no contact, but exact sees {missed[0][0]} meet "
        f"{missed[0][1]}; its blind spots are in docs/contact.md",
    )


def _verdict(
    pose: _Pose,
    obstacles: Answer,
    itself: Answer,
    closest: Closest | None,
    links: dict[str, float] | None,
) -> Verdict:
    robot, chosen, around, within = pose.robot, pose.chosen, pose.around, pose.within
    whole = worse_of(obstacles, itself)
    touching = bool(around.contacts or within.contacts)
    examined = around.examined + within.examined
    return Verdict(
        verdict=whole.verdict,
        reason=whole.reason,
        qualifiers=whole.qualifiers,
        checker=chosen.checker,
        checker_verdict=CONTACT if touching else CLEAR,
        pruning="own" if chosen.checker == "coal" else chosen.pruning,
        margin_m=chosen.margin.size,
        margin_kind=chosen.margin.kind,
        clearance_m=_clearance(closest, links),
        closest=closest,
        contacts=tuple(around.contacts),
        self_contacts=tuple(within.contacts),
        corridor_contacts=around.corridor_contacts,
        contained=(*around.contained, *within.contained),
        not_modelled=(*robot.not_modelled, *pose.scene.not_modelled),
        pairs_examined=examined,
        pairs_pruned=around.total + within.total - examined,
        seconds=0.0,
        q=tuple(float(value) for value in pose.q),
        obstacles=obstacles,
        itself=itself,
        allowed=robot.allowed_contacts,
        link_clearance=links,
    )


def _without_held(
    links: dict[str, float] | None, findings: Findings
) -> dict[str, float] | None:
    """Clearances in which a part that holds or is held has none."""
    if links is None:
        return None
    return {**links, **{c.link: 0.0 for c in findings.held}}


def _clearance(closest: Closest | None, links: dict[str, float] | None) -> float | None:
    if closest is not None:
        return closest.distance
    return min(links.values(), default=None) if links else None
