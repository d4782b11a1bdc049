"""Every pair of surfaces asked whether it meets; what is found is gathered."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from borecheck.contact import containment
from borecheck.contact.decision import Findings
from borecheck.contact.margin import SECURITY, Margin, enlarged
from borecheck.contact.settings import Settings
from borecheck.contact.verdict import UNKNOWN, Containment, pairs_of
from borecheck.geometry.mesh.enlarge import Enlarged
from borecheck.geometry.surfaces import Found, Surface, contacts, surface
from borecheck.geometry.triangles.placing import place_mesh, place_vertices
from borecheck.plans.corridor import Corridor
from borecheck.robots.parts import Part
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Obstacle, Scene

Array = NDArray[np.float64]

WORLD = np.eye(4)


def examine_obstacles(
    robot: Robot,
    scene: Scene,
    placements: dict[str, Array],
    chosen: Settings,
    corridor: Corridor | None,
    findings: Findings,
) -> None:
    """Every part against every obstacle; the needle in its corridor is meant."""
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
    note(findings, found, np.ones(len(found.pairs), dtype=bool), own, T, other)
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
    note(findings, found, ~meant, own, T, other)
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


def examine_itself(
    robot: Robot,
    placements: dict[str, Array],
    chosen: Settings,
    findings: Findings,
) -> None:
    """Parts that must not touch each other; they keep no margin."""
    for i, j in robot.self_pairs:
        first, second = robot.parts[i], robot.parts[j]
        a, b = surface(first.mesh), surface(second.mesh)
        T_a, T_b = placements[first.link], placements[second.link]
        found = contacts(a, T_a, b, T_b, chosen.checker, chosen.pruning)
        findings.count(found, a, b)
        note(findings, found, np.ones(len(found.pairs), bool), a, T_a, b, T_b)
        findings.contacts += pairs_of(first.mesh.name, second.mesh.name, found.pairs)


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


def note(
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

    first, second = _placed(a, T_a, pairs[:, 0]), _placed(b, T_b, pairs[:, 1])
    return bool(paper(first, second).any() or paper(second, first).any())


def _placed(of: Surface, T: Array, triangles: NDArray[np.int64]) -> Array:
    """Corners of some triangles in the world, (k, 3, 3), as every checker sees them."""
    corners = of.mesh.corners[triangles].reshape(-1, 3)
    return place_vertices(np.ascontiguousarray(T), corners).reshape(-1, 3, 3)
