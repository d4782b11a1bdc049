"""A path certificate: what anyone needs to check again that a motion is clear.

For every pair of surfaces the motion is covered by intervals. Each names an instant in
it, a lower bound of the clearance at that instant, and an upper bound of how far any
point of one surface moves against the other during the interval; the first exceeds the
second by more than the margin, so the interval is clear. That is a cruder argument than
the search's own (`motion.search`), on purpose: it can be checked with a forward
kinematics and a distance, and `verify.check` does so sharing no code with it.

Displacement. With the joints at q_m, let d_j be the largest distance of the surface's
bounding box from the axis of joint j (1 for a sliding joint). Going from q_m to any q
by changing the joints one after the other, from the standing surface's side on, every
step turns the surface about one axis while all joints behind it still stand at q_m: it
moves by at most |theta_j - theta_j,m| d_j. The sum bounds the whole displacement.

A passage (a needle and its patient) has two lists of intervals, which together cover
the motion. Those `beside` are as of any pair: there the needle is plainly clear of the
patient. The others have no clearance, but an instant and a displacement; grown by it,
what the needle takes up at that instant is in the corridor or clear of the patient
(`passage`).

Times count waypoints: 0 at the first, n - 1 at the last, straight in between.
"""

import hashlib
import io
import json
import re
import zipfile
from collections.abc import Mapping
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.whole_files import check_writable, written_beside
from borecheck.errors import BorecheckError
from borecheck.motion.cover import apart, beside_or_within, cover
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.problem import (
    Body,
    Pair,
    Passage,
    PathProblem,
    path_motion,
)
from borecheck.plans.corridor import Corridor
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, TURNS

Array = NDArray[np.float64]

FORMAT = "borecheck path certificate"
FORMAT_VERSION = 2
# Of intervals in which two surfaces stay apart.
_COLUMNS = ["from", "to", "at", "clearance_m", "displacement_m"]
# Names of the arrays in the file of meshes.
_MESH_ARRAY = re.compile(r"[0-9a-f]{64}\.(vertices|triangles)")


def certificate(
    problem: PathProblem,
    waypoints: ArrayLike,
    outcome: PathVerdict,
    about: Mapping[str, Any] | None = None,
) -> dict[str, Any] | None:
    """The certificate of a motion that `motion.search` found clear.

    Args:
        problem: Who must not touch whom.
        waypoints: The motion, (n, nq).
        outcome: What the search said.
        about: What it is called: robot, scene and, of a needle plan, `plan` with its
            name and corridor, which every passage must have. Plain values.

    Returns:
        Plain values for `json.dumps`, or None: the motion is not certified, holds an
        open surface, or passes so near that it would need more than MOST_INTERVALS
        intervals for a pair.
    """
    if not outcome.certified or problem.excluded or not problem.obstacles:
        return None  # a certificate leaves no pair out, and speaks of a scene
    if not all(body.topology.is_closed for body in bodies_of(problem)):
        return None
    motion = path_motion(problem, waypoints)
    content = statement(problem, waypoints, about)
    for pair, way, record in zip(
        problem.pairs, problem.routes, content["pairs"], strict=True
    ):
        intervals = cover(motion, partial(apart, problem.chain, pair, way, motion))
        if intervals is None:
            return None
        record["intervals"] = intervals
    for passage, record in zip(problem.passages, content["passages"], strict=True):
        intervals = cover(motion, beside_or_within(problem, passage, motion))
        if intervals is None:
            return None
        columns = record["columns"]
        record["intervals"] = [row for row in intervals if len(row) == len(columns)]
        beside = [row for row in intervals if len(row) != len(columns)]
        record["beside"] = {"columns": _COLUMNS, "intervals": beside}
    return {**content, "sha256": digest(content)}


def statement(
    problem: PathProblem, waypoints: ArrayLike, about: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """What a certificate says of a motion, but for the intervals that prove it.

    Args:
        problem: Who must not touch whom.
        waypoints: The motion, (n, nq).
        about: What it is called, as in `certificate`.
    """
    content: dict[str, Any] = {
        "format": FORMAT,
        "format_version": FORMAT_VERSION,
        "versions": {name: version(name) for name in ("borecheck", "numpy", "numba")},
        "waypoints": np.array(waypoints, dtype=np.float64).tolist(),
        "margin_m": float(problem.margin),
        "chain": _chain_record(problem.chain),
        "bodies": [
            _body_record(body, "robot" if k < len(problem.parts) else body.role)
            for k, body in enumerate(bodies_of(problem))
        ],
        "part_count": len(problem.parts),
        "pairs": [_pair_record(problem, pair) for pair in problem.pairs],
        "passages": [_passage_record(problem, p) for p in problem.passages],
        "allowed": [
            {"first": i, "second": j, "reason": reason}
            for i, j, reason in problem.allowed
        ],
    }
    if about is not None:
        content["about"] = dict(about)
    return content


def digest(content: dict[str, Any]) -> str:
    """Hash of a certificate's content (without its own `sha256`)."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def write_certificate(
    file: str | Path, document: dict[str, Any], problem: PathProblem
) -> None:
    """Writes a certificate, and beside it `<name>.npz` with the meshes it names.

    Both or neither: they are written under other names first, an earlier pair goes
    before the new one comes, and the certificate itself comes last. Whenever this is
    interrupted, no certificate stands beside the meshes of another.

    Raises:
        BorecheckError: They cannot be written; nothing is left of them.
    """
    file = Path(file)
    meshes = file.with_suffix(".npz")
    for path in (file, meshes):
        check_writable(path, stream=False)
    file, meshes = file.resolve(), meshes.resolve()  # a link stays a link
    arrays: dict[str, Any] = {}
    for body in bodies_of(problem):
        arrays[f"{body.mesh.sha256}.vertices"] = body.mesh.vertices
        arrays[f"{body.mesh.sha256}.triangles"] = body.mesh.triangles
    packed = io.BytesIO()
    np.savez_compressed(packed, **arrays)
    text = json.dumps(document, indent=1)
    partial: list[Path] = []
    try:
        for target, content in ((meshes, packed.getvalue()), (file, text.encode())):
            partial.append(written_beside(target, content))
        file.unlink(missing_ok=True)
        try:
            partial[0].replace(meshes)
            partial[1].replace(file)
        except BaseException:
            meshes.unlink(missing_ok=True)  # without its certificate it is of no use
            raise
    except OSError as error:
        raise BorecheckError(f"{file} cannot be written: {error.strerror}") from error
    finally:
        for temporary in partial:
            temporary.unlink(missing_ok=True)


def holds_certified_meshes(file: Path) -> bool:
    """Whether a file is one of meshes that `write_certificate` left beside another."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            return all(_MESH_ARRAY.fullmatch(name) for name in arrays.files)
    except (OSError, ValueError, EOFError, AttributeError, zipfile.BadZipFile):
        return False


def bodies_of(problem: PathProblem) -> tuple[Body, ...]:
    """Parts, then obstacles, as a certificate counts them."""
    return (*problem.parts, *problem.obstacles)


def _chain_record(chain: JointChain) -> list[dict[str, Any]]:
    kinds = {FIXED: "fixed", TURNS: "turns"}
    return [
        {
            "parent": int(chain.parent[j]),
            "origin": chain.origin[j].tolist(),
            "kind": kinds.get(int(chain.kind[j]), "slides"),
            "axis": chain.axis[j].tolist(),
            "source": int(chain.source[j]),
            "factor": float(chain.factor[j]),
            "offset": float(chain.offset[j]),
        }
        for j in range(chain.frame_count)
    ]


def _body_record(body: Body, role: str) -> dict[str, Any]:
    return {
        "name": body.name,
        "role": role,
        "frame": body.frame,
        "T_frame_mesh": body.T_frame_mesh.tolist(),
        "mesh_sha256": body.mesh.sha256,
    }


def _pair_record(problem: PathProblem, pair: Pair) -> dict[str, Any]:
    bodies = bodies_of(problem)
    return {
        "moving": bodies.index(pair.moving),
        "standing": bodies.index(pair.standing),
        "margin_m": float(pair.margin),
        "columns": _COLUMNS,
    }


def _passage_record(problem: PathProblem, passage: Passage) -> dict[str, Any]:
    corridor = passage.corridor
    return {
        "moving": passage.part,
        "standing": len(problem.parts) + passage.obstacle,
        **corridor_record(corridor),
        "columns": ["from", "to", "at", "displacement_m"],
    }


def corridor_record(corridor: Corridor) -> dict[str, Any]:
    """Where a needle may be, as plain values."""
    return {
        "entry": [float(x) for x in corridor.entry],
        "target": [float(x) for x in corridor.target],
        "radius_m": float(corridor.radius),
        "slack_m": float(corridor.slack),
    }
