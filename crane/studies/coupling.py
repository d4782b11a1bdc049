"""How well is the coupling of motors and joints found from what encoders read?

python -m crane.studies.coupling --samples 50000
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np

from crane.encoders import Series, simulated_series
from crane.transmission import CABLE, MOTORS, Identified, identify, transmission

OFFSET = 0.05  # of every joint encoder, [rad]; q8: 0.3 mm

TRUE = np.array(CABLE)


def study(samples: int, seed: int) -> dict[str, Any]:
    """C_cable from exact and from 14-bit series, with offsets, and driven in step."""
    rng = np.random.default_rng(seed)
    offset = OFFSET * np.array([1.0, 1.0, 1.0, 6.35e-3])
    cases = {
        "exact encoders": (simulated_series(samples, rng, bits=False), True),
        "14 bits": (simulated_series(samples, rng), True),
        "14 bits, offset of 50 mrad": (
            simulated_series(samples, rng, offset=offset),
            True,
        ),
        "exact, offset of 50 mrad": (
            simulated_series(samples, rng, bits=False, offset=offset),
            True,
        ),
        "the same, eq. (9) without intercept": (
            simulated_series(samples, rng, bits=False, offset=offset),
            False,
        ),
    }
    rows = [
        {"series": name, **told(identify(s.motors, s.joints, intercept=with_one))}
        for name, (s, with_one) in cases.items()
    ]
    return {
        "true": TRUE.tolist(),
        "found": rows,
        "in_step": [refused(samples, rng, bits) for bits in (False, True)],
        "there_and_back": there_and_back(rng),
    }


def told(found: Identified, true: Any = TRUE) -> dict[str, Any]:
    """The numbers of one identification, with its error where the truth is known."""
    known: dict[str, Any] = {}
    if true is not None:
        known["worst_entry"] = float(np.abs(found.cable - true).max())
    return known | {
        "above_diagonal": float(np.abs(np.triu(found.cable, 1)).max()),
        "above_in_standard_errors": found.above,
        "condition": found.condition,
        "residual_rms": found.residual_rms.tolist(),
        "offset": found.offset.tolist(),
        "cable": found.cable.tolist(),
        "standard_error": found.standard_error.tolist(),
        "above_diagonal_entries": [
            {"joint": joint, "motor": motor, "entry": entry, "standard_errors": ratio}
            for joint, motor, entry, ratio in found.above_diagonal()
        ],
    }


def refused(samples: int, rng: np.random.Generator, bits: bool) -> str:
    """Why a series with m6 in step with m5 is not taken."""
    series = simulated_series(samples, rng, bits=bits, in_step=True)
    try:
        identify(series.motors, series.joints)
    except ValueError as error:
        return str(error)
    return "was taken, which is wrong"


def there_and_back(rng: np.random.Generator) -> float:
    """Worst difference of q and C C^-1 q, over 1,000 configurations."""
    q, C = rng.uniform(-1.0, 1.0, (1000, 8)), transmission()
    return float(np.abs(C.joints(C.motors(q)) - q).max())


def measured(series: Series) -> dict[str, Any]:
    """The same for a series of a user, whose truth is not known."""
    found = identify(series.motors, series.joints)
    return {"found": [{"series": "measured", **told(found, None)}]}


def lines(found: dict[str, Any]) -> Iterator[str]:
    """What the study prints."""
    for r in found["found"]:
        worst = r.get("worst_entry")
        yield (
            f"{r['series']:36s}"
            + ("" if worst is None else f"worst entry of C {worst:.1e}, ")
            + f"above the diagonal {r['above_diagonal']:.1e}, "
            f"residual {max(r['residual_rms']):.1e}, condition {r['condition']:.2f}"
        )
    if "in_step" not in found:
        yield from _matrix(found["found"][0])
        return
    for reason in found["in_step"]:
        yield f"in step: refused, {reason}"
    yield f"joints to motors and back: {found['there_and_back']:.1e}"


def _matrix(r: dict[str, Any]) -> Iterator[str]:
    """What was found, entry by entry, and what speaks against the paper's form."""
    yield "C_cable" + " ".join(f"{name:>11s}" for name in MOTORS[4:]) + "      offset"
    for i, row in enumerate(r["cable"]):
        entries = " ".join(f"{x:11.7f}" for x in row)
        yield f"  q{i + 5}   {entries} {r['offset'][i]:11.7f}"
    yield "standard errors of the entries, residual of the row"
    for i, row in enumerate(r["standard_error"]):
        errors = " ".join(f"{x:11.1e}" for x in row)
        yield f"  q{i + 5}   {errors} {r['residual_rms'][i]:11.1e}"
    for e in r["above_diagonal_entries"]:
        yield (
            f"warning: not lower triangular, as eq. (10) has it: {e['motor']} moves "
            f"{e['joint']} by {e['entry']:.2g}, {e['standard_errors']:.0f} standard "
            "errors: another routing, columns exchanged, or play"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=50_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for line in lines(study(args.samples, args.seed)):
        print(line)


if __name__ == "__main__":
    main()
