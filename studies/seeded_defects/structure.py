"""Faults of the document and of the tree."""

from lxml import etree

from studies.seeded_defects.spoiling import SHAPES, assign, drop, kind, pick


@kind("structure")
def robot_name_missing(r, rng):
    return assign(r.root, "name", None)


@kind("structure")
def root_renamed(r, rng):
    r.root.tag = "model"
    return r.root


@kind("structure")
def tag_unclosed(r, rng):
    joints = r.joints()
    for comment in r.root.iter(etree.Comment):
        comment.text = " "  # an end tag within a comment ends nothing
    r.edits.append(lambda data: data.replace(b"</joint>", b"", 1))
    return r.root if joints else None


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
    return assign(pick(rng, r.links()), "name", None)


@kind("structure")
def joint_name_missing(r, rng):
    return assign(pick(rng, r.joints()), "name", None)


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
    return assign(two, "name", one.get("name"))


@kind("structure")
def parent_unknown(r, rng):
    joint = pick(rng, r.joints())
    assign(joint.find("parent"), "link", joint.find("parent").get("link") + "_x")
    return joint


@kind("structure")
def child_unknown(r, rng):
    joint = pick(rng, r.joints())
    assign(joint.find("child"), "link", joint.find("child").get("link") + "_x")
    return joint


@kind("structure")
def parent_missing(r, rng):
    return drop(pick(rng, r.joints()), "parent")


@kind("structure")
def child_missing(r, rng):
    return drop(pick(rng, r.joints()), "child")


@kind("structure")
def joint_type_missing(r, rng):
    return assign(pick(rng, r.joints()), "type", None)


@kind("structure")
def joint_type_misspelt(r, rng):
    return assign(pick(rng, r.joints("revolute")), "type", "revolut")


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
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 0 ${length}")


@kind("structure")
def xacro_tag_left(r, rng):
    name = "{http://www.ros.org/wiki/xacro}finger"
    return etree.SubElement(
        r.root, name, nsmap={"xacro": "http://www.ros.org/wiki/xacro"}
    )


@kind("structure")
def prefix_undeclared(r, rng):
    new = b"<undeclared:plugin/></robot>"
    r.edits.append(lambda data: data.replace(b"</robot>", new, 1))
    return r.root


@kind("structure")
def xml_version_zero(r, rng):
    r.edits.append(lambda d: d.replace(b"version='1.0'", b"version='0.0'", 1))
    return r.root


@kind("structure")
def number_is_nan(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 nan 0")


@kind("structure")
def number_is_word(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 0 height")


@kind("structure")
def number_has_comma(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0,1 0 0,25")


@kind("structure")
def number_has_unit(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 0 35mm")


@kind("structure")
def number_too_few(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 0.1")


@kind("structure")
def number_too_many(r, rng):
    return assign(pick(rng, r.numeric_origins()), "xyz", "0 0.1 0.2 0.3")


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
    return drop(pick(rng, r.root.findall("link/collision")), "geometry")


@kind("structure")
def geometry_empty(r, rng):
    geometry = pick(rng, r.root.findall("link/collision/geometry"))
    if geometry is not None:
        for child in list(geometry):
            geometry.remove(child)
    return geometry


@kind("structure")
def name_has_space(r, rng):
    return assign(pick(rng, r.joints("revolute", "prismatic", "fixed")), "name", "my j")


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
