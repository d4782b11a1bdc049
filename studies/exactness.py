"""Compare `exact` with rational arithmetic on classes of triangle pairs.

The oracle shares nothing with the checker: it writes one triangle as linear
inequalities, clips the other one by them (Sutherland-Hodgman) in `fractions.Fraction`,
and says contact if a point is left. No orientation sign, no edge-triangle test.

    python -m studies.exactness --pairs 105000 --seed 1 --state study.jsonl

Prints, per class: pairs, contacts, differences (must be 0), differences of the exact
road alone, and the share of pairs that floating point left to it. With `--state` every
finished chunk is a line of that file, and a second run goes on where the first stopped.
`--cost` prints nanoseconds per pair of the published test both ways round, of
`two_sided` and of `exact` (median CPU time of interleaved repeats) in place of it.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.triangles.exact import exact_counted, exact_road_only
from borecheck.geometry.triangles.narrowphase import contact_pairs
from borecheck.geometry.triangles.published import NARROWPHASES

Array = NDArray[np.float64]
Vector = tuple[Fraction, Fraction, Fraction]
HalfSpace = tuple[Vector, Fraction]  # n . x >= c
CHUNK = 500
FIELDS = ("pairs", "contacts", "differences", "road_differences", "exact_road")


# --- the oracle ---------------------------------------------------------------------


def meets(alpha: Array, beta: Array) -> bool:
    """Whether two closed triangles (3, 3) have a common point, in rationals."""
    polygon = [_vector(corner) for corner in beta]
    for normal, offset in _half_spaces([_vector(corner) for corner in alpha]):
        polygon = _clip(polygon, normal, offset)
        if not polygon:
            return False
    return True


def _vector(corner: Array) -> Vector:
    x, y, z = (Fraction(float(number)) for number in corner)
    return x, y, z


def _dot(u: Vector, v: Vector) -> Fraction:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _cross(u: Vector, v: Vector) -> Vector:
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


def _minus(u: Vector, v: Vector) -> Vector:
    return u[0] - v[0], u[1] - v[1], u[2] - v[2]


def _opposite(u: Vector) -> Vector:
    return -u[0], -u[1], -u[2]


def _half_spaces(t: list[Vector]) -> Iterator[HalfSpace]:
    """A triangle, segment or point as the points of all these half-spaces."""
    normal = _cross(_minus(t[1], t[0]), _minus(t[2], t[0]))
    if any(normal):
        yield from _hyperplane(normal, t[0])
        for i in range(3):
            inward = _cross(normal, _minus(t[(i + 1) % 3], t[i]))
            yield inward, _dot(inward, t[i])
        return
    ends = sorted(t)  # of points on one line, the first and the last are its ends
    along = _minus(ends[2], ends[0])
    for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        unit = (Fraction(axis[0]), Fraction(axis[1]), Fraction(axis[2]))
        yield from _hyperplane(_cross(along, unit) if any(along) else unit, ends[0])
    yield along, _dot(along, ends[0])
    yield _opposite(along), -_dot(along, ends[2])


def _hyperplane(normal: Vector, point: Vector) -> Iterator[HalfSpace]:
    offset = _dot(normal, point)
    yield normal, offset
    yield _opposite(normal), -offset


def _clip(polygon: list[Vector], normal: Vector, offset: Fraction) -> list[Vector]:
    """The part of a convex polygon (or segment, or point) within one half-space."""
    heights = [_dot(normal, point) - offset for point in polygon]
    if all(height >= 0 for height in heights):
        return polygon
    kept: list[Vector] = []
    for i, (point, height) in enumerate(zip(polygon, heights, strict=True)):
        if height >= 0:
            kept.append(point)
        following, next_height = (
            polygon[i - len(polygon) + 1],
            heights[i + 1 - len(polygon)],
        )
        if height * next_height < 0:
            share = height / (height - next_height)
            step = _minus(following, point)
            kept.append(
                (
                    point[0] + share * step[0],
                    point[1] + share * step[1],
                    point[2] + share * step[2],
                )
            )
    return kept


# --- the classes of pairs -----------------------------------------------------------


def general(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Corners anywhere."""
    return rng.normal(size=(n, 3, 3)), rng.normal(size=(n, 3, 3))


def lattice(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Corners on a coarse lattice, of whole numbers or of millimetres."""
    reach = rng.integers(1, 5, size=(n, 1, 1))
    a, b = (np.round(reach * rng.uniform(-1, 1, (n, 3, 3))) for _ in range(2))
    unit = rng.choice([1.0, 0.001, 0.0254], size=(n, 1, 1))
    return a * unit, b * unit


def nudged(rng: np.random.Generator, t: Array, ulps: int = 3) -> Array:
    """Every coordinate moved by up to a few units in the last place."""
    return t + rng.integers(-ulps, ulps + 1, size=t.shape) * np.spacing(np.abs(t))


def points_on(rng: np.random.Generator, t: Array) -> Array:
    """A point of each triangle (n, 3): inside, on an edge, or a corner."""
    weights = rng.dirichlet((1.0, 1.0, 1.0), size=len(t))
    weights[rng.random(len(t)) < 0.4, 2] = 0.0
    weights[rng.random(len(t)) < 0.2] = (1.0, 0.0, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.einsum("nc,nck->nk", weights, t)


def grazing(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """A corner or an edge of beta meets alpha up to a few units in the last place."""
    a, b = general(rng, n)
    x = points_on(rng, a)
    b[:, 0] = x
    through = rng.random(n) < 0.5
    step = rng.normal(size=(n, 3))
    b[through, 0] = (x + step)[through]
    b[through, 1] = (x - rng.uniform(0.2, 2.0, (n, 1)) * step)[through]
    return a, nudged(rng, b)


def coplanar(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Both in one plane: exactly (along axes, or sheared and dyadic), or as rounded."""
    a, b = (rng.integers(-64, 65, (n, 3, 3)) / 64.0 for _ in range(2))
    slope = rng.integers(-4, 5, size=(n, 1, 2)) / 4.0
    for t in (a, b):
        t[:, :, 2] = 0.5 + slope[:, :, 0] * t[:, :, 0] + slope[:, :, 1] * t[:, :, 1]
    axes = rng.integers(0, 3)
    a, b = np.roll(a, axes, axis=2), np.roll(b, axes, axis=2)
    turn = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    tilted = rng.random(n) < 0.3
    for t in (a, b):
        t[tilted] = np.einsum("nij,ncj->nci", turn, t)[tilted]
    return a, b


def needles(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Triangles 1e-3 to 1e-17 wide that nearly meet."""
    a, b = grazing(rng, n)
    for t in (a, b):
        thin = rng.random(n) < 0.8
        width = 10.0 ** rng.uniform(-17, -3, (n, 1))
        share = rng.uniform(-0.5, 1.5, (n, 1))
        third = t[:, 0] + share * (t[:, 1] - t[:, 0]) + width * rng.normal(size=(n, 3))
        t[thin, 2] = third[thin]
    return a, b


def zero_area(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Segments and points, against each other and against triangles, on a lattice."""
    a, b = lattice(rng, n)
    for t in (a, b):
        kind = rng.integers(0, 5, size=n)
        step = np.round(rng.uniform(-2, 2, (n, 3)))
        t[kind == 0, 2] = t[kind == 0, 1]
        t[kind == 1, 1] = t[kind == 1, 2] = t[kind == 1, 0]
        t[kind == 2, 1] = (t[:, 0] + step)[kind == 2]
        t[kind == 2, 2] = (t[:, 0] - 2.0 * step)[kind == 2]
        t[kind == 3, 1] = (t[:, 0] + t[:, 2])[kind == 3] / 2.0
    moved = rng.random(n) < 0.6  # so that many touch: bring two halfway points together
    b[moved] += ((a[:, :2].mean(axis=1) - b[:, 1:].mean(axis=1))[:, None])[moved]
    return a, b


def mixed_sizes(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """The other classes, at sizes from the smallest to the largest floating numbers."""
    makers = (general, lattice, grazing, coplanar, zero_area)
    a, b = makers[rng.integers(len(makers))](rng, n)
    power = rng.integers(-1070, 1020, size=(n, 1, 1))
    unlike = (rng.random(n) < 0.3)[:, None, None]
    spread = np.where(unlike, rng.integers(-900, 900, size=(n, 3, 3)), 0)
    return tuple(np.ldexp(t, np.clip(power + spread, -1070, 1020)) for t in (a, b))  # type: ignore[return-value]


CLASSES: dict[str, Callable[[np.random.Generator, int], tuple[Array, Array]]] = {
    "general": general,
    "lattice": lattice,
    "grazing": grazing,
    "coplanar": coplanar,
    "needle-like": needles,
    "zero-area": zero_area,
    "mixed sizes": mixed_sizes,
}


# --- the study ----------------------------------------------------------------------


def pairs_of(name: str, seed: int, chunk: int, n: int) -> tuple[Array, Array]:
    """The n pairs of one chunk; the same for the same seed."""
    rng = np.random.default_rng([seed, list(CLASSES).index(name), chunk])
    return CLASSES[name](rng, n)


def study_chunk(name: str, seed: int, chunk: int, n: int) -> dict[str, int]:
    """Counts over one chunk of pairs."""
    a, b = pairs_of(name, seed, chunk, n)
    truth = np.array([meets(alpha, beta) for alpha, beta in zip(a, b, strict=True)])
    answer, exact_road = exact_counted(a, b)
    return {
        "pairs": n,
        "contacts": int(truth.sum()),
        "differences": int((answer != truth).sum()),
        "road_differences": int((exact_road_only(a, b) != truth).sum()),
        "exact_road": exact_road,
    }


def read_state(path: Path | None, seed: int) -> dict[tuple[str, int], dict[str, int]]:
    """Finished chunks by class and number."""
    if path is None or not path.exists():
        return {}
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    return {(d["class"], d["chunk"]): d for d in lines if d["seed"] == seed}


def run(pairs: int, seed: int, state: Path | None) -> dict[str, dict[str, int]]:
    """Study all classes, about equally many pairs each."""
    chunks = -(-pairs // (CHUNK * len(CLASSES)))
    done = read_state(state, seed)
    totals = {name: dict.fromkeys(FIELDS, 0) for name in CLASSES}
    for chunk in range(chunks):
        for name in CLASSES:
            counts = done.get((name, chunk))
            if counts is None:
                counts = study_chunk(name, seed, chunk, CHUNK)
                if state is not None:
                    line = {"class": name, "chunk": chunk, "seed": seed, **counts}
                    with state.open("a") as file:
                        file.write(json.dumps(line) + "\n")
            for field in FIELDS:
                totals[name][field] += counts[field]
        print(f"{chunk + 1}/{chunks} chunks of each class", file=sys.stderr)
    return totals


def small_neighbours(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """What a tree hands to the leaf test: small triangles that are near each other."""
    centre = rng.uniform(-1.0, 1.0, size=(n, 1, 3))
    a = centre + 0.01 * rng.normal(size=(n, 3, 3))
    apart = 0.015 * rng.normal(size=(n, 1, 3))
    return a, centre + apart + 0.01 * rng.normal(size=(n, 3, 3))


def print_cost(seed: int, n: int = 20_000, repeats: int = 9) -> None:
    """Nanoseconds per pair for every class."""
    print(f"{'class':18}{'paper x2':>10}{'two-sided':>10}{'exact':>10} exact/two-sided")
    indices = np.stack([np.arange(n)] * 2, axis=1)
    for name, make in {"small neighbours": small_neighbours, **CLASSES}.items():
        a, b = (t.reshape(-1, 9) for t in make(np.random.default_rng(seed), n))
        a, b = np.ascontiguousarray(a), np.ascontiguousarray(b)
        spent: dict[str, list[float]] = {checker: [] for checker in NARROWPHASES}
        for _ in range(repeats + 1):  # the first repeat compiles
            for checker, code in NARROWPHASES.items():
                start = time.process_time_ns()
                contact_pairs(code, a, b, indices)
                spent[checker].append((time.process_time_ns() - start) / n)
        cost = {checker: np.median(times[1:]) for checker, times in spent.items()}
        both = cost["paper:robot"] + cost["paper:scanner"]
        plain, judge = cost["two-sided"], cost["exact"]
        print(f"{name:18}{both:10.1f}{plain:10.1f}{judge:10.1f} {judge / plain:14.2f}")


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=105_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", type=Path, help="file of finished chunks")
    parser.add_argument("--cost", action="store_true", help="time instead of judging")
    arguments = parser.parse_args(argv)
    if arguments.cost:
        print_cost(arguments.seed)
        return 0
    totals = run(arguments.pairs, arguments.seed, arguments.state)
    totals["all"] = {f: sum(t[f] for t in totals.values()) for f in FIELDS}
    print(
        f"{'class':12} {'pairs':>8} {'contacts':>9} {'differ':>7} "
        f"{'road':>5} exact road"
    )
    for name, t in totals.items():
        share = t["exact_road"] / t["pairs"]
        print(
            f"{name:12} {t['pairs']:8d} {t['contacts']:9d} {t['differences']:7d} "
            f"{t['road_differences']:5d} {share:9.1%}"
        )
    wrong = totals["all"]["differences"] + totals["all"]["road_differences"]
    return 0 if wrong == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
