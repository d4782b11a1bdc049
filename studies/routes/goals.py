"""Seeded goals of the installed robots in their own scanners."""

import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

import borecheck as bc
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

Array = NDArray[np.float64]

ROBOTS = ("zerobot", "mri_arm", "crane")
TOUCHING = 10


def stands() -> Iterator[tuple[Robot, Scene]]:
    """Each robot in the scanner that it is made for, with couch and patient."""
    for name in ROBOTS:
        robot = bc.load_robot(name)
        yield robot, bc.load_scene(robot.description.scanner)


def drawn(
    robot: Robot, scene: Scene, rng: np.random.Generator, goals: int
) -> tuple[list[Array], list[Array]]:
    """Goals within the limits that are clear, and ten that are not."""
    clear: list[Array] = []
    touching: list[Array] = []
    while len(clear) < goals or len(touching) < TOUCHING:
        for q in robot.model.random_configurations(rng, 50):
            (clear if bc.check(robot, scene, q).clear else touching).append(q)
    return clear[:goals], touching[:TOUCHING]


def progress(text: str) -> None:
    """One line on the terminal, written over by the next."""
    print(f"{text:<40}", end="\r", file=sys.stderr, flush=True)
