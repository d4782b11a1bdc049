"""The study of the 64 trials as one JSON document."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from zerobot.trials.bench import QUESTIONS
from zerobot.trials.errors import Sources
from zerobot.trials.fit import (
    FAMILIES,
    FLIP_MM,
    Effects,
    first_order,
    maximum_likelihood,
    needed_margin_mm,
    smallest_disturbance,
    spread_mm,
)
from zerobot.trials.monte_carlo import interval
from zerobot.trials.published import DISTANCES_MM, MARGIN_MM, approaches
from zerobot.trials.run import KINDS, ExaminedApproach, Study
from zerobot.trials.sections import sections, summary

Array = NDArray[np.float64]

PUBLISHED_RIGHT = 57  # of 64, abstract and section 5
CHECKERS = ("paper:robot", "paper:scanner", "two-sided", "exact", "coal")
FIRST_ORDER_DRAWS = 200_000

JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")


def document(study: Study) -> dict[str, Any]:
    """Tables, repetitions, fits and margins, ready for `json.dumps` and for a page."""
    found = _numbers(study)
    return {"summary": summary(found), **found, "sections": sections(found)}


def _numbers(study: Study) -> dict[str, Any]:
    reached = [case for case in study.cases if case.effects is not None]
    effects = [case.effects for case in reached if case.effects is not None]
    chance = _miss_chances(study, effects)
    return {
        "seed": study.options.seed,
        "samples": study.options.samples,
        "mount": study.options.mount,
        "level": study.options.level,
        "aim": study.options.aim,
        "trials": [
            _trial(case, d, chance.get(i))
            for i, case in enumerate(study.cases)
            for d in DISTANCES_MM
        ],
        "poses": [
            {"name": _stop_name(case, d), "q": _positions(case, d)}
            for case in reached
            for d in DISTANCES_MM
        ],
        "nominal": _nominal(study.cases),
        "exact_and_two_sided_agree": _agree(study.cases),
        "unreachable": [_name(c) for c in study.cases if c.setup.unreachable],
        "sources": asdict(study.sources),
        "monte_carlo": _monte_carlo(study, effects),
        "ranking": _ranking(study, chance),
        "fitted_to_the_published_table": _fits(effects, study.sources),
        "smallest_disturbances": [
            asdict(smallest_disturbance(family, effects)) for family in FAMILIES
        ],
        "margins": _margins(study, effects, reached),
        "published": {"right": PUBLISHED_RIGHT, "of": 64},
    }


def _trial(
    case: ExaminedApproach, distance_mm: int, chance: float | None
) -> dict[str, Any]:
    found = case.outcomes[distance_mm]
    trial, setup = found.trial, case.setup
    by_kind: dict[str, dict[str, str]] = {kind: {} for _, kind in QUESTIONS}
    for (checker, kind), verdict in found.verdicts.items():
        by_kind[kind][checker] = verdict
    row = {
        "point": trial.point,
        "axis": trial.axis,
        "q4_deg": trial.q4_deg,
        "q5_deg": trial.q5_deg,
        "distance_mm": trial.distance_mm,
        "expected": trial.expected,
        "published_ok": trial.published_ok,
        "verdicts": by_kind["enlarge-axes"],
        "verdicts_by_margin": by_kind,
        "reached": setup.unreachable is None,
        "reason": setup.unreachable or _reason(case, distance_mm),
        "shift_mm": 1e3 * setup.shift,
    }
    if setup.unreachable is not None or case.effects is None:
        return row
    stop = setup.stops[distance_mm]
    normal = case.effects.normal
    return row | {
        "q": _positions(case, distance_mm),
        "true_distance_mm": 1e3 * stop.closest.distance,
        "closest": {
            "link": stop.closest.link,
            "obstacle": stop.closest.obstacle,
            "points": stop.closest.points,
        },
        "off_goal_mm": 1e3 * setup.aim_error,
        "reach_mm": case.reach_mm,
        "flips_after_mm": {
            kind: abs(reach - distance_mm) for kind, reach in case.reach_mm.items()
        },
        "flips_after_mm_along": {
            axis: FLIP_MM / abs(float(n)) if abs(n) > 0.01 else None
            for axis, n in zip("xyz", normal, strict=True)
        },
        "bending_mm": case.effects.bending_mm,
        "rods_mm": case.effects.rods_mm,
        "miss_probability": chance if distance_mm == 15 else None,
    }


def _reason(case: ExaminedApproach, distance_mm: int) -> str | None:
    """Why the enlarged volume's verdict is not as expected, if it is not."""
    found = case.outcomes[distance_mm]
    expected = found.trial.expected
    wrong = [
        f"{kind}: reaches {case.reach_mm[kind]:.1f} mm towards the gantry"
        for kind in KINDS
        if found.verdicts[("exact", kind)] != expected
    ]
    differing = sorted(
        checker
        for (checker, kind), verdict in found.verdicts.items()
        if kind == "enlarge-axes" and verdict != found.verdicts[("exact", kind)]
    )
    if differing:
        names = ", ".join(differing)
        wrong.append(f"{names}: one-sided, misses what exact sees (docs/contact.md)")
    return "; ".join(wrong) or None


def _nominal(cases: Sequence[ExaminedApproach]) -> list[dict[str, Any]]:
    """Right verdicts of every checker under every margin, without any error."""
    rows = []
    for checker, kind in QUESTIONS:
        reached = [c for c in cases if c.setup.unreachable is None]
        right = {
            d: sum(
                c.outcomes[d].verdicts[(checker, kind)] == c.outcomes[d].trial.expected
                for c in reached
            )
            for d in DISTANCES_MM
        }
        rows.append(
            {
                "checker": checker,
                "margin_kind": kind,
                "right_at_25_mm": right[25],
                "right_at_15_mm": right[15],
                "right": sum(right.values()),
                "of": 2 * len(reached),
            }
        )
    return rows


def _agree(cases: Sequence[ExaminedApproach]) -> bool:
    return all(
        verdict == found.verdicts[("exact", kind)]
        for case in cases
        for found in case.outcomes.values()
        for (checker, kind), verdict in found.verdicts.items()
        if checker == "two-sided"
    )


def _name(case: ExaminedApproach) -> str:
    a = case.setup.approach
    return f"{a.point} {a.axis} ({a.q4_deg},{a.q5_deg}): {case.setup.unreachable}"


def _stop_name(case: ExaminedApproach, distance_mm: int) -> str:
    a = case.setup.approach
    return f"{a.point} {a.axis} ({a.q4_deg},{a.q5_deg}) {distance_mm} mm"


def _positions(case: ExaminedApproach, distance_mm: int) -> dict[str, float]:
    q = case.setup.stops[distance_mm].q
    return dict(zip(JOINTS, (float(v) for v in q), strict=True))


def _miss_chances(study: Study, effects: Sequence[Effects]) -> dict[int, float]:
    """Miss probability at 15 mm by approach, to first order (tails are rare)."""
    rng = np.random.default_rng([study.options.seed, 1])
    errors = first_order(effects, study.sources, rng, FIRST_ORDER_DRAWS)
    chances = (errors > FLIP_MM).mean(axis=0)
    places = [i for i, c in enumerate(study.cases) if c.effects is not None]
    return dict(zip(places, (float(v) for v in chances), strict=True))


def _monte_carlo(study: Study, effects: Sequence[Effects]) -> dict[str, Any] | None:
    """Success of the repeated experiment with a true 20 mm margin, and 57/64 in it."""
    clear = study.clear_mm
    if len(clear) == 0:
        return None
    wrong = np.stack([clear[..., 0] <= MARGIN_MM, clear[..., 1] > MARGIN_MM], axis=2)
    right = wrong.shape[1] * 2 - wrong.sum(axis=(1, 2))
    share = right / (2 * wrong.shape[1])
    total, good = wrong.size, int(wrong.size - wrong.sum())
    errors = clear - DISTANCES_MM
    linear = first_order(
        effects, study.sources, np.random.default_rng([study.options.seed, 2]), 20_000
    )
    return {
        "repetitions": len(clear),
        "trials_each": 2 * wrong.shape[1],
        "success_rate": good / total,
        "success_interval_95": interval(good, total),
        "right_of_each": [int(v) for v in right],
        "published_rate": PUBLISHED_RIGHT / 64,
        "share_of_repetitions_at_or_below_published": float(
            (share <= PUBLISHED_RIGHT / 64).mean()
        ),
        "misses_at_15_mm": int(wrong[..., 1].sum()),
        "false_alarms_at_25_mm": int(wrong[..., 0].sum()),
        "error_mm": {
            "mean": float(errors.mean()),
            "standard_deviation": float(errors.std()),
            "smallest": float(errors.min()),
            "largest": float(errors.max()),
        },
        "first_order_error_mm": {
            "mean": float(linear.mean()),
            "standard_deviation": float(linear.std()),
        },
        "standard_deviation_mm": [spread_mm(e, study.sources) for e in effects],
    }


def _ranking(study: Study, chance: dict[int, float]) -> list[dict[str, Any]]:
    """The 15 mm cells by our miss probability, the published misses marked.

    Where no repetition misses, the largest error that the picking allows decides.
    """
    half = 1e3 * np.array([study.sources.slice, study.sources.pick, study.sources.pick])
    rows = []
    for i, p in chance.items():
        effects = study.cases[i].effects
        assert effects is not None  # chances are worked out from them
        a = effects.approach
        rows.append(
            {
                "point": a.point,
                "axis": a.axis,
                "q4_deg": a.q4_deg,
                "q5_deg": a.q5_deg,
                "miss_probability": p,
                "normal_miss_probability": 0.5
                * math.erfc(
                    (FLIP_MM - effects.bending_mm)
                    / spread_mm(effects, study.sources)
                    / math.sqrt(2.0)
                ),
                "bending_mm": effects.bending_mm,
                "largest_error_mm": float(
                    effects.bending_mm + np.abs(effects.normal) @ half
                ),
                "published_miss": effects.missed,
            }
        )
    return sorted(rows, key=lambda r: (-r["miss_probability"], -r["largest_error_mm"]))


def _fits(effects: Sequence[Effects], sources: Sources) -> list[dict[str, Any]]:
    rows = [asdict(maximum_likelihood(family, effects, sources)) for family in FAMILIES]
    for row in rows:
        row["aic"] = 2.0 * len(row["parameters"]) - 2.0 * row["log_likelihood"]
    return rows


def _margins(
    study: Study, effects: Sequence[Effects], reached: Sequence[ExaminedApproach]
) -> dict[str, Any]:
    """Which margin would have worked, and how far the enlarged volumes reach."""
    rng = np.random.default_rng([study.options.seed, 3])
    errors = first_order(effects, study.sources, rng, FIRST_ORDER_DRAWS)
    modelled = np.stack([25.0 + errors, 15.0 + errors], axis=2)
    low, high = needed_margin_mm(modelled)
    found = maximum_likelihood("offset by posture", effects, study.sources)
    return {
        "with_our_error_model": {"at_least_mm": low, "at_most_mm": high},
        "gaussian_fit_of_the_published_rate": _rate_margin(),
        "posture_offsets_that_give_the_published_table": found.parameters,
        "enlarged_reach_mm": {
            kind: {
                "smallest": min(c.reach_mm[kind] for c in reached),
                "largest": max(c.reach_mm[kind] for c in reached),
                "false_alarms_at_25_mm": sum(
                    c.reach_mm[kind] >= DISTANCES_MM[0] for c in reached
                ),
            }
            for kind in KINDS
        },
    }


def _rate_margin() -> dict[str, float]:
    """Margins by a normal error with the published miss rate and no false alarm.

    Mean 3 mm and standard deviation 2.6 mm make 7 of 32 misses and, nearly always, no
    false alarm in 32; fitted to the table, not predicted.
    """
    from scipy.stats import norm

    published = [a.trial(15).published_ok for a in approaches()]
    missed = 1.0 - sum(published) / len(published)
    spread = 2.6  # mm
    mean = FLIP_MM - spread * float(norm.isf(missed))
    tail = float(norm.isf(1e-3))
    return {
        "mean_mm": mean,
        "standard_deviation_mm": spread,
        "at_least_mm": 15.0 + mean + tail * spread,
        "at_most_mm": 25.0 + mean - tail * spread,
    }
