"""Hostile xacro, URDF, Collada, STL and JSON files through the command line.

    python -m studies.hostile_files [--count 10000] [--seed 1] [--resume FILE]

Every file is made by a seeded maker (`hostile_makers`) in a folder of its own and given
to the commands that read its kind, under an audit hook (`watched`): no program may run,
no file may be opened or written beyond that folder, no secret printed; each must end
without a traceback, within 2 s of processor time and 1 GB. Worker processes take 250
files each; their answers are kept in the file of `--resume`. Exit status 1 otherwise.
"""

import argparse
import contextlib
import io
import json
import os
import random
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from pathlib import Path

from studies.hostile_makers import CANARY, MAKERS, PLAN, SETTINGS, prepare
from studies.watched import Tally, Watch, peak_bytes, python_folders, timed, watching

MAX_SECONDS = 2.0
MAX_BYTES = 1_000_000_000
CHUNK = 250
PATIENCE_S = 3600.0  # of a chunk; the processor time below ends sooner
MAX_CHUNK_S = 1200
PROJECT = Path(__file__).resolve().parents[1]
ROBOT = PROJECT / "tests" / "data" / "robots" / "two_link.urdf"
BLOCK = PROJECT / "tests" / "data" / "cases" / "box.stl"


def commands(path: Path) -> Iterator[list[str]]:
    """The commands that read a file of this kind."""
    file = str(path)
    if path.suffix in (".xacro", ".urdf"):
        yield ["validate", file, "--brief", "--no-run"]
        yield ["check", file, f"{BLOCK}:m@5,5,5", "--q", "home"]
    elif path.suffix in (".dae", ".stl"):
        holder = path.with_name("holder.urdf")
        mesh = f"<geometry><mesh filename='{path.name}'/></geometry>"
        holder.write_text(
            f"<robot name='r'><link name='l'><collision>{mesh}</collision></link>"
            "</robot>"
        )
        yield ["check", str(ROBOT), f"{file}:m@3,3,3", "--q", "0"]
        yield ["validate", str(holder), "--brief", "--no-run"]
    elif path.stem == "certificate":
        yield ["verify", file]
    elif path.stem == "plan":
        options = ["--plan", file, "--no-certificate", "--samples", "1"]
        yield ["check", "zerobot", "ct_gantry", *options]
    elif path.stem == "uncertainty":
        options = ["--q", "0", "--uncertainty", file, "--draws", "20"]
        yield ["check", str(ROBOT), f"{BLOCK}:m@3,3,3", *options]
    else:
        yield ["report", file, str(path.with_name("page.html"))]
        yield ["compare", str(ROBOT), f"{BLOCK}:m@3,3,3", "--replay", file]


def outcome_of(words: list[str]) -> str:
    """How a command ends, and what it must not do."""
    from borecheck.cli import main

    out, err = io.StringIO(), io.StringIO()
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = main(words)
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 2
    except BaseException as error:  # noqa: BLE001  a traceback, which must not be
        return f"PROBLEM {type(error).__name__}: {error!s:.200}"
    said = out.getvalue() + err.getvalue()
    if "Traceback" in said:
        return "PROBLEM traceback printed"
    if CANARY in said or "root:x:0" in said:
        return "PROBLEM a foreign file's content printed"
    if any(ord(c) < 32 and c not in "\n\t" for c in said):
        return "PROBLEM a control character printed"
    return {0: "answered", 1: "defects told"}.get(status, "refused")


def run(kind: str, start: int, count: int, seed: int, folder: Path) -> Tally:
    """Makes and reads the files `start` to `start + count` of a kind."""
    tally = Tally()
    for number in range(start, start + count):
        rng = random.Random(f"{seed} {kind} {number}")
        base = Path(tempfile.mkdtemp(dir=folder))
        path = MAKERS[kind](rng, prepare(base))
        for words in commands(path):
            _watched(tally, words, f"{kind} {number}: {words[0]}", path.parent)
    return tally


def _watched(tally: Tally, words: list[str], what: str, inside: Path) -> None:
    from borecheck.core.cache import cache_folder

    folders = (inside, cache_folder(), PROJECT, "/proc", "/sys", "/dev/null")
    allowed = (*map(os.path.realpath, folders), *python_folders())
    with watching(Watch(allowed, allow_code=True)) as watch:
        outcome, seconds = timed(lambda: outcome_of(words))
    tally.add(outcome, seconds, what)
    problems = list(watch.seen)
    if outcome.startswith("PROBLEM"):
        problems.append(outcome)
    if seconds > MAX_SECONDS:
        problems.append(f"{seconds:.1f} s")
    tally.problems += [f"{what}: {problem}" for problem in problems]


def warm_up(folder: Path) -> None:
    """Everything imported and compiled once, so that a first file is not slower."""
    good = (("plan", PLAN), ("uncertainty", SETTINGS), ("result", {}))
    inside = prepare(Path(tempfile.mkdtemp(dir=folder)))
    for name, document in good:
        path = inside / f"{name}.json"
        path.write_text(json.dumps(document))
        for words in commands(path):
            outcome_of(words)
    outcome_of(["compare", str(ROBOT), f"{BLOCK}:m@0.1,0,0.5", "--random", "2"])
    for kind in MAKERS:
        run(kind, -3, 3, 0, folder)


def worker(kind: str, start: int, count: int, seed: int) -> None:
    """One chunk; its tally goes to standard output as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        warm_up(Path(folder))
        _bound()
        tally = run(kind, start, count, seed, Path(folder))
    print(json.dumps({**asdict(tally), "bytes": peak_bytes()}))


def _bound() -> None:
    """1 GB beyond what Python, kernels and libraries take by now, and some minutes."""
    import resource

    spent = int(resource.getrusage(resource.RUSAGE_SELF).ru_utime)
    resource.setrlimit(resource.RLIMIT_CPU, (spent + MAX_CHUNK_S,) * 2)

    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MAX_BYTES, used + MAX_BYTES))


def chunk(kind: str, start: int, count: int, seed: int) -> dict[str, object]:
    """The answer of a worker process, or that it died or never ended."""
    words = [sys.executable, "-m", "studies.hostile_files", "--worker", kind]
    words += [str(start), "--count", str(count), "--seed", str(seed)]
    what = f"{kind} {start} to {start + count}"
    try:
        done = subprocess.run(
            words, capture_output=True, text=True, timeout=PATIENCE_S, check=False
        )
        return dict(json.loads(done.stdout.splitlines()[-1]))
    except subprocess.TimeoutExpired:
        problem = f"{what}: no end within {PATIENCE_S:g} s"
    except (ValueError, IndexError):
        problem = f"{what}: died (status {done.returncode}): {done.stderr[-300:]}"
    return {**asdict(Tally(problems=[problem])), "bytes": 0}


def study(count: int, seed: int, resume: Path | None, jobs: int) -> tuple[Tally, int]:
    """All chunks, or their answers in the file of `resume`; the sum, and the memory."""
    each = count // len(MAKERS)
    asked = [
        (kind, start, min(CHUNK, each - start), seed)
        for kind in MAKERS
        for start in range(0, each, CHUNK)
    ]
    known: dict[str, dict[str, object]] = {}
    if resume is not None and resume.exists():
        lines = resume.read_text().splitlines()
        known = dict(json.loads(line) for line in lines)
    total, peak = Tally(), 0
    left = [one for one in asked if repr(one) not in known]
    with ThreadPoolExecutor(jobs) as pool:
        answers = pool.map(lambda one: chunk(*one), left)
        for done, (one, answer) in enumerate(zip(left, answers, strict=True)):
            known[repr(one)] = answer
            if resume is not None and answer["counts"]:  # one that died is tried again
                with resume.open("a") as file:
                    file.write(json.dumps([repr(one), answer]) + "\n")
            print(f"{done + 1}/{len(left)} {one}: {answer['counts']}", file=sys.stderr)
    for one in asked:
        answer = dict(known[repr(one)])
        peak = max(peak, int(str(answer.pop("bytes"))))
        total = total.joined(Tally(**answer))  # type: ignore[arg-type]
    return total, peak


def main() -> int:
    """Runs the study; 1 if anything happened that must not."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--resume", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--worker", nargs=2, metavar=("KIND", "START"))
    asked = parser.parse_args()
    if asked.worker:
        worker(asked.worker[0], int(asked.worker[1]), asked.count, asked.seed)
        return 0
    total, peak = study(asked.count, asked.seed, asked.resume, asked.jobs)
    for problem in total.problems[:100]:
        print(problem)
    counts = ", ".join(f"{n} {name}" for name, n in sorted(total.counts.items()))
    print(f"slowest: {total.slowest}")
    print(
        f"{asked.count} files (seed {asked.seed}), readings: {counts}; "
        f"{len(total.problems)} things run, opened outside, printed or too slow; "
        f"at most {total.seconds:.2f} s and {peak / 1e6:.0f} MB"
    )
    return 1 if total.problems or peak > MAX_BYTES else 0


if __name__ == "__main__":
    sys.exit(main())
