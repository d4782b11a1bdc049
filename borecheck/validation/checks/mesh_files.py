"""Mesh file checks: is there a mesh in the file, and in which unit."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from borecheck.errors import MeshError
from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.validation.checks.geometry import shapes, where_checked
from borecheck.validation.checks.joints import origin_far
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.extents import shape_extent
from borecheck.validation.reading.mesh_reading import path_of, read_file
from borecheck.validation.registry import Problem, register

_NOT_FINITE = ("not finite", "beyond every room", "is no number")
_INDEX = ("names a vertex", "names vertex")
# A link longer than this many times the robot's whole kinematic length is no link.
LARGE_RATIO = 10.0
SMALL_RATIO = 1e-3
MARGIN_RATIO = 1.5  # a collision shape may be a little larger on purpose
UNIT_RATIOS = {1000.0: "millimetres", 25.4: "inches and millimetres", 39.37: "inches"}
UNIT_RATIOS |= {100.0: "centimetres"}


def mesh_shapes(robot: CheckedUrdf, *, scaled: bool = False) -> Iterator[DraftShape]:
    """One shape for each mesh file, the first that refers to it, collisions before.

    Args:
        robot: The robot.
        scaled: One for each file and scale, because the size of each is another.
    """
    seen = set()
    for shape in sorted(shapes(robot), key=lambda s: _rank(robot, s)):
        path = path_of(robot, shape)
        key = (path, shape.scale if scaled else None)
        if path is not None and key not in seen:
            seen.add(key)
            yield shape


def _rank(robot: CheckedUrdf, shape: DraftShape) -> tuple[bool, bool]:
    """What contacts are checked with comes first, collisions before visuals."""
    return where_checked(robot, shape) is not None, shape.kind != "collision"


def _unreadable(robot: CheckedUrdf) -> Iterator[tuple[DraftShape, str]]:
    for shape in mesh_shapes(robot):
        path = path_of(robot, shape)
        outcome = None if path is None else read_file(robot, path)
        if isinstance(outcome, MeshError):
            where = f"{outcome.element}: " if outcome.element else ""
            yield shape, where + outcome.problem


@register("G505", "mesh-unreadable", "geometry", "WEE", "meshes")
def mesh_unreadable(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh file holds no mesh: a Git LFS pointer, an HTML page, a cut or empty file.

    Why: The link has no geometry then: nothing can touch it.

    Fix: Fetch the real file (git lfs pull), or export it again.

    Libraries: Pinocchio and Drake stop; yourdfpy and PyBullet warn and leave it out.
    """
    for shape, problem in _unreadable(robot):
        by_other_checks = any(words in problem for words in (*_NOT_FINITE, *_INDEX))
        if not by_other_checks and "no mesh format" not in problem:
            yield _bad_mesh(robot, shape, problem)


@register("G507", "mesh-not-finite", "geometry", "WEE", "meshes")
def mesh_not_finite(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh has a vertex that is not a finite number.

    Why: Every comparison with NaN is false: contacts with that triangle are missed.

    Fix: Export the mesh again.

    Libraries: Coal and trimesh load it in silence.
    """
    for shape, problem in _unreadable(robot):
        if any(words in problem for words in _NOT_FINITE):
            yield _bad_mesh(robot, shape, problem)


@register("G508", "mesh-index", "geometry", "WEE", "meshes")
def mesh_index(robot: CheckedUrdf) -> Iterator[Problem]:
    """A triangle of a mesh names a vertex that is not there.

    Why: Libraries crash, skip the triangle or read foreign memory.

    Fix: Export the mesh again.
    """
    for shape, problem in _unreadable(robot):
        if any(words in problem for words in _INDEX):
            yield _bad_mesh(robot, shape, problem)


@register("G512", "mesh-unit", "geometry", "WWW", "meshes")
def mesh_unit(robot: CheckedUrdf) -> Iterator[Problem]:
    """The size of a mesh does not fit the robot.

    Why: A mesh in millimetres taken as metres is a thousand times too large, or the
    other way round; STL, OBJ and PLY files do not say their unit.

    Fix: Write scale="0.001 0.001 0.001" for a mesh in millimetres.

    Libraries: every library takes the numbers as metres.
    """
    # One origin in millimetres makes the robot, not its meshes, a wrong size (J314).
    if robot.size <= 1e-3 or any(origin_far(robot)):
        return
    for shape in mesh_shapes(robot, scaled=True):
        extent = shape_extent(robot, shape)
        if extent is None:
            continue
        longest = float((extent.high - extent.low).max())
        ratio = longest / robot.size
        size = f"the mesh is {longest:.3g} m long, the robot {robot.size:.3g} m"
        if ratio > LARGE_RATIO and longest > 5.0:
            hint = _scale_hint(shape, 1e-3)
            yield Problem(shape.shape, f"{size}: millimetres?", "scale", hint=hint)
        elif 0.0 < ratio < SMALL_RATIO:
            hint = _scale_hint(shape, 1e3)
            yield Problem(
                shape.shape, f"{size}: scaled down twice?", "scale", hint=hint
            )


def _apart(size: float, reference: float) -> float:
    """How many factors of e lie between two sizes."""
    return abs(math.log(size / max(reference, 1e-3)))


@register("G513", "mesh-unit-pair", "geometry", "WWW", "meshes")
def mesh_unit_pair(robot: CheckedUrdf) -> Iterator[Problem]:
    """Visual and collision of a link differ in size by the ratio of two units.

    Why: One of them is in another unit; what is seen is not what is checked.

    Fix: Correct the scale of the wrong one.
    """
    for link in robot.links:
        sizes: dict[str, float] = {}
        for kind in ("visual", "collision"):
            boxes = [shape_extent(robot, shape) for shape in link.of_kind(kind)]
            known = [box.diagonal for box in boxes if box is not None]
            if len(known) == len(boxes) and known:
                sizes[kind] = max(known)
        if len(sizes) < 2 or min(sizes.values()) <= 0.0:
            continue
        ratio = max(sizes.values()) / min(sizes.values())
        for unit_ratio, unit in UNIT_RATIOS.items():
            if abs(ratio / unit_ratio - 1.0) < 0.15:
                # Wrong is the one whose size is farther from the robot's.
                wrong = max(sizes, key=lambda kind: _apart(sizes[kind], robot.size))
                other = min(sizes, key=lambda kind: _apart(sizes[kind], robot.size))
                word = "larger" if sizes[wrong] > sizes[other] else "smaller"
                text = f"the {wrong} is {ratio:.4g} times {word} than the {other}"
                yield Problem(link.of_kind(wrong)[0].shape, f"{text}: {unit}?", "scale")
                break


@register("G538", "mesh-scale-pair", "geometry", "WWW")
def mesh_scale_pair(robot: CheckedUrdf) -> Iterator[Problem]:
    """The same mesh file has another scale as collision than as visual.

    Why: What is checked has another size, or is the mirror image, of what is drawn.

    Fix: Give both the same scale; to check with a margin, give a margin to the check.
    """
    for link in robot.links:
        drawn = {shape.filename: shape for shape in link.of_kind("visual")}
        for shape in link.of_kind("collision"):
            other = drawn.get(shape.filename) if shape.filename else None
            if other is None or 0.0 in (*shape.scale, *other.scale):
                continue
            ratios = [a / b for a, b in zip(shape.scale, other.scale, strict=True)]
            if min(ratios) < 1.0 / MARGIN_RATIO or max(ratios) > MARGIN_RATIO:
                scales = f"{_numbers(shape.scale)}, drawn with {_numbers(other.scale)}"
                yield Problem(shape.shape, f"scale {scales}", "scale")


def _numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:g}" for value in values)


@register("G514", "collada-unit", "geometry", "III", "meshes")
def collada_unit(robot: CheckedUrdf) -> Iterator[Problem]:
    """A Collada file is not in metres, or its up axis is not z.

    Why: Every loader treats unit and up axis differently, so the same file has another
    size or stands upright in one tool and lies down in the next.

    Fix: Export it again in metres with z up.

    Libraries: RViz and assimp apply the unit, some tools ignore it; trimesh, borecheck
    and Gazebo apply the unit; RViz ignores the up axis, assimp turns it.
    """
    from borecheck.geometry.mesh_files.collada import collada_conventions

    for shape in mesh_shapes(robot):
        path = path_of(robot, shape)
        if path is None or path.suffix.lower() != ".dae":
            continue
        try:
            metres, up = collada_conventions(path.read_bytes(), path)
        except (MeshError, OSError):
            continue  # G505 says so
        if metres != 1.0 or up != "Z_UP":
            level = Severity.WARNING if metres != 1.0 else None
            message = f"{path.name}: unit {metres:g} m, up axis {up}"
            yield Problem(shape.shape, message, "filename", level)


def _bad_mesh(robot: CheckedUrdf, shape: DraftShape, problem: str) -> Problem:
    message = f"{shape.filename!r}: {problem}"
    return Problem(shape.shape, message, "filename", where_checked(robot, shape))


def _scale_hint(shape: DraftShape, factor: float) -> str:
    scale = " ".join(f"{s:g}" for s in np.array(shape.scale) * factor)
    return f'If so, write scale="{scale}".'
