"""Never clear where there is contact: random motions against dense resampling.

Random chains (turning, sliding and mimic joints) carry boxes, needles and single
triangles through random waypoints past boxes, sheets without thickness and wires. Half
of the obstacles are then moved so that the motion grazes them within micrometres, on
either side. Every motion that the certified search calls clear is sampled a thousand
times finer than its waypoints with a forward kinematics and all-pairs exact tests of
its own; contact there is a failure. Every contact it reports is looked up as well.

    python -m studies.paths --paths 10000 --seed 1
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from borecheck.core.se3 import axis_rotation, transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.published import triangle_row
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import PathVerdict, search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS

Array = NDArray[np.float64]

FINER = 1000  # samples for every step between waypoints
SPARSE = 10  # what an ordinary sampled check might look at
# A sheet without thickness, closed: it holds nothing, so it does not stay unknown.
BOTH_SIDES = np.array([[0, 1, 2], [0, 2, 1], [0, 2, 3], [0, 3, 2]])
GRAZES = (-1e-5, -1e-6, -1e-7, 1e-7, 1e-6, 1e-5)  # gap of a grazing motion [m]


@dataclass(frozen=True)
class Case:
    """A motion, and the gap it was built to leave (None: as it came)."""

    problem: PathProblem
    waypoints: Array
    gap: float | None


def random_case(rng: np.random.Generator) -> Case:
    """A chain, what stands round it, and a motion; half of them grazing."""
    chain = _random_chain(rng)
    parts = tuple(
        Body(f"part{k}", _random_surface(rng, f"part{k}"), int(frame))
        for k, frame in enumerate(_frames_with_parts(rng, chain))
    )
    waypoints = _random_waypoints(rng, chain)
    obstacle = _random_obstacle(rng, chain, parts[-1], waypoints)
    self_pairs = _self_pairs(rng, parts)
    problem = PathProblem(chain, parts, (obstacle,), self_pairs)
    if rng.random() < 0.5:
        return Case(problem, waypoints, None)
    gap = float(rng.choice(GRAZES))
    grazing = _grazing(problem, waypoints, gap)
    return Case(grazing or problem, waypoints, gap if grazing else None)


def _random_chain(rng: np.random.Generator) -> JointChain:
    count = int(rng.integers(2, 7))
    origin = np.array(
        [
            transform(rng.uniform(-0.2, 0.2, 3), rng.uniform(-np.pi, np.pi, 3))
            for _ in range(count)
        ]
    )
    kind = rng.choice([FIXED, TURNS, TURNS, TURNS, SLIDES], count)
    kind[0] = TURNS
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    # A third of the joints mimic the one before them.
    source, free = np.zeros(count, np.int64), 0
    for j in range(1, count):
        if kind[j] != FIXED and rng.random() > 1 / 3:
            free += 1
        source[j] = free
    factor = np.where(rng.random(count) < 0.5, 1.0, rng.uniform(-1.5, 1.5, count))
    parent = np.array(
        [-1, *(int(rng.integers(max(0, j - 2), j)) for j in range(1, count))]
    )
    source = np.where(kind == FIXED, -1, source)
    offset = rng.uniform(-0.5, 0.5, count)
    return JointChain(parent, origin, kind, axis, source, factor, offset)


def _frames_with_parts(
    rng: np.random.Generator, chain: JointChain
) -> NDArray[np.int64]:
    last = chain.frame_count - 1
    if rng.random() < 0.5:
        return np.array([last])
    return np.array([int(rng.integers(0, last + 1)), last])


def _random_surface(rng: np.random.Generator, name: str) -> TriangleMesh:
    """A box, a needle, or a single triangle, away from its frame's origin."""
    shape = rng.integers(0, 3)
    if shape == 0:
        mesh = box(name, rng.uniform(0.01, 0.1, 3))
    elif shape == 1:
        mesh = box(name, [1e-3, 1e-3, rng.uniform(0.05, 0.2)])
    else:
        mesh = TriangleMesh(name, rng.normal(scale=0.05, size=(3, 3)), BOTH_SIDES[:2])
    return mesh.moved(transform(rng.uniform(-0.1, 0.1, 3), rng.uniform(-3, 3, 3)))


def _random_waypoints(rng: np.random.Generator, chain: JointChain) -> Array:
    """Few far waypoints, or many near ones as from a planner."""
    start = rng.uniform(-1.0, 1.0, chain.joint_count)
    if rng.random() < 0.7:
        count, step = int(rng.integers(2, 5)), rng.choice([0.02, 0.2, 1.0])
    else:
        count, step = int(rng.integers(8, 20)), rng.choice([1e-3, 1e-2, 0.1])
    steps = rng.normal(scale=step, size=(count - 1, chain.joint_count))
    if rng.random() < 0.5:  # nearly straight, as an interpolated motion
        steps = steps[:1] * (1.0 + 1e-3 * rng.normal(size=(count - 1, 1)))
    return start + np.vstack([np.zeros(chain.joint_count), np.cumsum(steps, axis=0)])


def _random_obstacle(
    rng: np.random.Generator, chain: JointChain, part: Body, waypoints: Array
) -> Body:
    """A box, sheet or wire near where the last part passes."""
    samples = dense(waypoints, 20)
    passing = placements(chain, samples)[:, part.frame]
    at = passing[rng.integers(len(passing))]
    corner = part.mesh.vertices[rng.integers(len(part.mesh.vertices))]
    beside = rng.normal(size=3) * rng.choice([0.005, 0.02, 0.1, 0.3])
    place = transform(at[:3, :3] @ corner + at[:3, 3] + beside, rng.uniform(-3, 3, 3))
    shape = rng.integers(0, 3)
    if shape == 0:
        mesh = box("obstacle", rng.uniform(0.01, 0.1, 3))
    elif shape == 1:  # a sheet without thickness
        corners = [
            [-0.05, -0.05, 0],
            [0.05, -0.05, 0],
            [0.05, 0.05, 0],
            [-0.05, 0.05, 0],
        ]
        mesh = TriangleMesh("obstacle", corners, BOTH_SIDES)
    else:  # a wire of 0.1 mm
        mesh = box("obstacle", [1e-4, 1e-4, 0.1])
    return Body("obstacle", mesh, T_frame_mesh=place)


def _self_pairs(
    rng: np.random.Generator, parts: tuple[Body, ...]
) -> tuple[tuple[int, int], ...]:
    if len(parts) == 2 and parts[0].frame != parts[1].frame and rng.random() < 0.5:
        return ((1, 0),)
    return ()


def _grazing(problem: PathProblem, waypoints: Array, gap: float) -> PathProblem | None:
    """The obstacle shifted along the shortest way until the motion leaves that gap."""
    part, obstacle = problem.parts[-1], problem.obstacles[0]
    T_part = placements(problem.chain, dense(waypoints, 200))[:, part.frame]
    shift = np.zeros(3)
    for _ in range(3):
        T_b = obstacle.T_frame_mesh.copy()
        T_b[:3, 3] += shift
        best = None
        for T in T_part:
            near = part.tree.closest(obstacle.tree, T, T_b)
            if best is None or near.distance < best.distance:
                best = near
        if best is None or best.distance < 1e-6:
            break
        way = (best.point_self - best.point_other) / best.distance
        shift = shift + way * (best.distance - gap)
    if not shift.any():
        return None
    T_b = obstacle.T_frame_mesh.copy()
    T_b[:3, 3] += shift
    moved = Body(obstacle.name, obstacle.mesh, T_frame_mesh=T_b)
    return PathProblem(problem.chain, problem.parts, (moved,), problem.self_pairs)


# --- the judge: samples, with kinematics and contact tests of its own ----------------


def dense(waypoints: Array, finer: int) -> Array:
    """So many configurations for every step between waypoints."""
    times = np.linspace(0.0, len(waypoints) - 1.0, finer * (len(waypoints) - 1) + 1)
    return np.column_stack(
        [np.interp(times, np.arange(len(waypoints)), q) for q in waypoints.T]
    )


def placements(chain: JointChain, samples: Array) -> Array:
    """T_world_frame (samples, frames, 4, 4) by products of matrices."""
    placed = np.zeros((len(samples), chain.frame_count, 4, 4))
    for j in range(chain.frame_count):
        motion = np.tile(np.eye(4), (len(samples), 1, 1))
        if chain.kind[j] != FIXED:
            theta = chain.factor[j] * samples[:, chain.source[j]] + chain.offset[j]
            if chain.kind[j] == SLIDES:
                motion[:, :3, 3] = theta[:, None] * chain.axis[j]
            else:
                K = axis_rotation(chain.axis[j], np.pi / 2)
                n = np.outer(chain.axis[j], chain.axis[j])
                K = K - n  # the cross product with the axis
                s, c = np.sin(theta)[:, None, None], np.cos(theta)[:, None, None]
                motion[:, :3, :3] = n + c * (np.eye(3) - n) + s * K
        step = chain.origin[j] @ motion
        before = placed[:, chain.parent[j]] if chain.parent[j] >= 0 else np.eye(4)
        placed[:, j] = before @ step
    return placed


def contact_fraction(case: Case, finer: int) -> float | None:
    """Where on the path dense samples first show contact, or None."""
    problem = case.problem
    samples = dense(case.waypoints, finer)
    placed = placements(problem.chain, samples)
    earliest = None
    for pair in problem.pairs:
        a, b = pair.moving, pair.standing
        T_b = placed[:, b.frame] if b.frame >= 0 else b.T_frame_mesh[None]
        k = _first_meeting(
            _placed(placed[:, a.frame], a.mesh), _placed(np.asarray(T_b), b.mesh)
        )
        if k >= 0 and (earliest is None or k < earliest):
            earliest = k
    return None if earliest is None else earliest / (len(samples) - 1)


def _placed(T: Array, mesh: TriangleMesh) -> Array:
    """Triangles (samples, m, 9) at every placement."""
    points = np.einsum("kij,mcj->kmci", T[:, :3, :3], mesh.corners)
    points += T[:, None, None, :3, 3]
    return np.ascontiguousarray(points.reshape(len(T), -1, 9))


# Not kept between runs: numba would not see that what it calls has changed.
@njit(nogil=True, error_model="numpy")
def _first_meeting(first, second):  # type: ignore[no-untyped-def]
    """First sample at which any two triangles meet, or -1; all pairs are asked."""
    for k in range(len(first)):
        beta = second[k] if len(second) > 1 else second[0]
        for i in range(first.shape[1]):
            alpha = triangle_row(first[k], i)
            for j in range(second.shape[1]):
                if exact_pair(alpha, triangle_row(beta, j)):
                    return k
    return -1


# --- the study -----------------------------------------------------------------------


def judge(case: Case, verdict: PathVerdict) -> str:
    """Name of the outcome; those that begin with WRONG must not occur."""
    intervals = verdict.intervals
    if verdict.certified:
        meets = contact_fraction(case, FINER) is not None
        return "WRONG: clear, but dense samples meet" if meets else "clear"
    if verdict.verdict == "contact":
        if "contained" in verdict.qualifiers and verdict.first_contact is None:
            return "contained"
        if contact_fraction(case, SPARSE) is not None:
            return "contact"
        if contact_fraction(case, FINER) is not None:
            return "contact that sparse samples miss"
        return "contact between dense samples"
    clear = [s for s in intervals if s.verdict == "clear"]
    if clear and _meets_within(case, [(s.start, s.end) for s in clear]):
        return "WRONG: a clear stretch meets"
    return "unknown"


def _meets_within(case: Case, stretches: Sequence[tuple[float, float]]) -> bool:
    at = contact_fraction(case, FINER)
    return at is not None and any(s < at < e for s, e in stretches)


def run(paths: int, seed: int, progress: bool = False) -> Counter[str]:
    """Outcomes of so many random motions."""
    rng = np.random.default_rng(seed)
    outcomes: Counter[str] = Counter()
    for k in range(paths):
        case = random_case(rng)
        outcome = judge(case, search(case.problem, case.waypoints))
        outcomes[outcome] += 1
        if case.gap is not None:
            outcomes[f"  of these grazing: {outcome}"] += 1
        if outcome.startswith("WRONG"):
            outcomes[f"  {outcome} in case {k} of seed {seed}"] += 1
        if progress and (k + 1) % 500 == 0:
            print(f"{k + 1} of {paths}: {dict(outcomes)}", file=sys.stderr, flush=True)
    return outcomes


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--paths", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args(argv)
    outcomes = run(arguments.paths, arguments.seed, progress=True)
    print(json.dumps(dict(sorted(outcomes.items())), indent=1))
    return int(any(name.startswith("WRONG") for name in outcomes))


if __name__ == "__main__":
    sys.exit(main())
