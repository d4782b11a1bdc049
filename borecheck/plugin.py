"""What a package that brings a robot or a scanner imports; the only door it needs.

A package describes its robot in a `RobotDescription` or its scanner in a
`ScannerDescription` and names it under an entry point of the group `borecheck.robots`
or `borecheck.scanners`. `docs/adding_a_robot.md` goes through it field by field. What
stands here changes only with a line in the changelog.
"""

from borecheck.errors import BorecheckError as BorecheckError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh as TriangleMesh
from borecheck.robots.description import LEVELS as LEVELS
from borecheck.robots.description import ROLES as ROLES
from borecheck.robots.description import Argument as Argument
from borecheck.robots.description import JointMap as JointMap
from borecheck.robots.description import RobotDescription as RobotDescription
from borecheck.robots.description import ScannerDescription as ScannerDescription
from borecheck.robots.description import Solutions as Solutions

__all__ = [
    "LEVELS",
    "ROLES",
    "Argument",
    "BorecheckError",
    "JointMap",
    "RobotDescription",
    "ScannerDescription",
    "Solutions",
    "TriangleMesh",
]
