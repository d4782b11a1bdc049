"""Closed meshes for links whose own are open: their convex hulls.

An open mesh has no inside, so nothing about it can be certified. What a user does then
is done here: the link gets a `<collision>` that holds all of it.
"""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial import ConvexHull

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.robots.robot import Robot


def with_hulls(text: str, robot: Robot, folder: Path) -> str:
    """The URDF with a hull for every open part, and the hulls beside it.

    Args:
        text: The URDF.
        robot: What it was loaded as.
        folder: Where the URDF will stand.
    """
    root = ElementTree.fromstring(text)
    for part in robot.parts:
        if part.mesh.is_closed:
            continue
        name = f"{robot.model.name}_{part.link}_hull.stl"
        write_stl(folder / name, hull(part.mesh))
        link = next(one for one in root.iter("link") if one.get("name") == part.link)
        for old in link.findall("collision"):
            link.remove(old)
        shape = ElementTree.SubElement(link, "collision")
        geometry = ElementTree.SubElement(shape, "geometry")
        ElementTree.SubElement(geometry, "mesh", filename=name)
    return ElementTree.tostring(root, encoding="unicode")


def hull(mesh: TriangleMesh) -> TriangleMesh:
    """The convex hull, its triangles turned outwards."""
    found = ConvexHull(mesh.vertices)
    triangles = found.simplices.astype(np.int64)
    corners = found.points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ij,ij->i", normals, found.equations[:, :3]) < 0.0
    triangles[inward] = triangles[inward][:, ::-1]
    used, renamed = np.unique(triangles, return_inverse=True)
    return TriangleMesh(mesh.name, found.points[used], renamed.reshape(-1, 3))
