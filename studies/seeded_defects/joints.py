"""Faults of joints: axes, limits, origins, mimic, names elsewhere."""

from lxml import etree

from studies.seeded_defects.spoiling import assign, drop, kind, pick, scale


@kind("joints")
def axis_zero(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return assign(pick(rng, axes), "xyz", "0 0 0")


@kind("joints")
def axis_long(r, rng):
    joints = r.joints("revolute", "continuous")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return scale(pick(rng, axes), "xyz", 2.0)


@kind("joints")
def axis_long_prismatic(r, rng):
    joints = r.joints("prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return scale(pick(rng, axes), "xyz", 3.0)


@kind("joints")
def axis_missing(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    return drop(pick(rng, [j for j in joints if j.find("axis") is not None]), "axis")


@kind("joints")
def axis_flipped(r, rng):
    joints = r.joints("revolute", "continuous", "prismatic")
    axes = [j.find("axis") for j in joints if j.find("axis") is not None]
    return scale(pick(rng, axes), "xyz", -1.0)


@kind("joints")
def limit_missing(r, rng):
    return drop(pick(rng, r.limited()), "limit")


def _limit(r, rng, types=("revolute", "prismatic")):
    joints = [j for j in r.limited() if j.get("type") in types]
    joint = pick(rng, [j for j in joints if j.find("mimic") is None])
    return None if joint is None else joint.find("limit")


def _can_move(joint):
    limit = joint.find("limit")
    return limit is not None and limit.get("lower", "0") != limit.get("upper", "0")


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
    limit = pick(rng, [j.find("limit") for j in r.limited() if _can_move(j)])
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
    return assign(_limit(r, rng), "effort", None)


@kind("joints")
def velocity_missing(r, rng):
    return assign(_limit(r, rng), "velocity", None)


@kind("joints")
def effort_negative(r, rng):
    return assign(_limit(r, rng), "effort", "-10")


@kind("joints")
def velocity_negative(r, rng):
    return assign(_limit(r, rng), "velocity", "-1")


@kind("joints")
def velocity_zero(r, rng):
    return assign(_limit(r, rng), "velocity", "0")


@kind("joints")
def origin_in_millimetres(r, rng):
    def length(origin):
        return max(abs(float(w)) for w in origin.get("xyz").split())

    far = [o for o in r.numeric_origins() if length(o) > 0.05]
    return scale(pick(rng, far), "xyz", 1000.0)


@kind("joints")
def rpy_in_degrees(r, rng):
    return assign(pick(rng, r.numeric_origins()), "rpy", "0 90 0")


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
    movable = [j for j in joints if _can_move(j)]
    if len(movable) < 2:
        return None
    one, two = rng.sample(movable, 2)
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
    return assign(pick(rng, inner), "type", "floating")


@kind("joints")
def joint_planar_inside(r, rng):
    parents = {j.find("child").get("link") for j in r.joints()}
    inner = [j for j in r.joints() if j.find("parent").get("link") in parents]
    return assign(pick(rng, inner), "type", "planar")


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
