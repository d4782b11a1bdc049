"""Single faults for URDF files: each kind changes one thing at a random place.

The kinds follow the faults that other validators were measured with and those that
users report, not borecheck's checks; nothing of borecheck is imported here. A kind is
a function `(robot, rng) -> element | None`: it changes the XML tree (or a mesh file, or
the text) and returns the element that is wrong now, or None if it does not apply.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from lxml import etree

SHAPES = ("box", "sphere", "cylinder", "mesh")


@dataclass
class Robot:
    """A robot to be spoilt: its tree, its folder, and last changes to the text."""

    root: Any
    folder: Path
    edits: list[Callable[[bytes], bytes]] = field(default_factory=list)
    tag: str = "spoilt"

    def links(self) -> list[Any]:
        """All links."""
        return self.root.findall("link")

    def joints(self, *types: str) -> list[Any]:
        """Joints of some types; all without one."""
        found = self.root.findall("joint")
        return [j for j in found if not types or j.get("type") in types]

    def limited(self) -> list[Any]:
        """Revolute and prismatic joints with a limit."""
        found = self.joints("revolute", "prismatic")
        return [j for j in found if j.find("limit") is not None]

    def numeric_origins(self) -> list[Any]:
        """Origins of joints with an xyz."""
        found = (j.find("origin") for j in self.joints())
        return [o for o in found if o is not None and o.get("xyz")]

    def inertials(self) -> list[Any]:
        """Inertials of links that move, with a mass and an inertia that count."""
        below = {j.find("child").get("link") for j in self.joints()}
        found = []
        for link in self.links():
            inertial = link.find("inertial")
            if inertial is None or link.get("name") not in below:
                continue
            if inertial.find("inertia") is None or link.find("visual") is None:
                continue
            if float(inertial.find("mass").get("value")) > 0.0:
                found.append(inertial)
        return found

    def meshes(self, kind: str = "collision") -> list[Any]:
        """Mesh elements of collisions (or visuals)."""
        return self.root.findall(f"link/{kind}/geometry/mesh")

    def shapes(self, tag: str) -> list[Any]:
        """Collision shapes of one kind."""
        return self.root.findall(f"link/collision/geometry/{tag}")

    def new_mesh(self, mesh: Any, data: bytes, suffix: str | None = None) -> None:
        """Writes a spoilt copy of a mesh and lets the element name it."""
        old = self.folder / mesh.get("filename")
        name = f"{self.tag}{suffix or old.suffix}"
        (old.parent / name).write_bytes(data)
        mesh.set("filename", f"{old.parent.name}/{name}")

    def obj(self, mesh: Any) -> tuple[list[list[float]], list[list[int]]]:
        """Vertices and faces of the OBJ file that an element names."""
        vertices, faces = [], []
        for line in (self.folder / mesh.get("filename")).read_text().splitlines():
            words = line.split()
            if words[:1] == ["v"]:
                vertices.append([float(w) for w in words[1:4]])
            elif words[:1] == ["f"]:
                faces.append([int(w) - 1 for w in words[1:4]])
        return vertices, faces

    def write_obj(
        self, mesh: Any, vertices: list[list[float]], faces: list[list[int]]
    ) -> None:
        """Lets the element name a new OBJ file."""
        lines = ["v " + " ".join(f"{x:.9g}" for x in v) for v in vertices]
        lines += ["f " + " ".join(str(i + 1) for i in f) for f in faces]
        self.new_mesh(mesh, ("\n".join(lines) + "\n").encode())


Mutation = Callable[[Robot, Random], Any]
KINDS: dict[str, tuple[str, Mutation]] = {}


def kind(group: str) -> Callable[[Mutation], Mutation]:
    def enter(function: Mutation) -> Mutation:
        KINDS[function.__name__] = (group, function)
        return function

    return enter


def pick(rng: Random, things: list[Any]) -> Any:
    return rng.choice(things) if things else None


def spoil(path: Path, name: str, seed: int) -> tuple[bytes, str] | None:
    """The bytes of a spoilt robot and where the fault is; None if it cannot be."""
    root = etree.parse(str(path)).getroot()
    before = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    robot = Robot(root, path.parent, tag=name)
    element = KINDS[name][1](robot, Random(f"{name} {seed} {path.name}"))
    if element is None:
        return None
    where = root.getroottree().getpath(element)
    data = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    for edit in robot.edits:
        data = edit(data)
    return None if data == before else (data, where)


def assign(element: Any, name: str, value: str | None) -> Any:
    if element is None:
        return None
    if value is None:
        element.attrib.pop(name, None)
    else:
        element.set(name, value)
    return element


def drop(parent: Any, tag: str) -> Any:
    if parent is None or parent.find(tag) is None:
        return None
    parent.remove(parent.find(tag))
    return parent


def scale(element: Any, name: str, factor: float) -> Any:
    if element is None:
        return None
    values = [float(w) * factor for w in element.get(name).split()]
    return assign(element, name, " ".join(f"{v:.9g}" for v in values))
