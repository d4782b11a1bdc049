"""Which findings of borecheck name a seeded fault rightly: code and element."""

import re

# Codes that name a fault rightly, by kind; a letter and digits are a beginning.
EXPECTED = {
    "robot_name_missing": "D104",
    "root_renamed": "D103",
    "tag_unclosed": "D102",
    "file_cut": "D102",
    "file_empty": "D101",
    "link_name_missing": "D121",
    "joint_name_missing": "D121",
    "link_name_twice": "D122",
    "joint_name_twice": "D122",
    "parent_unknown": "T202",
    "child_unknown": "T202",
    "parent_missing": "T203",
    "child_missing": "T203",
    "joint_type_missing": "D119",
    "joint_type_misspelt": "J301",
    "link_orphaned": "T204",
    "tree_cut_in_two": "T204",
    "cycle_made": "T205 T207",
    "joint_to_itself": "T205",
    "two_parents": "T206",
    "collision_misspelt": "D105",
    "shape_misspelt": "D105",
    "rpy_misspelt": "D106",
    "xyz_misspelt": "D106",
    "limit_misspelt": "D105",
    "upper_misspelt": "D106",
    "xacro_expression_left": "D109",
    "xacro_tag_left": "D109",
    "prefix_undeclared": "D107",
    "xml_version_zero": "D108",
    "number_is_nan": "D116",
    "number_is_word": "D114",
    "number_has_comma": "D120",
    "number_has_unit": "D120",
    "number_too_few": "D115",
    "number_too_many": "D115",
    "origin_twice": "D117",
    "shape_twice": "D117",
    "geometry_missing": "D118",
    "geometry_empty": "D118",
    "name_has_space": "D123",
    "name_differs_by_case": "D124",
    "material_undefined": "D128",
    "colour_as_bytes": "D130",
    "text_left_over": "D127",
    "entity_bomb": "D101",
    "axis_zero": "J302",
    "axis_long": "J303",
    "axis_long_prismatic": "J303",
    "axis_missing": "J304",
    "axis_flipped": "K602",
    "limit_missing": "J305",
    "limit_reversed": "J306",
    "limit_equal": "J307",
    "limit_lower_upper_omitted": "J308",
    "limit_in_degrees": "J309",
    "limit_excludes_zero": "J310",
    "stroke_in_millimetres": "J335",
    "effort_missing": "J311",
    "velocity_missing": "J311",
    "effort_negative": "J312",
    "velocity_negative": "J312",
    "velocity_zero": "J313",
    "origin_in_millimetres": "J314",
    "rpy_in_degrees": "J315",
    "mimic_unknown": "J316",
    "mimic_self": "J317",
    "mimic_circle": "J317",
    "mimic_chain": "J318",
    "mimic_of_fixed": "J319",
    "mimic_beyond_limits": "J321",
    "mimic_factor_zero": "J323",
    "joint_floating_inside": "J325",
    "joint_planar_inside": "J325",
    "damping_negative": "J329",
    "soft_limit_outside": "J330",
    "transmission_unknown_joint": "J327",
    "gazebo_unknown_reference": "J328",
    "mass_zero": "I402",
    "mass_negative": "I401",
    "mass_missing": "D118",
    "mass_in_grams": "I406 I410",
    "inertial_missing": "I403",
    "inertia_negative": "I404",
    "inertia_products_too_large": "I404",
    "inertia_triangle_broken": "I405",
    "inertia_zero": "I409",
    "inertia_placeholder": "I408",
    "inertia_in_square_millimetres": "I410",
    "inertia_nan": "D116",
    "inertia_entry_missing": "D119",
    "centre_of_mass_in_millimetres": "I407 J314",
    "mesh_missing": "G501",
    "mesh_other_case": "G502",
    "mesh_backslash": "G502",
    "mesh_absolute": "G503",
    "mesh_package_unknown": "G501",
    "mesh_path_escapes": "G504",
    "mesh_filename_missing": "D119",
    "mesh_is_folder": "G501",
    "mesh_empty": "G505",
    "mesh_lfs_pointer": "G505",
    "mesh_html_page": "G505",
    "mesh_stl_cut": "G505",
    "mesh_nan_vertex": "G507",
    "mesh_index_out_of_range": "G508",
    "mesh_no_faces": "G505",
    "mesh_in_millimetres": "G512 G513 G538",
    "mesh_scaled_down_twice": "G512 G513 G538",
    "mesh_in_inches": "G512 G513 G524 G538",
    "mesh_scale_zero": "G509",
    "mesh_mirrored": "G510",
    "mesh_degenerate_faces": "G515",
    "mesh_faces_twice": "G516",
    "mesh_winding_mixed": "G518",
    "mesh_inside_out": "G519",
    "mesh_open": "G517",
    "mesh_crosses_itself": "G521",
    "collision_missing": "G522",
    "collision_elsewhere": "G524 G523",
    "collision_much_too_small": "G523 G524",
    "shape_size_negative": "G525",
    "shape_size_zero": "G525",
    "shape_size_missing": "D119",
    "shape_size_two_numbers": "D115",
}
# A broken tree may be told at any of the links and joints that take part.
ANYWHERE = {
    "joint_name_twice",
    "tree_cut_in_two",
    "cycle_made",
    "mimic_circle",
    "text_left_over",
}


def element_of(path, where):
    """The element path of the fault, or None if the file is no XML."""
    from borecheck.errors import UrdfError
    from borecheck.robots.urdf.source import read

    try:
        source = read(path.read_bytes(), str(path))
    except UrdfError:
        return None
    spaces = {"xacro": "http://www.ros.org/wiki/xacro"}
    found = source.root.getroottree().xpath(where, namespaces=spaces)
    return source.path(found[0]) if found else None


def is_seen(kind, new, element):
    """Whether a new finding has a right code at the right element."""
    codes = tuple(EXPECTED[kind].split())
    for code, at in new:
        if not code.startswith(codes):
            continue
        if kind in ANYWHERE or element is None or at in ("", "robot"):
            return True
        if body(at) == body(element) or element == "robot":
            return True
    return False


def body(path):
    """The link or joint that an element belongs to."""
    match = re.match(r"robot/[^/\[]*(\[@name=(?:'[^']*'|\"[^\"]*\")\]|\[\d+\])?", path)
    return match.group() if match else path
