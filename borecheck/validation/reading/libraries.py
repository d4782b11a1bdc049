"""Pinocchio and yourdfpy place a robot's links: run in a process of its own.

`python -m borecheck.validation.reading.libraries` reads a request from standard input
and answers on standard output, both JSON. A process of its own, because a strange file
can make a C++ library die or hang, and because it runs beside the other checks.
"""

import io
import json
import re
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

MOST_MOVING = 200  # of them Pinocchio's data take 0.6 GB, of twice as many 4 GB
MOST_MEMORY = 8_000_000_000  # bytes of address space, of which less is used

Frames = dict[str, list[list[float]]]


def pinocchio_frames(
    text: str, configurations: list[dict[str, float]]
) -> dict[str, Any]:
    """All links' placements by Pinocchio with every joint, followers too, set by us."""
    import pinocchio as pin

    model = pin.buildModelFromXML(text)
    if model.nv > MOST_MOVING:
        raise MemoryError(f"not asked: its memory grows with {model.nv} joints cubed")
    data = model.createData()
    frames: Frames = {}
    for positions in configurations:
        q = pin.neutral(model)
        for name, value in positions.items():
            if model.existJointName(name):
                _set_joint(q, model.joints[model.getJointId(name)], value)
        pin.framesForwardKinematics(model, data, q)
        for index, frame in enumerate(model.frames):
            if frame.type == pin.FrameType.BODY:
                placed = np.array(data.oMf[index].homogeneous).reshape(-1)
                frames.setdefault(str(frame.name), []).append(placed.tolist())
    return {"frames": frames, "mimic": _mimic_refusal(text)}


def _set_joint(q: Any, joint: Any, value: float) -> None:
    at = joint.idx_q
    if joint.nq == 1:
        q[at] = value
    elif joint.nq == 2:  # a continuous joint: cosine and sine
        q[at], q[at + 1] = np.cos(value), np.sin(value)


def _mimic_refusal(text: str) -> str | None:
    """Why Pinocchio refuses the file when it is asked to respect mimic joints."""
    import pinocchio as pin

    if "<mimic" not in text:
        return None
    try:
        pin.buildModelFromXML(text, mimic=True)
    except Exception as error:  # noqa: BLE001  C++ exceptions of any kind
        return _line(error)
    return None


def yourdfpy_frames(
    text: str, configurations: list[dict[str, float]]
) -> dict[str, Any]:
    """All links' placements by yourdfpy, which follows mimic joints by itself."""
    import yourdfpy

    stream = io.BytesIO(text.encode())
    robot = yourdfpy.URDF.load(stream, load_meshes=False, build_scene_graph=True)
    edges = [(joint.parent, joint.child) for joint in robot.joint_map.values()]
    steps = _outward(robot.base_link, edges)
    frames: Frames = {}
    for positions in configurations:
        known = robot.actuated_joint_names
        robot.update_cfg({n: positions[n] for n in known if n in positions})
        # Link by link: asked from the base, every answer would walk the whole chain.
        placed = {robot.base_link: np.eye(4)}
        for parent, link in steps:
            placed[link] = placed[parent] @ robot.get_transform(link, parent)
        for link, T in placed.items():
            frames.setdefault(link, []).append(T.reshape(-1).tolist())
    return {"frames": frames}


def _outward(base: str, edges: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """(parent, child) from the base outward; what is not reached is left out."""
    below: dict[str, list[str]] = {}
    for parent, child in edges:
        below.setdefault(parent, []).append(child)
    steps, reached = [], [base]
    for parent in reached:
        for child in below.pop(parent, []):
            steps.append((parent, child))
            reached.append(child)
    return steps


def pinocchio_geometry(
    text: str, configurations: list[dict[str, float]]
) -> dict[str, Any]:
    """The collision geometry as Pinocchio loads it, with trees of boxes by Coal."""
    import pinocchio as pin

    model = pin.buildModelFromXML(text)
    kind = pin.GeometryType.COLLISION
    found = pin.buildGeomFromUrdfString(model, text, kind)
    return {"shapes": int(found.ngeoms)}


LIBRARIES: Mapping[str, Callable[[str, list[dict[str, float]]], dict[str, Any]]] = {
    "pinocchio": pinocchio_frames,
    "yourdfpy": yourdfpy_frames,
    "geometry": pinocchio_geometry,
}


def answers(request: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """What each library says to a text and its configurations, one after the other."""
    for name in request["libraries"]:
        start = time.perf_counter()
        try:
            found = LIBRARIES[name](request["text"], request["configurations"])
        except Exception as error:  # noqa: BLE001  the point is to see what they do
            found = {"error": _line(error)}
        spent = {"seconds": time.perf_counter() - start, "bytes": _peak_bytes()}
        yield {name: {**found, **spent}}


def _peak_bytes() -> int:
    """The largest memory of this process so far."""
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _line(error: BaseException) -> str:
    text = " ".join(str(error).split())
    text = re.sub(r"^From file: .*? message: ", "", text)  # where in Coal's source
    return f"{type(error).__name__}: {text}"[:300]


def _bound_memory() -> None:
    """Pinocchio's memory grows with the cube of the joints: bounded, it refuses."""
    import resource

    _, most = resource.getrlimit(resource.RLIMIT_AS)
    if most == resource.RLIM_INFINITY or most > MOST_MEMORY:
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, most))


def _import_early() -> None:
    """Imports the libraries while the request is still being put together."""
    import pinocchio  # noqa: F401
    import yourdfpy  # noqa: F401


if __name__ == "__main__":
    _bound_memory()
    _import_early()
    # One line a library: what was said before one dies is heard.
    for said in answers(json.load(sys.stdin)):
        sys.stdout.write(json.dumps(said) + "\n")
        sys.stdout.flush()
