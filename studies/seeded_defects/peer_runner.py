"""Gives URDF files to one other tool and writes what it says, one JSON line each.

    PYTHON studies/seeded_defects/peer_runner.py TOOL OUT.jsonl < files

Run with the interpreter of the environment that holds the tool. Each file goes through
a process of its own, so that a crash counts as a rejection and ends nothing.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PATIENCE_S = 20  # a tool that is silent so long counts as one that refuses
QUIET = {"capture_output": True, "text": True}


def check_urdf(file):
    done = subprocess.run(["check_urdf", file], timeout=PATIENCE_S - 1, **QUIET)
    lines = done.stderr.splitlines()
    if done.returncode != 0:
        raise RuntimeError(" | ".join(lines) or f"exit {done.returncode}")
    return lines


def urdf_parser_py(file):
    from urdf_parser_py.urdf import URDF

    URDF.from_xml_string(Path(file).read_bytes())
    return []


def pinocchio(file):
    import pinocchio as pin

    model = pin.buildModelFromUrdf(file)
    folder = [str(Path(file).parent)]
    for kind in (pin.GeometryType.COLLISION, pin.GeometryType.VISUAL):
        pin.buildGeomFromUrdf(model, file, kind, package_dirs=folder)
    return []


def yourdfpy(file):
    import logging

    from yourdfpy import URDF

    logging.basicConfig(level=logging.WARNING)
    robot = URDF.load(
        file, load_collision_meshes=True, build_collision_scene_graph=True
    )
    robot.validate()
    return [f"WARNING {error}" for error in robot.errors]


def mujoco(file):
    import mujoco

    folder = Path(file).parent / "meshes"
    assets = {p.name: p.read_bytes() for p in folder.glob("*") if p.is_file()}
    model = mujoco.MjModel.from_xml_path(file, assets)
    mujoco.mj_forward(model, mujoco.MjData(model))
    return []


def drake(file):
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
    from pydrake.systems.framework import DiagramBuilder

    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 0.001)
    Parser(plant).AddModels(file)
    plant.Finalize()
    builder.Build()
    return []


def urdf_validator(file):
    with tempfile.TemporaryDirectory() as out:
        command = Path(sys.executable).with_name("urdf_validate")
        words = [str(command), file, "--output-dir", out]
        done = subprocess.run(words, timeout=PATIENCE_S - 1, **QUIET)
    lines = [re.sub(r"\x1b\[\d*m", "", line) for line in done.stdout.splitlines()]
    if done.returncode > 1 or "Traceback" in done.stderr:
        loud = [line for line in lines if "FAIL" in line] or done.stderr.splitlines()
        raise RuntimeError(" | ".join(loud[-3:]))
    return [line for line in lines if "WARN" in line or "FAIL" in line]


TOOLS = {
    "check_urdf": check_urdf,
    "urdf_parser_py": urdf_parser_py,
    "pinocchio": pinocchio,
    "yourdfpy": yourdfpy,
    "mujoco": mujoco,
    "drake": drake,
    "urdf-validator": urdf_validator,
}
WARM = {
    "pinocchio": "pinocchio",
    "yourdfpy": "yourdfpy",
    "mujoco": "mujoco",
    "drake": "pydrake.all",
    "urdf_parser_py": "urdf_parser_py.urdf",
}


def run_one(tool, file):
    """Status and lines of one file, in a forked process."""
    with tempfile.TemporaryFile("w+") as said:
        return _forked(tool, file, said)


def _forked(tool, file, said):
    child = os.fork()
    if child == 0:
        signal.alarm(PATIENCE_S)
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        code = 0
        try:
            for line in TOOLS[tool](file):
                os.write(2, (line + "\n").encode())
        except BaseException as error:  # noqa: BLE001  whatever a tool raises
            text = " ".join(str(error).split())
            os.write(2, f"REJECTED {type(error).__name__}: {text}\n".encode())
            code = 1
        os._exit(code)
    _, status = os.waitpid(child, 0)
    said.seek(0)
    lines = said.read().splitlines()
    if os.WIFSIGNALED(status):
        return f"killed by signal {os.WTERMSIG(status)}", lines
    return ("ok" if os.WEXITSTATUS(status) == 0 else "rejected"), lines


def main():
    tool, out = sys.argv[1], Path(sys.argv[2])
    if tool in WARM:
        __import__(WARM[tool])
    done = set()
    if out.exists():
        done = {json.loads(line)["file"] for line in out.read_text().splitlines()}
    with out.open("a") as stream:
        for file in sys.stdin.read().splitlines():
            if file in done:
                continue
            start = time.perf_counter()
            status, lines = run_one(tool, file)
            seconds = time.perf_counter() - start
            record = {"file": file, "status": status, "lines": lines}
            stream.write(json.dumps({**record, "seconds": seconds}) + "\n")
            stream.flush()


if __name__ == "__main__":
    main()
