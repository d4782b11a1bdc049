"""The verifier's geometry at its borders: rims, counts and limits, in exact numbers."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.verify import solid
from borecheck.verify.chain import WORLD, Chain, Joint, skewness
from borecheck.verify.distance import (
    GroupedMesh,
    _along_a_curve,
    _gap_of_segments,
    _near_boxes,
    near_triangles,
)
from borecheck.verify.fields import Rejected
from borecheck.verify.passage import MOST_SLACK, WIDEST_NEEDLE, StatedCorridor
from borecheck.verify.solid import Side, is_embedded, leads_away, side_of
from borecheck.verify.statement import Passage

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Block = tuple[Array, Indices]

# A line as near as this to a triangle's rim meets it, relative to sizes.
RIM = 1e-12


def _grouped(*blocks: Block) -> GroupedMesh:
    starts = np.cumsum([0, *(len(v) for v, _ in blocks)])
    triangles = [t + s for (_, t), s in zip(blocks, starts[:-1], strict=True)]
    return GroupedMesh(
        np.concatenate([v for v, _ in blocks]), np.concatenate(triangles)
    )


def _block(size: Any, at: Any) -> Block:
    mesh = box("block", size).moved(transform(at))
    return mesh.vertices, mesh.triangles


@pytest.fixture
def upwards(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all straight lines the one along z alone."""
    monkeypatch.setattr(solid, "_directions", lambda: np.array([[0.0, 0.0, 1.0]]))


@pytest.mark.usefixtures("upwards")
@pytest.mark.parametrize("turn", [1, -1])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("beside", "free"), [(-0.1, False), (1.0, False), (2.0, False), (2.5, True)]
)
def test_a_line_beside_a_rim_meets_it(
    turn: int, side: float, beside: float, free: bool
) -> None:
    """The line passes an edge of length 2; of the largest size, 2, a square."""
    d = beside * RIM
    corners = np.array([[d, -1.0, 1.0], [d, 1.0, 1.0], [2.0, 0.0, 1.0]])
    corners[:, 0] *= side
    assert leads_away(np.zeros(3), corners[None, ::turn]) == free


@pytest.mark.usefixtures("upwards")
@pytest.mark.parametrize(
    ("area", "free"), [(2e-12, False), (2.9e-12, False), (4e-12, True)]
)
def test_what_is_behind_must_be_so_surely(area: float, free: bool) -> None:
    """A tiny triangle below, across the line: seen too thin, it might be before it."""
    e = (area / 4.0) ** 0.5
    behind = np.array([[[-e, -e, -1.0], [e, -e, -1.0], [0.0, e, -1.0]]])
    assert leads_away(np.zeros(3), behind) == free
    assert not leads_away(np.zeros(3), -behind)


def test_the_lines_go_round_by_the_golden_angle() -> None:
    directions = solid._directions()[6:]
    assert len(directions) == 100
    np.testing.assert_allclose(directions[:, 2], 0.99 - 0.02 * np.arange(100))
    around = np.unwrap(np.arctan2(directions[:, 1], directions[:, 0]))
    golden = 2.0 * np.pi / ((1.0 + 5.0**0.5) / 2.0)
    off = np.diff(around) - golden
    np.testing.assert_allclose(
        off - 2.0 * np.pi * np.round(off / 2 / np.pi), 0.0, atol=1e-9
    )


@pytest.mark.parametrize(
    ("turns", "told"),
    [
        *((0.0, 0), (1.0009, 1), (0.9991, 1), (-1.0009, -1), (1e-3, 0), (-1e-3, 0)),
        *((1.0015, None), (0.9985, None), (0.5, None), (-0.9985, None), (2.0, 2)),
    ],
)
def test_turns_are_whole_up_to_a_thousandth(
    monkeypatch: pytest.MonkeyPatch, turns: float, told: int | None
) -> None:
    monkeypatch.setattr(solid, "winding", lambda *_: turns)
    assert solid._whole_turns(np.zeros(3), np.zeros((1, 3, 3))) == told


def test_sheets_meet_up_to_a_micrometre() -> None:
    for gap, free in ((0.9e-6, False), (1.5e-6, True)):
        blocks = (_block([2.0] * 3, [0, 0, 0]), _block([2.0] * 3, [2.0 + gap, 0, 0]))
        assert is_embedded(_grouped(*blocks)) == free


def test_every_part_has_its_own_box() -> None:
    mesh = _grouped(_block([2.0, 4.0, 6.0], [0, 0, 0]), _block([1.0] * 3, [9, 8, -7]))
    low, high = solid._boxes_of_parts(mesh)
    order = np.argsort(low[:, 0])
    lowest = np.array([[-1.0, -2, -3], [8.5, 7.5, -7.5]])
    highest = np.array([[1.0, 2, 3], [9.5, 8.5, -6.5]])
    np.testing.assert_allclose(low[order], lowest)
    np.testing.assert_allclose(high[order], highest)


def test_boxes_of_parts_hold_all_of_their_triangles() -> None:
    corners = np.array([[0.0, 1, 2], [3, -4, 5], [6, 7, -8]])
    mesh = GroupedMesh(np.vstack([corners, corners + 20.0]), np.arange(6).reshape(2, 3))
    low, high = solid._boxes_of_parts(mesh)
    np.testing.assert_array_equal(np.sort(low, axis=0)[0], [0.0, -4.0, -8.0])
    np.testing.assert_array_equal(np.sort(high, axis=0)[0], [6.0, 7.0, 5.0])
    np.testing.assert_array_equal(np.sort(high, axis=0)[1], [26.0, 27.0, 25.0])


def _room() -> list[Block]:
    """Six walls that cross: no line leads out, and none is round the middle."""
    walls = []
    for k in range(3):
        size = np.full(3, 4.2 + 0.03 * k)
        size[k] = 0.2
        walls += [_block(size, sign * 2.0 * np.eye(3)[k]) for sign in (1.0, -1.0)]
    return walls


@pytest.mark.parametrize(("count", "told"), [(16, Side.OUTSIDE), (17, Side.UNTOLD)])
def test_sixteen_parts_round_a_point_are_looked_into(count: int, told: Side) -> None:
    """Slanted bars that pass beside the point: the boxes of all of them hold it."""
    bars = []
    for k in range(count):
        aside = 0.03 * (k + 1) * np.array([1.0, -1.0, 0.0])
        bar = box("bar", [3.0, 0.01, 0.02])
        T = transform(aside, [0.0, 0.0, np.pi / 4.0])
        bars.append((bar.moved(T).vertices, bar.triangles))
    assert side_of(np.array([0.001, 0.002, 0.003]), _grouped(*_room(), *bars)) is told


def test_triangles_are_sorted_along_mortons_curve() -> None:
    """Bits of the three cell numbers, of 1024 a side of the largest extent, in turn."""
    points = np.random.default_rng(5).uniform(0.0, 1.0, (200, 3)) * [2.0, 1.0, 0.5]
    points = np.vstack([points, np.zeros(3), [2.0, 1.0, 0.5]]) + [7.0, -3.0, 0.1]
    low = points.min(axis=0)
    expected = []
    for point in points:
        cells = [min(int(x / 2.0 * 1024), 1023) for x in point - low]
        words = [f"{cell:010b}" for cell in cells]
        expected.append(
            int("".join(z + y + x for x, y, z in zip(*words, strict=True)), 2)
        )
    np.testing.assert_array_equal(_along_a_curve(points), expected)
    assert _along_a_curve(np.ones((2, 3))).tolist() == [0, 0]


def test_closest_points_of_segments_are_inside_or_at_ends() -> None:
    """Crossing at right angles, beyond an end, parallel, and of no length."""
    e = np.eye(3)
    for p, u, q, v, gap in (
        (-e[0], 2 * e[0], e[2] - e[1], 2 * e[1], -e[2]),
        (-e[0], 2 * e[0], 3 * e[0] + e[2], e[1], [-2, 0, -1]),
        (3 * e[0] + e[2], e[1], -e[0], 2 * e[0], [2, 0, 1]),
        (0 * e[0], e[0], 3 * e[0] + e[1], e[0], [-2, -1, 0]),
        (0 * e[0], e[0], 0.5 * e[0] + e[1], 0 * e[0], [0, -1, 0]),
        (e[2], 0 * e[0], e[1], 0 * e[0], [0, -1, 1]),
    ):
        rows = [np.array([x], dtype=float) for x in (p, u, q, v)]
        np.testing.assert_allclose(_gap_of_segments(*rows), [gap], atol=1e-15)


def _corridor() -> StatedCorridor:
    stated = Passage(0, 1, np.zeros(3), np.array([0, 0, 0.05]), 1e-3, 2e-3, np.empty(0))
    return StatedCorridor(stated, np.array([[[1.0, 0, 0], [2, 0, 0], [1, 1, 0]]]))


@pytest.mark.parametrize("count", [3, 4, 5, 6, 7])
@pytest.mark.parametrize("size", [1e-3, 0.3, 7.0])
def test_a_line_through_the_middle_of_a_regular_polygon(
    count: int, size: float
) -> None:
    """All sides are as near as the nearest: only rounding is left to tell it by."""
    angle = 0.3 + 2.0 * np.pi * np.arange(count) / count
    polygon = size * np.column_stack(
        [np.cos(angle), np.sin(angle), 0.2 * np.cos(angle)]
    )
    for turned in (polygon, polygon[::-1]):
        assert _corridor()._aside_of(turned) == 0.0
        beside = turned + [1.01 * size, 0.0, 0.0]
        assert _corridor()._aside_of(beside) > 0.0


def _joint(kind: str, parent: int, **given: object) -> Joint:
    fields: dict[str, object] = {"origin": np.eye(4), "axis": np.eye(3)[2]}
    fields |= {"source": 0, "factor": 1.0, "offset": 0.0, **given}
    return Joint(parent=parent, kind=kind, **fields)  # type: ignore[arg-type]


def test_rounding_by_hand() -> None:
    """Half a unit in the last place, for each joint above and four more, 40 and 4 times
    the largest turn; and three times what rotations and axes lack, bodies' twice."""
    points = np.array([[0.0], [-2.5]])
    chain = Chain([_joint("turns", WORLD), _joint("turns", 0)], points)
    steps = 2.0**-53 * (2 + 4) * (40.0 + 4.0 * 2.5)
    assert chain.rounding(3.0, 0.0) == pytest.approx(3.0 * steps)
    assert chain.rounding(3.0, 1e-12) == pytest.approx(3.0 * (steps + 6e-12))
    origin = np.eye(4)
    origin[0, 1] = 1e-12
    long = np.array([0.0, 0.0, 1.0 - 2.0**-40])
    off = Chain(
        [_joint("turns", WORLD, origin=origin), _joint("turns", 0, axis=long)], points
    )
    lacking = 1e-12 + 2.0 * 2.0**-40
    assert off.rounding(3.0, 0.0) == pytest.approx(3.0 * (steps + 3.0 * lacking))
    fixed = Chain([_joint("fixed", WORLD, axis=9.0 * long)], points)
    assert fixed.rounding(1.0, 0.0) == pytest.approx(2.0**-53 * 5 * 40.0)


def test_the_world_is_no_frame_of_the_chain() -> None:
    """Though the last joint is fixed, two arms on the world have nothing between."""
    kinds = [("turns", WORLD), ("turns", WORLD), ("fixed", 1)]
    chain = Chain([_joint(*kind) for kind in kinds], np.zeros((2, 1)))
    assert chain.required_pairs([0, 1]) == {(0, 1)}


def test_what_is_too_short_is_as_skew_as_what_is_too_long() -> None:
    for off in (1e-6, -1e-6):
        T = np.diag([1.0, 1.0 + off, 1.0, 1.0])
        assert skewness(T) == pytest.approx(2e-6, rel=1e-3)


def test_a_corridor_is_for_needles_and_their_holes() -> None:
    """1 cm across, and 2 mm beside it."""
    assert (WIDEST_NEEDLE, MOST_SLACK) == (5e-3, 2e-3)


def test_a_corridor_has_a_length() -> None:
    sheet = np.array([[[1.0, 0, 0], [2, 0, 0], [1, 1, 0]]])
    for length, fine in ((1.5e-10, True), (1e-10, False), (0.0, False)):
        target = np.array([0.0, 0.0, length])
        stated = Passage(0, 1, np.zeros(3), target, 1e-3, 2e-3, np.empty(0))
        if fine:
            assert StatedCorridor(stated, sheet).length == length
        else:
            with pytest.raises(Rejected, match="no length"):
                StatedCorridor(stated, sheet)


def test_the_width_is_that_of_the_farthest_corner() -> None:
    """About the middle of the box that holds it, seen along the line."""
    needle = np.array([[[0.0, 0.0, 0.01], [4.0, 0.0, 0.02], [0.0, 1.0, 0.03]]])
    needle[0, 2] = [1.0, 6.0, 0.03]
    depth, width = _corridor().depth_and_width(needle, 0.0)
    assert depth == pytest.approx(0.03)
    assert width == pytest.approx(np.hypot(2.0, 3.0))


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("order", [1, -1])
def test_what_rounding_leaves_open_is_near(side: float, order: int) -> None:
    """98 apart, 100 from the origin: 16 half units in the last place of 198."""
    flat = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.0, 1.0, 0]])
    near, far = (side * (flat + [x, 0.0, 0.0]) for x in (0.0, 99.0))
    one, other = (
        GroupedMesh(corners, np.array([[0, 1, 2]])) for corners in (near, far)[::order]
    )
    for lacking, found in ((2.6e-13, True), (5e-13, False)):
        pairs = list(near_triangles(one, one.sorted, other, 98.0 - lacking))
        assert (pairs != []) == found


def test_boxes_as_far_apart_as_asked_are_near() -> None:
    boxes = np.array([[[0.0, 0, 0], [1, 1, 1]], [[3, 0, 0], [4, 1, 1]]])
    for reach, count in ((2.0, 1), (np.nextafter(2.0, 0.0), 0)):
        found = [len(i) for i, _ in _near_boxes(boxes[:1], boxes[1:], reach)]
        assert sum(found) == count
