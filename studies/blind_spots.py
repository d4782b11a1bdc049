"""Count what the published, one-sided contact test does not see.

    python -m studies.blind_spots --poses 40 --levels coarse middle fine

Three parts, all judged by `exact`:

1. random pairs of triangles: how many contacts each direction of the test loses;
2. simple solids pushed into each other: a needle into plates and rings of ever smaller
   triangles, a block's corner into a plate;
3. an installed robot in an installed scanner, at each level of detail: it is carried
   along a random direction until it touches, then `--depth` further.

A lost pose is one in which a checker finds no triangle pair at all though there are
some: the verdict is wrong. Lost pairs in a pose that is found do no harm.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import borecheck as bc
from borecheck.core.se3 import axis_rotation
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.published import paper
from borecheck.geometry.triangles.two_sided import two_sided

Array = NDArray[np.float64]
CHECKERS = ("paper:robot", "paper:scanner", "two-sided")
REACH = 0.6  # how far the robot is carried to find a contact, [m]
TOUCH = 1e-4  # how closely the touching place is found, [m]


# --- 1. random pairs ----------------------------------------------------------------


def random_pairs(n: int, rng: np.random.Generator) -> None:
    """Print how many contacts of random triangles each test loses."""
    alpha, beta = rng.normal(size=(n, 3, 3)), rng.normal(size=(n, 3, 3))
    truth = exact(alpha, beta)
    found = {
        "paper, first is alpha": paper(alpha, beta),
        "paper, second is alpha": paper(beta, alpha),
        "two-sided": two_sided(alpha, beta),
    }
    print(f"random pairs: {n}, of which in contact: {truth.sum()}")
    for name, answer in found.items():
        lost, false = (truth & ~answer).sum(), (answer & ~truth).sum()
        print(f"  {name:24} lost {lost:5d} ({lost / truth.sum():.1%}), false {false}")


# --- counting over poses of mesh pairs ----------------------------------------------


@dataclass
class Tally:
    """What the checkers found in poses that are in contact."""

    poses: int
    pairs: int
    lost_poses: dict[str, int]
    lost_pairs: dict[str, int]
    false_pairs: int

    @classmethod
    def empty(cls) -> "Tally":
        """Nothing counted yet."""
        return cls(0, 0, dict.fromkeys(CHECKERS, 0), dict.fromkeys(CHECKERS, 0), 0)

    def add(self, contacts: Callable[[str], set[tuple[int, ...]]]) -> None:
        """Count one pose, given each checker's triangle pairs."""
        truth = contacts("exact")
        if not truth:
            return
        self.poses += 1
        self.pairs += len(truth)
        for checker in CHECKERS:
            found = contacts(checker)
            self.lost_poses[checker] += not found
            self.lost_pairs[checker] += len(truth - found)
            self.false_pairs += len(found - truth)

    def print(self, name: str) -> None:
        """One line of the table."""
        poses = "".join(f"{self.lost_poses[c]:11d}" for c in CHECKERS)
        share = (self.lost_pairs[c] / max(self.pairs, 1) for c in CHECKERS)
        pairs = "".join(f"{s:11.1%}" for s in share)
        print(
            f"{name:44}{self.poses:6d}{poses}{self.pairs:8d}{pairs}{self.false_pairs:6d}"
        )


def print_header(title: str) -> None:
    """Title and column heads of a table."""
    heads = "".join(f"{c.replace('paper', 'p'):>11}" for c in CHECKERS)
    print(f"\n{title}")
    print(f"{'':44}{'poses':>6}{'lost poses of each':>33}{'lost pairs of each':>41}")
    print(f"{'':50}{heads}{'pairs':>8}{heads}{'false':>6}")


Surfaces = Sequence[tuple[MeshTree, Array]]


def pairs_between(
    robot: Surfaces, scanner: Surfaces, checker: str
) -> set[tuple[int, ...]]:
    """Triangle pairs in contact, over all pairs of surfaces."""
    return {
        (i, j, *map(int, pair))
        for i, (a, T_a) in enumerate(robot)
        for j, (b, T_b) in enumerate(scanner)
        for pair in a.contacts(b, T_a, T_b, checker)
    }


def count(poses: Iterable[tuple[Surfaces, Surfaces]]) -> Tally:
    """Tally over poses; each is what stands where."""
    tally = Tally.empty()
    for robot, scanner in poses:
        tally.add(lambda c, r=robot, s=scanner: pairs_between(r, s, c))  # type: ignore[misc]
    return tally


# --- 2. simple solids ---------------------------------------------------------------


def prism(radius: float, length: float, sections: int) -> TriangleMesh:
    """A closed prism along z from 0 to length."""
    angle = 2.0 * np.pi * np.arange(sections) / sections
    ring = radius * np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length]])
    vertices = np.concatenate([ring, ring + ends[1], ends])
    i = np.arange(sections)
    j, bottom, top = (i + 1) % sections, 2 * sections, 2 * sections + 1
    n = sections
    faces = [(i, j, n + j), (i, n + j, n + i), (j, i, 0 * i + bottom)]
    faces.append((n + i, n + j, 0 * i + top))
    triangles = np.concatenate([np.stack(face, axis=1) for face in faces])
    return TriangleMesh(f"prism of {sections}", vertices, triangles)


def ring(inner: float, outer: float, depth: float, sections: int) -> TriangleMesh:
    """A closed ring about z with a bore, from -depth/2 to depth/2."""
    angle = 2.0 * np.pi * np.arange(sections) / sections
    circle = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    half = np.array([0.0, 0.0, 0.5 * depth])
    corners = [outer * circle - half, outer * circle + half]
    corners += [inner * circle + half, inner * circle - half]
    i = np.arange(sections)
    j = (i + 1) % sections
    triangles = []
    for k in range(4):
        a, b = k * sections, (k + 1) % 4 * sections
        triangles.append(np.stack([a + i, a + j, b + j], axis=1))
        triangles.append(np.stack([a + i, b + j, b + i], axis=1))
    vertices = np.concatenate(corners)
    return TriangleMesh(f"ring of {sections}", vertices, np.concatenate(triangles))


def block(x: float, y: float, z: float) -> TriangleMesh:
    """A closed box about the origin, twelve triangles."""
    signs = [[(k >> i & 1) - 0.5 for i in range(3)] for k in range(8)]
    quads = ((0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1))
    quads = (*quads, (4, 5, 7, 6))
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return TriangleMesh("block", np.array(signs) * [x, y, z], np.array(triangles))


def placed_at(point: Array, direction: Array, rng: np.random.Generator) -> Array:
    """T whose z axis is a direction, turned at random about it, at a point."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, rng.normal(size=3))
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = point
    return T


def into_a_ring(
    sections: int, n: int, rng: np.random.Generator
) -> Iterator[tuple[Surfaces, Surfaces]]:
    """A needle's end, 5 mm deep in the front or in the bore wall of a ring."""
    needle, scanner = (
        MeshTree.of(prism(5.5e-4, 0.15, 8)),
        ring(0.36, 0.9, 0.9, sections),
    )
    tree = MeshTree.of(scanner)
    for _ in range(n):
        t = rng.integers(len(scanner.triangles))
        a, b, c = scanner.corners[t]
        point = rng.dirichlet((1.0, 1.0, 1.0)) @ scanner.corners[t]
        out = np.cross(b - a, c - a)
        out = out / np.linalg.norm(out) + 0.2 * rng.normal(size=3)
        out /= np.linalg.norm(out)
        yield [(needle, placed_at(point - 0.005 * out, out, rng))], [(tree, np.eye(4))]


def corner_into_plate(
    n: int, rng: np.random.Generator
) -> Iterator[tuple[Surfaces, Surfaces]]:
    """A corner of a box-shaped scanner, 5 mm deep in a cover plate of the robot."""
    plate, scanner = MeshTree.of(block(0.4, 0.4, 0.01)), MeshTree.of(block(2, 2, 1))
    for _ in range(n):
        out = np.array([1.0, 1.0, 1.0]) + 0.3 * rng.normal(size=3)
        T = placed_at(np.array([1.0, 1.0, 0.5]), out, rng)
        T[:3, 3] += T[:3, :3] @ np.append(rng.uniform(-0.1, 0.1, 2), 0.0)
        yield [(plate, T)], [(scanner, np.eye(4))]


def simple_solids(n: int, rng: np.random.Generator) -> None:
    """Print the table of simple solids."""
    print_header("simple solids, 5 mm deep")
    for sections in (16, 64, 256, 1024):
        tally = count(into_a_ring(sections, n, rng))
        tally.print(f"needle 1.1 mm into a ring of {8 * sections} triangles")
    count(corner_into_plate(n, rng)).print("corner of a box scanner in a robot plate")


# --- 3. a robot in its scanner ------------------------------------------------------


def robot_poses(
    robot_name: str,
    scene_name: str,
    level: str,
    n: int,
    depth: float,
    rng: np.random.Generator,
) -> Iterator[tuple[Surfaces, Surfaces]]:
    """Poses of a robot, carried along a line until `depth` [m] deep in its scanner."""
    robot = bc.load_robot(robot_name, level=level)
    scene = bc.load_scene(scene_name, level=level)
    parts = [(part.link, MeshTree.of(part.mesh)) for part in robot.parts]
    things = [o.mesh for o in scene.obstacles if o.role != "patient"]
    scanner = [(MeshTree.of(mesh), np.eye(4)) for mesh in things]
    triangles = sum(len(part.mesh.triangles) for part in robot.parts)
    against = sum(len(mesh.triangles) for mesh in things)
    print(f"{level}: {triangles} x {against} triangles", file=sys.stderr)
    made = 0
    for _ in range(20 * n):
        if made == n:
            break
        q = rng.uniform(robot.model.lower, robot.model.upper)
        at = robot.placements(q)
        step = axis_rotation((0.0, 0.0, 1.0), rng.uniform(0, 2 * np.pi))[:, 0]

        def carried(s: float, at: dict = at, step: Array = step) -> Surfaces:  # type: ignore[type-arg]
            shift = np.eye(4)
            shift[:3, 3] = s * step
            return [(tree, shift @ at[link]) for link, tree in parts]

        s = touching(carried, scanner)
        if s is not None:
            made += 1
            yield carried(s + depth), scanner


def touching(carried: Callable[[float], Surfaces], scanner: Surfaces) -> float | None:
    """How far to carry a clear robot until it touches; None if it never does."""

    def meets(s: float) -> bool:
        return any(
            a.first_contact(b, T_a, T_b) for a, T_a in carried(s) for b, T_b in scanner
        )

    low, high = 0.0, REACH
    if meets(low) or not meets(high):
        return None
    while high - low > TOUCH:
        middle = 0.5 * (low + high)
        if meets(middle):
            high = middle
        else:
            low = middle
    return high


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=20_000)
    parser.add_argument("--poses", type=int, default=40)
    parser.add_argument("--levels", nargs="*", default=["coarse", "middle", "fine"])
    parser.add_argument("--robot", default="zerobot")
    parser.add_argument("--scene", default="ct_gantry")
    parser.add_argument("--depth", type=float, default=0.005, help="[m]")
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args(argv)
    rng = np.random.default_rng(arguments.seed)
    random_pairs(arguments.pairs, rng)
    simple_solids(5 * arguments.poses, rng)
    print_header(
        f"{arguments.robot} in {arguments.scene}, {1000 * arguments.depth:g} mm deep"
    )
    for level in arguments.levels:
        poses = robot_poses(
            arguments.robot,
            arguments.scene,
            level,
            arguments.poses,
            arguments.depth,
            rng,
        )
        count(poses).print(level)
    return 0


if __name__ == "__main__":
    sys.exit(main())
