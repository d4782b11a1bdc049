"""The study of the 64 trials as one JSON document."""

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from zerobot.trials.bench import QUESTIONS
from zerobot.trials.error_tables import (
    PUBLISHED_RIGHT,
    fits,
    margins,
    miss_chances,
    ranking,
    repetitions,
)
from zerobot.trials.fit import (
    FAMILIES,
    FLIP_MM,
    smallest_disturbance,
)
from zerobot.trials.published import DISTANCES_MM
from zerobot.trials.run import KINDS, ExaminedApproach, Study
from zerobot.trials.sections import sections, summary

CHECKERS = ("paper:robot", "paper:scanner", "two-sided", "exact", "coal")

JOINTS = ("q1", "q2", "q3", "q4", "q5", "q6")


def document(study: Study) -> dict[str, Any]:
    """Tables, repetitions, fits and margins, ready for `json.dumps` and for a page."""
    found = _numbers(study)
    return {"summary": summary(found), **found, "sections": sections(found)}


def _numbers(study: Study) -> dict[str, Any]:
    reached = [case for case in study.cases if case.effects is not None]
    effects = [case.effects for case in reached if case.effects is not None]
    chance = miss_chances(study, effects)
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
        "monte_carlo": repetitions(study, effects),
        "ranking": ranking(study, chance),
        "fitted_to_the_published_table": fits(effects, study.sources),
        "smallest_disturbances": [
            asdict(smallest_disturbance(family, effects)) for family in FAMILIES
        ],
        "margins": margins(study, effects, reached),
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
