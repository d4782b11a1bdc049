"""Would `borecheck fk` notice a wrong number? Every one is changed by 0.1 mm or 1e-4.

For every installed robot with a closed form: each dimension of the closed form, and
each number of each origin, axis and mimic of the compiled URDF, is changed in turn; the
closed form and Pinocchio must then disagree. What goes unseen is printed with its
reason.

    python -m studies.perturbations --configurations 12
"""

import argparse
import sys

import numpy as np

from borecheck.robots.description import installed_names
from borecheck.robots.kinematics.configurations import sample_configurations
from borecheck.robots.kinematics.perturbation import unseen_perturbations
from borecheck.robots.robot import Robot, load_robot


def study(robot: Robot, configurations: int, seed: int) -> int:
    """Prints what is seen and what is not; returns how many are not."""
    rng = np.random.default_rng(seed)
    qs = sample_configurations(robot.model, rng, configurations)
    found = unseen_perturbations(robot, qs)
    mount = ", ".join(f"{k}={v}" for k, v in robot.arguments.items() if k == "mount")
    total = len(found.seen) + len(found.unseen)
    print(
        f"{robot.name} {mount}: {len(found.seen)} of {total} changed numbers are seen"
    )
    for item in found.unseen:
        print(f"  not seen: {item.number}: {item.why}")
    return len(found.unseen)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--configurations", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for name in installed_names("robots"):
        plain = load_robot(name)
        if plain.description is None or plain.description.forward is None:
            print(f"{name}: no closed form")
            continue
        mounts = plain.description.arguments.get("mount")
        for mount in mounts.choices if mounts else ("",):
            robot = load_robot(name, mount=mount) if mount else plain
            study(robot, args.configurations, args.seed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
