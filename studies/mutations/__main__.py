"""Does a test notice when the code that says `clear` is changed?

    python -m studies.mutations --count 240 --seed 1

Takes a seeded sample of all small changes (`changes`) of the rooms contact, motion,
verify and plans, containment among them, and asks for each whether the tests of its own
room notice it: those in the folder that mirrors it, and `ALSO`. Prints the share by
module, and every change that nobody noticed. With --state FILE it goes on where it
was interrupted; changes that were missed are asked again.

Kernels that are compiled take minutes each: of their modules a few are taken.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

from studies.mutations import judge
from studies.mutations.changes import Mutant, mutants, mutated
from studies.mutations.exempt import EQUIVALENT, KERNELS
from studies.mutations.judge import PROJECT, ROOMS, Child, KnownTest

KERNEL_MUTANTS = 4  # of each module of kernels
NICE = 15

# Tests that are a module's own though they stand in another room.
ALSO = {
    "borecheck/motion/certificate.py": (
        "tests/verify/test_check.py",
        "tests/verify/test_passage.py",
    ),
    "borecheck/motion/cover.py": (
        "tests/verify/test_check.py",
        "tests/verify/test_passage.py",
    ),
    "borecheck/motion/binding.py": ("tests/verify/test_binding.py",),
}
# Tests that look at kernels by themselves: asked first, because what others need beside
# is compiled anew, too.
KERNEL_TESTS = {
    "borecheck/contact/pose_kernel.py": ("tests/contact/test_pose_steps.py",),
    "borecheck/motion/bound_kernels.py": ("tests/motion/test_bounds.py",),
    "borecheck/motion/by_distance.py": ("tests/motion/test_by_distance_steps.py",),
    "borecheck/motion/halving.py": ("tests/motion/test_walk_steps.py",),
    "borecheck/motion/swept_boxes.py": ("tests/motion/test_walk_steps.py",),
}


def sources() -> dict[str, str]:
    """Modules that are mutated, by their path, with their text."""
    files = [f for room in ROOMS for f in (PROJECT / "borecheck" / room).glob("*.py")]
    return {str(f.relative_to(PROJECT)): f.read_text() for f in sorted(files)}


def sample(texts: dict[str, str], count: int, seed: int) -> list[Mutant]:
    """A seeded set of changes, none of them known to be equivalent.

    Each has its own place in the order, so that a module that is edited, or one more
    that is known to be equivalent, leaves the others of the set where they are.
    """
    everything, few = [], []
    for module, text in texts.items():
        found = [m for m in mutants(module, text) if m.change not in EQUIVALENT]
        found.sort(key=lambda m: m.rank(seed))
        if module in KERNELS:
            few += found[:KERNEL_MUTANTS]
        else:
            everything += found
    everything.sort(key=lambda m: m.rank(seed))
    chosen = few[:count]
    chosen += everything[: count - len(chosen)]
    return sorted(chosen, key=lambda m: (m.module, m.number))


def files_for(module: str) -> tuple[str, ...]:
    """Where a module's tests are: first its own files, then its room's, then `ALSO`."""
    room = Path(module).parent.name
    folder = sorted((PROJECT / "tests" / room).glob("test_*.py"))
    names = [str(f.relative_to(PROJECT)) for f in folder]
    also = [name for name in ALSO.get(module, ()) if (PROJECT / name).is_file()]
    return tuple(dict.fromkeys([*own_files(module), *names, *also]))


def own_files(module: str) -> tuple[str, ...]:
    """Files of tests that are named after a module, or look at its kernels."""
    file = Path(module)
    folder = PROJECT / "tests" / file.parent.name
    files = [folder / f"test_{file.stem}.py", *folder.glob(f"test_{file.stem}_*.py")]
    names = [str(f.relative_to(PROJECT)) for f in files if f.is_file()]
    return (*KERNEL_TESTS.get(module, ()), *names)


class State:
    """What is known from before, a line of JSON each.

    Attributes:
        tests: By file, with the lines they reach of modules that are as they were.
        changed: By file, modules that they reached and that are no longer the same.
        noticed: By change, the test that noticed it.
        before: The same of modules that are no longer what they were.
    """

    def __init__(self, file: Path | None, texts: dict[str, str]) -> None:
        self._file = file
        self._texts = texts
        self.tests: dict[str, list[KnownTest]] = {}
        self.changed: dict[str, set[str]] = {}
        self.noticed: dict[str, str] = {}
        self.before: dict[str, str] = {}
        for row in self._rows():
            if "tests" in row:
                self._take(row)
            elif row["of"] == self._digest(row["module"]):
                self.noticed[row["change"]] = row["by"]
            else:
                self.before[row["change"]] = row["by"]

    def keep_noticed(self, mutant: Mutant, by: str) -> None:
        """Remembers who noticed it."""
        self.noticed[mutant.change] = by
        row = {"module": mutant.module, "change": mutant.change, "by": by}
        self._write({**row, "of": self._digest(mutant.module)})

    def keep_tests(self, file: str, tests: list[KnownTest]) -> None:
        """Remembers what tests reach."""
        self.tests[file] = tests
        self.changed.pop(file, None)
        rows = [
            [t.name, t.seconds, {m: sorted(hit) for m, hit in t.lines.items()}]
            for t in tests
        ]
        reached = sorted({module for test in tests for module in test.lines})
        of = {name: self._digest(name) for name in (file, *reached)}
        self._write({"file": file, "tests": rows, "of": of})

    def forget(self, tests: Collection[str]) -> None:
        """What these noticed is not known."""
        self.noticed = {k: by for k, by in self.noticed.items() if by not in tests}

    def _take(self, row: dict[str, Any]) -> None:
        file, of = row["file"], row["of"]
        if of[file] != self._digest(file):
            return
        changed = {module for module in of if of[module] != self._digest(module)}
        self.changed[file] = changed
        self.tests[file] = [
            KnownTest(
                name,
                seconds,
                {m: frozenset(k) for m, k in hit.items() if m not in changed},
            )
            for name, seconds, hit in row["tests"]
        ]

    def _write(self, row: dict[str, Any]) -> None:
        if self._file is not None:
            with self._file.open("a") as stream:
                stream.write(json.dumps(row) + "\n")

    def _rows(self) -> Iterator[dict[str, Any]]:
        if self._file is not None and self._file.is_file():
            for line in self._file.read_text().splitlines():
                yield json.loads(line)

    def _digest(self, name: str) -> str:
        """Of a module, or of a file of tests."""
        text = self._texts.get(name)
        if text is None:
            file = PROJECT / name
            text = file.read_text() if file.is_file() else ""
        return sha256(text.encode()).hexdigest()[:16]


def recorded(waiting: Sequence[Mutant], state: State, texts: dict[str, str]) -> None:
    """Runs tests, unmutated, of which it is not known what they reach of a module."""
    modules = dict.fromkeys(mutant.module for mutant in waiting)
    files = dict.fromkeys(file for module in modules for file in files_for(module))
    for k, file in enumerate(files):
        changed = state.changed.get(file, set()) & modules.keys()
        if file not in state.tests or changed:
            _tell(f"unmutated {k + 1}/{len(files)}: {file}")
            state.keep_tests(file, judge.record([file], texts))


def confirm(changes: Collection[str], state: State) -> None:
    """Forgets what was noticed by tests that fail without any mutation, or are gone."""
    by = {state.noticed[change] for change in changes if change in state.noticed}
    names = sorted(name for name in by if "::" in name)
    if names:
        _tell(f"unmutated: {len(names)} tests that noticed something")
        state.forget(judge.failing(names))


def run(
    asked: Sequence[Mutant],
    state: State,
    texts: dict[str, str],
    jobs: int,
    tests_of: Callable[[Mutant], list[KnownTest]],
) -> None:
    """Asks the tests of every mutant; `jobs` at a time."""

    def cost(mutant: Mutant) -> float:
        return sum(test.seconds for test in tests_of(mutant))

    waiting = sorted(asked, key=lambda m: (m.module in KERNELS, cost(m)))
    running: list[tuple[Mutant, Child]] = []
    done = 0
    while waiting or running:
        while waiting and len(running) < jobs:
            mutant = waiting.pop(0)
            running.append((mutant, _asked(mutant, texts, tests_of(mutant))))
        for mutant, child in running:
            try:
                answer = child.wait(poll=0.1)
            except TimeoutError:
                continue
            running.remove((mutant, child))
            done += 1
            _settle(mutant, answer, state)
            _tell(f"{done} asked, {len(waiting)} to come")
            break


def _asked(mutant: Mutant, texts: dict[str, str], tests: list[KnownTest]) -> Child:
    return judge.judged(
        mutant.module,
        mutated(texts[mutant.module], mutant.number),
        tests,
        first=own_files(mutant.module),
        kernels=_compiled(mutant, texts),
    )


def who_noticed_before(mutant: Mutant, state: State) -> list[KnownTest]:
    """The test that noticed it when its module was another one, if it is there."""
    test = KnownTest(state.before.get(mutant.change, ""), judge.SLOWEST, {})
    is_there = "::" in test.name and (PROJECT / test.file).is_file()
    return [test] if is_there else []


def _tests_of(mutant: Mutant, state: State, texts: dict[str, str]) -> list[KnownTest]:
    tests = [t for file in files_for(mutant.module) for t in state.tests[file]]
    importing = not mutant.function.rpartition(".")[2].islower()
    importing = importing or _compiled(mutant, texts)  # no line of it is traced
    first = own_files(mutant.module)
    lines = mutant.lines
    return list(
        judge.reaching(tests, mutant.module, lines, importing=importing, first=first)
    )


def _compiled(mutant: Mutant, texts: dict[str, str]) -> bool:
    return "@kernel" in texts[mutant.module]


def _settle(mutant: Mutant, answer: dict[str, Any] | None, state: State) -> None:
    if answer is not None and not answer["noticed"]:
        return
    by = "no end, or a crash" if answer is None else answer["by"]
    state.keep_noticed(mutant, by)


def report(chosen: Sequence[Mutant], state: State, out: Any) -> float:
    """Prints share and survivors; the share noticed."""
    missed = [m for m in chosen if m.change not in state.noticed]
    print(f"{'module':<40} {'mutants':>8} {'noticed':>8}", file=out)
    for module in dict.fromkeys(m.module for m in chosen):
        of = sum(m.module == module for m in chosen)
        lost = sum(m.module == module for m in missed)
        print(f"{module:<40} {of:>8} {of - lost:>8}", file=out)
    share = 1.0 - len(missed) / max(len(chosen), 1)
    total = len(chosen)
    print(f"{'all':<40} {total:>8} {total - len(missed):>8}", file=out)
    print(f"noticed: {share:.1%} of {total} ({len(EQUIVALENT)} equivalent left out)")
    for m in missed:
        print(f"missed: {m.module}:{m.lines[0]} {m.before} -> {m.after}", file=out)
    return share


def _tell(text: str) -> None:
    if sys.stderr.isatty() or os.environ.get("BORECHECK_PROGRESS"):
        print(f"\r{time.strftime('%H:%M:%S')} {text:<70}", end="", file=sys.stderr)


def main(arguments: Sequence[str] | None = None) -> int:
    """The study; 0 if at least 95 % are noticed."""
    parser = argparse.ArgumentParser(prog="python -m studies.mutations")
    parser.add_argument("--count", type=int, default=240)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", type=Path, help="goes on from here, and writes here")
    parser.add_argument("--only", default="", help="modules whose path contains this")
    parser.add_argument("--list", action="store_true", help="the changes, and no more")
    parser.add_argument("--jobs", type=int, default=2, help="mutants at a time")
    asked = parser.parse_args(arguments)
    texts = sources()
    chosen = sample(texts, asked.count, asked.seed)
    chosen = [m for m in chosen if asked.only in m.module]
    if asked.list:
        for m in chosen:
            print(f"{m.module}:{m.lines[0]} {m.function}: {m.before} -> {m.after}")
        return 0
    os.nice(NICE)
    judge.prepare()
    state = State(asked.state, texts)
    confirm([m.change for m in chosen], state)
    waiting = [m for m in chosen if m.change not in state.noticed]
    again = [m for m in waiting if who_noticed_before(m, state)]
    run(again, state, texts, asked.jobs, lambda m: who_noticed_before(m, state))
    left = [m for m in waiting if m.change not in state.noticed]
    recorded(left, state, texts)
    run(left, state, texts, asked.jobs, lambda m: _tests_of(m, state, texts))
    confirm([m.change for m in waiting], state)
    return 0 if report(chosen, state, sys.stdout) >= 0.95 else 1


if __name__ == "__main__":
    raise SystemExit(main())
