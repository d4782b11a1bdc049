"""Checks a path certificate again, with numpy only and no code of the search.

For every pair of surfaces the intervals must cover the motion from its first waypoint
to its last without a gap. For every interval three things are derived here once more:
the placements at the named instant (products of Rodrigues rotations), how far any
point of one surface can move against the other during the interval, and that no two
triangles are nearer than the named clearance (boxes round groups of triangles, then
the distance of the triangles left over). The clearance must exceed displacement and
margin. Closed surfaces must not hold each other at the start.

A passage is a pair that may touch within a stated corridor, a needle and its patient.
Its intervals name an instant and a displacement; `verify.passage` says what must
hold then. What corridor was meant, no certificate can know: it is named in the answer.
Names of robot, scene and plan are what the writer called them; only that a passage is
the corridor of the plan named is asked.

Displacement. Let the joints stand at q_m. Of a product of joint transforms change one
factor after the other from the standing side to the moving side: at each step what lies
behind the joint is still as at q_m, so a point moves on a circle about that joint's
axis whose radius is its distance from the axis at q_m, or straight along it. Steps add.
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.verify.distance import GroupedMesh, nearer_than
from borecheck.verify.passage import StatedCorridor
from borecheck.verify.solid import connected_corners, is_closed, winding_number

Array = NDArray[np.float64]
Arrays = tuple[Array, NDArray[np.int64]]

FORMAT = "borecheck path certificate"
FORMAT_VERSION = 1
# The clearance must exceed margin and displacement by this: more than rounding, [m].
RESERVE = 1e-9
# Displacements may be recorded this much below what is derived here: rounding, [m].
ROUNDING = 1e-10
# What a passage and the plan it belongs to must both state.
CORRIDOR = ("entry", "target", "radius_m", "slack_m")
# A rotation's rows are unit vectors up to this.
RIGID = 1e-9


@dataclass(frozen=True)
class Verification:
    """What checking a certificate gave.

    Attributes:
        accepted: Whether every statement was confirmed.
        problems: What was not, one line each.
        intervals: How many intervals were checked.
        pairs: How many pairs of surfaces.
        not_covered: Pairs (part, obstacle) that the certificate leaves out.
        passages: Pairs that may touch, and the corridor stated for each.
    """

    accepted: bool
    problems: tuple[str, ...]
    intervals: int
    pairs: int
    not_covered: tuple[tuple[str, str], ...] = ()
    passages: tuple[str, ...] = ()


class _Rejected(Exception):  # noqa: N818 - not an error: the answer of the check
    """A statement of the certificate that does not hold."""


def verify(
    source: str | Path | Mapping[str, Any],
    meshes: Mapping[str, Arrays] | Iterable[Arrays] | str | Path | None = None,
) -> Verification:
    """Checks a certificate.

    Args:
        source: A file, or its content.
        meshes: The surfaces it speaks of: arrays (vertices (n, 3) [m], triangles
            (m, 3)) in any order or under any names, or the `.npz` file with them. By
            default the file beside the certificate with the suffix `.npz`.

    Returns:
        Whether it holds, and if not, why not. A certificate that cannot be read at all
        is not accepted either.
    """
    try:
        document, beside = _read(source)
        _check_frame(document)
        known = _known_meshes(meshes if meshes is not None else beside)
        checker = _Checker(document, known)
        return checker.run()
    except _Rejected as problem:
        return Verification(False, (str(problem),), 0, 0)
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as problem:
        text = f"not a certificate: {type(problem).__name__}: {problem}"
        return Verification(False, (text,), 0, 0)


def _read(source: str | Path | Mapping[str, Any]) -> tuple[dict[str, Any], Path | None]:
    if isinstance(source, Mapping):
        return dict(source), None
    file = Path(source)
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        raise _Rejected(f"{file}: cannot be read: {error.strerror}") from error
    return dict(json.loads(text)), file.with_suffix(".npz")


def _check_frame(document: dict[str, Any]) -> None:
    """Format, version, and that nothing was changed since it was written."""
    if document["format"] != FORMAT or document["format_version"] != FORMAT_VERSION:
        raise _Rejected(f"not a {FORMAT}, version {FORMAT_VERSION}")
    content = {name: value for name, value in document.items() if name != "sha256"}
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    if hashlib.sha256(text.encode()).hexdigest() != document["sha256"]:
        raise _Rejected("its content does not have the hash it states")


def _known_meshes(
    meshes: Mapping[str, Arrays] | Iterable[Arrays] | str | Path | None,
) -> dict[str, Arrays]:
    """Meshes by the hash of their numbers, which is computed here."""
    if meshes is None:
        raise _Rejected("the meshes it speaks of are needed to check it")
    if isinstance(meshes, str | Path):
        found: Iterable[Arrays] = _read_meshes(Path(meshes))
    elif isinstance(meshes, Mapping):
        found = meshes.values()
    else:
        found = meshes
    known = {}
    for points, corners in found:
        vertices = np.array(points, dtype=np.float64, order="C")
        triangles = np.array(corners, dtype=np.int64, order="C")
        both = hashlib.sha256(vertices.tobytes())
        both.update(triangles.tobytes())
        known[both.hexdigest()] = (vertices, triangles)
    return known


def _read_meshes(file: Path) -> list[Arrays]:
    try:
        with np.load(file, allow_pickle=False) as stored:
            names = {name.rsplit(".", 1)[0] for name in stored.files}
            return [
                (stored[f"{name}.vertices"], stored[f"{name}.triangles"])
                for name in sorted(names)
            ]
    except (OSError, EOFError) as error:
        raise _Rejected(f"{file}: its meshes cannot be read: {error}") from error


@dataclass(frozen=True)
class _Joint:
    """One joint of the chain as the certificate states it."""

    parent: int
    origin: Array
    kind: str
    axis: Array
    source: int
    factor: float
    offset: float


@dataclass(frozen=True, eq=False)
class _Surface:
    """One body of the certificate with its mesh."""

    name: str
    frame: int
    T_frame_mesh: Array
    mesh: GroupedMesh
    box: Array

    @cached_property
    def closed(self) -> bool:
        """Whether it bounds a solid."""
        return is_closed(self.mesh.vertices, self.mesh.triangles)

    @cached_property
    def one_corner_each(self) -> Array:
        """A corner of every connected part."""
        return connected_corners(self.mesh.vertices, self.mesh.triangles)


class _Checker:
    """A certificate taken apart, and every statement of it asked again."""

    def __init__(self, document: dict[str, Any], known: dict[str, Arrays]) -> None:
        self.waypoints = np.array(document["waypoints"], dtype=np.float64)
        if self.waypoints.ndim != 2 or not np.isfinite(self.waypoints).all():
            raise _Rejected("its waypoints are not configurations")
        if len(self.waypoints) == 1:  # a motion that stands still
            self.waypoints = np.repeat(self.waypoints, 2, axis=0)
        self.joints = [_joint(k, record) for k, record in enumerate(document["chain"])]
        self.margin = float(document["margin_m"])
        self.parts = int(document["part_count"])
        self.bodies = [self._surface(r, known) for r in document["bodies"]]
        self.pairs = document["pairs"]
        self.passages = document.get("passages", [])
        self.about = document.get("about")
        self.excluded = {(int(i), int(j)) for i, j in document["excluded"]}
        self.allowed: list[str] = []
        self.problems: list[str] = []
        self.checked = 0

    def run(self) -> Verification:
        self._all_pairs_are_there()
        self._passages_are_the_plans()
        for record in self.pairs:
            try:
                self._pair(record)
            except _Rejected as problem:
                self.problems.append(str(problem))
        for record in self.passages:
            try:
                self._passage(record)
            except (_Rejected, ValueError) as problem:
                self.problems.append(str(problem))
        left_out = tuple(
            (self.bodies[i].name, self.bodies[self.parts + j].name)
            for i, j in sorted(self.excluded)
        )
        if not (self.pairs or self.passages):
            self.problems.append("it speaks of no pair of surfaces")
        return Verification(
            not self.problems,
            tuple(self.problems),
            self.checked,
            len(self.pairs) + len(self.passages),
            left_out,
            tuple(self.allowed),
        )

    def _surface(self, record: dict[str, Any], known: dict[str, Arrays]) -> _Surface:
        name, stated = str(record["name"]), record["mesh_sha256"]
        if stated not in known:
            raise _Rejected(f"{name}: no mesh given has the hash {stated[:12]}...")
        T = _rigid(record["T_frame_mesh"], name)
        frame = int(record["frame"])
        if not -1 <= frame < len(self.joints):
            raise _Rejected(f"{name}: fixed to no frame of the chain")
        vertices, triangles = known[stated]
        used = vertices[np.unique(triangles)]
        low, high = used.min(axis=0), used.max(axis=0)
        box = np.array(
            [[(low, high)[b >> k & 1][k] for k in range(3)] for b in range(8)]
        )
        return _Surface(name, frame, T, GroupedMesh(vertices, triangles), box)

    def _all_pairs_are_there(self) -> None:
        """Every part against every obstacle, unless stated as left out."""
        records = [*self.pairs, *self.passages]
        stated = {(int(r["moving"]), int(r["standing"])) for r in records}
        for i in range(self.parts):
            for j in range(len(self.bodies) - self.parts):
                if (i, self.parts + j) not in stated and (i, j) not in self.excluded:
                    names = self.bodies[i].name, self.bodies[self.parts + j].name
                    self.problems.append(f"{names[0]} and {names[1]}: not examined")

    def _passages_are_the_plans(self) -> None:
        """Where names are stated: contact is allowed in the named plan's corridor."""
        if self.about is None:
            return
        plan = self.about.get("plan")
        for record in self.passages:
            if plan is None:
                self.problems.append("it allows contact, but names no needle plan")
            elif any(record[name] != plan[name] for name in CORRIDOR):
                name = plan["name"]
                self.problems.append(f"the corridor is not that of the plan {name!r}")

    def _pair(self, record: dict[str, Any]) -> None:
        a = self.bodies[int(record["moving"])]
        b = self.bodies[int(record["standing"])]
        names = f"{a.name} and {b.name}"
        intervals = np.array(record["intervals"], dtype=np.float64)
        if intervals.ndim != 2 or intervals.shape[1] != 5:
            raise _Rejected(f"{names}: no intervals")
        if not np.isfinite(intervals).all():
            raise _Rejected(f"{names}: an interval holds a number that is not finite")
        against_obstacle = int(record["standing"]) >= self.parts
        margin = float(record["margin_m"])
        if margin < (self.margin if against_obstacle else 0.0):
            raise _Rejected(f"{names}: examined with a smaller margin")
        self._covers(intervals, names)
        for row in intervals:
            self._interval(a, b, row, margin, names)
            self.checked += 1
        self._holds_nothing(a, b, names)

    def _passage(self, record: dict[str, Any]) -> None:
        """A part that may touch an obstacle of the world, within a corridor."""
        i, j = int(record["moving"]), int(record["standing"])
        if not 0 <= i < self.parts <= j < len(self.bodies):
            raise _Rejected("a passage is not of a part and an obstacle")
        a, b = self.bodies[i], self.bodies[j]
        names = f"{a.name} and {b.name}"
        if b.frame >= 0:
            raise _Rejected(f"{names}: {b.name} moves, a corridor does not")
        if not b.closed:
            raise _Rejected(f"{names}: {b.name} is open, it has no inside")
        intervals = np.array(record["intervals"], dtype=np.float64)
        if intervals.ndim != 2 or intervals.shape[1] != 4:
            raise _Rejected(f"{names}: no intervals")
        if not np.isfinite(intervals).all():
            raise _Rejected(f"{names}: an interval holds a number that is not finite")
        self._covers(intervals, names)
        R, shift = b.T_frame_mesh[:3, :3], b.T_frame_mesh[:3, 3]
        patient = b.mesh.corners @ R.T + shift
        corridor = StatedCorridor(record, patient)
        for row in intervals:
            self._within(a, b, corridor, patient, row, names)
            self.checked += 1
        self.allowed.append(f"{a.name} in {b.name} {corridor}")

    def _within(
        self,
        a: _Surface,
        b: _Surface,
        corridor: StatedCorridor,
        patient: Array,
        row: Array,
        names: str,
    ) -> None:
        """During an interval a is in the corridor, or outside b and not touching it."""
        begin, end, at, displacement = (float(x) for x in row)
        where = f"{names}, {begin:.6g} to {end:.6g}"
        placed, moved = self._moved(a, b, (begin, end, at), displacement, where)
        T = _of(placed, a)
        needle = a.mesh.corners @ T[:3, :3].T + T[:3, 3]
        moved += RESERVE
        wrong = corridor.why_not(needle, moved)
        if wrong:
            raise _Rejected(f"{where}: {a.name} {wrong}")
        depth = float(((needle - corridor.entry) @ corridor.axis).min())
        tail = corridor.at(depth - moved)
        low, high = patient.min(axis=(0, 1)), patient.max(axis=(0, 1))
        beyond = (tail < low).any() or (tail > high).any()
        if not beyond and winding_number(tail, patient) != 0:
            raise _Rejected(f"{where}: {a.name} begins inside {b.name}")

    def _covers(self, intervals: Array, names: str) -> None:
        begin, end, at = intervals[:, 0], intervals[:, 1], intervals[:, 2]
        if begin[0] != 0.0 or end[-1] != len(self.waypoints) - 1.0:
            raise _Rejected(f"{names}: the intervals leave out an end of the path")
        wrong = np.flatnonzero(begin[1:] != end[:-1])
        if len(wrong):
            where = end[wrong[0]]
            raise _Rejected(f"{names}: the intervals do not join at {where:.6g}")
        if not ((begin <= at) & (at <= end) & (begin < end)).all():
            raise _Rejected(f"{names}: an interval does not hold its own instant")

    def _interval(
        self, a: _Surface, b: _Surface, row: Array, margin: float, names: str
    ) -> None:
        begin, end, at, clearance, displacement = (float(x) for x in row)
        where = f"{names}, {begin:.6g} to {end:.6g}"
        placed, moved = self._moved(a, b, (begin, end, at), displacement, where)
        if not clearance > moved + margin + RESERVE:
            raise _Rejected(
                f"{where}: clearance does not exceed displacement and margin"
            )
        T_world_a = _of(placed, a)
        T_b_a = np.linalg.inv(_of(placed, b)) @ T_world_a
        if nearer_than(a.mesh, b.mesh, T_b_a, clearance - ROUNDING):
            raise _Rejected(f"{where}: the surfaces are nearer than {clearance:.3e} m")

    def _moved(
        self,
        a: _Surface,
        b: _Surface,
        times: tuple[float, float, float],
        stated: float,
        where: str,
    ) -> tuple[list[Array], float]:
        """Placements at the instant, and how far a moves against b about it, [m].

        Times are begin, end and instant; the way is at least the stated one.
        """
        begin, end, at = times
        placed = self._placements(self._values(at))
        moved = self._displacement(a, b, placed, begin, end, at)
        if not stated >= moved - ROUNDING:
            raise _Rejected(f"{where}: moves up to {moved:.3e} m, not {stated:.3e} m")
        return placed, max(moved, stated)

    def _displacement(
        self,
        a: _Surface,
        b: _Surface,
        placed: list[Array],
        begin: float,
        end: float,
        at: float,
    ) -> float:
        """Largest way of any point of a against b from the instant `at`, [m]."""
        middle = self._values(at)
        inside = np.arange(np.floor(begin) + 1.0, np.ceil(end))
        others = [self._values(t) for t in (begin, *inside, end)]
        change = np.abs(np.array(others) - middle).max(axis=0)
        corners = a.box @ _of(placed, a)[:3, :3].T + _of(placed, a)[:3, 3]
        total = 0.0
        for k in self._between(a.frame, b.frame):
            joint = self.joints[k]
            if joint.kind == "slides":
                total += float(change[k])
            elif joint.kind == "turns":
                away = corners - placed[k][:3, 3]
                axis = placed[k][:3, :3] @ joint.axis
                beside = away - np.outer(away @ axis, axis)
                total += float(change[k] * np.linalg.norm(beside, axis=1).max())
        return total

    def _between(self, first: int, second: int) -> set[int]:
        """Joints that move one frame against another: above one, not above both."""
        return self._above(first) ^ self._above(second)

    def _above(self, frame: int) -> set[int]:
        found = set()
        while frame >= 0:
            found.add(frame)
            frame = self.joints[frame].parent
        return found

    def _values(self, time: float) -> Array:
        """Joint values at a time that counts waypoints, (joints,)."""
        k = min(int(np.floor(time)), len(self.waypoints) - 2)
        part = time - k
        q = (1.0 - part) * self.waypoints[k] + part * self.waypoints[k + 1]
        return np.array(
            [0.0 if j.kind == "fixed" else j.factor * q[j.source] + j.offset
             for j in self.joints]
        )  # fmt: skip

    def _placements(self, values: Array) -> list[Array]:
        """T_world_frame of every frame."""
        placed: list[Array] = []
        for joint, value in zip(self.joints, values, strict=True):
            T = joint.origin @ _motion(joint, float(value))
            placed.append(T if joint.parent < 0 else placed[joint.parent] @ T)
        return placed

    def _holds_nothing(self, a: _Surface, b: _Surface, names: str) -> None:
        """At the start, neither closed surface holds a part of the other."""
        for surface in (a, b):
            if not surface.closed:
                raise _Rejected(f"{names}: {surface.name} is open, it has no inside")
        placed = self._placements(self._values(0.0))
        T_b_a = np.linalg.inv(_of(placed, b)) @ _of(placed, a)
        for inner, outer, T in ((a, b, T_b_a), (b, a, np.linalg.inv(T_b_a))):
            for corner in inner.one_corner_each:
                point = T[:3, :3] @ corner + T[:3, 3]
                outside = (point < outer.box.min(axis=0)) | (
                    point > outer.box.max(axis=0)
                )
                if outside.any():
                    continue
                if winding_number(point, outer.mesh.corners) != 0:
                    raise _Rejected(f"{names}: {inner.name} is inside {outer.name}")


def _joint(index: int, record: dict[str, Any]) -> _Joint:
    kind = str(record["kind"])
    if kind not in ("fixed", "turns", "slides"):
        raise _Rejected(f"joint {index} of the chain is of an unknown kind, {kind}")
    parent, source = int(record["parent"]), int(record["source"])
    if not -1 <= parent < index or (kind != "fixed" and source < 0):
        raise _Rejected(f"joint {index} of the chain has no place in it")
    axis = np.array(record["axis"], dtype=np.float64)
    if kind != "fixed" and not abs(np.linalg.norm(axis) - 1.0) < RIGID:
        raise _Rejected(f"joint {index} of the chain: the axis is no unit vector")
    origin = _rigid(record["origin"], f"joint {index} of the chain")
    factor, offset = float(record["factor"]), float(record["offset"])
    return _Joint(parent, origin, kind, axis, source, factor, offset)


def _rigid(values: Any, name: str) -> Array:
    T = np.array(values, dtype=np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise _Rejected(f"{name}: not a placement")
    R = T[:3, :3]
    skewed = np.abs(R @ R.T - np.eye(3)).max() > RIGID or np.linalg.det(R) < 0.0
    if skewed or (T[3] != (0.0, 0.0, 0.0, 1.0)).any():
        raise _Rejected(f"{name}: not a rigid placement")
    return T


def _motion(joint: _Joint, value: float) -> Array:
    """Turn or shift of one joint by its value (Rodrigues' formula)."""
    T = np.eye(4)
    if joint.kind == "slides":
        T[:3, 3] = value * joint.axis
    elif joint.kind == "turns":
        n = joint.axis
        across = np.cross(np.eye(3), n)
        along = np.outer(n, n)
        cosine, sine = np.cos(value), np.sin(value)
        T[:3, :3] = cosine * np.eye(3) + (1.0 - cosine) * along + sine * across
    return T


def _of(placed: list[Array], surface: _Surface) -> Array:
    """T_world_mesh of a surface."""
    if surface.frame < 0:
        return surface.T_frame_mesh
    return placed[surface.frame] @ surface.T_frame_mesh
