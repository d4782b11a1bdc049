"""The last check: does `borecheck check` load the robot? By its own loader."""

from collections.abc import Iterator
from pathlib import Path

from borecheck.errors import BorecheckError, MeshError
from borecheck.geometry.mesh_files.reading import MeshFile
from borecheck.robots.parts import collision_parts, refuse_nothing
from borecheck.robots.urdf.parse import build
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.mesh_reading import read_file
from borecheck.validation.registry import Problem, register


@register("G539", "check-refuses", "geometry", "IEI", "last")
def check_refuses(robot: CheckedUrdf) -> Iterator[Problem]:
    """No link has geometry, or `borecheck check` refuses the robot for another reason.

    Why: No contact can be looked for. Asked only where no other finding is an error:
    with the profile `collision`, check refuses exactly the files that have an error.

    Fix: Give the links <collision> (or <visual>) geometry.
    """
    if robot.holds_macros_only:
        return  # T201 tells of those
    problem = why_refused(robot)
    if problem is not None:
        yield Problem(robot.root, f"borecheck check refuses it: {problem}")


def why_refused(robot: CheckedUrdf) -> str | None:
    """What stops a check of this robot; meshes are looked at if they are to be read."""

    def read(path: Path) -> MeshFile:
        outcome = read_file(robot, path)
        if isinstance(outcome, MeshError):
            raise outcome
        return MeshFile(outcome, None, None, False, ())

    file = robot.folder / Path(robot.file).name
    try:
        tree = build(robot.source)
        if not any(link.visuals or link.collisions for link in tree.links):
            refuse_nothing((), file)
        if robot.options.meshes:
            roots = robot.options.roots
            refuse_nothing(collision_parts(tree, file, roots, read), file)
    except BorecheckError as error:
        return getattr(error, "problem", str(error))
    return None
