"""How much room the parts of a robot have at most, over boxes of configurations."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.queries import Queries, queries
from borecheck.core.once import once_per_record
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.scene import Scene
from borecheck.setup.family import Spread
from borecheck.setup.field import Field, field
from borecheck.setup.terms import ITSELF, NOTHING, OBSTACLES, PATIENT, Terms
from borecheck.setup.witnesses import MANY_JOINTS, Witnesses, joints_above, witnesses

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

# Fields are made around the isocentre, [m]: what is farther bounds nothing.
LOW, HIGH = np.array([-0.55, -0.46, -0.36]), np.array([0.45, 0.46, 0.46])
SCANNER, COUCH, SICK, ANY = "scanner", "couch", "patient", "any"
# Relative width of those distances.
WITHIN = 0.05
# Pairs of parts with so few joints between them are held against each other.
FEW_JOINTS = 3


@once_per_record
def fields_of(scene: Scene) -> Mapping[str, Field]:
    """Fields of what is scanner, couch and patient in a scene."""
    of = {"scanner": SCANNER, "other": SCANNER, "couch": COUCH, "patient": SICK}
    meshes: dict[str, list[TriangleMesh]] = {
        name: [] for name in (SCANNER, COUCH, SICK)
    }
    for obstacle in scene.obstacles:
        meshes[of[obstacle.role]].append(obstacle.mesh)
    fields = {name: field(found, LOW, HIGH) for name, found in meshes.items()}
    least = np.min([found.values for found in fields.values()], axis=0)
    return {**fields, ANY: replace(fields[SICK], values=least)}


@dataclass(frozen=True, eq=False)
class Room:
    """Upper bounds of distances over boxes, (n,), [m]; below 0: surely in contact.

    Attributes:
        obstacles: Of parts that must keep the padding, to what is no patient.
        sick: Of such parts to patients.
        scanner: Of the whole robot to the scanner.
        patient: Of the robot without its insertion mechanism to patients.
        itself: Of parts to parts that must not touch.
    """

    obstacles: Array
    sick: Array
    scanner: Array
    patient: Array
    itself: Array


@dataclass(frozen=True, eq=False)
class _Part:
    """A part with its witnesses, and what it is asked about."""

    link: str
    frame: int
    witnesses: Witnesses
    corners: Array
    padded: bool
    is_needle: bool
    in_mechanism: bool
    many: bool


@dataclass(frozen=True, eq=False)
class Padded:
    """A robot's parts as they are held against a scene's fields and distances."""

    terms: Terms
    parts: tuple[_Part, ...]
    pairs: tuple[tuple[int, int], ...]
    near: Queries

    @staticmethod
    def of(terms: Terms) -> "Padded":
        """Of what is asked of one robot in one scene."""
        robot = terms.robot
        frame_of, _ = chain_of(robot)
        moving = joints_above(robot)
        excluded = {name for pair in terms.asked.excluded for name in pair}
        parts = tuple(
            _Part(
                part.link,
                frame_of[part.link],
                found,
                np.array(list(product(*part.mesh.bounds.T))),
                not {part.link, part.mesh.name} & excluded,
                part.link == terms.needle.link,
                part.link in terms.mechanism,
                count >= MANY_JOINTS,
            )
            for part, found, count in zip(
                robot.parts, witnesses(robot), moving, strict=True
            )
        )
        pairs = tuple(
            (a, b)
            for a, b in robot.self_pairs
            if moving[a] >= MANY_JOINTS and moving[b] - moving[a] <= FEW_JOINTS + 1
        )
        far = [p.link for p, n in zip(parts, moving, strict=True) if n < MANY_JOINTS]
        patients = [o.name for o in terms.scene.obstacles if o.role == "patient"]
        skip = [(link, o.name) for link in set(far) for o in terms.scene.obstacles]
        skip += [(terms.needle.link, name) for name in patients]
        near = queries(robot, terms.scene, skip=skip, itself=False, solids=False)
        return Padded(terms, parts, pairs, near)

    def broken(self, room: Room) -> Codes:
        """What surely stands against every configuration of each box."""
        padding = self.terms.asked.padding - _ROUNDING
        codes = np.full(len(room.obstacles), NOTHING, np.int8)
        codes[room.itself < -_ROUNDING] = ITSELF
        codes[room.obstacles < padding] = OBSTACLES
        codes[room.sick < padding] = PATIENT
        return codes

    def touched(self, spread: Spread, fields: Mapping[str, Field]) -> NDArray[np.bool_]:
        """Whether arm and bore, couch or patient surely break the padding, (n,)."""
        chain = chain_of(self.terms.robot)[1]
        parts = [p for p in self.parts if p.many and p.padded and not p.is_needle]
        frames = np.array([part.frame for part in parts])
        placed = chain.placements(spread.q, frames)
        padding = self.terms.asked.padding - _ROUNDING
        found = np.zeros(len(spread.q), bool)
        for k, part in enumerate(parts):
            rows = np.flatnonzero(~found)
            at = _placed(part.witnesses.points, placed[rows, k])
            most = fields[ANY].at_most(at) - part.witnesses.radii
            close = most < padding
            near = np.flatnonzero(close.any(axis=1))
            if len(near):
                more = spread.points(part.link, _full(at, rows, len(found)))[rows[near]]
                found[rows[near]] = (most[near] + more < padding).any(axis=1)
        return found

    def room(self, spread: Spread, fields: Mapping[str, Field]) -> Room:
        """By witnesses and fields."""
        n = len(spread.q)
        found = Room(*(np.full(n, np.inf) for _ in range(5)))
        balls: dict[int, tuple[Array, Array]] = {}
        chain = chain_of(self.terms.robot)[1]
        frames = np.array([part.frame for part in self.parts])
        placed = chain.placements(spread.q, frames)
        for k, part in enumerate(self.parts):
            points, radii = part.witnesses.points, part.witnesses.radii
            if not len(points):
                continue
            at = _placed(points, placed[:, k])
            more = spread.points(part.link, at) - radii
            balls[k] = at, more
            most = {
                kind: (fields[kind].at_most(at) + more).min(axis=1)
                for kind in (SCANNER, COUCH, SICK)
            }
            _note(part, most, found)
        for a, b in self.pairs:
            self._hold(found.itself, (a, balls[a]), (b, balls[b]))
        return found

    def _hold(
        self,
        itself: Array,
        first: tuple[int, tuple[Array, Array]],
        second: tuple[int, tuple[Array, Array]],
    ) -> None:
        """Balls of one part against balls of another."""
        (a, (at_a, more_a)), (b, (at_b, more_b)) = first, second
        A = self.parts[a].witnesses.radii > 0.0
        B = self.parts[b].witnesses.radii > 0.0
        if not (A.any() and B.any()):
            return
        apart = at_a[:, A][:, :, None] - at_b[:, B][:, None]
        far = np.linalg.norm(apart, axis=3)
        far += more_a[:, A][:, :, None] + more_b[:, B][:, None]
        np.minimum(itself, far.min(axis=(1, 2)), out=itself)

    def measured(self, spread: Spread) -> Room:
        """By certified distances in the middles, and how far the parts' boxes go."""
        n = len(spread.q)
        found = Room(*(np.full(n, np.inf) for _ in range(5)))
        bounds = self.near.clearances(spread.q, "pair", WITHIN)[..., 1]
        bounds = np.where(np.isnan(bounds), np.inf, bounds)
        chain = chain_of(self.terms.robot)[1]
        role = {o.name: o.role for o in self.terms.scene.obstacles}
        number = {p.mesh.name: k for k, p in enumerate(self.terms.robot.parts)}
        ways: dict[int, Array] = {}
        for row, (name, other) in enumerate(self.near.pairs):
            k = number[name]
            part = self.parts[k]
            if k not in ways:
                T = chain.placements(spread.q, np.array([part.frame]))[:, 0]
                at = _placed(part.corners, T)
                ways[k] = spread.points(part.link, at).max(axis=1)
            kind = {"other": SCANNER}.get(role[other], role[other])
            _note(part, {kind: bounds[:, row] + ways[k]}, found)
        return found


_ROUNDING = 1e-9


def _placed(points: Array, T: Array) -> Array:
    """Points (k, 3) of a link at its placements (n, 4, 4), (n, k, 3)."""
    return np.asarray(points @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3])


def _full(at: Array, rows: NDArray[np.intp], count: int) -> Array:
    """Rows (m, k, 3) among (count, k, 3)."""
    whole = np.zeros((count, *at.shape[1:]))
    whole[rows] = at
    return whole


def _note(part: _Part, most: Mapping[str, Array], found: Room) -> None:
    """Takes bounds of one part into those of the robot."""
    for kind, bound in most.items():
        if kind == SICK:
            if not part.is_needle and part.padded:
                np.minimum(found.sick, bound, out=found.sick)
            if not part.in_mechanism:
                np.minimum(found.patient, bound, out=found.patient)
            continue
        if part.padded:
            np.minimum(found.obstacles, bound, out=found.obstacles)
        if kind == SCANNER:
            np.minimum(found.scanner, bound, out=found.scanner)
