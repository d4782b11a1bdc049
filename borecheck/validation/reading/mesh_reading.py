"""Mesh files of a robot: resolved and read once, whatever asks for them."""

from pathlib import Path

from borecheck.errors import MeshError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.robots.urdf.package_paths import Resolution, resolve
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.mesh_facts import MeshFacts, facts_of


def resolution_of(robot: CheckedUrdf, reference: str) -> Resolution:
    """Where a reference leads, remembered."""
    roots = robot.options.roots
    found: Resolution = robot.remembered(
        "resolutions", reference, lambda: resolve(reference, robot.folder, roots)
    )
    return found


def read_file(robot: CheckedUrdf, path: Path) -> TriangleMesh | MeshError:
    """The mesh in a file in its own unit, or why it cannot be read; remembered."""
    found: TriangleMesh | MeshError = robot.remembered(
        "meshes", path, lambda: _read(path)
    )
    return found


def _read(path: Path) -> TriangleMesh | MeshError:
    from borecheck.geometry.mesh_files.reading import read_mesh

    try:
        return read_mesh(path)
    except MeshError as error:
        return error


def path_of(robot: CheckedUrdf, shape: DraftShape) -> Path | None:
    """The mesh file of a shape, if it is a mesh that can be found."""
    if shape.filename is None:
        return None
    return resolution_of(robot, shape.filename).path


def mesh_of(robot: CheckedUrdf, shape: DraftShape) -> TriangleMesh | None:
    """The mesh of a shape, unscaled; None if it is not to be read or cannot be."""
    path = path_of(robot, shape)
    if path is None or not robot.options.meshes:
        return None
    outcome = read_file(robot, path)
    return outcome if isinstance(outcome, TriangleMesh) else None


def facts(robot: CheckedUrdf, shape: DraftShape) -> MeshFacts | None:
    """Counts about the mesh of a shape, remembered per file."""
    mesh, path = mesh_of(robot, shape), path_of(robot, shape)
    if mesh is None or path is None:
        return None
    found: MeshFacts = robot.remembered("facts", path, lambda: facts_of(mesh))
    return found
