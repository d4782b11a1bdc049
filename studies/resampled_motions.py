"""Is the certified least clearance of a motion true: resampled by other libraries.

Motions of random chains past boxes, sheets and wires (half of them grazing), and of our
robots between random clear poses in their scanners. Each is placed a thousand times for
every step between its waypoints by Pinocchio, around its least ones a thousand times
finer again, and the distance of every pair is asked of Coal. A motion said to be clear
must meet nothing there, and come nowhere nearer than its certified least clearance.
Coal takes gaps of less than about a micrometre for contact: there exact signs judge.

No distance is left out that could be the least: a pair is skipped only at instants
where the boxes round both are farther apart than something already found.

    python -m studies.resampled_motions --chains 800 --robots 240 --seed 1
"""

import argparse
import json
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from borecheck.contact.check import check
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.all_pairs import all_contacts
from borecheck.geometry.triangles.narrowphase import narrowphase_code
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.motion.least_clearance import least_clearance
from borecheck.motion.problem import PathProblem
from borecheck.motion.robot_problem import path_problem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, load_scene
from studies.paths import random_case

Array = NDArray[np.float64]
# Placements (k, parts, 4, 4) of the moving parts at configurations (k, nq).
Kinematics = Callable[[Array], Array]

FINER = 1000
# The lowest places of the curve that are looked at finer again.
PLACES = 3
# What Coal's distances may be off by, and ours; far below any tolerance, [m].
ROUNDING = 1e-7


@dataclass(frozen=True, eq=False)
class Case:
    """A motion as both sides see it."""

    family: str
    problem: PathProblem
    waypoints: Array
    kinematics: Kinematics


@dataclass
class Result:
    """What came of all motions."""

    outcomes: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)
    below: dict[str, list[float]] = field(default_factory=dict)
    above: list[float] = field(default_factory=list)
    not_within: int = 0
    instants: int = 0
    interrupted: bool = False


# --- motions -------------------------------------------------------------------------


def chain_case(rng: np.random.Generator) -> Case:
    """A random chain past a random obstacle, from the study of paths."""
    found = random_case(rng)
    frames = [part.frame for part in found.problem.parts]
    place = _of_chain(found.problem.chain, frames)
    return Case("chains", found.problem, found.waypoints, place)


def chain_model(chain: JointChain) -> Any:
    """The chain as a Pinocchio model with one joint for every frame that moves."""
    model = pin.Model()
    joint_of, offset_of = {-1: 0}, {-1: pin.SE3.Identity()}
    for j in range(chain.frame_count):
        parent = int(chain.parent[j])
        place = offset_of[parent] * pin.SE3(chain.origin[j])
        if chain.kind[j] == FIXED:
            joint_of[j], offset_of[j] = joint_of[parent], place
        else:
            kind = pin.JointModelPrismaticUnaligned
            if chain.kind[j] != SLIDES:
                kind = pin.JointModelRevoluteUnaligned
            joint = model.addJoint(joint_of[parent], kind(chain.axis[j]), place, str(j))
            joint_of[j], offset_of[j] = joint, pin.SE3.Identity()
        frame = pin.Frame(f"f{j}", joint_of[j], offset_of[j], pin.FrameType.OP_FRAME)
        model.addFrame(frame)
    return model


def _of_chain(chain: JointChain, frames: Sequence[int]) -> Kinematics:
    model = chain_model(chain)
    moving = [j for j in range(chain.frame_count) if chain.kind[j] != FIXED]
    data = model.createData()
    ids = [model.getFrameId(f"f{frame}") for frame in frames]

    def place(qs: Array) -> Array:
        theta = chain.factor * qs[:, chain.source] + chain.offset
        placed = np.zeros((len(qs), len(ids), 4, 4))
        for k, row in enumerate(theta):
            pin.framesForwardKinematics(model, data, row[moving])
            for i, frame in enumerate(ids):
                placed[k, i] = data.oMf[frame].homogeneous
        return placed

    return place


def robot_case(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A motion between clear poses of a robot: long, or a short piece of one."""
    lower, upper = robot.model.lower, robot.model.upper
    points: list[Array] = []
    while len(points) < rng.integers(2, 4):
        q = rng.uniform(lower, upper)
        if points and rng.random() < 0.5:  # a step as a planner makes it
            q = points[-1] + 0.1 * (q - points[-1])
        if check(robot, scene, q).clear:
            points.append(q)

    def place(qs: Array) -> Array:
        every = (robot.placements(q) for q in qs)
        return np.array([[T[part.link] for part in robot.parts] for T in every])

    return Case(robot.name, path_problem(robot, scene), np.array(points), place)


# --- the judge -----------------------------------------------------------------------


class Oracle:
    """The least distance over instants, by Coal, of everything in a case."""

    def __init__(self, case: Case) -> None:
        self.case = case
        problem = case.problem
        self.parts = [_model(part.mesh) for part in problem.parts]
        self.obstacles = [_model(obstacle.mesh) for obstacle in problem.obstacles]
        self.places = [_placement(o.T_frame_mesh) for o in problem.obstacles]
        self.own = np.array([_centre_and_half(p.mesh) for p in problem.parts])
        boxes = [_centre_and_half(o.mesh) for o in problem.obstacles]
        self.boxes = np.array(
            [
                _moved(np.array(box), o.T_frame_mesh)
                for box, o in zip(boxes, problem.obstacles, strict=True)
            ]
        )
        self.best, self.instants, self.touching = np.inf, 0, False

    def least(self) -> float:
        """Least distance found, [m]; 0 in contact."""
        steps = len(self.case.waypoints) - 1
        times = np.linspace(0.0, steps, FINER * steps + 1)
        curve = self._curve(times)
        edges = np.pad(curve, 1, constant_values=np.inf)
        lowest = np.flatnonzero((curve <= edges[:-2]) & (curve <= edges[2:]))
        for k in lowest[np.argsort(curve[lowest])][:PLACES]:
            around = times[max(k - 1, 0)], times[min(k + 1, len(times) - 1)]
            self._curve(np.linspace(*around, FINER))
        return self.best

    def self_contact(self) -> bool:
        """Whether parts that must not touch each other do so at any instant."""
        steps = len(self.case.waypoints) - 1
        placed = self._placed(np.linspace(0.0, steps, FINER * steps + 1))
        centre, half = self._moved_boxes(placed)
        for i, j in self.case.problem.self_pairs:
            between = np.abs(centre[:, i] - centre[:, j]) - half[:, i] - half[:, j]
            for k in np.flatnonzero((between <= 0.0).all(axis=-1)):
                request, result = coal.CollisionRequest(), coal.CollisionResult()
                T_i, T_j = _placement(placed[k, i]), _placement(placed[k, j])
                pair = self.parts[i], T_i, self.parts[j], T_j
                if coal.collide(*pair, request, result):
                    return True
        return False

    def _placed(self, times: Array) -> Array:
        self.instants += len(times)
        points = self.case.waypoints
        steps = np.arange(len(points))
        qs = np.column_stack([np.interp(times, steps, column) for column in points.T])
        return self.case.kinematics(qs)

    def _curve(self, times: Array) -> Array:
        """Least distance at each instant, or a bound that is above the least so far."""
        placed = self._placed(times)
        gaps = self._gaps(placed)
        curve = gaps.min(axis=(1, 2))
        for k in np.argsort(curve):
            if curve[k] > self.best:
                break
            near = zip(*np.nonzero(gaps[k] <= self.best), strict=True)
            found = [self._distance(placed[k, i], int(i), int(j)) for i, j in near]
            curve[k] = max(curve[k], min(found))
        return curve

    def _gaps(self, placed: Array) -> Array:
        """Distances (k, parts, obstacles) between boxes along the axes."""
        centre, half = self._moved_boxes(placed)
        between = np.abs(centre[:, :, None] - self.boxes[None, None, :, 0])
        apart = between - half[:, :, None] - self.boxes[None, None, :, 1]
        return np.asarray(np.linalg.norm(np.maximum(apart, 0.0), axis=-1))

    def _moved_boxes(self, placed: Array) -> tuple[Array, Array]:
        """Centres and half extents, along the axes, of the parts' boxes."""
        R, t = placed[..., :3, :3], placed[..., :3, 3]
        centre = np.einsum("kpij,pj->kpi", R, self.own[:, 0]) + t
        return centre, np.einsum("kpij,pj->kpi", np.abs(R), self.own[:, 1])

    def _distance(self, T: Array, part: int, obstacle: int) -> float:
        one = self.parts[part], _placement(T)
        other = self.obstacles[obstacle], self.places[obstacle]
        request, result = coal.DistanceRequest(), coal.DistanceResult()
        found = max(float(coal.distance(*one, *other, request, result)), 0.0)
        if found == 0.0 and not self.touching:
            moving = self.case.problem.parts[part].mesh
            standing = self.case.problem.obstacles[obstacle]
            other_mesh = place_mesh(standing.T_frame_mesh, standing.mesh)
            self.touching = _meet(place_mesh(T, moving), other_mesh)
        self.best = min(self.best, found)
        return found


def _meet(a: TriangleMesh, b: TriangleMesh) -> bool:
    """Whether placed surfaces meet: all pairs of triangles, by exact signs."""
    rows = a.corners.reshape(-1, 9), b.corners.reshape(-1, 9)
    return len(all_contacts(narrowphase_code("exact"), *rows)) > 0


def _model(mesh: TriangleMesh) -> Any:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.triangles), len(mesh.vertices))
    model.addVertices(np.array(mesh.vertices))
    model.addTriangles(np.array(mesh.triangles))
    model.endModel()
    return model


def _placement(T: Array) -> Any:
    return coal.Transform3s(np.array(T[:3, :3]), np.array(T[:3, 3]))


def _centre_and_half(mesh: TriangleMesh) -> tuple[Array, Array]:
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    return 0.5 * (low + high), 0.5 * (high - low)


def _moved(box: Array, T: Array) -> Array:
    return np.array([T[:3, :3] @ box[0] + T[:3, 3], np.abs(T[:3, :3]) @ box[1]])


# --- the study -----------------------------------------------------------------------


def examine(case: Case, result: Result, label: str) -> None:
    """Adds what comes of one motion."""
    found = search(case.problem, case.waypoints)
    result.outcomes[f"{case.family}: {found.verdict}"] += 1
    if not found.certified:
        return
    least = least_clearance(case.problem, case.waypoints, found)
    oracle = Oracle(case)
    resampled = oracle.least()
    if oracle.touching or oracle.self_contact():
        result.wrong.append(f"{label}: clear, but resampled in contact")
    result.instants += oracle.instants
    if least is None:
        result.outcomes[f"{case.family}: clear without a least clearance"] += 1
        return
    if least.lower > resampled + ROUNDING:
        result.wrong.append(f"{label}: {least.lower} m certified, {resampled} m seen")
    result.not_within += not least.within_tolerance
    result.above.append(least.upper - resampled)
    if resampled == 0.0:
        result.outcomes["nearer than Coal tells from contact"] += 1
        return
    kind = "2 mm and more" if resampled >= 2e-3 else "less than 2 mm"
    for name in ("all", kind):
        result.below.setdefault(name, []).append(1.0 - least.lower / resampled)


def run(
    chains: int, robots: int, seed: int, progress: Callable[[str], None] | None = None
) -> Result:
    """Outcomes of so many random motions of chains and of robots.

    What is finished stays when the user interrupts.
    """
    result = Result()
    try:
        _examine_all(result, chains, robots, seed, progress or (lambda text: None))
    except KeyboardInterrupt:
        result.interrupted = True
    return result


def _examine_all(
    result: Result, chains: int, robots: int, seed: int, progress: Callable[[str], None]
) -> None:
    rng = np.random.default_rng(seed)
    for k in range(chains):
        examine(chain_case(rng), result, f"chain {k} of seed {seed}")
        if (k + 1) % 100 == 0:
            progress(f"{k + 1} of {chains} chains: {dict(result.outcomes)}")
    ours = _robots() if robots else []
    for k in range(robots):
        robot, scene = ours[k % len(ours)]
        case = robot_case(rng, robot, scene)
        examine(case, result, f"{robot.name} {k} of seed {seed}")
        if (k + 1) % 20 == 0:
            progress(f"{k + 1} of {robots} of robots: {dict(result.outcomes)}")


def _robots() -> list[tuple[Robot, Scene]]:
    return [
        (load_robot("zerobot", mount="+90"), load_scene("ct_gantry")),
        (load_robot("mri_arm"), load_scene("mri_open_magnet")),
    ]


def summary(result: Result) -> dict[str, Any]:
    """Counts, and how far the certified least clearance is below the resampled one."""
    quantiles = (0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
    return {
        "motions": sum(n for name, n in result.outcomes.items() if ":" in name),
        "interrupted": result.interrupted,
        "outcomes": dict(sorted(result.outcomes.items())),
        "instants resampled": result.instants,
        "wrong": result.wrong,
        "clear and not within the tolerance": result.not_within,
        "certified below resampled, share": {
            name: {
                "motions": len(values),
                **{f"{q:.0%}": float(np.quantile(values, q)) for q in quantiles},
            }
            for name, values in sorted(result.below.items())
        },
        "reached above resampled at most, m": max(result.above, default=0.0),
    }


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--chains", type=int, default=800)
    parser.add_argument("--robots", type=int, default=240)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args(argv)
    result = run(
        arguments.chains,
        arguments.robots,
        arguments.seed,
        lambda text: print(text, file=sys.stderr, flush=True),
    )
    print(json.dumps(summary(result), indent=1))
    return 130 if result.interrupted else int(bool(result.wrong))


if __name__ == "__main__":
    sys.exit(main())
