"""An analytic torso scanned in 8 positions: does the obstacle contain its skin?

    python -m studies.scanned_torso [--samples 1000000]

The torso and two arms are closed forms in the scanner's frame. A scan of them is made
as a scanner makes it: slices tilted or not, in the patient's coordinates of each
position, voxels that hold the mean of what is in them, noise of 12 Hounsfield units.
Nothing of borecheck is used for the scan but the files' format. Then: is every sample
of the true skin inside the obstacle, and how far outside does that reach?
"""

import argparse
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

POSITIONS = ("HFS", "HFP", "HFDR", "HFDL", "FFS", "FFP", "FFDR", "FFDL")
TILTS_DEG = (0.0, 20.0, -20.0)
NOISE_HU, TISSUE_HU, AIR_HU = 12.0, 40.0, -1000.0

# Of the surface beyond its offset: half a voxel's diagonal and what simplifying takes.
EXCESS_M = 0.0015

# Right, anterior, superior of the patient in the scanner's frame (x along the bore, z
# up), by position: DICOM PS3.3 C.7.3.1.1.2, written out here once more on purpose.
_AXES = {
    "HFS": ("-y", "+z", "+x"),
    "HFP": ("+y", "-z", "+x"),
    "HFDR": ("-z", "+y", "+x"),
    "HFDL": ("+z", "-y", "+x"),
    "FFS": ("+y", "+z", "-x"),
    "FFP": ("-y", "-z", "-x"),
    "FFDR": ("-z", "-y", "-x"),
    "FFDL": ("+z", "+y", "-x"),
}


@dataclass(frozen=True)
class Blob:
    """A superellipsoid: sum of |x / a|^p <= 1, about a centre, [m]."""

    centre: tuple[float, float, float]
    axes: tuple[float, float, float]
    power: float

    def level(self, points):
        """Below 1 within, (...)."""
        scaled = np.abs((points - np.array(self.centre)) / np.array(self.axes))
        return (scaled**self.power).sum(axis=-1)

    def skin(self, rng, count):
        """Points on the surface, (count, 3)."""
        rays = rng.normal(size=(count, 3)) * np.array(self.axes)
        level = (np.abs(rays / np.array(self.axes)) ** self.power).sum(axis=1)
        return np.array(self.centre) + rays / level[:, None] ** (1.0 / self.power)


BODY = (
    Blob((0.01, 0.0, 0.03), (0.11, 0.16, 0.11), 2.6),
    Blob((0.0, 0.215, 0.0), (0.09, 0.035, 0.04), 2.4),
    Blob((0.02, -0.215, 0.0), (0.08, 0.035, 0.04), 2.4),
)


def scanner_from_lps(position):
    """Rotation, (3, 3)."""
    unit = {"x": [1.0, 0, 0], "y": [0, 1.0, 0], "z": [0, 0, 1.0]}
    right, anterior, superior = (
        (1.0 if word[0] == "+" else -1.0) * np.array(unit[word[1]])
        for word in _AXES[position]
    )
    return np.column_stack([-right, -anterior, superior])


def scan(folder, position, tilt_deg, isocentre_m, *, voxel=(2.0, 2.5, 3.0), seed=1):
    """Writes a series of the body; voxel: across, down, along, [mm].

    Returns:
        How many slices.
    """
    from tests.patients.series import dataset

    rng = np.random.default_rng(seed)
    R = scanner_from_lps(position)
    angle = np.radians(tilt_deg)
    row = np.array([0.0, -1.0, 0.0])
    column = np.array([np.sin(angle), 0.0, -np.cos(angle)])
    step = np.array([1.0, 0.0, 0.0]) * voxel[2] / 1e3
    if np.cross(row, column) @ step < 0:
        step = -step
    across, down = row * voxel[0] / 1e3, column * voxel[1] / 1e3
    columns, rows = int(0.58 / np.linalg.norm(across)), int(0.36 / voxel[1] * 1e3)
    slices = int(0.4 / np.linalg.norm(step))
    middle = np.array([0.01, 0.0, 0.02])
    first = middle - across * columns / 2 - down * rows / 2 - step * slices / 2
    normal = np.cross(row, column)
    normal *= np.sign(normal @ step)
    thick = normal * abs(step @ normal)
    folder.mkdir(parents=True, exist_ok=True)
    i, j = np.arange(columns), np.arange(rows)
    for k in range(slices):
        centre = first + step * k
        grid = centre + across * i[None, :, None] + down * j[:, None, None]
        share = _coverage(grid, across, down, thick)
        values = AIR_HU + (TISSUE_HU - AIR_HU) * share
        values += rng.normal(0.0, NOISE_HU, share.shape)
        origin = R.T @ centre + np.array(isocentre_m)
        image = dataset(
            np.rint(values).astype(np.int16),
            1e3 * origin,
            (*(R.T @ row), *(R.T @ column)),
            (voxel[1], voxel[0]),
            PatientPosition=position,
        )
        image.save_as(folder / f"{k:04d}", enforce_file_format=True)
    return slices


def _coverage(grid, across, down, thick):
    """Share of each voxel that is tissue, by 3 x 3 x 3 points where it is cut."""
    level = np.min([blob.level(grid) for blob in BODY], axis=0)
    share = (level <= 1.0).astype(float)
    near = (level > 0.5) & (level < 1.9)
    points, parts = grid[near], (-1 / 3, 0.0, 1 / 3)
    total = np.zeros(len(points))
    for a in parts:
        for b in parts:
            for c in parts:
                moved = points + a * across + b * down + c * thick
                within = np.min([blob.level(moved) for blob in BODY], axis=0) <= 1.0
                total += within
    share[near] = total / 27
    return share


def skin(count, seed=2):
    """Points of the true skin, in the scanner's frame, (about count, 3), [m]."""
    rng = np.random.default_rng(seed)
    return np.concatenate([blob.skin(rng, count // len(BODY)) for blob in BODY])


def judged(position, tilt_deg, samples, folder, **scanned):
    """Share of the skin inside, excess [m], offset [m], gap [m], of one scan."""
    import igl
    from scipy.spatial import cKDTree

    from borecheck.patients.obstacle import patient_obstacle
    from borecheck.patients.reading import read_volume

    isocentre = np.array([0.012, -0.188, -0.751])
    scan(folder, position, tilt_deg, isocentre, **scanned)
    R = scanner_from_lps(position)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, -R @ isocentre
    made = patient_obstacle(read_volume(folder), T)
    points = skin(samples)
    mesh = made.mesh
    winding = igl.fast_winding_number(mesh.vertices, mesh.triangles, points)
    inside = float((np.abs(winding) > 0.5).mean())
    corners = mesh.corners
    asked = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])
    dense = skin(5 * samples, seed=3)
    excess = float(cKDTree(dense).query(asked)[0].max())
    return inside, excess, made


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=1_000_000)
    args = parser.parse_args()
    wrong = 0
    for position in POSITIONS:
        for tilt in TILTS_DEG:
            begun = time.process_time()
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "scan"
                inside, excess, made = judged(position, tilt, args.samples, path)
            proof = made.proof
            right = inside == 1.0 and excess <= proof.offset + EXCESS_M
            wrong += not right
            print(
                f"{position:4} tilt {tilt:+3.0f}: {inside:.4%} of the skin inside, "
                f"excess {1e3 * excess:.2f} mm (offset {1e3 * proof.offset:.2f}; "
                f"proven gap {1e3 * proof.gap:.2f}, "
                f"excess {1e3 * (proof.excess or 0):.2f}), "
                f"{len(made.mesh.triangles)} triangles, "
                f"{time.process_time() - begun:.1f} s{'' if right else '  WRONG'}",
                flush=True,
            )
    print(f"{len(POSITIONS) * len(TILTS_DEG)} scans, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
