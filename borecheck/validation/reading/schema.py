"""Which elements and attributes a URDF knows, and how many numbers each holds."""

from typing import Any

from borecheck.robots.urdf.source import tag_of
from borecheck.robots.urdf.tree import JOINT_TAGS, LINK_TAGS

LIMITS = (
    *("lower", "upper", "effort", "velocity"),
    *("acceleration", "deceleration", "jerk"),
)

# Of each element the attributes and the children it may have.
SCHEMA: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "robot": (("name", "version"), ("link", "joint", "material")),
    "link": (("name", "type"), LINK_TAGS),
    "visual": (("name",), ("origin", "geometry", "material")),
    "collision": (("name",), ("origin", "geometry")),
    "geometry": ((), ("box", "cylinder", "sphere", "capsule", "mesh")),
    "box": (("size",), ()),
    "cylinder": (("radius", "length"), ()),
    "capsule": (("radius", "length"), ()),
    "sphere": (("radius",), ()),
    "mesh": (("filename", "scale"), ()),
    "material": (("name",), ("color", "texture")),
    "color": (("rgba",), ()),
    "texture": (("filename",), ()),
    "inertial": ((), ("origin", "mass", "inertia")),
    "mass": (("value",), ()),
    "inertia": (("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), ()),
    "origin": (("xyz", "rpy", "quat_xyzw"), ()),
    "joint": (("name", "type"), JOINT_TAGS),
    "parent": (("link",), ()),
    "child": (("link",), ()),
    "axis": (("xyz",), ()),
    "limit": (LIMITS, ()),
    "dynamics": (("damping", "friction"), ()),
    "mimic": (("joint", "multiplier", "offset"), ()),
    "calibration": (("rising", "falling", "reference_position"), ()),
    "safety_controller": (
        ("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"),
        (),
    ),
}

# Extensions: what is in them is their own affair.
FREE = (
    *("gazebo", "transmission", "ros2_control", "sensor", "plugin", "mujoco"),
    *("isaac_sim", "group", "disable_collisions", "self_collide", "verbose"),
    *("contact_coefficients", "contact", "loop", "loop_joint", "sdf", "frame"),
    *("compliant", "hardwareInterface", "actuator", "motor", "rotor", "xacro"),
)

REQUIRED_ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "box": ("size",),
    "cylinder": ("radius", "length"),
    "capsule": ("radius", "length"),
    "sphere": ("radius",),
    "mesh": ("filename",),
    "mass": ("value",),
    "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
    "axis": ("xyz",),
    "joint": ("type",),
    "mimic": ("joint",),
    "color": ("rgba",),
    "safety_controller": ("k_velocity",),
}

# How many numbers an attribute of an element holds.
NUMERIC: dict[tuple[str, str], int] = {
    ("origin", "xyz"): 3,
    ("origin", "rpy"): 3,
    ("axis", "xyz"): 3,
    ("box", "size"): 3,
    ("mesh", "scale"): 3,
    ("color", "rgba"): 4,
    **{
        (element, attribute): 1
        for element, attributes in {
            "cylinder": ("radius", "length"),
            "capsule": ("radius", "length"),
            "sphere": ("radius",),
            "mass": ("value",),
            "inertia": ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"),
            "limit": LIMITS,
            "dynamics": ("damping", "friction"),
            "mimic": ("multiplier", "offset"),
            "calibration": ("rising", "falling", "reference_position"),
            "safety_controller": (
                *("soft_lower_limit", "soft_upper_limit"),
                *("k_position", "k_velocity"),
            ),
        }.items()
        for attribute in attributes
    },
}


def required_attributes(element: Any) -> tuple[str, ...]:
    """The attributes that an element must have."""
    return REQUIRED_ATTRIBUTES.get(tag_of(element), ())
