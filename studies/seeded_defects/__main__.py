"""How many single faults does `borecheck validate` see, and how many do others see?

    python -m studies.seeded_defects STEP FOLDER [NAME=PYTHON ...] [--per-kind N]

    make    sound and spoilt files (--robots DIR: other than example-robot-data)
    judge   borecheck over all
    peers   other tools over all, each with the interpreter that holds it
    table   the page in the docs

The robots are public ones (example-robot-data) whose meshes are replaced by their
convex hulls, so that every tool can read them and single faults stay single; what a
tool says about the sound robot does not count. Faults come from the modules in
`seeded_defects`, which import nothing of borecheck.
"""

import argparse
import json
import subprocess
import time
from collections import Counter
from importlib.metadata import files
from pathlib import Path

from lxml import etree

from studies.seeded_defects import KINDS, spoil
from studies.seeded_defects.files import read_lines, rows_of
from studies.seeded_defects.table import table

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
        for kind in KINDS:
            spoilt = spoil(base, kind, 0)
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
    from borecheck.geometry.mesh_files.reading import read_mesh
    from borecheck.robots.urdf.package_paths import resolve

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
            if not row["kind"]:
                record["collision"] = levels_of(Path(row["file"]))
            stream.write(json.dumps(record) + "\n")
            stream.flush()
    print(f"{len(rows)} files, {time.perf_counter() - start:.0f} s")


def marks_of(path, asked):
    """Codes and elements of what is found, and the codes of errors."""
    from borecheck.validation import validate_file

    found = validate_file(path, configured=False, self_intersection=asked, **OPTIONS)
    marks = [[f.code, f.element] for f in found if f.severity != "info"]
    return {"marks": marks, "errors": [f.code for f in found if f.severity == "error"]}


def levels_of(path):
    """The severities that a sound robot gets in the default profile."""
    from borecheck.validation import validate_file

    return sorted({str(f.severity) for f in validate_file(path, configured=False)})


def peers(folder, tools, per_kind):
    """Other tools over all files, each with its own interpreter."""
    listed = "\n".join(row["file"] for row in rows_of(folder, per_kind)) + "\n"
    for word in tools:
        name, _, python = word.partition("=")
        out = folder / f"{name}.jsonl"
        (folder / f"{name}.version").write_text(version_of(name, python))
        if name == "simcheck":
            run_simcheck(folder, python, out, listed)
            continue
        runner = Path(__file__).with_name("peer_runner.py")
        words = ["nice", "-n", "10", python, "-P", str(runner), name, str(out)]
        subprocess.run(words, input=listed, text=True, check=True)
        print(name, "done")


def version_of(name, python):
    """The version of a tool, by the package that holds it."""
    words = ["dpkg-query", "-W", "-f", "${Version}", "liburdfdom-tools"]
    if name != "check_urdf":
        package = {"pinocchio": "pin"}.get(name, name)
        code = f"from importlib.metadata import version as v; print(v({package!r}))"
        words = [python, "-P", "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def run_simcheck(folder, python, out, listed):
    """Simcheck reads a list of files and writes its own lines."""
    names = folder / "files.txt"
    names.write_text(listed)
    command = str(Path(python).with_name("simcheck"))
    words = [command, "scan", "--files-from", str(names), "-o", str(out)]
    words += ["--static-only", "--no-config", "-q", "-j", "1"]
    subprocess.run(["nice", "-n", "10", *words], check=False)


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
