"""What is compared: one function per row of the table, each returns its lines."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from benchmarks.peers import MANY, Coal, Fcl, Pinocchio, coal_request
from benchmarks.plain import chunked_numpy, scalar_loop
from benchmarks.poses import POSES, BenchScene, Pose, path_of
from benchmarks.timing import paired
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.geometry.triangles import all_pairs
from borecheck.geometry.triangles import exact as exact_contact
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.published import NARROWPHASES
from borecheck.geometry.triangles.two_sided import two_sided
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import search

SAMPLES = 1000  # poses on a path
ENDS = ("clear", "free", "contact")  # see poses.path_of


@dataclass(frozen=True)
class Line:
    """One measured line of the table.

    Attributes:
        row: Which row of the issue.
        case: Scene and pose.
        ours: Median CPU seconds of the project's own call.
        others: Median CPU seconds of each peer, by name with its settings.
        goals: Least ratio wanted against a peer, by name.
        note: What else the reader should know.
    """

    row: str
    case: str
    ours: float
    others: dict[str, float]
    goals: dict[str, float] = field(default_factory=dict)
    note: str = ""

    def ratio(self, name: str) -> float:
        """How many times faster than that peer."""
        return self.others[name] / self.ours


class Bench:
    """One scene with everything built that the rows need."""

    def __init__(self, scene: BenchScene, repeats: int) -> None:
        self.scene = scene
        self.repeats = repeats
        self.trees = [MeshTree.of(mesh) for mesh in scene.links]
        self.tree = MeshTree.of(scene.obstacle)
        self.moving = MovingLinks.against(
            PackedTrees(self.trees), PackedTrees([self.tree])
        )

    @cached_property
    def coal(self) -> Coal:
        """Coal's models of it."""
        return Coal(self.scene)

    @cached_property
    def pin(self) -> Pinocchio:
        """Pinocchio's model of it."""
        return Pinocchio(self.scene, self.coal)

    @cached_property
    def fcl(self) -> Fcl:
        """python-fcl's models of it."""
        return Fcl(self.scene)

    @cached_property
    def problem(self) -> PathProblem:
        """The certified search's view of it."""
        parts = tuple(
            Body(mesh.name, mesh, frame)
            for mesh, frame in zip(self.scene.links, self.scene.frames, strict=True)
        )
        return PathProblem(
            self.scene.chain, parts, (Body("obstacle", self.scene.obstacle),)
        )

    def time(self, jobs: dict[str, Callable[[], object]]) -> dict[str, float]:
        """Median CPU seconds of every job, in turns."""
        return paired(jobs, self.repeats)


def first_contact(bench: Bench) -> list[Line]:
    """Row 1: one pose, one Python call, all links."""
    return [_first_contact_at(bench, name) for name in POSES]


def _first_contact_at(bench: Bench, name: str) -> Line:
    pose = bench.scene.poses[name]
    one, moving, coal, pin = pose.placements[None], bench.moving, bench.coal, bench.pin
    default, tight = coal_request(), coal_request(tight=True)
    if bool(moving.first_contacts(one)[0]) != coal.geometry(pose, default):
        raise RuntimeError(f"{bench.scene.name}, {name}: Coal sees something else")
    transforms = coal.transforms(pose)
    pin.stand(pose)
    q = pin.configuration(pose.q)
    times = bench.time(
        {
            "ours": lambda: moving.first_contacts(one),
            "Coal geometry API, default": lambda: coal.geometry(pose, default),
            "Coal geometry API, break_distance=0": lambda: coal.geometry(pose, tight),
            "Coal objects reused, default": lambda: coal.reused(transforms, default),
            "Coal objects reused, break_distance=0": lambda: coal.reused(
                transforms, tight
            ),
            "Pinocchio one call, default": lambda: pin.collide(q),
            "python-fcl": lambda: bench.fcl.collide(pose),
        }
    )
    goals = {
        "Coal geometry API, default": 10.0 if name.startswith("parallel") else 5.0,
        "Pinocchio one call, default": 2.0,
    }
    return _line("1 first contact", bench, name, times, goals)


def every_contact(bench: Bench) -> list[Line]:
    """Row 2: all triangle pairs in contact."""
    return [_every_contact_at(bench, name) for name in POSES[3:]]


def _every_contact_at(bench: Bench, name: str) -> Line:
    pose = bench.scene.poses[name]
    one, moving, coal = pose.placements[None], bench.moving, bench.coal
    default, tight = coal_request(MANY), coal_request(MANY, tight=True)
    times = bench.time(
        {
            "ours": lambda: moving.contacts(one),
            "Coal, default": lambda: coal.all_contacts(pose, default),
            "Coal, break_distance=0": lambda: coal.all_contacts(pose, tight),
            "python-fcl": lambda: bench.fcl.collide(pose, MANY),
        }
    )
    goals = {"Coal, default": 12.0, "Coal, break_distance=0": 6.0}
    counts = len(moving.contacts(one)), coal.all_contacts(pose, default)
    note = f"{counts[0]} pairs (Coal {counts[1]})"
    return _line("2 all contacts", bench, name, times, goals, note)


def clearance(bench: Bench) -> list[Line]:
    """Row 3: certified within 10 %, and exact."""
    return [line for name in POSES[:3] for line in _clearance_at(bench, name)]


def _clearance_at(bench: Bench, name: str) -> list[Line]:
    pose = bench.scene.poses[name]
    one, moving = pose.placements[None], bench.moving
    times = bench.time(
        {
            "10 %": lambda: moving.clearances(one, 0.1),
            "exact": lambda: moving.clearances(one, 0.0),
            "coal.distance": lambda: bench.coal.distance(pose),
            "python-fcl distance": lambda: bench.fcl.distance(pose),
        }
    )
    exact, near = times.pop("exact"), times.pop("10 %")
    note = f"{float(moving.clearances(one)[0, 0]) * 1e3:.3f} mm"
    return [
        _line(row, bench, name, {"ours": ours, **times}, {"coal.distance": goal}, note)
        for row, ours, goal in (
            ("3 clearance within 10 %", near, 25.0),
            ("3 clearance, exact", exact, 0.75),
        )
    ]


def many_poses(bench: Bench) -> list[Line]:
    """Row 4: 1,000 poses in one call."""
    bench.pin.stand(bench.scene.poses["clear"])
    return [_many_poses_to(bench, end) for end in ENDS]


def _many_poses_to(bench: Bench, end: str) -> Line:
    qs = path_of(bench.scene, SAMPLES, end)
    placed = _placements(bench, qs)
    default, tight = coal_request(), coal_request(tight=True)
    poses = [Pose(q, np.zeros(3), T) for q, T in zip(qs, placed, strict=True)]
    values = [bench.pin.configuration(q) for q in qs]
    hits = bench.moving.first_contacts(placed)
    coal, pin = bench.coal, bench.pin
    times = bench.time(
        {
            "ours": lambda: bench.moving.first_contacts(placed),
            "Coal loop, geometry API, default": lambda: [
                coal.geometry(pose, default) for pose in poses
            ],
            "Coal loop, geometry API, break_distance=0": lambda: [
                coal.geometry(pose, tight) for pose in poses
            ],
            "Pinocchio loop, default": lambda: [pin.collide(q) for q in values],
        }
    )
    goals = {"Coal loop, geometry API, default": 20.0, "Pinocchio loop, default": 7.0}
    note = f"{int(hits.sum())} of {SAMPLES} poses in contact; goal 0.5 ms"
    return _line("4 1,000 poses", bench, end, times, goals, note)


def whole_path(bench: Bench) -> list[Line]:
    """Row 5: every instant of the same motions, kinematics included."""
    return [_whole_path_to(bench, end) for end in ENDS]


def _whole_path_to(bench: Bench, end: str) -> Line:
    qs = path_of(bench.scene, SAMPLES, end)
    verdict = search(bench.problem, qs)
    times = bench.time({"ours": lambda: search(bench.problem, qs)})
    counts = ", ".join(f"{n} {what}" for what, n in verdict.counts.items())
    goal = 2.0 if end == "contact" else 0.3
    note = f"{verdict.verdict}; {counts}; goal {goal:g} ms"
    return _line("5 certified path", bench, end, times, {}, note)


def exactness(bench: Bench) -> list[Line]:
    """Row 6: the exact test against plain floating point, per leaf and per query."""
    pose = bench.scene.poses["50 mm deep"]
    one = pose.placements[None]
    first, second = _leaf_pairs(bench, pose)
    leaf = bench.time(
        {
            "ours": lambda: exact_contact.exact(first, second),
            "float64, both ways round": lambda: two_sided(first, second),
        }
    )
    query = bench.time(
        {
            "ours": lambda: bench.moving.contacts(one, "exact"),
            "float64, both ways round": lambda: bench.moving.contacts(one, "two-sided"),
        }
    )
    rng = np.random.default_rng(0)
    lattice = rng.integers(0, 4, (2, 20_000, 3, 3)).astype(float)
    hard = bench.time(
        {
            "ours": lambda: exact_contact.exact(*lattice),
            "float64, both ways round": lambda: two_sided(*lattice),
        }
    )
    _, roads = exact_contact.exact_counted(*lattice)
    lines = []
    for what, times, goal, note in (
        ("leaf", leaf, 1 / 1.5, f"{len(first)} pairs whose boxes meet"),
        ("query", query, 1 / 1.1, "all contacts"),
        ("degenerate", hard, 0.0, f"20,000 lattice pairs, {roads} by exact arithmetic"),
    ):
        line = _line("6 exactness", bench, what, times, {}, note)
        if goal:
            line.goals["float64, both ways round"] = goal
        lines.append(line)
    return lines


def brute_force(bench: Bench) -> list[Line]:
    """Row 7: every triangle against every triangle."""
    pose = bench.scene.poses["50 mm deep"]
    alpha = np.concatenate(
        [
            place_mesh(T, mesh).corners.reshape(-1, 9)
            for T, mesh in zip(pose.placements, bench.scene.links, strict=True)
        ]
    )
    beta = np.ascontiguousarray(bench.scene.obstacle.corners.reshape(-1, 9))
    code = NARROWPHASES["exact"]
    pairs = len(alpha) * len(beta)
    # The slow ones are timed on a part and scaled: their work is that of the pairs.
    part = beta[: max(1, int(2e7 / len(alpha)))]
    few = beta[: max(1, int(1e6 / len(alpha)))]
    times = bench.time(
        {
            "ours": lambda: all_pairs.all_contacts(code, alpha, beta),
            "plain numba signs": lambda: all_pairs.all_contacts(
                code, alpha, beta, vector=False
            ),
            "scalar numba loop": lambda: scalar_loop(alpha, part),
            "chunked numpy": lambda: chunked_numpy(alpha, few),
        }
    )
    times["scalar numba loop"] *= len(beta) / len(part)
    times["chunked numpy"] *= len(beta) / len(few)
    goals = {"scalar numba loop": 45.0, "chunked numpy": 500.0}
    speed = pairs / times["ours"] / 1e9
    note = f"{pairs:.3g} pairs, {speed:.2f} G verified pairs/s (goal 4 with AVX-512)"
    return [_line("7 all pairs", bench, "50 mm deep", times, goals, note)]


ROWS: dict[str, Callable[[Bench], list[Line]]] = {
    "1": first_contact,
    "2": every_contact,
    "3": clearance,
    "4": many_poses,
    "5": whole_path,
    "6": exactness,
    "7": brute_force,
}


def _line(
    row: str,
    bench: Bench,
    case: str,
    times: dict[str, float],
    goals: dict[str, float],
    note: str = "",
) -> Line:
    others = {name: value for name, value in times.items() if name != "ours"}
    a, b = bench.scene.counts
    where = f"{bench.scene.name} ({a} x {b}), {case}"
    return Line(row, where, times["ours"], others, dict(goals), note)


def _placements(bench: Bench, qs: Any) -> Any:
    """T_world_link along a path, (k, links, 4, 4)."""
    chain = bench.scene.chain
    return chain.placements(qs, bench.scene.frames)


def _leaf_pairs(bench: Bench, pose: Pose) -> tuple[Any, Any]:
    """Triangles whose boxes meet at a pose, placed, two arrays (k, 3, 3)."""
    first, second = [], []
    parts = zip(bench.scene.links, bench.trees, pose.placements, strict=True)
    for mesh, tree, T in parts:
        ids = tree.candidates(bench.tree, T, np.eye(4))
        first.append(place_mesh(T, mesh).corners[ids[:, 0]])
        second.append(bench.scene.obstacle.corners[ids[:, 1]])
    return np.concatenate(first), np.concatenate(second)
