"""Small robots in small scenes: motions that are clear, and motions that touch."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box, sphere
from borecheck.motion.certificate import bodies_of, certificate, statement
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS
from borecheck.verify.binding import Expected
from borecheck.verify.check import Expect

Array = NDArray[np.float64]
Document = dict[str, Any]

ABOUT: Document = {
    "robot": {
        "name": "arm.urdf",
        "arguments": {"mount": "+90"},
        "urdf_sha256": "0" * 64,
    },
    "scene": {"name": "gantry.stl", "arguments": {}},
}


@dataclass(frozen=True, eq=False)
class Case:
    """A motion, with its certificate if it is clear."""

    problem: PathProblem
    waypoints: Array
    document: Document

    @property
    def meshes(self) -> list[tuple[Array, NDArray[np.int64]]]:
        """The surfaces, as a verifier takes them."""
        bodies = bodies_of(self.problem)
        return [(body.mesh.vertices, body.mesh.triangles) for body in bodies]

    @property
    def expect(self) -> Expect:
        """What a certificate of these files must state."""
        content = statement(self.problem, self.waypoints, ABOUT)
        known = {b.mesh.sha256: (b.mesh.vertices, b.mesh.triangles)
                 for b in bodies_of(self.problem)}  # fmt: skip
        return lambda document: Expected("these files", content, known)


def honest(rng: np.random.Generator) -> Case:
    """A random motion that is clear, with its certificate."""
    while True:
        problem, waypoints = _random(rng)
        outcome = search(problem, waypoints)
        if outcome.verdict == "clear":
            document = certificate(problem, waypoints, outcome, ABOUT)
            if document is not None:
                return Case(problem, waypoints, document)


def touching(rng: np.random.Generator) -> Case:
    """A random motion that touches; it starts and ends clear."""
    while True:
        problem, waypoints = _random(rng)
        ends = (search(problem, q[None]).verdict for q in (waypoints[0], waypoints[-1]))
        touches = search(problem, waypoints).verdict == "contact"
        if touches and all(verdict == "clear" for verdict in ends):
            return Case(problem, waypoints, {})


def _random(rng: np.random.Generator) -> tuple[PathProblem, Array]:
    """An arm of three to five links that carry bars, past a ball and a block."""
    count = int(rng.integers(3, 6))
    turns = rng.random(count) < 0.75
    axis = rng.normal(size=(count, 3))
    source = np.arange(count)
    factor = np.ones(count)
    if rng.random() < 0.3:  # a mimic joint
        source[-1], factor[-1] = 0, rng.uniform(-1.0, 1.0)
    kind = np.where(turns, TURNS, SLIDES)
    if rng.random() < 0.3:
        kind[1] = FIXED
    used = np.unique(source[kind != FIXED], return_inverse=True)[1]
    source = np.full(count, -1)
    source[kind != FIXED] = used
    chain = JointChain(
        np.arange(count) - 1,
        np.array([_joint_origin(rng, j) for j in range(count)]),
        kind, axis, source, factor, np.zeros(count),
    )  # fmt: skip
    parts = tuple(_bar(rng, j) for j in range(count) if j == 0 or rng.random() < 0.8)
    obstacles = tuple(_obstacle(rng, k) for k in range(int(rng.integers(1, 3))))
    margin = float(rng.choice([0.0, 0.002, 0.01]))
    problem = PathProblem(chain, parts, obstacles, _self_pairs(chain, parts), margin)
    steps = rng.uniform(-0.25, 0.25, (int(rng.integers(1, 4)), max(1, len(set(used)))))
    return problem, np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps, axis=0)])


def _joint_origin(rng: np.random.Generator, j: int) -> Array:
    reach = [0.25 if j else 0.0, 0.0, 0.0]
    return transform(reach, rng.uniform(-0.5, 0.5, 3))


def _bar(rng: np.random.Generator, frame: int) -> Body:
    size = [rng.uniform(0.12, 0.2), *rng.uniform(0.02, 0.05, 2)]
    mesh = box("bar", size).moved(transform([0.125, 0.0, 0.0]))
    return Body(f"bar{frame}", mesh, frame)


def _obstacle(rng: np.random.Generator, k: int) -> Body:
    place = transform(rng.uniform(-0.7, 0.9, 3), rng.uniform(-3.0, 3.0, 3))
    mesh = box("block", rng.uniform(0.05, 0.5, 3))
    if rng.random() < 0.2:
        mesh = sphere("ball", rng.uniform(0.05, 0.2))
    role = str(rng.choice(["scanner", "couch", "patient", "other"]))
    return Body(f"obstacle{k}", replace(mesh, name="m"), T_frame_mesh=place, role=role)


def _self_pairs(
    chain: JointChain, parts: tuple[Body, ...]
) -> tuple[tuple[int, int], ...]:
    """All pairs of parts but of one rigid body and of neighbours: a straight chain."""
    body: list[int] = []
    for frame in range(chain.frame_count):
        fixed = chain.kind[frame] == FIXED and frame > 0
        body.append(body[frame - 1] if fixed else frame)
    own = [body[part.frame] for part in parts]
    order = {b: k for k, b in enumerate(sorted(set(own)))}
    return tuple(
        (i, j)
        for j in range(len(parts))
        for i in range(j)
        if abs(order[own[i]] - order[own[j]]) > 1
    )
