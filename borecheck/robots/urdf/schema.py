"""Which elements and attributes a URDF knows, and how many numbers each holds."""

JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
AXIS_TYPES = ("revolute", "continuous", "prismatic", "planar")
LIMITED_TYPES = ("revolute", "prismatic")
FREE_TYPES = ("floating", "planar")  # of several degrees of freedom
SHAPES = ("box", "cylinder", "sphere", "capsule", "mesh")
LINK_TAGS = ("inertial", "visual", "collision")
JOINT_TAGS = (
    *("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    *("calibration", "safety_controller"),
)

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
    "geometry": ((), SHAPES),
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

# Simulators bring robots of their own in here.
EXTENSIONS = (
    *("gazebo", "sdf", "mujoco", "plugin", "sensor", "isaac_sim"),
    *("transmission", "ros2_control"),
)

# Extensions and what else is known beside URDF: no spelling is looked for in them.
FREE = (
    *("gazebo", "transmission", "ros2_control", "sensor", "plugin", "mujoco"),
    *("isaac_sim", "group", "disable_collisions", "self_collide", "verbose"),
    *("contact_coefficients", "contact", "loop", "loop_joint", "sdf", "frame"),
    *("compliant", "hardwareInterface", "actuator", "motor", "rotor", "xacro"),
)

VERSIONS = ("1.0", "1.1", "1.2")

# Of each element the children that may stand once, and those that must stand.
SINGLE = {
    "link": ("inertial",),
    "joint": JOINT_TAGS,
    "visual": ("origin", "geometry", "material"),
    "collision": ("origin", "geometry"),
    "inertial": ("origin", "mass", "inertia"),
}
REQUIRED = {
    "visual": ("geometry",),
    "collision": ("geometry",),
    "inertial": ("mass", "inertia"),
}
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

# Which of them are lengths, or factors of lengths, in space.
LENGTHS = (
    *(("origin", "xyz"), ("box", "size"), ("sphere", "radius"), ("mesh", "scale")),
    *((tag, name) for tag in ("cylinder", "capsule") for name in ("radius", "length")),
)
