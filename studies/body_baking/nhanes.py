"""Prints the table of girths from NHANES' files of body measures.

    python -m studies.body_baking.nhanes male.csv female.csv

The files hold weight, height, arm and leg length, girths of arm, hips and waist of
adults, P_BMX of 2017 to March 2020 (public domain), with comments before the header.
"""

import sys

import numpy as np

from borecheck.bodies.table import KEYS

WITHIN = 1.25  # kg/m2


def main() -> None:
    for file in sys.argv[1:]:
        with open(file) as text:  # noqa: PTH123
            rows = [line for line in text if not line.startswith("#")]
        data = np.genfromtxt(rows[1:], delimiter=",")
        weight, height, _, _, _, hip, waist = data.T
        bmi = weight / (height / 100.0) ** 2
        print(file, f"{len(data)} persons, mean stature {height.mean():.1f} cm")
        for key in KEYS:
            near = np.abs(bmi - key) <= WITHIN
            at_key = [np.polyfit(bmi[near] - key, g[near], 1)[1] for g in (waist, hip)]
            waist_cm, hip_cm = at_key
            print(f"{key:5.1f} {near.sum():4d} waist {waist_cm:6.1f} hip {hip_cm:6.1f}")


if __name__ == "__main__":
    main()
