"""Replays the disputed triangle pairs of a comparison, alone, from its result file."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.contact.comparison import judged
from borecheck.core.result_file import read_result
from borecheck.errors import InputError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import CHECKERS, Surface, contacts

WORLD = np.eye(4)


def replay(path: Path) -> dict[str, Any]:
    """All checkers asked again about each dumped pair of triangles.

    Args:
        path: A result of `borecheck compare --out`, or a page made of one.

    Returns:
        The parts of a `compare` document; each pair counts as a pose of its own.
        `agreed` holds the pairs about which all checkers say the same now, `changed`
        what the file says otherwise: pair, checker, stored and present verdict.

    Raises:
        InputError: The file cannot be read or holds no comparison.
    """
    source = read_result(path)
    disputed = source.get("disagreements")
    if not isinstance(disputed, list):
        raise InputError(path, "holds no comparison (no `disagreements`)")
    summaries: dict[str, dict[str, Any]] = {
        name: {
            "contact_poses": [],
            "triangle_pairs": 0,
            "pairs_examined": 0,
            "pairs_pruned": 0,
            "seconds": 0.0,
        }
        for name in CHECKERS
    }
    again, changed = [], []
    for number, entry in enumerate(disputed):
        found = _one(path, number, entry, summaries)
        again.append(found)
        changed += _changed(path, number, entry, found)
    return {
        "robot": _with_warnings(path, source, "robot"),
        "scene": _with_warnings(path, source, "scene"),
        "not_modelled": _texts(path, source, "not_modelled"),
        "poses": [{"q": {}, "verdicts": d["verdicts"], "contained": []} for d in again],
        "pruning": "none",
        "checkers": summaries,
        "disagreements": [d for d in again if not _agree(d)],
        "agreed": [d for d in again if _agree(d)],
        "changed": changed,
    }


def _agree(pair: Mapping[str, Any]) -> bool:
    return len(set(pair["verdicts"].values())) == 1


def _changed(
    path: Path, number: int, entry: Mapping[str, Any], found: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Every checker of a pair whose verdict is not the one that the file holds."""
    stored = entry.get("verdicts", {})
    if not isinstance(stored, dict):
        raise InputError(path, "verdicts is no object", f"disagreement {number}")
    names = ("pose", "link", "obstacle", "link_triangle", "obstacle_triangle")
    pair = {name: found[name] for name in names}
    return [
        {**pair, "checker": name, "stored": said, "now": found["verdicts"][name]}
        for name, said in stored.items()
        if name in found["verdicts"] and said is not found["verdicts"][name]
    ]


def _with_warnings(path: Path, source: Mapping[str, Any], key: str) -> dict[str, Any]:
    block = source.get(key, {})
    if not isinstance(block, dict):
        raise InputError(path, f"{key} is no object", key)
    return {**block, "warnings": _texts(path, block, "warnings")}


def _texts(path: Path, source: Mapping[str, Any], key: str) -> list[str]:
    texts = source.get(key, [])
    if not isinstance(texts, list) or not all(isinstance(t, str) for t in texts):
        raise InputError(path, "is no list of texts", key)
    return texts


def _whole(path: Path, number: int, entry: Mapping[str, Any], key: str) -> int:
    value = entry.get(key, 0)
    if not isinstance(value, int):
        raise InputError(path, f"{key} is no number", f"disagreement {number}")
    return value


def _one(
    path: Path,
    number: int,
    entry: Mapping[str, Any],
    summaries: dict[str, dict[str, Any]],
) -> dict[str, Any]:
    first, second = _triangles(path, number, entry)
    a, b = (Surface(_mesh(t)) for t in (first, second))
    verdicts = {}
    for name in CHECKERS:
        start = time.perf_counter()
        found = contacts(a, WORLD, b, WORLD, name, "none", same_vertices=True)
        summary = summaries[name]
        summary["seconds"] += time.perf_counter() - start
        summary["pairs_examined"] += 1
        summary["triangle_pairs"] += len(found.pairs)
        verdicts[name] = len(found.pairs) > 0
        if verdicts[name]:
            summary["contact_poses"].append(number)
    where = (
        str(entry.get("link", "a")),
        str(entry.get("obstacle", "b")),
        _whole(path, number, entry, "link_triangle"),
        _whole(path, number, entry, "obstacle_triangle"),
    )
    result = judged(number, where, verdicts, first, second)
    return {
        "pose": number,
        "link": result.link,
        "obstacle": result.obstacle,
        "link_triangle": result.link_triangle,
        "obstacle_triangle": result.obstacle_triangle,
        "verdicts": result.verdicts,
        "exact": result.exact,
        "cause": result.cause,
        "corners": result.corners,
    }


def _triangles(
    path: Path, number: int, entry: Mapping[str, Any]
) -> tuple[np.ndarray[Any, np.dtype[np.float64]], ...]:
    try:
        corners = np.array(entry["corners"], dtype=np.float64)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(path, "has no corners", f"disagreement {number}") from error
    if corners.shape != (2, 3, 3) or not np.isfinite(corners).all():
        raise InputError(path, "is not two triangles", f"disagreement {number}")
    return corners[0], corners[1]


def _mesh(triangle: np.ndarray[Any, np.dtype[np.float64]]) -> TriangleMesh:
    return TriangleMesh("triangle", triangle, np.array([[0, 1, 2]]))
