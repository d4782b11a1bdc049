"""How many single faults does `borecheck validate` see, and how many do others see?

    scripts/study_seeded_defects.py make FOLDER [--robots DIR]   sound and spoilt files
    scripts/study_seeded_defects.py judge FOLDER                 borecheck over all
    scripts/study_seeded_defects.py peers FOLDER NAME=PYTHON ...   other tools over all
    scripts/study_seeded_defects.py table FOLDER                 the table in the docs

The robots are public ones (example-robot-data) whose meshes are replaced by their
convex hulls, so that every tool can read them and single faults stay single; what a
tool says about the sound robot does not count. Faults come from `urdf_mutators`, which
imports nothing of borecheck.
"""

import argparse
import json
import re
import subprocess
import sys
import time
from collections import Counter, defaultdict
from importlib.metadata import files
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parent))
import urdf_mutators as mutators
from lxml import etree

PEERS = (
    "check_urdf",
    "urdf_parser_py",
    "pinocchio",
    "yourdfpy",
    "drake",
    "mujoco",
    "urdf-validator",
    "simcheck",
)
# One robot of each family; the largest ones would only take longer.
ROBOTS = (
    "a1_description/urdf/a1.urdf",
    "allegro_hand_description/urdf/allegro_right_hand.urdf",
    "anymal_c_simple_description/urdf/anymal.urdf",
    "b1_description/urdf/b1-z1.urdf",
    "baxter_description/urdf/baxter.urdf",
    "bolt_description/robots/bolt.urdf",
    "borinot_description/urdf/borinot_flying_arm_2.urdf",
    "centauro_description/urdf/centauro.urdf",
    "double_pendulum_description/urdf/double_pendulum.urdf",
    "finger_edu_description/robots/finger_edu.urdf",
    "g1_description/urdf/g1_29dof_rev_1_0.urdf",
    "go1_description/urdf/go1.urdf",
    "go2_description/urdf/go2.urdf",
    "hextilt_description/urdf/hextilt_flying_arm_5.urdf",
    "hyq_description/robots/hyq_no_sensors.urdf",
    "icub_description/robots/icub_reduced.urdf",
    "kinova_description/robots/kinova.urdf",
    "laikago_description/urdf/laikago.urdf",
    "panda_description/urdf/panda.urdf",
    "romeo_description/urdf/romeo_small.urdf",
    "so_arm_description/urdf/so101.urdf",
    "solo_description/robots/solo12.urdf",
    "talos_data/robots/talos_left_arm.urdf",
    "tiago_description/robots/tiago.urdf",
    "ur_description/urdf/ur5_robot.urdf",
    "ur_description/urdf/ur3_gripper.urdf",
    "xarm_description/urdf/xarm7.urdf",
    "z1_description/urdf/z1.urdf",
)

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
    "mesh_in_millimetres": "G512 G513",
    "mesh_scaled_down_twice": "G512 G513",
    "mesh_in_inches": "G512 G513",
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
OPTIONS = {"profile": "dynamics", "run": False}
# Searched for on request only; the hulls of the sound robots cross nothing.
CROSSING = "mesh_crosses_itself"


def robot_data():
    """The folder of example-robot-data's robots."""
    for entry in files("example-robot-data") or []:
        if entry.parts[-2:] == ("urdf", "ur5_robot.urdf"):
            return Path(entry.locate()).resolve().parents[2]
    raise SystemExit("example-robot-data is not installed; give --robots")


def make(folder, robots):
    """Sound robots with hulls for meshes, and a spoilt copy for each kind and robot."""
    made = []
    for name in ROBOTS:
        base = prepare(robots / name, folder)
        if base is not None:
            made.append(base)
    rows = []
    for base in made:
        for kind in mutators.KINDS:
            spoilt = mutators.spoil(base, kind, 0)
            if spoilt is None:
                continue
            path = base.with_name(f"{kind}.urdf")
            path.write_bytes(spoilt[0])
            rows.append({"file": str(path), "kind": kind, "where": spoilt[1]})
    sound = [{"file": str(base), "kind": None, "where": None} for base in made]
    lines = [json.dumps(row) for row in [*sound, *rows]]
    (folder / "files.jsonl").write_text("\n".join(lines) + "\n")
    kinds = Counter(row["kind"] for row in rows)
    print(f"{len(made)} robots, {len(kinds)} kinds, {len(rows)} spoilt files")


def prepare(source, folder):
    """A copy of a robot whose meshes are closed convex hulls in OBJ files."""
    home = folder / f"{source.stem}_{source.parent.parent.name.split('_')[0]}"
    (home / "meshes").mkdir(parents=True, exist_ok=True)
    tree = etree.parse(str(source))
    names = {}
    for mesh in tree.getroot().iter("mesh"):
        reference = mesh.get("filename")
        if reference not in names:
            names[reference] = hull(reference, source, home, len(names))
        if names[reference] is None:
            print(f"{source.name}: no hull for {reference}; left out")
            return None
        mesh.set("filename", names[reference])
    base = home / "sound.urdf"
    tree.write(str(base), xml_declaration=True, encoding="UTF-8")
    return base if loads(base) else None


def hull(reference, source, home, number):
    """Writes the convex hull of a mesh; its new name."""
    import trimesh

    from borecheck.errors import MeshError
    from borecheck.mesh_file import read_mesh
    from borecheck.package_paths import resolve

    found = resolve(reference, source.parent).path
    if found is None:
        return None
    try:
        mesh = read_mesh(found)
    except MeshError:
        return None
    rounded = mesh.vertices.round(6)
    convex = trimesh.convex.convex_hull(rounded)
    lines = ["v " + " ".join(f"{x:.9g}" for x in v) for v in convex.vertices]
    lines += ["f " + " ".join(str(i + 1) for i in f) for f in convex.faces]
    name = f"meshes/m{number}_{found.stem}.obj"
    (home / name).write_text("\n".join(lines) + "\n")
    return name


def loads(base):
    """Whether other libraries load it: what sound means is not for borecheck to say."""
    import pinocchio
    import yourdfpy

    try:
        pinocchio.buildModelFromUrdf(str(base))
        yourdfpy.URDF.load(str(base), load_meshes=False)
    except Exception as error:  # noqa: BLE001  any refusal is a refusal
        print(f"{base}: not loaded by a peer ({type(error).__name__}); left out")
        return False
    return True


def rows_of(folder, per_kind=None):
    """The sound robots and the spoilt files; of each kind all, or so many at random."""
    lines = (folder / "files.jsonl").read_text().splitlines()
    rows = [json.loads(line) for line in lines]
    by_kind = defaultdict(list)
    for row in rows:
        by_kind[row["kind"]].append(row)
    chosen = by_kind.pop(None)
    for kind, found in by_kind.items():
        count = len(found) if per_kind is None else min(per_kind, len(found))
        chosen += Random(kind).sample(found, count)
    return chosen


def judge(folder, per_kind):
    """Runs borecheck over all files; finished ones are kept and not done again."""
    out = folder / "borecheck.jsonl"
    done = {row["file"]: row for row in read_lines(out)}
    rows = rows_of(folder, per_kind)
    sound = {str(Path(row["file"]).with_name("sound.urdf")) for row in rows}
    start = time.perf_counter()
    with out.open("a") as stream:
        for row in rows:
            if row["file"] in done or (not row["kind"] and row["file"] not in sound):
                continue
            record = {**row, **marks_of(Path(row["file"]), row["kind"] == CROSSING)}
            stream.write(json.dumps(record) + "\n")
            stream.flush()
    print(f"{len(rows)} files, {time.perf_counter() - start:.0f} s")


def marks_of(path, asked):
    """Codes and elements of what is found, and the codes of errors."""
    from borecheck.validation import validate_file

    found = validate_file(path, configured=False, self_intersection=asked, **OPTIONS)
    marks = [[f.code, f.element] for f in found if f.severity != "info"]
    return {"marks": marks, "errors": [f.code for f in found if f.severity == "error"]}


def read_lines(path):
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines()]


def judged(folder, rows):
    """{file: whether the fault was seen with a right code at the right element}."""
    done = {row["file"]: row for row in read_lines(folder / "borecheck.jsonl")}
    seen = {}
    for row in rows:
        if not row["kind"] or row["file"] not in done:
            continue
        path = Path(row["file"])
        base = done[str(path.with_name("sound.urdf"))]["marks"]
        new = Counter(map(tuple, done[row["file"]]["marks"]))
        new -= Counter(map(tuple, base))
        element = element_of(path, row["where"])
        seen[row["file"]] = is_seen(row["kind"], sorted(new), element)
    return seen


def element_of(path, where):
    """The element path of the fault, or None if the file is no XML."""
    from borecheck.errors import UrdfError
    from borecheck.urdf_source import read

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


def peers(folder, tools, per_kind):
    """Other tools over all files, each with its own interpreter."""
    listed = "\n".join(row["file"] for row in rows_of(folder, per_kind)) + "\n"
    for word in tools:
        name, _, python = word.partition("=")
        out = folder / f"{name}.jsonl"
        if name == "simcheck":
            run_simcheck(folder, python, out, listed)
            continue
        runner = Path(__file__).with_name("peer_runner.py")
        words = ["nice", "-n", "10", python, str(runner), name, str(out)]
        subprocess.run(words, input=listed, text=True, check=True)
        print(name, "done")


def run_simcheck(folder, python, out, listed):
    """Simcheck reads a list of files and writes its own lines."""
    names = folder / "files.txt"
    names.write_text(listed)
    command = str(Path(python).with_name("simcheck"))
    words = [command, "scan", "--files-from", str(names), "-o", str(out)]
    words += ["--static-only", "--no-config", "-q", "-j", "1"]
    subprocess.run(["nice", "-n", "10", *words], check=False)


def said_by(folder, name):
    """{file: (rejected, set of complaints)} of one tool."""
    said = {}
    for line in (folder / f"{name}.jsonl").read_text().splitlines():
        record = json.loads(line)
        if name == "simcheck":
            said[simcheck_file(record)] = simcheck_said(record)
        else:
            plain = {normal(text) for text in record["lines"] if is_loud(text)}
            said[record["file"]] = (record["status"] != "ok", plain)
    return said


def simcheck_file(record):
    return str(record.get("path") or record.get("file") or record.get("asset"))


def simcheck_said(record):
    results = record.get("results") or record.get("findings") or record.get("issues")
    loud, errors = set(), False
    for entry in results or []:
        level = str(entry.get("severity") or entry.get("level") or "").lower()
        if level in ("error", "warning", "warn"):
            loud.add(normal(f"{entry.get('check') or entry.get('id')} {entry}"))
            errors = errors or level == "error"
    return errors, loud


def is_loud(line):
    """Whether a line of output is a complaint."""
    return bool(
        re.search(r"warn|error|fail|reject|invalid|unknown|missing", line, re.I)
    )


def normal(line):
    """A complaint without paths and numbers."""
    line = re.sub(r"(/[^\s:'\"]*)+", "PATH", line)
    return re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "#", line)


def noticed(folder, name, rows):
    """{file: whether a tool said something new about it}."""
    said = said_by(folder, name)
    found = {}
    for row in rows:
        if row["kind"] is None:
            continue
        base = said.get(str(Path(row["file"]).parent / "sound.urdf"), (False, set()))
        rejected, loud = said.get(row["file"], (False, set()))
        found[row["file"]] = (rejected and not base[0]) or bool(loud - base[1])
    return found


def table(folder, per_kind):
    """The study's table and what stays undetected, as Markdown."""
    rows = rows_of(folder, per_kind)
    seen = judged(folder, rows)
    rows = [row for row in rows if not row["kind"] or row["file"] in seen]
    columns = {"borecheck": seen}
    for name in PEERS:
        if (folder / f"{name}.jsonl").exists():
            columns[name] = noticed(folder, name, rows)
    groups = {kind: group for kind, (group, _) in mutators.KINDS.items()}
    print(summary(rows, columns, groups))
    print()
    print(by_kind(rows, columns))
    missed = [row for row in rows if row["kind"] and not seen[row["file"]]]
    for row in missed:
        print(f"not seen: {row['kind']} in {Path(row['file']).parent.name}")


def rates(rows, column):
    """{kind: share of its files that were noticed}."""
    counts = defaultdict(list)
    for row in rows:
        if row["kind"]:
            counts[row["kind"]].append(bool(column.get(row["file"])))
    return {kind: sum(found) / len(found) for kind, found in counts.items()}


def summary(rows, columns, groups):
    names = ["structure", "joints", "inertia", "geometry"]
    lines = ["| tool | " + " | ".join(names) + " | kinds | files |"]
    lines.append("|---|" + "---:|" * (len(names) + 2))
    files_of = Counter(groups[row["kind"]] for row in rows if row["kind"])
    for name, column in columns.items():
        share = rates(rows, column)
        cells = []
        for group in names:
            hits = sum(
                bool(column.get(row["file"]))
                for row in rows
                if row["kind"] and groups[row["kind"]] == group
            )
            cells.append(f"{100 * hits / files_of[group]:.0f} %")
        kinds = sum(rate >= 0.5 for rate in share.values())
        total = sum(bool(v) for v in column.values())
        everything = sum(files_of.values())
        tail = f"{kinds} of {len(share)} | {100 * total / everything:.1f} % |"
        lines.append(f"| {name} | " + " | ".join(cells) + f" | {tail}")
    return "\n".join(lines)


def by_kind(rows, columns):
    shares = {name: rates(rows, column) for name, column in columns.items()}
    count = Counter(row["kind"] for row in rows if row["kind"])
    lines = ["| kind | files | " + " | ".join(columns) + " |"]
    lines.append("|---|---:|" + "---:|" * len(columns))
    for kind in mutators.KINDS:
        if kind in count:
            cells = [f"{100 * shares[name][kind]:.0f}" for name in columns]
            lines.append(f"| {kind} | {count[kind]} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("step", choices=("make", "judge", "peers", "table"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("tools", nargs="*", metavar="NAME=PYTHON")
    parser.add_argument("--robots", type=Path)
    parser.add_argument("--per-kind", type=int, help="so many files of each kind")
    args = parser.parse_intermixed_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.step == "make":
        make(args.folder.resolve(), args.robots or robot_data())
    elif args.step == "judge":
        judge(args.folder.resolve(), args.per_kind)
    elif args.step == "peers":
        peers(args.folder.resolve(), args.tools, args.per_kind)
    else:
        table(args.folder.resolve(), args.per_kind)


if __name__ == "__main__":
    main()
