"""Will the robot touch anything at this configuration: one verdict from all pairs.

A verdict is `clear` only if every pair of part and obstacle was examined, no surface
meets another, no solid holds another, the certified distance exceeds the margin, and
no obstacle's unit was guessed. What the numbers leave open is `unknown`.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact import clearance, containment, round_shapes
from borecheck.contact.decision import Answer, Findings, decide
from borecheck.contact.margin import NO_MARGIN, SECURITY, Margin, enlarged, margin_for
from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Closest,
    Containment,
    Verdict,
    pairs_of,
)
from borecheck.geometry.mesh.enlarge import Enlarged
from borecheck.geometry.surfaces import (
    Found,
    Surface,
    check_pruning,
    checker_name,
    contacts,
    surface,
)
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.plans.corridor import Corridor
from borecheck.robots.parts import Part
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene

Array = NDArray[np.float64]

WORLD = np.eye(4)


@dataclass(frozen=True)
class Settings:
    """How a configuration is checked.

    Attributes:
        checker: The narrowphase, one of `pair_search.CHECKERS`.
        pruning: none, coal or bvh.
        margin: Required clearance to the obstacles.
        link_clearance: Whether to report the clearance of every part.
    """

    checker: str = "exact"
    pruning: str = "bvh"
    margin: Margin = NO_MARGIN
    link_clearance: bool = False


def settings(
    checker: str = "exact",
    pruning: str = "bvh",
    margin: float = 0.0,
    margin_kind: str | None = None,
    link_clearance: bool = False,
) -> Settings:
    """Settings from names, checked.

    Raises:
        UnknownNameError: A checker, pruning or margin kind that does not exist.
        UsageError: A margin that the checker cannot keep.
    """
    full = checker_name(checker)
    return Settings(
        full,
        check_pruning(pruning),
        margin_for(full, margin, margin_kind),
        link_clearance,
    )


def check(
    robot: Robot,
    scene: Scene,
    q: ArrayLike,
    *,
    margin: float = 0.0,
    margin_kind: str | None = None,
    checker: str = "exact",
    pruning: str = "bvh",
    corridor: Corridor | None = None,
) -> Verdict:
    """The verdict for one configuration.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        q: Joint positions in the order of `robot.model.joint_names`, [m] and [rad].
        margin: Required clearance to every obstacle, [m]. Parts of the robot need
            not keep it among themselves.
        margin_kind: offset (true distance), enlarge-axes, enlarge-axes:world, or
            security (Coal's); each checker has a default.
        checker: exact, two-sided, paper, paper:robot, paper:scanner or coal.
        pruning: none, coal or bvh; all give the same triangle pairs.
        corridor: Where the needle may be in the patient; None: nowhere.

    Raises:
        JointLimitError: q is beyond a joint limit.
        UnknownNameError, UsageError: Settings that do not exist or do not fit.
    """
    chosen = settings(checker, pruning, margin, margin_kind)
    return check_with(robot, scene, q, chosen, corridor)


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


def _examined(
    robot: Robot,
    scene: Scene,
    q: Array,
    chosen: Settings,
    corridor: Corridor | None,
) -> Verdict:
    """The verdict for surfaces as they are, round shapes or not."""
    placements = robot.placements(q)
    findings = Findings([], [], [])
    _examine_obstacles(robot, scene, placements, chosen, corridor, findings)
    _examine_self(robot, placements, chosen, findings)
    touching = bool(findings.contacts or findings.self_contacts)
    closest, links = None, None
    if not findings.contacts or chosen.link_clearance:
        closest, links = clearance.to_obstacles(
            robot, scene, placements, corridor, every_link=chosen.link_clearance
        )
    if not touching:
        findings.contained += containment.all_contained(
            robot, scene, placements, findings.punctured
        )
    if any(pair.holds for pair in findings.contained):
        closest, links = None, _without_held(links, findings)
    answer = decide(findings, chosen.checker, chosen.margin, closest)
    if answer.verdict == CLEAR and chosen.checker != "exact":
        answer = _asked_again(robot, scene, placements, chosen, corridor, answer)
    if answer.verdict == CLEAR and scene.doubt is not None:
        answer = Answer(UNKNOWN, f"{scene.doubt}; {answer.reason}", answer.qualifiers)
    return Verdict(
        verdict=answer.verdict,
        reason=answer.reason,
        qualifiers=answer.qualifiers,
        checker=chosen.checker,
        checker_verdict=CONTACT if touching else CLEAR,
        pruning="own" if chosen.checker == "coal" else chosen.pruning,
        margin_m=chosen.margin.size,
        margin_kind=chosen.margin.kind,
        clearance_m=_clearance(closest, links),
        closest=closest,
        contacts=tuple(findings.contacts),
        self_contacts=tuple(findings.self_contacts),
        corridor_contacts=findings.corridor_contacts,
        contained=tuple(findings.contained),
        not_modelled=(*robot.not_modelled, *scene.not_modelled),
        pairs_examined=findings.examined,
        pairs_pruned=findings.total - findings.examined,
        seconds=0.0,
        q=tuple(float(value) for value in q),
        link_clearance=links,
    )


def _without_held(
    links: dict[str, float] | None, findings: Findings
) -> dict[str, float] | None:
    """Clearances in which a part that holds or is held has none."""
    if links is None:
        return None
    return {**links, **{c.link: 0.0 for c in findings.contained if c.holds}}


def _clearance(closest: Closest | None, links: dict[str, float] | None) -> float | None:
    if closest is not None:
        return closest.distance
    return min(links.values(), default=None) if links else None


def _examine_obstacles(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    chosen: Settings,
    corridor: Corridor | None,
    findings: Findings,
) -> None:
    for part, own, grown in _grown_parts(robot, placements, chosen.margin):
        T = placements[part.link]
        for obstacle in scene.obstacles:
            if corridor is not None and robot.may_enter(part.link, obstacle.role):
                _examine_puncture(part, T, obstacle, chosen, corridor, findings)
            else:
                _examine_pair(part, own, grown, T, obstacle, chosen, findings)


def _examine_pair(
    part: Part,
    own: Surface,
    grown: Enlarged | None,
    T: Array,
    obstacle: Obstacle,
    chosen: Settings,
    findings: Findings,
) -> None:
    """A part, grown or not, against an obstacle."""
    other = surface(obstacle.mesh)
    security = chosen.margin.size if chosen.margin.kind == SECURITY else 0.0
    found = contacts(own, T, other, WORLD, chosen.checker, chosen.pruning, security)
    findings.count(found, own, other)
    _note(findings, found, np.ones(len(found.pairs), dtype=bool), own, T, other)
    pairs = found.pairs
    if grown is not None:
        if len(pairs) == 0 and containment.lies_in_grown(grown, T, other):
            findings.within_growth.append((part.mesh.name, obstacle.name))
        pairs = np.unique(
            np.column_stack([grown.source[pairs[:, 0]], pairs[:, 1]]), axis=0
        )
    findings.contacts += pairs_of(part.mesh.name, obstacle.name, pairs)


def _examine_puncture(
    part: Part,
    T: Array,
    obstacle: Obstacle,
    chosen: Settings,
    corridor: Corridor,
    findings: Findings,
) -> None:
    """The needle against the patient: what lies in the plan's corridor is meant.

    No margin here: the needle is to touch, and only there.
    """
    own, other = surface(part.mesh), surface(obstacle.mesh)
    placed = place_mesh(T, part.mesh)
    found = contacts(own, T, other, WORLD, chosen.checker, chosen.pruning)
    findings.count(found, own, other)
    meant = corridor.allows(placed, obstacle.mesh, found.pairs)
    findings.corridor_contacts += int(meant.sum())
    _note(findings, found, ~meant, own, T, other)
    pairs = found.pairs[~meant]
    findings.contacts += pairs_of(part.mesh.name, obstacle.name, pairs)
    met = found.pairs
    if (
        chosen.checker != "exact"
    ):  # whose word on where the needle goes in is not enough
        met = contacts(own, T, other, WORLD).pairs
        meant = corridor.allows(placed, obstacle.mesh, met)
    if len(met) == 0:
        return
    findings.punctured.add((part.mesh.name, obstacle.name))
    stray = corridor.stray(placed, obstacle.mesh, other.topology)
    if stray is not None and meant.all():
        state = "a_in_b" if stray.certain else UNKNOWN
        findings.contained.append(
            Containment(
                part.mesh.name, obstacle.name, obstacle.role, state, stray.reason
            )
        )


def _examine_self(
    robot: Robot,
    placements: dict[str, Array],
    chosen: Settings,
    findings: Findings,
) -> None:
    for i, j in robot.self_pairs:
        first, second = robot.parts[i], robot.parts[j]
        a, b = surface(first.mesh), surface(second.mesh)
        T_a, T_b = placements[first.link], placements[second.link]
        found = contacts(a, T_a, b, T_b, chosen.checker, chosen.pruning)
        findings.count(found, a, b)
        _note(findings, found, np.ones(len(found.pairs), bool), a, T_a, b, T_b)
        findings.self_contacts += pairs_of(
            first.mesh.name, second.mesh.name, found.pairs
        )


def _grown_parts(
    robot: Robot, placements: dict[str, Array], margin: Margin
) -> Iterator[tuple[Part, Surface, Enlarged | None]]:
    """Every part with the surface to examine, and what it grew to if enlarged."""
    for part in robot.parts:
        if margin.enlarges:
            grown = enlarged(part.mesh, margin, placements[part.link][:3, :3])
            yield part, surface(grown.mesh), grown
        else:
            yield part, surface(part.mesh), None


def _note(
    findings: Findings,
    found: Found,
    keep: NDArray[np.bool_],
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array = WORLD,
) -> None:
    """Remembers what qualifies the contact: depth, and Coal's tolerance."""
    pairs = found.pairs[keep]
    if len(pairs) == 0:
        return
    findings.only_tolerance &= bool(found.within_tolerance[keep].all())
    findings.crossing = findings.crossing or _cross(a, T_a, b, T_b, pairs)


def _cross(
    a: Surface, T_a: Array, b: Surface, T_b: Array, pairs: NDArray[np.int64]
) -> bool:
    """Whether an edge of one crosses the inside of the other in any of the pairs."""
    from borecheck.geometry.triangles.published import paper

    first = place_mesh(T_a, a.mesh).corners[pairs[:, 0]]
    second = place_mesh(T_b, b.mesh).corners[pairs[:, 1]]
    return bool(paper(first, second).any() or paper(second, first).any())


def _asked_again(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    chosen: Settings,
    corridor: Corridor | None,
    answer: Answer,
) -> Answer:
    """The answer of another checker than `exact`, after that was asked the same."""
    margin = NO_MARGIN if chosen.margin.kind == SECURITY else chosen.margin
    judge = Settings("exact", "bvh", margin)
    seen = Findings([], [], [])
    _examine_obstacles(robot, scene, placements, judge, corridor, seen)
    _examine_self(robot, placements, judge, seen)
    missed = [(pair.link, pair.obstacle) for pair in seen.contacts]
    missed += [(pair.link, pair.obstacle) for pair in seen.self_contacts]
    missed += seen.within_growth
    if not missed:
        return answer
    return Answer(
        UNKNOWN,
        f"{chosen.checker} sees no contact, but exact sees {missed[0][0]} meet "
        f"{missed[0][1]}; its blind spots are in docs/contact.md",
    )
