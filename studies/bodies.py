"""Twelve bodies beside the table of girths: size, mass, closedness, crossings, time.

    python -m studies.bodies

Heights of 1.76 m (men) and 1.63 m (women), arms at the sides and up in turn.
"""

import time

from borecheck.bodies.body import make_body
from borecheck.bodies.spec import BodySpec
from borecheck.geometry.surfaces import surface
from borecheck.validation.reading.mesh_crossing import crossing_pairs

HEIGHTS = {"m": 1.76, "f": 1.63}


def main() -> None:
    print(
        "body             waist (table)   hips (table) [cm]   BMI   height  size [mm]"
    )
    for sex, height in HEIGHTS.items():
        for k, bmi in enumerate(range(20, 46, 5)):
            show(BodySpec(sex, float(bmi), height, ("side", "up")[k % 2]))


def show(spec: BodySpec) -> None:
    """One line about a body."""
    start = time.process_time()
    body = make_body(spec)
    took = time.process_time() - start
    said, mesh = body.to_json(), body.mesh
    waist, hip = (100 * said["table"][name] for name in ("waist_m", "hip_m"))
    size = " x ".join(f"{1e3 * x:.0f}" for x in said["size_m"])
    closed = "closed" if surface(mesh).topology.is_closed else "OPEN"
    print(
        f"{spec.sex} {spec.bmi:g} {spec.arms:5s}"
        f"{100 * body.waist:12.1f} ({waist:5.1f}) {100 * body.hip:7.1f} ({hip:5.1f})"
        f"{said['bmi']:12.2f} {said['height_m']:8.3f}  {size}, {closed}, "
        f"{len(mesh.triangles)} triangles, {len(crossing_pairs(mesh))} pairs cross, "
        f"{1e3 * took:.0f} ms"
    )


if __name__ == "__main__":
    main()
