"""Does the closed form lose a pose, and what does the paper's iteration find beside it?

python -m crane.studies.inverse --poses 100000 --iterated 10000
"""

import argparse
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane.branches import many_q5_q6
from crane.dimensions import LIMITS
from crane.inverse import exists, within_limits
from crane.kinematics import forward, jacobian
from crane.least_squares import PAPER, TIGHT, Chain, Found, Settings, solve

Array = NDArray[np.float64]

LOWER, UPPER = np.array(list(LIMITS.values())).T
AHEAD = 0.05  # of the tip before frame 8: default of `needle_ahead`
CHUNK = 20_000

ENDLESS = Chain(lambda q: forward(q)["8"], jacobian)
LIMITED = Chain(lambda q: forward(q)["8"], jacobian, LOWER, UPPER)
REDUNDANT = (4, 5, 7)  # q5, q6 as in section V-B, and q8, which it leaves out


def poses(count: int, rng: np.random.Generator) -> Array:
    """Configurations within the limits, (count, 8), even over every joint's range."""
    return rng.uniform(LOWER, UPPER, (count, 8))


def closed_form(count: int, rng: np.random.Generator) -> dict[str, Any]:
    """Every pose asked for again: what is lost, what remains, how many branches."""
    totals = {"lost": 0, "one_branch": 0, "two_branches": 0}
    worst = {"tip_m": 0.0, "axis_rad": 0.0}
    for first in range(0, count, CHUNK):
        q = poses(min(CHUNK, count - first), rng)
        T = forward(q)["needle_tip"]
        found = many_q5_q6(T[:, :3, 3], T[:, :3, 2], q[:, 4], q[:, 5], q[:, 7])
        back = forward(found.reshape(-1, 8))["needle_tip"].reshape(len(q), 2, 4, 4)
        away = np.linalg.norm(back[..., :3, 3] - T[:, None, :3, 3], axis=-1)
        axis = np.cross(back[..., :3, 2], T[:, None, :3, 2])
        worst["tip_m"] = max(worst["tip_m"], float(np.nanmax(away)))
        angle = float(np.nanmax(np.linalg.norm(axis, axis=-1)))
        worst["axis_rad"] = max(worst["axis_rad"], angle)
        again = np.abs(found - q[:, None]).max(axis=-1).min(axis=1)
        totals["lost"] += int(np.sum(~(again < 1e-6)))
        inside = within_limits(found).sum(axis=1)
        totals["one_branch"] += int(np.sum(inside == 1))
        totals["two_branches"] += int(np.sum(inside == 2))
    return {
        "poses": count,
        "lost": totals["lost"],
        "worst": worst,
        "one_branch_share": totals["one_branch"] / count,
        "two_branches_share": totals["two_branches"] / count,
    }


def law(count: int, rng: np.random.Generator) -> dict[str, Any]:
    """The law of existence on a grid of (q5, q6) all round, for random directions."""
    side = int(np.ceil(np.sqrt(count)))
    angles = np.linspace(-np.pi, np.pi, side)
    q5, q6 = (v.ravel() for v in np.meshgrid(angles, angles, indexing="ij"))
    n = rng.normal(size=(len(q5), 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    answers = exists(n, q5, q6)
    q = many_q5_q6(np.zeros_like(n), n, q5, q6, np.zeros_like(q5))
    given = np.isfinite(q[:, 0]).all(axis=1)
    z7, along = _axis_of_q7(q[given, 0]), n[given]
    square = np.abs(np.sum(z7 * along, axis=1))
    # what the law denies must be out of reach of every q4, looked at densely
    denied = np.flatnonzero(~answers)[:2000]
    nearest = _least_slope(n[denied], q5[denied], q6[denied])
    return {
        "points": len(q5),
        "exist": int(answers.sum()),
        "disagree": int(np.sum(answers != given)),
        "worst_of_those_given_rad": float(square.max()),
        "least_of_those_denied_rad": float(nearest.min()) if len(denied) else None,
    }


def _axis_of_q7(q: Array) -> Array:
    return forward(q)["7"][:, :3, 2]


def _least_slope(n: Array, q5: Array, q6: Array) -> Array:
    """How square the axis of q7 and the needle become at best over all q4."""
    q = np.zeros((len(n), 8))
    q[:, 4], q[:, 5] = q5, q6
    least = np.full(len(n), np.inf)
    for q4 in np.linspace(-np.pi, np.pi, 181):
        q[:, 3] = q4
        least = np.minimum(least, np.abs(np.sum(_axis_of_q7(q) * n, axis=1)))
    return least


def iterated(count: int, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Levenberg and Marquardt from random starts, beside the closed form."""
    q = poses(count, rng)
    starts, targets = poses(count, rng), ENDLESS.forward(q)
    held = starts.copy()
    held[:, REDUNDANT] = q[:, REDUNDANT]
    rows = []
    for chain, limits in ((ENDLESS, "none"), (LIMITED, "kept")):
        for settings, name in ((PAPER, "0.5 mm, 0.06 rad"), (TIGHT, "1e-10")):
            label = {"limits": limits, "tolerance": name}
            found = solve(chain, targets, starts, settings)
            rows.append({"joints": "all eight", **label, **_told(found)})
            found = solve(chain, targets, held, settings, held=REDUNDANT)
            row = {"joints": "q5, q6, q8 held", **label, **_told(found)}
            if settings is TIGHT:
                row["worst_off_a_branch"] = off_branch(found, targets, held)
            rows.append(row)
    return rows


def restarted(
    count: int, rng: np.random.Generator, settings: Settings = PAPER
) -> dict[str, Any]:
    """Within limits, from new random starts until each pose is found."""
    q = poses(count, rng)
    left, starts = ENDLESS.forward(q), 0
    needed = []
    while len(left) and starts < 50:
        starts += 1
        found = solve(LIMITED, left, poses(len(left), rng), settings)
        needed += [starts] * int(found.converged.sum())
        left = left[~found.converged]
    return {"never": len(left), "most_starts": starts, "mean": float(np.mean(needed))}


def held_anywhere(count: int, rng: np.random.Generator) -> dict[str, Any]:
    """q5 and q6 held at random: the law of existence says where it can succeed."""
    targets, starts = ENDLESS.forward(poses(count, rng)), poses(count, rng)
    can = exists(targets[:, :3, 2], starts[:, 4], starts[:, 5])
    found = solve(ENDLESS, targets, starts, TIGHT, held=REDUNDANT)
    return {
        "exist": int(can.sum()),
        "exist_and_converged": int((can & found.converged).sum()),
        "do_not_exist": int((~can).sum()),
        "do_not_exist_and_converged": int((~can & found.converged).sum()),
    }


def _told(found: Found) -> dict[str, Any]:
    done = found.converged
    return {
        "converged_share": float(done.mean()),
        "local_minima": int(found.stalled.sum()),
        "out_of_steps": int(np.sum(~done & ~found.stalled)),
        "median_iterations": float(np.median(found.iterations[done])),
        "most_iterations": int(found.iterations[done].max()),
    }


def off_branch(found: Found, targets: Array, held: Array) -> float:
    """How far the iteration's answers are from the nearest closed form."""
    done = found.converged
    T, q = targets[done], found.q[done]
    n = T[:, :3, 2]
    tips = T[:, :3, 3] + AHEAD * n
    both = many_q5_q6(tips, n, *held[done][:, REDUNDANT].T)
    off = both - q[:, None]
    off[..., 3:7] = (off[..., 3:7] + np.pi) % (2.0 * np.pi) - np.pi
    return float(np.abs(off).max(axis=-1).min(axis=1).max())


def lines(found: dict[str, Any]) -> Iterator[str]:
    """What the study prints."""
    c, e = found["closed_form"], found["law"]
    yield (
        f"closed form, {c['poses']} poses within limits: {c['lost']} lost; residual at "
        f"most {c['worst']['tip_m']:.1e} m, {c['worst']['axis_rad']:.1e} rad"
    )
    yield (
        f"  within limits one branch {100 * c['one_branch_share']:.1f} %, "
        f"two {100 * c['two_branches_share']:.1f} %"
    )
    yield (
        f"law of existence, {e['points']} (q5, q6): {e['exist']} exist, "
        f"{e['disagree']} disagree; worst given {e['worst_of_those_given_rad']:.1e}, "
        f"least denied {e['least_of_those_denied_rad']:.1e}"
    )
    yield "Levenberg-Marquardt, one random start a pose (share, median, most; minima):"
    for r in found["iterated"]:
        off = r.get("worst_off_a_branch")
        yield (
            f"  {r['joints']:16s} limits {r['limits']:5s} {r['tolerance']:17s}"
            f"{100 * r['converged_share']:7.2f} % {r['median_iterations']:4.0f} "
            f"{r['most_iterations']:4d}; {r['local_minima']} minima, "
            f"{r['out_of_steps']} out of steps"
            + ("" if off is None else f"; off a branch {off:.1e}")
        )
    again, held = found["restarted"], found["held_anywhere"]
    yield (
        f"  within limits with new starts: {again['never']} never found, "
        f"at most {again['most_starts']} starts, {again['mean']:.2f} on the average"
    )
    yield (
        f"  q5, q6 held at random: {held['exist_and_converged']} of {held['exist']} "
        f"that exist converge, {held['do_not_exist_and_converged']} of "
        f"{held['do_not_exist']} that do not"
    )


def study(count: int, iterations: int, seed: int) -> dict[str, Any]:
    """All of it.

    Args:
        count: Poses of the closed form, and points of the law's grid.
        iterations: Poses of the iteration.
        seed: Of all random numbers.
    """
    rng = np.random.default_rng(seed)
    return {
        "closed_form": closed_form(count, rng),
        "law": law(count, rng),
        "iterated": iterated(iterations, rng),
        "restarted": restarted(iterations, rng),
        "held_anywhere": held_anywhere(iterations, rng),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--iterated", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for line in lines(study(args.poses, args.iterated, args.seed)):
        print(line)


if __name__ == "__main__":
    main()
