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

from borecheck.core.palette import ROLES, rgb
from borecheck.geometry.kernels.compile import kernel
from borecheck.report.display import inflated, unpacked

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
# Normal and offset of a plane for "housing", "rest" and "robot": what lies beyond it
# (n x > offset) is left out.
Cuts = dict[str, tuple[Array, float]]

WIDTH, HEIGHT = 880, 560  # of a picture, [px]
# Every pixel is the mean of so many squared.
FINER = 2

COLOURS = {role: rgb(colour) for role, colour in ROLES.items()}
PAPER = (255, 255, 255)
# Inside of a cut or open surface, share of the outside's brightness; on its hatching.
_INSIDE, _HATCH = 0.78, 0.62
# From line to line of the hatching, and their width, [fine px].
_STEP, _LINE = 18, 4
# What a plane cuts: housings, what one sees whole unless all is cut, and the robot.
_KINDS = {"couch": "rest", "patient": "rest", "robot": "robot"}

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

    def on_picture(
        self, points: Array, width: int = WIDTH, height: int = HEIGHT
    ) -> Array:
        """Points (n, 3) as pixel x, y (y down) and depth (greater is nearer)."""
        d = points - self.centre
        scale = width / self.width
        x = d @ self.right * scale + 0.5 * width
        y = 0.5 * height - d @ self.up * scale
        return np.stack([x, y, d @ self.towards], axis=-1)


def looking(
    centre: Array, direction: "Sequence[float] | Array", width: float
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
    """The meshes of a result, unpacked once for several pictures.

    Args:
        display: The geometry of a result.
        width: Of a picture, [px].
        height: Of a picture, [px].
    """

    def __init__(
        self, display: "Mapping[str, Any]", width: int = WIDTH, height: int = HEIGHT
    ) -> None:
        self.width, self.height = width, height
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

    def pixels(self, view: OrthographicView, points: Array) -> Array:
        """Points (n, 3) on a picture of this size: x, y, depth."""
        return view.on_picture(points, self.width, self.height)

    def picture(
        self,
        motion: int,
        pose: int,
        view: OrthographicView,
        cuts: Cuts | None = None,
    ) -> bytes:
        """A PNG of the robot at a pose within its surroundings: see `image`."""
        return png(self.image(motion, pose, view, cuts))

    def image(
        self,
        motion: int,
        pose: int,
        view: OrthographicView,
        cuts: Cuts | None = None,
    ) -> Image:
        """The robot at a pose within its surroundings, (height, width, 3).

        Args:
            motion: Which motion.
            pose: Which of its poses.
            view: From where.
            cuts: What is left out.
        """
        h, w = self.height * FINER, self.width * FINER
        depth = np.full((h, w), -np.inf)
        image = np.zeros((h, w, 3), dtype=np.uint8)
        image[:] = PAPER
        for role, corners in self._around:
            self._draw(depth, image, view, corners, role, cuts)
        for link, corners in self._links:
            placed = self._placed(motion, pose, link, corners)
            role = "needle" if link == self._needle else "robot"
            self._draw(depth, image, view, placed, role, cuts)
        _outline(depth, image, view.width / w)
        coarse = image.reshape(self.height, FINER, self.width, FINER, 3)
        return np.rint(coarse.mean(axis=(1, 3))).astype(np.uint8)

    def _draw(
        self,
        depth: Array,
        image: Image,
        view: OrthographicView,
        corners: Array,
        role: str,
        cuts: Cuts | None,
    ) -> None:
        kind = _KINDS.get("robot" if role == "needle" else role, "housing")
        normal, offset = (cuts or {}).get(kind, (np.zeros(3), 1.0))
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        normals = normals / np.where(length > 0.0, length, 1.0)
        inside = normals @ view.towards < 0.0
        shade = np.where(inside, _INSIDE, 0.66 + 0.34 * np.abs(normals @ _LIGHT))
        shaded = np.clip(np.outer(shade, COLOURS[role]), 0, 255).astype(np.uint8)
        pixels = self.pixels(view, corners.reshape(-1, 3)).reshape(-1, 3, 3)
        pixels[:, :, :2] *= FINER
        _fill(depth, image, pixels, corners @ normal - offset, shaded, inside)


@kernel
def _fill(
    depth: Array,
    image: Image,
    pixels: Array,
    beyond: Array,
    colours: Image,
    inside: NDArray[np.bool_],
) -> None:
    """Draws triangles into depth buffer and image, pixel centre by pixel centre.

    Args:
        depth: Depth so far, (h, w); greater is nearer.
        image: Colours so far, (h, w, 3).
        pixels: x, y, depth of the corners, (n, 3, 3).
        beyond: Height of each corner over the section plane, (n, 3).
        colours: One per triangle, (n, 3).
        inside: Which triangles show their inside, and are hatched, (n,).
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
                hatch = inside[t] and (x + h - y) % _STEP < _LINE
                for k in range(3):
                    full = colours[t, k]
                    image[y, x, k] = full * (_HATCH / _INSIDE) if hatch else full


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
