"""Are errors of a registration as large as stated, and what is refused?

python -m crane.studies.registration --seeds 200
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane.calibration_motion import (
    CENTROID,
    FIDUCIALS,
    TRACKER_SHIFT,
    calibrated,
    noisy,
    sensor_in_robot,
    stage_trajectory,
)
from crane.registration import register, uncertainty
from crane.turning import turns

Array = NDArray[np.float64]

T_SCANNER_ROBOT = np.eye(4)
TARGET = (0.0, 0.0, -0.05)  # below the isocentre, in the scanner's frame


def study(seeds: int, seed: int) -> dict[str, Any]:
    """FRE and TRE over many draws; a chain of three; affine beside rigid; refusals."""
    rng = np.random.default_rng(seed)
    T = tracker_place()
    clouds = {
        "27 poses of the stages": (sensor_in_robot(stage_trajectory())[:, :3, 3],),
        "8 fiducial spheres": (np.array(FIDUCIALS),),
    }
    noise = (TRACKER_SHIFT, CENTROID)
    rows = [
        {"points": name, **drawn(points, T, fle, seeds, rng)}
        for (name, (points,)), fle in zip(clouds.items(), noise, strict=True)
    ]
    return {
        "convention": "FLE, FRE, TRE: rms length of a point's error, all axes",
        "draws": rows,
        "chain": chain(seeds, rng),
        "affine": affine(T, rng),
        "refused": refusals(T, rng),
        "uncertainty": uncertainty(calibrated(T, T_SCANNER_ROBOT, rng).scanner_robot),
    }


def tracker_place() -> Array:
    """Where the tracker stands, arbitrary."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = turns([[0.4, -0.9, 2.0]])[0], [0.3, -0.2, 0.1]
    return T


def drawn(
    a: Array, T: Array, fle: float, seeds: int, rng: np.random.Generator
) -> dict[str, Any]:
    """FRE and TRE of many noisy registrations beside what is expected."""
    b = a @ T[:3, :3].T + T[:3, 3]
    target = b.mean(axis=0) + [0.05, 0.03, -0.10]
    before = T[:3, :3].T @ (target - T[:3, 3])
    fre, off = [], []
    for _ in range(seeds):
        found = register(a, noisy(b, fle, rng))
        fre.append(found.fre)
        off.append(found.T[:3, :3] @ before + found.T[:3, 3] - target)
    expected = fle * np.sqrt(1.0 - 2.0 / len(a))
    rms = float(np.sqrt(np.mean(np.square(fre))))
    tre = float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))
    stated = register(a, b, fle).tre(target)
    return {
        "seeds": seeds,
        "fle_mm": 1e3 * fle,
        "fre_mm": 1e3 * rms,
        "fre_expected_mm": 1e3 * float(expected),
        "fre_ratio": rms / float(expected),
        "tre_mm": 1e3 * tre,
        "tre_expected_mm": 1e3 * stated,
        "tre_ratio": tre / stated,
    }


def chain(seeds: int, rng: np.random.Generator) -> dict[str, Any]:
    """T_scanner_robot of whole calibrations: errors at a target and what is stated."""
    T, truth = tracker_place(), T_SCANNER_ROBOT
    off, normal = [], []
    stated = 0.0
    for _ in range(seeds):
        found = calibrated(T, truth, rng).scanner_robot
        error = found.T @ np.linalg.inv(truth)
        off.append((error @ [*TARGET, 1.0])[:3] - TARGET)
        C = found.target_covariance(TARGET)
        normal.append(float(off[-1] @ np.linalg.solve(C, off[-1])))
        stated += float(np.trace(C)) / seeds
    tre = float(np.sqrt(np.mean(np.sum(np.square(off), axis=1))))
    return {
        "seeds": seeds,
        "tre_mm": 1e3 * tre,
        "tre_expected_mm": 1e3 * float(np.sqrt(stated)),
        # chi-squared of three: 3 on the average if the covariance is right
        "mahalanobis": float(np.mean(normal)),
    }


def affine(T: Array, rng: np.random.Generator) -> dict[str, float]:
    """Eq. (15) read literally on the same noisy points: its determinant."""
    a = sensor_in_robot(stage_trajectory())[:, :3, 3]
    b = a @ T[:3, :3].T + T[:3, 3]
    literal, rigid = [], []
    for _ in range(200):
        read = noisy(b, TRACKER_SHIFT, rng)
        M = np.linalg.lstsq(np.column_stack([a, np.ones(len(a))]), read, rcond=None)[0]
        literal.append(float(np.linalg.det(M[:3])))
        rigid.append(abs(float(np.linalg.det(register(a, read).T[:3, :3])) - 1.0))
    return {
        "least": min(literal),
        "most": max(literal),
        "rigid_off_by": max(rigid),
    }


def refusals(T: Array, rng: np.random.Generator) -> dict[str, str]:
    """What happens to points that do not tell a transform."""
    q = np.tile(stage_trajectory()[0], (10, 1))
    q[:, 2] += np.linspace(0.0, 0.3, 10)
    line = sensor_in_robot(q)[:, :3, 3]
    moved = line @ T[:3, :3].T + T[:3, 3]
    cloud = np.array(FIDUCIALS)
    asked = {
        "one stage alone": (line, moved),
        "one stage alone, noisy": (line, noisy(moved, TRACKER_SHIFT, rng)),
        "standing still": (line[:1].repeat(5, 0), moved[:1].repeat(5, 0)),
        "an axis reversed": (cloud, cloud * [1.0, 1.0, -1.0]),
    }
    found = {}
    for name, (a, b) in asked.items():
        try:
            register(a, b)
            found[name] = "was taken, which is wrong"
        except ValueError as error:
            found[name] = str(error)
    return found


def lines(found: dict[str, Any]) -> Iterator[str]:
    """What the study prints."""
    yield found["convention"]
    for r in found["draws"]:
        yield (
            f"{r['points']:23s} FLE {r['fle_mm']:.3f}, {r['seeds']} seeds: FRE "
            f"{r['fre_mm']:.4f} expected {r['fre_expected_mm']:.4f} "
            f"({r['fre_ratio']:.4f}); TRE {r['tre_mm']:.4f} expected "
            f"{r['tre_expected_mm']:.4f} mm ({r['tre_ratio']:.3f})"
        )
    c, d = found["chain"], found["affine"]
    yield (
        f"scanner to robot over sensor and tracker, {c['seeds']} calibrations: TRE "
        f"{c['tre_mm']:.2f} mm, stated {c['tre_expected_mm']:.2f}; squared error in "
        f"its covariance {c['mahalanobis']:.2f} (3 if right)"
    )
    yield (
        f"eq. (15) read as affine: det {d['least']:.4f} to {d['most']:.4f}; rigid: 1 "
        f"within {d['rigid_off_by']:.0e}"
    )
    for name, reason in found["refused"].items():
        yield f"{name}: refused, {reason}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for line in lines(study(args.seeds, args.seed)):
        print(line)


if __name__ == "__main__":
    main()
