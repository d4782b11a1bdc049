"""Single faults for URDF files: each kind changes one thing at a random place.

The kinds follow the faults that other validators were measured with and those that
users report, not borecheck's checks; nothing of borecheck is imported here. A kind is
a function `(robot, rng) -> element | None`: it changes the XML tree (or a mesh file, or
the text) and returns the element that is wrong now, or None if it does not apply.
"""

from __future__ import annotations

import struct
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
    robot = Robot(root, path.parent, tag=name)
    element = KINDS[name][1](robot, Random(f"{name} {seed} {path.name}"))
    if element is None:
        return None
    where = root.getroottree().getpath(element)
    data = etree.tostring(root, xml_declaration=True, encoding="UTF-8")
    for edit in robot.edits:
        data = edit(data)
    return data, where


def _set(element: Any, name: str, value: str | None) -> Any:
    if element is None:
        return None
    if value is None:
        element.attrib.pop(name, None)
    else:
        element.set(name, value)
    return element


def _drop(parent: Any, tag: str) -> Any:
    if parent is None or parent.find(tag) is None:
        return None
    parent.remove(parent.find(tag))
    return parent


def _vector(element: Any, name: str, factor: float) -> Any:
    if element is None:
        return None
    values = [float(w) * factor for w in element.get(name).split()]
    return _set(element, name, " ".join(f"{v:.9g}" for v in values))


# --- structure ---------------------------------------------------------------


@kind("structure")
def robot_name_missing(r, rng):
    return _set(r.root, "name", None)


@kind("structure")
def root_renamed(r, rng):
    r.root.tag = "model"
    return r.root


@kind("structure")
def tag_unclosed(r, rng):
    r.edits.append(lambda data: data.replace(b"</joint>", b"", 1))
    return r.root if r.joints() else None


@kind("structure")
def file_cut(r, rng):
    r.edits.append(lambda data: data[: int(len(data) * rng.uniform(0.3, 0.9))])
    return r.root


@kind("structure")
def file_empty(r, rng):
    r.edits.append(lambda data: b"")
    return r.root


@kind("structure")
def link_name_missing(r, rng):
    return _set(pick(rng, r.links()), "name", None)


@kind("structure")
def joint_name_missing(r, rng):
    return _set(pick(rng, r.joints()), "name", None)


@kind("structure")
def link_name_twice(r, rng):
    if len(r.links()) < 2:
        return None
    one, _two = rng.sample(r.links(), 2)
    return etree.SubElement(r.root, "link", name=one.get("name"))


@kind("structure")
def joint_name_twice(r, rng):
    if len(r.joints()) < 2:
        return None
    one, two = rng.sample(r.joints(), 2)
    return _set(two, "name", one.get("name"))


@kind("structure")
def parent_unknown(r, rng):
    joint = pick(rng, r.joints())
    _set(joint.find("parent"), "link", joint.find("parent").get("link") + "_x")
    return joint


@kind("structure")
def child_unknown(r, rng):
    joint = pick(rng, r.joints())
    _set(joint.find("child"), "link", joint.find("child").get("link") + "_x")
    return joint


@kind("structure")
def parent_missing(r, rng):
    return _drop(pick(rng, r.joints()), "parent")


@kind("structure")
def child_missing(r, rng):
    return _drop(pick(rng, r.joints()), "child")


@kind("structure")
def joint_type_missing(r, rng):
    return _set(pick(rng, r.joints()), "type", None)


@kind("structure")
def joint_type_misspelt(r, rng):
    return _set(pick(rng, r.joints("revolute")), "type", "revolut")


@kind("structure")
def link_orphaned(r, rng):
    return etree.SubElement(r.root, "link", name="left_over_link")


@kind("structure")
def tree_cut_in_two(r, rng):
    joint = pick(rng, r.joints())
    r.root.remove(joint)
    return r.root


@kind("structure")
def cycle_made(r, rng):
    children = {j.find("child").get("link") for j in r.joints()}
    tops = [j for j in r.joints() if j.find("parent").get("link") not in children]
    joint = pick(rng, tops)
    below = {joint.find("child").get("link")}
    for _ in range(len(r.joints())):
        for j in r.joints():
            if j.find("parent").get("link") in below:
                below.add(j.find("child").get("link"))
    joint.find("parent").set("link", rng.choice(sorted(below)))
    return joint


@kind("structure")
def joint_to_itself(r, rng):
    joint = pick(rng, r.joints())
    joint.find("parent").set("link", joint.find("child").get("link"))
    return joint


@kind("structure")
def two_parents(r, rng):
    if len(r.joints()) < 3:
        return None
    joint = pick(rng, r.joints()[1:])
    other = r.joints()[0].find("parent").get("link")
    if other == joint.find("parent").get("link"):
        return None
    new = etree.SubElement(r.root, "joint", name="second_parent", type="fixed")
    etree.SubElement(new, "parent", link=other)
    etree.SubElement(new, "child", link=joint.find("child").get("link"))
    return new


@kind("structure")
def collision_misspelt(r, rng):
    element = pick(rng, r.root.findall("link/collision"))
    if element is not None:
        element.tag = "colision"
    return element


@kind("structure")
def shape_misspelt(r, rng):
    element = pick(rng, [s for t in SHAPES for s in r.shapes(t)])
    if element is not None:
        element.tag = element.tag + "s"
    return element


@kind("structure")
def rpy_misspelt(r, rng):
    element = pick(rng, [o for o in r.numeric_origins() if o.get("rpy")])
    if element is not None:
        element.set("ryp", element.attrib.pop("rpy"))
    return element


@kind("structure")
def xyz_misspelt(r, rng):
    element = pick(rng, r.numeric_origins())
    if element is not None:
        element.set("xzy", element.attrib.pop("xyz"))
    return element


@kind("structure")
def limit_misspelt(r, rng):
    joint = pick(rng, r.limited())
    if joint is not None:
        joint.find("limit").tag = "limits"
    return joint


@kind("structure")
def upper_misspelt(r, rng):
    joint = pick(rng, [j for j in r.limited() if j.find("limit").get("upper")])
    if joint is not None:
        limit = joint.find("limit")
        limit.set("uper", limit.attrib.pop("upper"))
    return joint


@kind("structure")
def xacro_expression_left(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 0 ${length}")


@kind("structure")
def xacro_tag_left(r, rng):
    name = "{http://www.ros.org/wiki/xacro}finger"
    return etree.SubElement(
        r.root, name, nsmap={"xacro": "http://www.ros.org/wiki/xacro"}
    )


@kind("structure")
def prefix_undeclared(r, rng):
    new = b"<controller:plugin/></robot>"
    r.edits.append(lambda data: data.replace(b"</robot>", new, 1))
    return r.root


@kind("structure")
def xml_version_zero(r, rng):
    r.edits.append(lambda d: d.replace(b"version='1.0'", b"version='0.0'", 1))
    return r.root


@kind("structure")
def number_is_nan(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 nan 0")


@kind("structure")
def number_is_word(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 0 height")


@kind("structure")
def number_has_comma(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0,1 0 0,25")


@kind("structure")
def number_has_unit(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 0 35mm")


@kind("structure")
def number_too_few(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 0.1")


@kind("structure")
def number_too_many(r, rng):
    return _set(pick(rng, r.numeric_origins()), "xyz", "0 0.1 0.2 0.3")


@kind("structure")
def origin_twice(r, rng):
    origin = pick(rng, r.numeric_origins())
    if origin is None:
        return None
    joint = origin.getparent()
    return etree.SubElement(joint, "origin", xyz="0 0 1")


@kind("structure")
def shape_twice(r, rng):
    geometry = pick(rng, r.root.findall("link/collision/geometry"))
    if geometry is not None:
        etree.SubElement(geometry, "box", size="0.1 0.1 0.1")
    return geometry


@kind("structure")
def geometry_missing(r, rng):
    return _drop(pick(rng, r.root.findall("link/collision")), "geometry")


@kind("structure")
def geometry_empty(r, rng):
    geometry = pick(rng, r.root.findall("link/collision/geometry"))
    if geometry is not None:
        for child in list(geometry):
            geometry.remove(child)
    return geometry


@kind("structure")
def name_has_space(r, rng):
    return _set(pick(rng, r.joints("revolute", "prismatic", "fixed")), "name", "my j")


@kind("structure")
def name_differs_by_case(r, rng):
    joint = pick(rng, [j for j in r.joints() if j.get("name").upper() != j.get("name")])
    if joint is None:
        return None
    new = etree.SubElement(r.root, "link", name="case_link")
    extra = etree.SubElement(r.root, "joint", type="fixed")
    extra.set("name", joint.get("name").upper())
    etree.SubElement(extra, "parent", link=joint.find("child").get("link"))
    etree.SubElement(extra, "child", link=new.get("name"))
    return extra


@kind("structure")
def material_undefined(r, rng):
    visual = pick(rng, r.root.findall("link/visual"))
    if visual is None:
        return None
    for old in visual.findall("material"):
        visual.remove(old)
    return etree.SubElement(visual, "material", name="no_such_colour")


@kind("structure")
def colour_as_bytes(r, rng):
    material = etree.SubElement(r.root, "material", name="bytes_colour")
    return etree.SubElement(material, "color", rgba="200 100 0 255")


@kind("structure")
def text_left_over(r, rng):
    link = pick(rng, r.links())
    link.tail = (link.tail or "") + " --> "
    return r.root


@kind("structure")
def entity_bomb(r, rng):
    bomb = b'<!DOCTYPE robot [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>\n'
    r.edits.append(lambda d: d.replace(b"<robot", bomb + b"<robot", 1))
    return r.root


# --- joints ------------------------------------------------------------------


@kind("joints")
def axis_zero(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return _set(pick(rng, axes), "xyz", "0 0 0")


@kind("joints")
def axis_long(r, rng):
    joints = r.joints("revolute", "continuous")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return _vector(pick(rng, axes), "xyz", 2.0)


@kind("joints")
def axis_long_prismatic(r, rng):
    joints = r.joints("prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return _vector(pick(rng, axes), "xyz", 3.0)


@kind("joints")
def axis_missing(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    return _drop(pick(rng, [j for j in joints if j.find("axis") is not None]), "axis")


@kind("joints")
def axis_flipped(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return _vector(pick(rng, axes), "xyz", -1.0)


@kind("joints")
def limit_missing(r, rng):
    return _drop(pick(rng, r.limited()), "limit")


def _limit(r, rng, types=("revolute", "prismatic")):
    joints = [j for j in r.limited() if j.get("type") in types]
    joint = pick(rng, [j for j in joints if j.find("mimic") is None])
    return None if joint is None else joint.find("limit")


@kind("joints")
def limit_reversed(r, rng):
    limit = _limit(r, rng)
    if limit is not None:
        low, high = limit.get("lower", "0"), limit.get("upper", "0")
        if float(low) == float(high):
            return None
        limit.set("lower", high)
        limit.set("upper", low)
    return limit


@kind("joints")
def limit_equal(r, rng):
    limit = _limit(r, rng)
    if limit is not None:
        limit.set("lower", "0")
        limit.set("upper", "0")
    return limit


@kind("joints")
def limit_lower_upper_omitted(r, rng):
    limit = _limit(r, rng)
    if limit is not None:
        limit.attrib.pop("lower", None)
        limit.attrib.pop("upper", None)
    return limit


@kind("joints")
def limit_in_degrees(r, rng):
    limit = _limit(r, rng, ("revolute",))
    if limit is not None:
        limit.set("lower", "-90")
        limit.set("upper", "90")
    return limit


@kind("joints")
def limit_excludes_zero(r, rng):
    limit = _limit(r, rng)
    if limit is not None:
        limit.set("lower", "0.02")
        limit.set("upper", "0.04")
    return limit


@kind("joints")
def stroke_in_millimetres(r, rng):
    limit = _limit(r, rng, ("prismatic",))
    if limit is not None:
        limit.set("lower", "0")
        limit.set("upper", "400")
    return limit


@kind("joints")
def effort_missing(r, rng):
    return _set(_limit(r, rng), "effort", None)


@kind("joints")
def velocity_missing(r, rng):
    return _set(_limit(r, rng), "velocity", None)


@kind("joints")
def effort_negative(r, rng):
    return _set(_limit(r, rng), "effort", "-10")


@kind("joints")
def velocity_negative(r, rng):
    return _set(_limit(r, rng), "velocity", "-1")


@kind("joints")
def velocity_zero(r, rng):
    return _set(_limit(r, rng), "velocity", "0")


@kind("joints")
def origin_in_millimetres(r, rng):
    def length(origin):
        return max(abs(float(w)) for w in origin.get("xyz").split())

    far = [o for o in r.numeric_origins() if length(o) > 0.05]
    return _vector(pick(rng, far), "xyz", 1000.0)


@kind("joints")
def rpy_in_degrees(r, rng):
    return _set(pick(rng, r.numeric_origins()), "rpy", "0 90 0")


def _mimic(r, rng, leader, **more):
    joints = [j for j in r.limited() if j.find("mimic") is None]
    joint = pick(rng, [j for j in joints if j.get("name") != leader])
    if joint is None:
        return None
    return etree.SubElement(joint, "mimic", joint=leader or joint.get("name"), **more)


@kind("joints")
def mimic_unknown(r, rng):
    return _mimic(r, rng, "no_such_joint")


@kind("joints")
def mimic_self(r, rng):
    return _mimic(r, rng, None)


@kind("joints")
def mimic_circle(r, rng):
    joints = [j for j in r.limited() if j.find("mimic") is None]
    if len(joints) < 2:
        return None
    one, two = rng.sample(joints, 2)
    etree.SubElement(one, "mimic", joint=two.get("name"))
    return etree.SubElement(two, "mimic", joint=one.get("name"))


@kind("joints")
def mimic_chain(r, rng):
    joints = [j for j in r.joints("revolute") if j.find("mimic") is None]
    if len(joints) < 3:
        return None
    one, two, three = rng.sample(joints, 3)
    etree.SubElement(two, "mimic", joint=one.get("name"))
    return etree.SubElement(three, "mimic", joint=two.get("name"))


@kind("joints")
def mimic_of_fixed(r, rng):
    fixed = pick(rng, r.joints("fixed"))
    return None if fixed is None else _mimic(r, rng, fixed.get("name"))


@kind("joints")
def mimic_beyond_limits(r, rng):
    joints = [j for j in r.joints("revolute") if j.find("mimic") is None]
    if len(joints) < 2:
        return None
    one, two = rng.sample(joints, 2)
    return etree.SubElement(two, "mimic", joint=one.get("name"), multiplier="50")


@kind("joints")
def mimic_factor_zero(r, rng):
    joints = [j for j in r.joints("revolute") if j.find("mimic") is None]
    if len(joints) < 2:
        return None
    one, two = rng.sample(joints, 2)
    return etree.SubElement(two, "mimic", joint=one.get("name"), multiplier="0")


@kind("joints")
def joint_floating_inside(r, rng):
    parents = {j.find("child").get("link") for j in r.joints()}
    inner = [j for j in r.joints() if j.find("parent").get("link") in parents]
    return _set(pick(rng, inner), "type", "floating")


@kind("joints")
def joint_planar_inside(r, rng):
    parents = {j.find("child").get("link") for j in r.joints()}
    inner = [j for j in r.joints() if j.find("parent").get("link") in parents]
    return _set(pick(rng, inner), "type", "planar")


@kind("joints")
def damping_negative(r, rng):
    joint = pick(rng, r.joints("revolute", "prismatic", "continuous"))
    if joint is None:
        return None
    for old in joint.findall("dynamics"):
        joint.remove(old)
    return etree.SubElement(joint, "dynamics", damping="-0.5", friction="0")


@kind("joints")
def soft_limit_outside(r, rng):
    joint = pick(rng, [j for j in r.limited() if j.find("limit").get("upper")])
    if joint is None:
        return None
    for old in joint.findall("safety_controller"):
        joint.remove(old)
    upper = float(joint.find("limit").get("upper"))
    values = {"k_velocity": "1", "soft_upper_limit": f"{upper + 1.0:g}"}
    return etree.SubElement(joint, "safety_controller", values)


@kind("joints")
def transmission_unknown_joint(r, rng):
    new = etree.SubElement(r.root, "transmission", name="t_left_over")
    etree.SubElement(new, "type").text = "transmission_interface/SimpleTransmission"
    return etree.SubElement(new, "joint", name="no_such_joint")


@kind("joints")
def gazebo_unknown_reference(r, rng):
    return etree.SubElement(r.root, "gazebo", reference="no_such_link")


# --- inertia -----------------------------------------------------------------


@kind("inertia")
def mass_zero(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else _set(inertial.find("mass"), "value", "0")


@kind("inertia")
def mass_negative(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else _vector(inertial.find("mass"), "value", -1.0)


@kind("inertia")
def mass_missing(r, rng):
    return _drop(pick(rng, r.inertials()), "mass")


@kind("inertia")
def mass_in_grams(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else _vector(inertial.find("mass"), "value", 1e3)


@kind("inertia")
def inertial_missing(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else _drop(inertial.getparent(), "inertial")


def _inertia(r, rng, **values):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    for name, value in values.items():
        inertia.set(name, value)
    return inertia


@kind("inertia")
def inertia_negative(r, rng):
    return _inertia(r, rng, ixx="-0.01")


@kind("inertia")
def inertia_products_too_large(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    value = 3.0 * max(float(inertia.get(n)) for n in ("ixx", "iyy", "izz"))
    return _set(inertia, "ixy", f"{value:.6g}")


@kind("inertia")
def inertia_triangle_broken(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    value = 10.0 * sum(float(inertia.get(n)) for n in ("ixx", "iyy"))
    return _set(inertia, "izz", f"{value:.6g}")


@kind("inertia")
def inertia_zero(r, rng):
    zero = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "0")
    return _inertia(r, rng, **zero)


@kind("inertia")
def inertia_placeholder(r, rng):
    ones = dict.fromkeys(("ixx", "iyy", "izz"), "1")
    return _inertia(r, rng, **ones, ixy="0", ixz="0", iyz="0")


@kind("inertia")
def inertia_in_square_millimetres(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    inertia = inertial.find("inertia")
    for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
        _vector(inertia, name, 1e6)
    return inertia


@kind("inertia")
def inertia_nan(r, rng):
    return _inertia(r, rng, izz="nan")


@kind("inertia")
def inertia_entry_missing(r, rng):
    inertial = pick(rng, r.inertials())
    return None if inertial is None else _set(inertial.find("inertia"), "iyy", None)


@kind("inertia")
def centre_of_mass_in_millimetres(r, rng):
    inertial = pick(rng, r.inertials())
    if inertial is None:
        return None
    origin = inertial.find("origin")
    if origin is None:
        origin = etree.SubElement(inertial, "origin")
    return _set(origin, "xyz", "0 0 50")


# --- geometry ----------------------------------------------------------------


@kind("geometry")
def mesh_missing(r, rng):
    mesh = pick(rng, r.meshes())
    return None if mesh is None else _set(mesh, "filename", "meshes/no_such.obj")


@kind("geometry")
def mesh_other_case(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    folder, _, name = mesh.get("filename").rpartition("/")
    return _set(mesh, "filename", f"{folder}/{name.upper()}")


@kind("geometry")
def mesh_backslash(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return _set(mesh, "filename", mesh.get("filename").replace("/", "\\"))


@kind("geometry")
def mesh_absolute(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return _set(mesh, "filename", "/home/someone/ws/src/arm/" + mesh.get("filename"))


@kind("geometry")
def mesh_package_unknown(r, rng):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    return _set(mesh, "filename", "package://no_such_pkg/" + mesh.get("filename"))


@kind("geometry")
def mesh_path_escapes(r, rng):
    mesh = pick(rng, r.meshes())
    return (
        None if mesh is None else _set(mesh, "filename", "../" * 12 + "etc/passwd.obj")
    )


@kind("geometry")
def mesh_filename_missing(r, rng):
    return _set(pick(rng, r.meshes()), "filename", None)


@kind("geometry")
def mesh_is_folder(r, rng):
    mesh = pick(rng, r.meshes())
    return None if mesh is None else _set(mesh, "filename", "meshes")


def _mesh_of_bytes(r, rng, data, suffix=None):
    mesh = pick(rng, r.meshes())
    if mesh is not None:
        r.new_mesh(mesh, data, suffix)
    return mesh


@kind("geometry")
def mesh_empty(r, rng):
    return _mesh_of_bytes(r, rng, b"")


@kind("geometry")
def mesh_lfs_pointer(r, rng):
    text = b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 1234\n"
    return _mesh_of_bytes(r, rng, text)


@kind("geometry")
def mesh_html_page(r, rng):
    return _mesh_of_bytes(r, rng, b"<!DOCTYPE html><html><body>404</body></html>")


@kind("geometry")
def mesh_stl_cut(r, rng):
    triangle = struct.pack("<12fH", *([0.0] * 3), 0, 0, 0, 1, 0, 0, 0, 1, 0, 0)
    data = b"cut".ljust(80) + struct.pack("<I", 500) + triangle * 20
    return _mesh_of_bytes(r, rng, data, ".stl")


def _changed(r, rng, change):
    mesh = pick(rng, r.meshes())
    if mesh is None:
        return None
    vertices, faces = r.obj(mesh)
    r.write_obj(mesh, *change(vertices, faces))
    return mesh


@kind("geometry")
def mesh_nan_vertex(r, rng):
    def change(v, f):
        v[rng.randrange(len(v))][1] = float("nan")
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_index_out_of_range(r, rng):
    def change(v, f):
        f[rng.randrange(len(f))][2] = len(v) + 5
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_no_faces(r, rng):
    return _changed(r, rng, lambda v, f: (v, []))


@kind("geometry")
def mesh_in_millimetres(r, rng):
    return _changed(r, rng, lambda v, f: ([[1e3 * x for x in p] for p in v], f))


@kind("geometry")
def mesh_scaled_down_twice(r, rng):
    return _set(pick(rng, r.meshes()), "scale", "0.001 0.001 0.001")


@kind("geometry")
def mesh_in_inches(r, rng):
    return _set(pick(rng, r.meshes()), "scale", "39.37 39.37 39.37")


@kind("geometry")
def mesh_scale_zero(r, rng):
    return _set(pick(rng, r.meshes()), "scale", "1 0 1")


@kind("geometry")
def mesh_mirrored(r, rng):
    return _set(pick(rng, r.meshes()), "scale", "1 -1 1")


@kind("geometry")
def mesh_degenerate_faces(r, rng):
    def change(v, f):
        extra = [[t[0], t[1], t[1]] for t in rng.sample(f, min(3, len(f)))]
        return v, f + extra

    return _changed(r, rng, change)


@kind("geometry")
def mesh_faces_twice(r, rng):
    return _changed(r, rng, lambda v, f: (v, f + rng.sample(f, max(1, len(f) // 20))))


@kind("geometry")
def mesh_winding_mixed(r, rng):
    def change(v, f):
        for i in rng.sample(range(len(f)), max(1, len(f) // 10)):
            f[i] = f[i][::-1]
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_inside_out(r, rng):
    return _changed(r, rng, lambda v, f: (v, [t[::-1] for t in f]))


@kind("geometry")
def mesh_open(r, rng):
    def change(v, f):
        for i in sorted(rng.sample(range(len(f)), max(1, len(f) // 20)), reverse=True):
            del f[i]
        return v, f

    return _changed(r, rng, change)


@kind("geometry")
def mesh_crosses_itself(r, rng):
    def change(v, f):
        size = [max(p[k] for p in v) - min(p[k] for p in v) for k in range(3)]
        moved = [[p[k] + 0.37 * size[k] for k in range(3)] for p in v]
        return v + moved, f + [[i + len(v) for i in t] for t in f]

    return _changed(r, rng, change)


@kind("geometry")
def collision_missing(r, rng):
    links = [k for k in r.links() if k.find("visual") is not None]
    link = pick(rng, [k for k in links if len(k.findall("collision")) == 1])
    return _drop(link, "collision")


def _origin_of(collision):
    origin = collision.find("origin")
    if origin is None:
        origin = etree.SubElement(collision, "origin", xyz="0 0 0")
    return origin


@kind("geometry")
def collision_elsewhere(r, rng):
    links = [k for k in r.links() if k.find("visual") is not None]
    found = [c for k in links for c in k.findall("collision")]
    collision = pick(rng, [c for c in found if len(c.getparent()) and _single(c)])
    if collision is None:
        return None
    origin = _origin_of(collision)
    x, y, z = (float(w) for w in origin.get("xyz", "0 0 0").split())
    origin.set("xyz", f"{x + 0.4:.6g} {y:.6g} {z + 0.2:.6g}")
    return collision


def _single(collision):
    return len(collision.getparent().findall("collision")) == 1


@kind("geometry")
def collision_much_too_small(r, rng):
    meshes = [m for m in r.meshes() if _single(m.getparent().getparent())]
    meshes = [
        m
        for m in meshes
        if m.getparent().getparent().getparent().find("visual") is not None
    ]
    return _set(pick(rng, meshes), "scale", "0.1 0.1 0.1")


@kind("geometry")
def shape_size_negative(r, rng):
    shape = pick(rng, [s for t in ("box", "sphere", "cylinder") for s in r.shapes(t)])
    if shape is None:
        return None
    name = "size" if shape.tag == "box" else "radius"
    words = shape.get(name).split()
    return _set(shape, name, " ".join(["-" + words[0], *words[1:]]))


@kind("geometry")
def shape_size_zero(r, rng):
    shape = pick(rng, [s for t in ("sphere", "cylinder") for s in r.shapes(t)])
    return _set(shape, "radius", "0")


@kind("geometry")
def shape_size_missing(r, rng):
    shape = pick(rng, [s for t in ("sphere", "cylinder") for s in r.shapes(t)])
    return _set(shape, "radius", None)


@kind("geometry")
def shape_size_two_numbers(r, rng):
    return _set(pick(rng, r.shapes("box")), "size", "0.1 0.1")
