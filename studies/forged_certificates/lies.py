"""The best lie one can tell about a motion that touches.

Every pair is covered by intervals that are true, as far as there are any; what is left,
where the surfaces meet, is lied away in one way after the other. Lies about the motion
itself (`OF_ANOTHER`) make the certificate a true one of another robot, scene or path:
only the files can tell, so these must be refused when bound.
"""

import copy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.by_distance import displacement_about
from borecheck.motion.certificate import statement
from borecheck.motion.problem import Body, Motion, Pair, PathProblem, path_motion
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import TURNS, WORLD
from studies.forged_certificates.mutations import renewed
from studies.forged_certificates.problems import ABOUT, Case

Array = NDArray[np.float64]
Document = dict[str, Any]

NARROWEST = 1 / 256  # of a waypoint's step: shorter intervals are not tried
ROOM = 3e-8


@dataclass(frozen=True)
class Row:
    """An interval, with what is true of it."""

    begin: float
    end: float
    at: float
    clearance: float
    moved: float

    @property
    def row(self) -> list[float]:
        """As a certificate writes it."""
        return [self.begin, self.end, self.at, self.clearance, self.moved]


def rows_of(
    problem: PathProblem, motion: Motion, number: int
) -> list[tuple[Row, bool]]:
    """Intervals of a pair, in order, and whether each is proven."""
    pair, way = problem.pairs[number], problem.routes[number]
    waiting, found = [(0.0, len(motion.theta) - 1.0)], []
    while waiting:
        begin, end = waiting.pop()
        at = 0.5 * (begin + end)
        placed = motion.place(problem.chain, at)
        moved = displacement_about(
            problem.chain, pair, way, motion, placed, begin, at, end
        )
        need = moved + pair.margin + ROOM
        clearance = _clearance(pair, placed, 2.0 * need)
        if clearance > need or end - begin < NARROWEST:
            row = Row(begin, end, at, min(clearance, 2.0 * need), moved)
            found.append((row, clearance > need))
        else:
            waiting += [(at, end), (begin, at)]
    return found


def _clearance(pair: Pair, placed: Array, enough: float) -> float:
    T_b = pair.standing.T_frame_mesh
    if pair.standing.frame != WORLD:
        T_b = placed[pair.standing.frame]
    T_a = placed[pair.moving.frame]
    answer = pair.moving.tree.within(pair.standing.tree, T_a, T_b, enough)
    return enough if answer.verdict == "clear" else max(0.0, float(answer.lower) - 1e-9)


def truthful(case: Case) -> tuple[Document, list[int]]:
    """All that is true of a motion, and which pairs are not clear all the way."""
    document = statement(case.problem, case.waypoints, ABOUT)
    motion = path_motion(case.problem, case.waypoints)
    wrong = []
    for k, record in enumerate(document["pairs"]):
        rows = rows_of(case.problem, motion, k)
        record["intervals"] = [row.row for row, _ in rows]
        if not all(proven for _, proven in rows):
            wrong.append(k)
            record["unproven"] = [n for n, (_, proven) in enumerate(rows) if not proven]
    return document, wrong


Lie = Callable[[Document, list[int]], None]


def _rows(
    document: Document, wrong: list[int]
) -> Iterator[tuple[Document, list[float]]]:
    for k in wrong:
        record = document["pairs"][k]
        for n in record["unproven"]:
            yield record, record["intervals"][n]


def nothing(document: Document, wrong: list[int]) -> None:
    """Only the truth, which does not suffice."""


def less_moved(document: Document, wrong: list[int]) -> None:
    """Displacements as small as the clearance asks."""
    for record, row in _rows(document, wrong):
        row[3] = max(row[3], record["margin_m"] + ROOM)
        row[4] = max(0.0, row[3] - record["margin_m"] - ROOM / 2)


def more_apart(document: Document, wrong: list[int]) -> None:
    """Clearances as large as the displacement asks, and no larger."""
    for record, row in _rows(document, wrong):
        row[3] = row[4] + record["margin_m"] + ROOM


def hardly_apart(document: Document, wrong: list[int]) -> None:
    """The same by the least that is not refused for itself."""
    for record, row in _rows(document, wrong):
        row[3] = row[4] + record["margin_m"] + 1.0001e-9


def instants_elsewhere(document: Document, wrong: list[int]) -> None:
    """The instant of each interval where another one is clear."""
    for record, row in _rows(document, wrong):
        good = [
            r for r in record["intervals"] if r[3] > r[4] + record["margin_m"] + ROOM
        ]
        if good:
            row[2:] = good[0][2:]


def standing_instants(document: Document, wrong: list[int]) -> None:
    """Intervals at whose instant nothing has moved yet."""
    for record, row in _rows(document, wrong):
        row[2], row[4] = row[0], 0.0
        row[3] = max(row[3], record["margin_m"] + ROOM)


def left_out(document: Document, wrong: list[int]) -> None:
    """No interval where it touches."""
    for k in wrong:
        record = document["pairs"][k]
        kept = [
            r for n, r in enumerate(record["intervals"]) if n not in record["unproven"]
        ]
        record["intervals"] = kept or [[0.0, 0.0, 0.0, 1.0, 0.0]]


def bridged(document: Document, wrong: list[int]) -> None:
    """The interval before it reaches over the gap."""
    for k in wrong:
        record, end = document["pairs"][k], 0.0
        kept = [
            r for n, r in enumerate(record["intervals"]) if n not in record["unproven"]
        ]
        for row, after in zip_longest(kept, kept[1:]):
            row[0], end = end, row[1] if after is None else after[0]
            row[1] = end
        if kept:
            kept[-1][1] = float(len(document["waypoints"]) - 1)
        record["intervals"] = kept or [[0.0, 1.0, 0.5, 1.0, 0.5]]


def backwards(document: Document, wrong: list[int]) -> None:
    """Intervals that join, because one runs backwards over what touches."""
    for record, row in _rows(document, wrong):
        row[0], row[1] = row[1], row[0]
        row[3], row[4] = record["margin_m"] + ROOM, 0.0


def without_pair(document: Document, wrong: list[int]) -> None:
    """The pair is not named."""
    for k in reversed(wrong):
        del document["pairs"][k]


def another_twice(document: Document, wrong: list[int]) -> None:
    """Another pair is named in its place."""
    good = [k for k in range(len(document["pairs"])) if k not in wrong]
    for k in wrong:
        document["pairs"][k] = copy.deepcopy(document["pairs"][good[0] if good else k])


def other_body(document: Document, wrong: list[int]) -> None:
    """The pair stands, of a part with itself."""
    for k in wrong:
        document["pairs"][k]["standing"] = document["pairs"][k]["moving"]
        less_moved(document, [k])


def excluded(document: Document, wrong: list[int]) -> None:
    """The pair is left out with a word for it."""
    gone = [document["pairs"][k] for k in wrong]
    for record in gone:
        first, second = sorted((record["moving"], record["standing"]))
        document["allowed"].append(
            {"first": first, "second": second, "reason": "they may touch"}
        )
    parts = document["part_count"]
    document["excluded"] = [[r["moving"], r["standing"] - parts] for r in gone]
    without_pair(document, wrong)


def allowed(document: Document, wrong: list[int]) -> None:
    """The same in the words of this version."""
    excluded(document, wrong)
    del document["excluded"]


def negative_margin(document: Document, wrong: list[int]) -> None:
    """So much less than nothing that anything is enough."""
    document["margin_m"] = -10.0
    for k in wrong:
        document["pairs"][k]["margin_m"] = -10.0


def no_parts(document: Document, wrong: list[int]) -> None:
    """Nothing moves, so nothing needs to be asked."""
    document["part_count"] = 0
    without_pair(document, wrong)


def many_parts(document: Document, wrong: list[int]) -> None:
    """Everything is a part, or more than that."""
    document["part_count"] = len(document["bodies"]) if len(wrong) % 2 else 10**30
    without_pair(document, wrong)


def through_a_corridor(document: Document, wrong: list[int]) -> None:
    """What touches is a needle in its patient, and the plan says so."""
    corridor = {
        "entry": [0.0, 0.0, 3.0], "target": [0.0, 0.0, -3.0],
        "radius_m": 9.0, "slack_m": 1.0,
    }  # fmt: skip
    if wrong[0] % 2:
        corridor |= {"radius_m": 5e-3, "slack_m": 2e-3}
    document["about"] = {**document["about"], "plan": {"name": "liver", **corridor}}
    for k in wrong:
        record = document["pairs"][k]
        document["bodies"][record["standing"]]["role"] = "patient"
        document["passages"].append(
            {
                "moving": record["moving"], "standing": record["standing"], **corridor,
                "columns": ["from", "to", "at", "displacement_m"],
                "intervals": [[*r[:3], r[4]] for r in record["intervals"]],
            }
        )  # fmt: skip
    without_pair(document, wrong)


def beside_a_corridor(document: Document, wrong: list[int]) -> None:
    """What touches is a needle with a corridor, said to be clear all the way."""
    rows = [document["pairs"][k]["intervals"] for k in wrong]
    through_a_corridor(document, wrong)
    columns = ["from", "to", "at", "clearance_m", "displacement_m"]
    for passage, intervals in zip(
        document["passages"][-len(wrong) :], rows, strict=True
    ):
        passage["intervals"] = []
        passage["beside"] = {"columns": columns, "intervals": intervals}


def far_away(document: Document, wrong: list[int]) -> None:
    """So far that a step of the numbers is larger than the robot."""
    for body in document["bodies"][document["part_count"] :]:
        body["T_frame_mesh"][0][3] += 1e17
    document["chain"][0]["origin"][0][3] += 1e17
    less_moved(document, wrong)


def nowhere(document: Document, wrong: list[int]) -> None:
    """A motion through numbers that overflow between two that do not."""
    document["chain"][0]["factor"] = 1e308
    less_moved(document, wrong)


def shrunk(document: Document, wrong: list[int]) -> None:
    """An obstacle whose placement shrinks it."""
    for k in wrong:
        body = document["bodies"][document["pairs"][k]["standing"]]
        for row in body["T_frame_mesh"][:3]:
            row[:3] = [0.05 * x for x in row[:3]]


def long_axis(document: Document, wrong: list[int]) -> None:
    """Axes so short that nothing turns."""
    for joint in document["chain"]:
        joint["axis"] = [1e-6 * x for x in joint["axis"]]
    less_moved(document, wrong)


LIES: tuple[Lie, ...] = (
    nothing, less_moved, more_apart, hardly_apart, instants_elsewhere,
    standing_instants, left_out, bridged, backwards, without_pair, another_twice,
    other_body, excluded, allowed, negative_margin, no_parts, many_parts,
    through_a_corridor, beside_a_corridor, far_away, nowhere, shrunk, long_axis,
)  # fmt: skip


def forged(case: Case) -> Iterator[tuple[str, Document]]:
    """Every lie about a motion that touches."""
    document, wrong = truthful(case)
    for lie in LIES:
        lying = copy.deepcopy(document)
        lie(lying, wrong)
        for record in lying["pairs"]:
            record.pop("unproven", None)
        yield lie.__name__, renewed(lying)
    yield "skipped", _skipped(case)


def _skipped(case: Case) -> Document:
    """The instants of a motion that stands still where this one begins."""
    still = np.repeat(case.waypoints[:1], 2, axis=0)
    document, _ = truthful(Case(case.problem, still, {}))
    scale = float(len(case.waypoints) - 1)
    for record in document["pairs"]:
        for row in record["intervals"]:
            row[:3] = [scale * x for x in row[:3]]
    document["waypoints"] = case.waypoints.tolist()
    return renewed(document)


def hidden(rng: np.random.Generator) -> Iterator[tuple[str, Document, list[Any]]]:
    """Nothing but the truth about surfaces that never meet: one solid holds the other.

    An arm that moves a little, wholly in a block: drawn once; drawn on both sides; as
    two blocks that overlap of which one is inside out; and without a triangle.
    """
    chain = JointChain(
        np.array([-1]), np.eye(4)[None], np.array([TURNS]), rng.normal(size=(1, 3)),
        np.array([0]), np.ones(1), np.zeros(1),
    )  # fmt: skip
    arm = Body("arm", box("arm", rng.uniform(0.02, 0.2, 3)), 0)
    size = rng.uniform(2.0, 4.0, 3)
    block = box("block", size)
    back = TriangleMesh("block", block.vertices, block.triangles[:, ::-1])
    shift = transform([0.3 * size[0], 0.0, 0.0])
    surfaces = {
        "once": block,
        "both sides": _joined(block, back),
        "one inside out": _joined(block.moved(shift), back.moved(np.linalg.inv(shift))),
        "open": TriangleMesh("block", block.vertices, block.triangles[1:]),
    }
    points = np.array([[0.0], [rng.uniform(0.05, 0.5)]])
    for name, mesh in surfaces.items():
        problem = PathProblem(chain, (arm,), (Body("block", mesh),))
        case = Case(problem, points, {})
        yield name, renewed(truthful(case)[0]), case.meshes


def _joined(first: TriangleMesh, second: TriangleMesh) -> TriangleMesh:
    corners = second.triangles + len(first.vertices)
    return TriangleMesh(
        first.name,
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.triangles, corners]),
    )


def of_another(clear: Case, touching: Case) -> Iterator[tuple[str, Document]]:
    """True certificates of something else: to be refused as one of the touching motion.

    A clear motion of another robot under the names of this one; a robot whose joints do
    not move; an obstacle that stands elsewhere or is thinner.
    """
    yield "another robot and scene", clear.document
    still = _still(touching)
    yield "another path of it", still
    for change in (_fixed_joints, _moved_away, _weak_joints):
        changed = change(copy.deepcopy(still), touching)
        yield change.__name__.strip("_"), renewed(changed)
    thinner = copy.deepcopy(still)
    for body in thinner["bodies"][thinner["part_count"] :]:
        body["mesh_sha256"] = clear.document["bodies"][0]["mesh_sha256"]
    yield "other meshes", renewed(thinner)


def _still(case: Case) -> Document:
    """The robot stands where its motion begins, which is clear."""
    problem = case.problem
    points = np.repeat(case.waypoints[:1], len(case.waypoints), axis=0)
    document, _ = truthful(Case(problem, points, {}))
    return renewed(document)


def _fixed_joints(document: Document, case: Case) -> Document:
    for joint in document["chain"]:
        joint["kind"] = "fixed"
    document["waypoints"] = case.waypoints.tolist()
    return document


def _weak_joints(document: Document, case: Case) -> Document:
    for joint in document["chain"]:
        joint["factor"] = 0.0
    document["waypoints"] = case.waypoints.tolist()
    return document


def _moved_away(document: Document, case: Case) -> Document:
    for body in document["bodies"][document["part_count"] :]:
        body["T_frame_mesh"][2][3] += 50.0
    return document
