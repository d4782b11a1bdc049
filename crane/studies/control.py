"""What the closed loop takes out, what it leaves, and why: a cone as in Fig. 11.

python -m crane.studies.control
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from crane.control.controller import Gains
from crane.control.filter import changeover
from crane.control.laws import found_limits, gain_limit, lag, noise_gain
from crane.control.loop import Run, closed_loop, ideal, open_loop
from crane.control.motors import sampled_loop
from crane.control.plant import PERFECT, Plant
from crane.control.trajectory import AHEAD, STEPS, cone, held, line, path_per_step
from crane.kinematics import forward

Array = NDArray[np.float64]

# The needle about 30 deg off the vertical over the couch, all joints well inside.
START = (0.0, 0.15, 0.3, 0.0, 0.2, 0.1, float(np.radians(60.0)), 0.02)
SETTLED = 100  # periods after which the beginning is forgotten
GAIN = 0.3
DELAYS = np.arange(6)
PRINTED = (0.2e-3, float(np.radians(0.71)))  # of the earlier paper, its abstract
TRACKER = (1.4e-3, float(np.radians(0.5)))  # rms from memory, unverified


def study(seed: int, steps: int = STEPS, motor_steps: int = 400) -> dict[str, Any]:
    """Open and closed loop, at rest, laws, noise, motors.

    Args:
        seed: Of the tracker's noise.
        steps: Periods a turn of the cone.
        motor_steps: Periods of it that are simulated motor by motor.
    """
    targets = cone(forward(np.array(START))["8"], steps)
    q0 = ideal(targets[:1], START)[0]
    plant, gains = Plant(), Gains(GAIN)
    runs = {
        "open loop": open_loop(plant, targets, q0),
        "closed loop": closed_loop(plant, targets, q0, gains),
        "closed, feed-forward": closed_loop(
            plant, targets, q0, replace(gains, feed_forward=True)
        ),
    }
    rest = closed_loop(plant, held(targets[0], 101), q0, gains)
    return {
        "runs": [{"loop": name, **told(run)} for name, run in runs.items()],
        "predicted": predicted(steps),
        "at_rest_mm": {
            "begin": 1e3 * float(rest.position[0, 0]),
            "after_30": 1e3 * float(rest.position[30, 0]),
            "after_100": 1e3 * float(rest.position[100, 0]),
        },
        "lag": lag_law(),
        "limits": limits(),
        "noise": noise(seed),
        "motors": motors(targets[: motor_steps + 1], q0),
        "changeover_hz": changeover(),
        "speed": speed(),
        "pictures": pictures(runs, targets),
    }


def told(run: Run, settled: int = SETTLED) -> dict[str, float]:
    """Mean and worst errors once the beginning is forgotten."""
    at, turn = 1e3 * run.position[settled:], np.degrees(run.angle[settled:])
    return {
        "mean_mm": float(at.mean()),
        "worst_mm": float(at.max()),
        "mean_deg": float(turn.mean()),
        "worst_deg": float(turn.max()),
    }


def predicted(steps: int) -> dict[str, float]:
    """Path per period over K."""
    path, angle = path_per_step(steps=steps)
    return {
        "mm": 1e3 * float(lag(path, GAIN)),
        "deg": float(np.degrees(lag(angle, GAIN))),
    }


def lag_law() -> list[dict[str, float]]:
    """Behind a target on a straight line, for gains and speeds, on the whole plant."""
    q0 = np.array(START)
    T = Plant().placement(q0[None])[0]
    rows = []
    gains = np.array([0.1, 0.3, 0.6, 1.0, 1.5])
    for step in (0.02e-3, 0.1e-3):
        targets = line(T, 160, step * np.array([0.36, 0.48, -0.8]))
        run = closed_loop(Plant(), targets, q0, Gains(gains))
        for i, gain in enumerate(gains):
            mine = float(run.position[-20:, i].mean())
            rows.append(
                {
                    "K": float(gain),
                    "mm_per_period": 1e3 * step,
                    "lag_mm": 1e3 * mine,
                    "ratio": mine / float(lag(step, gain)),
                }
            )
    return rows


def limits() -> list[dict[str, float]]:
    """Where the simulated loop begins to swing, beside theory."""
    found, theory = found_limits(PERFECT, START, DELAYS), gain_limit(DELAYS)
    return [
        {"delay": int(n), "found": float(f), "theory": float(t), "ratio": float(f / t)}
        for n, f, t in zip(DELAYS, found, theory, strict=True)
    ]


def noise(seed: int) -> dict[str, float]:
    """True error at rest when the tracker's rated error were all white noise."""
    plant = replace(PERFECT, tracker_shift=TRACKER[0], tracker_turn=TRACKER[1])
    T = forward(np.array(START))["8"]
    rng = np.random.default_rng(seed)
    starts = np.tile(START, (16, 1))
    run = closed_loop(plant, held(T, 300), starts, Gains(GAIN), rng=rng)
    after = run.position[50:]
    return {
        "shift_mm": 1e3 * float(np.sqrt(np.mean(after**2))),
        "predicted_mm": 1e3 * TRACKER[0] * float(noise_gain(GAIN)),
        "turn_deg": float(np.degrees(np.sqrt(np.mean(run.angle[50:] ** 2)))),
    }


def motors(targets: Array, q0: Array) -> list[dict[str, Any]]:
    """The same with motors at 1 kHz, on the cone and at rest."""
    rows = []
    for rounding in (False, True):
        name = "14 bits" if rounding else "exact"
        moving = sampled_loop(Plant(), targets, q0, Gains(GAIN), rounding=rounding)
        still = held(targets[0], 150)
        rest = sampled_loop(Plant(), still, q0, Gains(GAIN), rounding=rounding)
        row = {"encoders": name, **told(moving)}
        rows.append({**row, "at_rest_mm": 1e3 * float(rest.position[-30:].max())})
    return rows


def speed() -> dict[str, float]:
    """At which speed the lag stays below the earlier paper's 0.2 mm."""
    circle = 2.0 * np.pi * AHEAD * float(np.sin(np.radians(10.0)))
    return {
        "mm_per_period": 1e3 * PRINTED[0] * GAIN,
        "periods_a_turn": circle / (PRINTED[0] * GAIN),
        "lag_deg_there": float(np.degrees(PRINTED[0] / AHEAD)),
    }


def pictures(runs: dict[str, Run], targets: Array) -> dict[str, Any]:
    """Curves as in Fig. 11: errors over the turn, and the needle guide's path."""
    position, angle, path = {}, {}, {}
    wanted = 1e3 * targets[:, :3, 3]
    path["target"] = wanted[::10, :2].tolist()
    for name, run in runs.items():
        k = np.arange(0, len(run.position), 10)
        position[name] = np.column_stack([k, 1e3 * run.position[k, 0]]).tolist()
        angle[name] = np.column_stack([k, np.degrees(run.angle[k, 0])]).tolist()
        path[name] = (1e3 * run.placed[k, 0, :2, 3]).tolist()
    return {
        "position": {"lines": position, "x": "period", "y": "position error [mm]"},
        "angle": {"lines": angle, "x": "period", "y": "angle error [deg]"},
        "path": {"lines": path, "x": "x [mm]", "y": "y [mm]"},
    }


def lines(found: dict[str, Any]) -> Iterator[str]:
    """What the study prints."""
    for r in found["runs"]:
        yield (
            f"{r['loop']:21s} mean {r['mean_mm']:.3f} mm {r['mean_deg']:.3f} deg, "
            f"worst {r['worst_mm']:.3f} mm {r['worst_deg']:.3f} deg"
        )
    p, rest, s = found["predicted"], found["at_rest_mm"], found["speed"]
    yield f"path per period / K:  {p['mm']:.3f} mm {p['deg']:.3f} deg"
    yield (
        f"at rest, no noise: {rest['begin']:.2f} mm at first, {rest['after_30']:.1e} "
        f"after 30 periods, {rest['after_100']:.1e} after 100"
    )
    worst = max(abs(r["ratio"] - 1.0) for r in found["lag"])
    yield f"lag law, {len(found['lag'])} gains and speeds: within {100 * worst:.2f} %"
    for r in found["limits"]:
        yield (
            f"delay {r['delay']}: swings from K = {r['found']:.4f}, theory "
            f"{r['theory']:.4f} ({r['ratio']:.4f})"
        )
    n = found["noise"]
    yield (
        f"white noise of 1.4 mm, 0.5 deg: {n['shift_mm']:.2f} mm (predicted "
        f"{n['predicted_mm']:.2f}) and {n['turn_deg']:.2f} deg of true error at rest"
    )
    for r in found["motors"]:
        yield (
            f"motors at 1 kHz, encoders {r['encoders']}: {r['mean_mm']:.3f} mm "
            f"{r['mean_deg']:.3f} deg on the cone, {r['at_rest_mm']:.1e} mm at rest"
        )
    yield f"filter changes over at {found['changeover_hz']:.2f} Hz"
    yield (
        f"0.2 mm takes at most {s['mm_per_period']:.3f} mm a period, "
        f"{s['periods_a_turn']:.0f} periods a turn; its lag is "
        f"{s['lag_deg_there']:.3f} deg: 0.71 deg is no lag"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    for text in lines(study(args.seed, args.steps)):
        print(text)


if __name__ == "__main__":
    main()
