"""Whether the tests of a module notice a change of it: each mutant in its own process.

One process imports what lies below the mutated rooms, and forks for every mutant. The
child finds the mutant when it imports the module (no file is changed) and runs the
tests that reach the changed statement, quickest first, until one fails. Compiled
kernels of modules that did not change are loaded, not compiled.
"""

import ast
import json
import os
import resource
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

PROJECT = Path(__file__).parents[2]
ROOMS = ("contact", "motion", "verify", "plans")
# Imported before forking: what all of the rooms stand on.
BELOW = (
    *("numpy", "pytest", "hypothesis", "coal", "pinocchio"),
    *(
        "borecheck.geometry.surfaces",
        "borecheck.robots.robot",
        "borecheck.robots.scene",
    ),
    *("borecheck.geometry.tree.many_links", "borecheck.geometry.mesh_files.reading"),
)
# A test that takes longer is a study; what only it would notice counts as missed, [s].
SLOWEST = 8.0
# Of all that reach a change the quickest are run, until they take so long, [s].
BUDGET = 30.0
# Its own tests that take less come before all others, [s].
QUICK = 1.0
# Processor time for a mutant beside that of its tests, [s]; then it hangs: noticed.
GRACE = 20.0
COMPILING = 900.0
# Calls of a function within a test whose lines are looked at: tracing takes time.
ENOUGH = 200

# What pytest ends with where none of the tests asked for is there.
NONE_FOUND = 5
BROKEN = 3  # what a child ends with


@dataclass(frozen=True)
class KnownTest:
    """One test, unmutated.

    Attributes:
        name: As pytest names it.
        seconds: Processor time.
        lines: Lines reached, by module.
    """

    name: str
    seconds: float
    lines: Mapping[str, frozenset[int]]

    @property
    def file(self) -> str:
        """Where it stands."""
        return self.name.partition("::")[0]


class Recorder:
    """A pytest plugin: time of each test, and lines of the modules that it reaches.

    What the set-up of a test reaches is taken as reached by every test of its file:
    fixtures are shared.
    """

    def __init__(self, modules: Iterable[str] = ()) -> None:
        self.tests: list[KnownTest] = []
        self.failed = False
        self._modules = {str(PROJECT / module): module for module in modules}
        self._shared: dict[str, set[int]] = {}
        self._hit: dict[str, set[int]] = {}
        self._begin = 0.0
        self._calls: Counter[CodeType] = Counter()

    def pytest_runtest_setup(self) -> None:
        """Before the fixtures."""
        self._begin = time.process_time()
        self._trace()

    def pytest_runtest_call(self) -> None:
        """Before the test itself."""
        self._stop()
        for module, lines in self._hit.items():
            self._shared.setdefault(module, set()).update(lines)
        self._trace()

    def pytest_runtest_logreport(self, report: Any) -> None:
        """After each phase."""
        self._stop()
        self.failed |= report.failed
        if report.when == "call":
            hit = {module: frozenset(lines) for module, lines in self._hit.items()}
            spent = time.process_time() - self._begin
            self.tests.append(KnownTest(report.nodeid, spent, hit))

    def found(self) -> list[KnownTest]:
        """All tests, with what their set-up shares."""
        return [
            KnownTest(
                test.name,
                test.seconds,
                {
                    module: test.lines.get(module, frozenset())
                    | self._shared.get(module, frozenset())
                    for module in {*test.lines, *self._shared}
                },
            )
            for test in self.tests
        ]

    def _trace(self) -> None:
        self._hit, self._calls = {}, Counter()
        if self._modules:
            sys.settrace(self._entered)

    def _stop(self) -> None:
        sys.settrace(None)

    def _entered(self, frame: FrameType, _event: str, _arg: object) -> Any:
        module = self._modules.get(frame.f_code.co_filename)
        self._calls[frame.f_code] += 1
        if module is None or self._calls[frame.f_code] > ENOUGH:
            return None
        lines = self._hit.setdefault(module, set())
        lines.add(frame.f_lineno)

        def reached(inner: FrameType, _event: str, _arg: object) -> Any:
            lines.add(inner.f_lineno)
            return reached

        return reached


class Chosen:
    """A pytest plugin: the chosen tests alone, in their order; which one fails."""

    def __init__(self, names: Sequence[str]) -> None:
        self._order = {name: k for k, name in enumerate(names)}
        self.noticed_by = ""

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Drops the others."""
        items[:] = [item for item in items if item.nodeid in self._order]
        items.sort(key=lambda item: self._order[item.nodeid])

    def pytest_runtest_logreport(self, report: Any) -> None:
        """Remembers the failure."""
        if report.failed:
            self.noticed_by = report.nodeid


class Passed(Chosen):
    """A pytest plugin: which of the chosen tests pass."""

    def __init__(self, names: Sequence[str]) -> None:
        super().__init__(names)
        self._failed: set[str] = set()
        self._run: set[str] = set()

    def pytest_runtest_logreport(self, report: Any) -> None:
        """After each phase."""
        self._run.add(report.nodeid)
        if not report.passed:
            self._failed.add(report.nodeid)

    def names(self) -> set[str]:
        """Of those that ran and failed in none of their phases."""
        return self._run - self._failed


class Mutated(MetaPathFinder, SourceFileLoader):  # type: ignore[misc]
    """Finds one module, changed."""

    def __init__(self, module: str, tree: ast.Module) -> None:
        name = module.removesuffix(".py").replace("/", ".")
        SourceFileLoader.__init__(self, name, str(PROJECT / module))
        self._tree = tree

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: Any = None
    ) -> ModuleSpec | None:
        """For the module alone."""
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and fullname == self.name:
            spec.loader = self
            return spec
        return None

    def get_code(self, fullname: str) -> CodeType:
        """Of the mutant."""
        code: CodeType = compile(self._tree, self.path, "exec")
        return code


def prepare() -> None:
    """Imports what the rooms stand on; of the rooms nothing."""
    os.chdir(PROJECT)
    for name in BELOW:
        import_module(name)
    for room in ROOMS:
        assert f"borecheck.{room}" not in sys.modules, f"{room} is mutated too late"


def record(files: Sequence[str], modules: Iterable[str]) -> list[KnownTest]:
    """All tests of the files, unmutated; run in a child.

    Raises:
        RuntimeError: One fails as it is.
    """

    def run() -> dict[str, Any]:
        recorder, clock = Recorder(modules), Recorder()
        _pytest(files, recorder)
        _pytest(files, clock)  # once more, because tracing takes time
        seconds = {test.name: test.seconds for test in clock.tests}
        found = [
            [t.name, seconds[t.name], {m: sorted(hit) for m, hit in t.lines.items()}]
            for t in recorder.found()
        ]
        return {"failed": recorder.failed or clock.failed, "tests": found}

    answer = Child(run, 3600.0).wait()
    if answer is None or answer["failed"]:
        raise RuntimeError(f"a test fails without any mutation: {', '.join(files)}")
    return [
        KnownTest(name, seconds, {m: frozenset(lines) for m, lines in hit.items()})
        for name, seconds, hit in answer["tests"]
    ]


def failing(names: Sequence[str]) -> set[str]:
    """Which of some tests do not pass as everything is; run in a child."""

    def run() -> dict[str, Any]:
        passed = Passed(names)
        files = dict.fromkeys(name.partition("::")[0] for name in names)
        there = [file for file in files if (PROJECT / file).is_file()]
        if there:  # else all of them would be run
            _pytest(there, passed)
        return {"passed": sorted(passed.names())}

    answer = Child(run, 3600.0).wait()
    return set(names) - set(answer["passed"] if answer else ())


def judged(
    module: str,
    tree: ast.Module,
    tests: Sequence[KnownTest],
    *,
    first: Sequence[str] = (),
    kernels: bool,
) -> "Child":
    """A child that runs the tests with the mutant; tells the one that fails.

    Args:
        module: Path of the module.
        tree: What is put in its place.
        tests: In their order.
        first: Files whose tests are run before the others' files are read.
        kernels: Whether it holds compiled kernels.
    """

    def run() -> dict[str, Any]:
        sys.meta_path.insert(0, Mutated(module, tree))
        if kernels:
            _compile_anew(PROJECT / module)
        own = [test for test in tests if test.file in first]
        others = [test for test in tests if test.file not in first]
        for some in filter(None, (own, others)):  # else all of them would be run
            chosen = Chosen([test.name for test in some])
            status = _pytest(list(dict.fromkeys(t.file for t in some)), chosen, "-x")
            if status not in (0, NONE_FOUND):
                by = chosen.noticed_by or f"pytest {status}"
                return {"noticed": True, "by": by}
        return {"noticed": False, "by": ""}

    seconds = GRACE + 3.0 * sum(test.seconds for test in tests)
    return Child(run, seconds + (COMPILING if kernels else 0.0))


class Child:
    """A forked process that computes a record."""

    def __init__(self, run: Callable[[], dict[str, Any]], seconds: float) -> None:
        self._reading, writing = os.pipe()
        self._pid = os.fork()
        if self._pid == 0:
            os.close(self._reading)
            _alone(run, writing, seconds)
        os.close(writing)
        self._late = time.monotonic() + 30.0 * seconds  # waits for ever, asleep

    def wait(self, poll: float | None = None) -> dict[str, Any] | None:
        """What it computed; None if it was ended. With `poll`: asks once.

        Raises:
            TimeoutError: With `poll`: it is not finished.
        """
        if poll is not None and not self._ended():
            time.sleep(poll)
            raise TimeoutError
        with os.fdopen(self._reading) as stream:
            text = stream.read()
        if poll is None:
            os.waitpid(self._pid, 0)
        return json.loads(text) if text else None

    def _ended(self) -> bool:
        if os.waitpid(self._pid, os.WNOHANG)[0]:
            return True
        if time.monotonic() > self._late:
            os.kill(self._pid, signal.SIGKILL)
        return False


def _alone(run: Callable[[], dict[str, Any]], writing: int, seconds: float) -> None:
    """What a child does; it never returns."""
    status = BROKEN
    try:
        limit = int(seconds) + 1
        resource.setrlimit(resource.RLIMIT_CPU, (limit, limit))
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        answer = json.dumps(run())
        with os.fdopen(writing, "w") as pipe:
            pipe.write(answer)
        status = 0
    except BaseException:
        traceback.print_exc()
        raise
    finally:
        os._exit(status)


def _pytest(files: Sequence[str], plugin: object, *more: str) -> int:
    import pytest

    options = ["-q", "-n0", "-p", "no:cacheprovider", "--no-header", *more]
    # hypothesis is here before pytest could rewrite its assertions
    options += ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    return int(pytest.main([*options, *files], plugins=[plugin]))


def _compile_anew(file: Path) -> None:
    """Kernels of the module, and of all that use it, live as long as this process."""
    from borecheck.core.cache import process_folder
    from borecheck.geometry.kernels import cache

    kept = cache.KernelLocator.get_cache_path

    def path(self: Any) -> str:
        if file in cache.sources(self._file):
            return str(process_folder())
        return str(kept(self))

    cache.KernelLocator.get_cache_path = path  # type: ignore[method-assign]


def reaching(
    tests: Iterable[KnownTest],
    module: str,
    lines: tuple[int, int],
    *,
    importing: bool,
    first: Sequence[str] = (),
) -> Iterator[KnownTest]:
    """The tests that reach any of the lines, quickest first.

    Args:
        tests: Of the module.
        module: Its path.
        lines: First and last.
        importing: Whether the lines are run on import: then every test does.
        first: Files whose quick tests come before all others.
    """
    wanted = set(range(lines[0], lines[1] + 1))
    spent = 0.0

    def place(test: KnownTest) -> tuple[bool, float]:
        return test.file not in first or test.seconds > QUICK, test.seconds

    for test in sorted(tests, key=place):
        if test.seconds > SLOWEST:
            continue
        if importing or wanted & test.lines.get(module, frozenset()):
            spent += test.seconds
            if spent > BUDGET:
                return
            yield test
