"""A map of directions as JSON."""

from typing import Any

import numpy as np

from borecheck.directions.blockers import Blocker, blockers
from borecheck.directions.direction_map import DirectionMap
from borecheck.directions.leaves import STATES
from borecheck.directions.witnesses import points_of


def map_block(found: DirectionMap) -> dict[str, Any]:
    """Target, chart, requirements, shares and cells."""
    setup = found.setup
    asked, chart = setup.asked, setup.chart
    return {
        "target": chart.target.tolist(),
        "chart": {
            "joints": list(chart.about.axes),
            "lower_deg": np.degrees(chart.limits[0]).tolist(),
            "upper_deg": np.degrees(chart.limits[1]).tolist(),
            "direction_at_zero": chart.directions(np.zeros((1, 2)))[0].tolist(),
        },
        "resolution_deg": float(np.degrees(asked.resolution)),
        "standoff_m": asked.standoff,
        "margin_m": asked.margin,
        "target_error_m": asked.target_error,
        "max_depth_m": _finite(asked.max_depth),
        "max_obliquity_deg": _finite(float(np.degrees(asked.max_obliquity))),
        "shares": found.shares,
        "reasons": [
            {"state": state, "reason": text, "share": share}
            for (state, text), share in found.reasons.items()
        ],
        "blockers": [_blocker(blocker) for blocker in blockers(found)],
        "cells": [_cell(found, k) for k in range(len(found.leaves))],
    }


def _blocker(blocker: Blocker) -> dict[str, Any]:
    return {
        "part": blocker.part,
        "obstacle": blocker.obstacle,
        "share": blocker.share,
        "deepest_m": blocker.deepest,
        "needle_short_m": blocker.needle_short,
    }


def _cell(found: DirectionMap, k: int) -> dict[str, Any]:
    leaves = found.leaves
    cause = int(leaves.cause[k])
    known = bool(np.isfinite(leaves.depth[k]).all())
    return {
        "low_deg": np.degrees(leaves.low[k]).tolist(),
        "high_deg": np.degrees(leaves.high[k]).tolist(),
        "state": STATES[leaves.state[k]],
        "reason": found.causes[cause].text if cause >= 0 else None,
        "names": list(found.causes[cause].names) if cause >= 0 else [],
        "depth_m": leaves.depth[k].tolist() if known else None,
        "obliquity_deg": np.degrees(leaves.obliquity[k]).tolist() if known else None,
        "witness": _witness(found, k),
    }


def _witness(found: DirectionMap, k: int) -> dict[str, Any] | None:
    """The point that proves contact."""
    part, obstacle, number = (int(x) for x in found.leaves.witness[k])
    if number < 0 or STATES[found.leaves.state[k]] != "contact":
        return None
    mesh = found.setup.robot.parts[part].mesh
    return {
        "part": mesh.name,
        "obstacle": found.setup.scene.obstacles[obstacle].name,
        "point_m": points_of(mesh)[number].tolist(),
        "station_m": float(found.leaves.station[k]),
    }


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
