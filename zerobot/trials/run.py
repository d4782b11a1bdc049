"""Runs the study of the 64 trials over all cores and remembers what is finished.

The results do not depend on the number of cores: approaches are solved one by one, and
the repetitions come in chunks with a random generator each.
"""

import json
import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import InputError
from zerobot.trials.bench import Bench, Outcome, Setup, outcome, reach, set_up
from zerobot.trials.errors import Sources
from zerobot.trials.fit import Effects
from zerobot.trials.monte_carlo import (
    Experiment,
    RealStop,
    chunks,
    real_stops,
    run_chunk,
    undisturbed,
)
from zerobot.trials.published import DISTANCES_MM, PublishedApproach, approaches

Array = NDArray[np.float64]
Counter = Callable[[int, int], None]
Progress = Callable[[str], Counter]

KINDS = ("enlarge-axes", "enlarge-axes:world", "offset")


@dataclass(frozen=True)
class StudyOptions:
    """What the study is about.

    Attributes:
        mount: The mounting side.
        level: Level of detail of the meshes.
        aim: Whether the operator shifts across the approach to meet the goal point.
        samples: Repetitions of the experiment.
        seed: Of all random numbers.
        jobs: Cores; 0 for all.
        state: File that keeps finished chunks, or None.
    """

    mount: str = "+90"
    level: str = "coarse"
    aim: bool = True
    samples: int = 200
    seed: int = 0
    jobs: int = 0
    state: Path | None = None


@dataclass(frozen=True, eq=False)
class ExaminedApproach:
    """One approach: set-up, what the checkers say at its stops, what disturbs it.

    Attributes:
        setup: The approach in the model.
        outcomes: By distance [mm].
        reach_mm: {margin kind: true distance at which the grown robot touches}, [mm].
        real: Where the bent robot stops; empty if out of reach.
        effects: Normal, bending and rods; None if out of reach.
    """

    setup: Setup
    outcomes: dict[int, Outcome]
    reach_mm: dict[str, float]
    real: tuple[RealStop, ...]
    effects: Effects | None


@dataclass(frozen=True, eq=False)
class Study:
    """All approaches and all repetitions.

    Attributes:
        options: As asked.
        sources: The disturbances, fixed before.
        cases: In the order of the tables.
        clear_mm: Model clearances at 25 and 15 mm of every repetition, for the
            approaches within reach, (samples, approaches, 2), [mm].
    """

    options: StudyOptions
    sources: Sources
    cases: tuple[ExaminedApproach, ...]
    clear_mm: Array


def run(options: StudyOptions, sources: Sources, progress: Progress) -> Study:
    """The whole study; with a state file, finished chunks are not run again.

    Args:
        options: What the study is about.
        sources: The disturbances.
        progress: Makes a counter `(done, total)` for what is named.

    Raises:
        InputError: The state file belongs to another study.
    """
    with _workers(options, sources) as submit:
        cases = _cases(submit, options, progress)
        stops = [case.real for case in cases if case.real]
        clear = _repetitions(submit, options, sources, stops, progress)
    return Study(options, sources, cases, clear)


def examine(
    experiment: Experiment, rods: Experiment, approach: PublishedApproach, aim: bool
) -> ExaminedApproach:
    """Set-up, verdicts, reach and undisturbed errors of one approach.

    Args:
        experiment: Real robot, model and gantry.
        rods: The same with the model's rods placed with the whole of W_T_4.
        approach: Which.
        aim: As in the options.
    """
    bench = Bench(experiment.real, experiment.scene)
    setup = set_up(bench, approach, aim=aim)
    outcomes = {d: outcome(bench, setup, d) for d in DISTANCES_MM}
    if setup.unreachable is not None:
        return ExaminedApproach(setup, outcomes, {}, (), None)
    reached = {kind: 1e3 * reach(bench, setup, kind) for kind in KINDS}
    real = real_stops(experiment, [setup])[0]
    error = 1e3 * undisturbed(experiment, [real])[0] - DISTANCES_MM
    with_rods = 1e3 * undisturbed(rods, [real])[0] - DISTANCES_MM
    closest = setup.stops[15].closest
    away = np.array(closest.points[0]) - np.array(closest.points[1])
    effects = Effects(
        approach,
        away / np.linalg.norm(away),
        float(error[1]),
        float(with_rods[1] - error[1]),
    )
    return ExaminedApproach(setup, outcomes, reached, real, effects)


Submit = Callable[..., Any]

# One experiment per worker process: loading it takes longer than a chunk.
_worker: dict[str, Any] = {}


@contextmanager
def _workers(options: StudyOptions, sources: Sources) -> Iterator[Submit]:
    jobs = options.jobs or os.cpu_count() or 1
    # spawned, not forked: numba and Coal hold threads
    with ProcessPoolExecutor(
        jobs, get_context("spawn"), _load, (options, sources)
    ) as pool:
        try:
            yield pool.submit
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _load(options: StudyOptions, sources: Sources) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the study
    frame4 = Sources(**{**_fields(sources), "level_parts": "frame4"})
    _worker["experiment"] = Experiment(sources, options.mount, options.level)
    _worker["rods"] = Experiment(frame4, options.mount, options.level)


def _examine(approach: PublishedApproach, aim: bool) -> ExaminedApproach:
    return examine(_worker["experiment"], _worker["rods"], approach, aim)


def _chunk(
    stops: list[tuple[RealStop, ...]], draws: int, rng: np.random.Generator
) -> Array:
    return run_chunk(_worker["experiment"], stops, draws, rng)


def _cases(
    submit: Submit, options: StudyOptions, progress: Progress
) -> tuple[ExaminedApproach, ...]:
    wanted = approaches()
    tasks = {submit(_examine, a, options.aim): i for i, a in enumerate(wanted)}
    found: dict[int, ExaminedApproach] = {}
    count = progress("approaches")
    for task in as_completed(tasks):
        found[tasks[task]] = task.result()
        count(len(found), len(wanted))
    return tuple(found[i] for i in range(len(wanted)))


def _repetitions(
    submit: Submit,
    options: StudyOptions,
    sources: Sources,
    stops: list[tuple[RealStop, ...]],
    progress: Progress,
) -> Array:
    key = _key(options, sources, stops)
    done = _read_state(options.state, key)
    parts = list(chunks(options.seed, options.samples))
    tasks = {
        submit(_chunk, stops, draws, rng): i for i, draws, rng in parts if i not in done
    }
    count = progress("chunks of repetitions")
    for task in as_completed(tasks):
        i = tasks[task]
        done[i] = 1e3 * task.result()
        _append_state(options.state, key, i, done[i])
        count(len(done), len(parts))
    rows = [done[i] for i, _, _ in parts]
    return np.concatenate(rows) if rows else np.zeros((0, len(stops), 2))


def _key(
    options: StudyOptions, sources: Sources, stops: list[tuple[RealStop, ...]]
) -> str:
    """What a chunk depends on; another study's chunks are not taken for ours."""
    inputs = {
        "mount": options.mount,
        "level": options.level,
        "aim": options.aim,
        "samples": options.samples,
        "seed": options.seed,
        "sources": asdict(sources),
        "stops": [[list(stop.q) for stop in pair] for pair in stops],
    }
    return sha256(json.dumps(inputs, sort_keys=True).encode()).hexdigest()


def _read_state(path: Path | None, key: str) -> dict[int, Array]:
    done: dict[int, Array] = {}
    if path is None or not path.exists():
        return done
    for number, line in enumerate(path.read_text().splitlines(), start=1):
        try:
            entry = json.loads(line)
            same, chunk = entry["key"] == key, int(entry["chunk"])
            clear = np.array(entry["clear_mm"], dtype=np.float64)
        except (ValueError, KeyError, TypeError):
            continue  # a line cut short by an interruption: that chunk is run again
        if not same:
            raise InputError(
                path, "belongs to another study; choose a new file", f"line {number}"
            )
        done[chunk] = clear
    return done


def _append_state(path: Path | None, key: str, chunk: int, clear: Array) -> None:
    if path is None:
        return
    line = json.dumps({"key": key, "chunk": chunk, "clear_mm": clear.tolist()})
    with path.open("a") as file:
        file.write(line + "\n")


def _fields(sources: Sources) -> dict[str, Any]:
    return {name: getattr(sources, name) for name in sources.__dataclass_fields__}
