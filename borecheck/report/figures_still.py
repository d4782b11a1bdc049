"""Still pictures of robot and scanner, drawn offline: a small z-buffer renderer.

For print and for readers without scripts. Orthographic, so that lengths can be measured
in the picture; parts of the scanner before a section plane are left out.
"""

import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel
from borecheck.report.display import inflated, unpacked

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Array = NDArray[np.float64]
Image = NDArray[np.uint8]

WIDTH, HEIGHT = 880, 560
# Every pixel is the mean of so many squared.
FINER = 2

COLOURS = {
    "robot": (84, 131, 181),
    "needle": (30, 30, 34),
    "scanner": (205, 209, 214),
    "couch": (148, 158, 170),
    "patient": (226, 188, 160),
    "other": (170, 160, 185),
    "self": (78, 121, 167),
}
PAPER = (255, 255, 255)
# Inside of a cut or open surface, share of the outside's brightness.
_INSIDE = 0.7

_LIGHT = np.array([0.35, -0.45, 0.82]) / np.linalg.norm([0.35, -0.45, 0.82])


@dataclass(frozen=True, eq=False)
class OrthographicView:
    """An orthographic view.

    Attributes:
        centre: Point in the middle of the picture, (3,), [m].
        right: Unit vector to the right, (3,).
        up: Unit vector upwards, (3,).
        width: Width of the picture, [m].
    """

    centre: Array
    right: Array
    up: Array
    width: float

    @property
    def towards(self) -> Array:
        """Unit vector from the scene to the eye."""
        return np.cross(self.right, self.up)

    def on_picture(self, points: Array) -> Array:
        """Points (n, 3) as pixel x, y (y down) and depth (greater is nearer)."""
        d = points - self.centre
        scale = WIDTH / self.width
        x = d @ self.right * scale + 0.5 * WIDTH
        y = 0.5 * HEIGHT - d @ self.up * scale
        return np.stack([x, y, d @ self.towards], axis=-1)


def looking(
    centre: Array, direction: "Sequence[float]", width: float
) -> OrthographicView:
    """The view that looks along `direction` at a point, z upwards."""
    forward = np.array(direction, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    aside = np.cross(forward, (0.0, 0.0, 1.0))
    if np.linalg.norm(aside) < 1e-9:
        aside = np.array([0.0, -1.0, 0.0])
    right = aside / np.linalg.norm(aside)
    return OrthographicView(centre, right, np.cross(right, forward), width)


class Stage:
    """The meshes of a result, unpacked once for several pictures."""

    def __init__(self, display: "Mapping[str, Any]") -> None:
        self._frames = {name: k for k, name in enumerate(display["frames"])}
        self._needle = display.get("needle")
        self._links = [(block["link"], unpacked(block)) for block in display["links"]]
        self._around = [
            (block["role"], unpacked(block)) for block in display["obstacles"]
        ]
        self._motions = [
            inflated(motion["placements"], "<f4")
            .astype(np.float64)
            .reshape(motion["poses"], len(self._frames), 3, 4)
            for motion in display["motions"]
        ]

    def robot_points(self, motion: int, pose: int) -> Array:
        """Corners of the robot's triangles as placed, (n, 3)."""
        placed = [self._placed(motion, pose, *link) for link in self._links]
        return np.concatenate(placed).reshape(-1, 3)

    def _placed(self, motion: int, pose: int, link: str, corners: Array) -> Array:
        T = self._motions[motion][pose, self._frames[link]]
        placed: Array = corners @ T[:, :3].T + T[:, 3]
        return placed

    def picture(
        self,
        motion: int,
        pose: int,
        view: OrthographicView,
        cut: "tuple[Array, float] | None" = None,
    ) -> bytes:
        """A PNG of the robot at a pose within its surroundings.

        Args:
            motion: Which motion.
            pose: Which of its poses.
            view: From where.
            cut: Normal and offset of a plane; what lies beyond it (n x > offset) of
                scanner, couch and patient is left out.
        """
        h, w = HEIGHT * FINER, WIDTH * FINER
        depth = np.full((h, w), -np.inf)
        image = np.zeros((h, w, 3), dtype=np.uint8)
        image[:] = PAPER
        no_cut = (np.zeros(3), 1.0)
        for role, corners in self._around:
            _draw(depth, image, view, corners, COLOURS[role], cut or no_cut)
        for link, corners in self._links:
            colour = COLOURS["needle" if link == self._needle else "robot"]
            placed = self._placed(motion, pose, link, corners)
            _draw(depth, image, view, placed, colour, no_cut)
        _outline(depth, image, view.width / w)
        coarse = image.reshape(HEIGHT, FINER, WIDTH, FINER, 3).mean(axis=(1, 3))
        return png(np.rint(coarse).astype(np.uint8))


def _draw(
    depth: Array,
    image: Image,
    view: OrthographicView,
    corners: Array,
    colour: tuple[int, int, int],
    cut: tuple[Array, float],
) -> None:
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0.0, length, 1.0)
    facing = normals @ view.towards
    shade = 0.66 + 0.34 * np.abs(normals @ _LIGHT)
    shade = np.where(facing >= 0.0, shade, _INSIDE)
    shaded = np.clip(np.outer(shade, colour), 0, 255).astype(np.uint8)
    pixels = view.on_picture(corners.reshape(-1, 3)).reshape(-1, 3, 3)
    pixels[:, :, :2] *= FINER
    beyond = corners @ cut[0] - cut[1]
    _fill(depth, image, pixels, beyond, shaded)


@kernel
def _fill(
    depth: Array, image: Image, pixels: Array, beyond: Array, colours: Image
) -> None:
    """Draws triangles into depth buffer and image, pixel centre by pixel centre.

    Args:
        depth: Depth so far, (h, w); greater is nearer.
        image: Colours so far, (h, w, 3).
        pixels: x, y, depth of the corners, (n, 3, 3).
        beyond: Height of each corner over the section plane, (n, 3).
        colours: One per triangle, (n, 3).
    """
    h, w = depth.shape
    for t in range(len(pixels)):
        ax, ay, az = pixels[t, 0]
        bx, by, bz = pixels[t, 1]
        cx, cy, cz = pixels[t, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        x0 = max(int(np.floor(min(ax, bx, cx))), 0)
        x1 = min(int(np.ceil(max(ax, bx, cx))), w - 1)
        y0 = max(int(np.floor(min(ay, by, cy))), 0)
        y1 = min(int(np.ceil(max(ay, by, cy))), h - 1)
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                px, py = x + 0.5, y + 0.5
                u = ((bx - px) * (cy - py) - (by - py) * (cx - px)) / area
                v = ((cx - px) * (ay - py) - (cy - py) * (ax - px)) / area
                s = 1.0 - u - v
                if u < 0.0 or v < 0.0 or s < 0.0:
                    continue
                z = u * az + v * bz + s * cz
                if z <= depth[y, x]:
                    continue
                height = u * beyond[t, 0] + v * beyond[t, 1] + s * beyond[t, 2]
                if height > 0.0:
                    continue
                depth[y, x] = z
                image[y, x, 0] = colours[t, 0]
                image[y, x, 1] = colours[t, 1]
                image[y, x, 2] = colours[t, 2]


def _outline(depth: Array, image: Image, pixel: float) -> None:
    """Darkens pixels where the depth jumps: edges that a reader can follow."""
    jump = np.zeros(depth.shape, dtype=bool)
    finite = np.where(np.isfinite(depth), depth, -1e3)
    limit = max(12.0 * pixel, 0.004)
    across = np.abs(np.diff(finite, axis=1)) > limit
    down = np.abs(np.diff(finite, axis=0)) > limit
    jump[:, 1:] |= across
    jump[1:, :] |= down
    image[jump] = (image[jump] * 0.45).astype(np.uint8)


def png(image: Image) -> bytes:
    """An image (h, w, 3) as a PNG file."""
    h, w, _ = image.shape
    # each row as its difference to the row above (filter 2): flat areas vanish
    wide = image.astype(np.int16)
    wide[1:] -= image[:-1]
    rows = np.zeros((h, 1 + 3 * w), dtype=np.uint8)
    rows[:, 0] = 2
    rows[:, 1:] = (wide & 0xFF).astype(np.uint8).reshape(h, -1)
    head = struct.pack(">IIBBBBB", w, h, 8, 2, 0, 0, 0)
    body = zlib.compress(rows.tobytes(), 9)
    chunks = ((b"IHDR", head), (b"IDAT", body), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data))
        + kind
        + data
        + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
