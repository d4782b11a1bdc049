"""Many files: found in folders and by patterns, checked in parallel, resumable."""

import json
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from fnmatch import fnmatch
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from borecheck.core.version import __version__
from borecheck.core.whole_files import telling
from borecheck.errors import BorecheckError, InputError, UsageError
from borecheck.validation.file_progress import FileProgress
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.options import Options
from borecheck.validation.outputs.json import to_record

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

SUFFIXES = (".urdf", ".urdf.xacro")
PARALLEL_FROM = 4  # fewer files are done before another process has started
NAMED = 10  # so many unfinished files are listed
# Folders that hold other people's files: installed packages, histories, caches.
_NOT_OURS = ("venv", "env", "node_modules", "site-packages", "__pycache__")

Check = Callable[[str], list[Finding]]


def expand_files(words: Sequence[str], skipped: list[str] | None = None) -> list[str]:
    """The files that names, folders and patterns mean, each once, in order.

    Folders are searched for .urdf and .urdf.xacro without following links; "-" is the
    standard input. A folder that cannot be read stands for itself, to be reported.
    Hidden folders below, and those of installed packages, are not looked into.

    Args:
        words: What was typed.
        skipped: The folders that were not looked into are added.

    Raises:
        UsageError: A folder or pattern that holds no such file.
    """
    found: list[str] = []
    left_out: list[str] = [] if skipped is None else skipped
    for word in words:
        if word != "-" and _is_folder(word):
            found += _in_folder(word, left_out)
        elif word != "-" and set(word) & set("*?["):
            found += _by_pattern(word)
        else:
            found.append(word)
    return list(dict.fromkeys(found))


def _is_folder(word: str) -> bool:
    return os.path.isdir(word)  # noqa: PTH112  False, no error, if it may not be asked


def _in_folder(word: str, skipped: list[str]) -> list[str]:
    found: list[str] = []
    before = len(skipped)

    def note(error: OSError) -> None:
        found.append(str(error.filename))

    for folder, below, files in os.walk(word, onerror=note):
        skipped += [str(Path(folder) / b) for b in sorted(below) if _is_not_ours(b)]
        below[:] = sorted(name for name in below if not _is_not_ours(name))
        for name in sorted(files):
            if name.endswith(SUFFIXES):
                found.append(str(Path(folder) / name))
    if not found:
        count = len(skipped) - before
        but = f" ({count} hidden or package folders not looked into)" if count else ""
        suffixes = " or ".join(SUFFIXES)
        raise UsageError(f"{word}: holds no file that ends in {suffixes}{but}")
    return found


def _is_not_ours(name: str) -> bool:
    return name.startswith(".") or name in _NOT_OURS


def _by_pattern(word: str) -> list[str]:
    if Path(word).is_file():
        return [word]
    import glob

    names = sorted(glob.glob(word, recursive=True))  # noqa: PTH207  keeps the prefix as typed
    found = [name for name in names if Path(name).is_file()]
    if found:
        return found
    folder = Path(word)
    while set(str(folder)) & set("*?["):
        folder = folder.parent
    if folder.is_dir() and why_unreadable(folder) is not None:
        return [str(folder)]
    raise UsageError(f"{word}: matches no file")


def why_unreadable(folder: Path) -> str | None:
    """What the system says against looking into a folder; None if it can be read."""
    try:
        os.scandir(folder).close()
    except OSError as error:
        return f"cannot be read: {error.strerror or error}"
    return None


def check_many(
    files: Sequence[str],
    check: Check,
    *,
    jobs: int,
    resume: Path | None,
    key: Callable[[str], str],
    progress: TextIO | None,
) -> list[tuple[str, list[Finding]]]:
    """(file, findings) for each file, in order.

    Args:
        files: The files.
        check: A function that can be sent to another process.
        jobs: Processes at most.
        resume: Finished results are kept here and not computed again.
        key: What else a kept result of a file depends on.
        progress: Where to tell how far it is.
    """
    done = _finished(resume, files, key) if resume is not None else {}
    left = [file for file in files if file not in done]
    tell = None if progress is None else FileProgress(progress, len(left))
    with closing(_checked(left, check, jobs)) as checked:
        for count, (file, findings) in enumerate(checked, start=1):
            done[file] = findings
            if resume is not None:
                _keep(resume, file, key(file), findings)
            if tell is not None:
                tell(count)
    return [(file, done[file]) for file in files]


def _checked(
    files: Sequence[str], check: Check, jobs: int
) -> Generator[tuple[str, list[Finding]], None, None]:
    if jobs < 2 or len(files) < PARALLEL_FROM:
        for file in files:
            yield file, check(file)
        return
    from concurrent.futures import as_completed
    from concurrent.futures.process import BrokenProcessPool

    unfinished = []
    with _workers(min(jobs, len(files))) as pool:
        running = {pool.submit(_told_plainly, check, file): file for file in files}
        for future in as_completed(running):
            try:
                found = future.result()
            except BrokenProcessPool:
                unfinished.append(running[future])
                continue
            yield running[future], found
    if unfinished:
        raise BorecheckError(_died(sorted(unfinished, key=files.index)))


@contextmanager
def _workers(count: int) -> Iterator["ProcessPoolExecutor"]:
    """Processes that end at once when we do, by Ctrl-C, SIGTERM or an error."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    others = set(multiprocessing.active_children())
    with _terminable():
        pool = ProcessPoolExecutor(count, initializer=_deaf_to_interruptions)
        try:
            yield pool
            pool.shutdown()
        except BaseException:
            with _undisturbed():
                for worker in set(multiprocessing.active_children()) - others:
                    worker.terminate()
                pool.shutdown(cancel_futures=True)
            raise


@contextmanager
def _terminable() -> Iterator[None]:
    """SIGTERM as an exception meanwhile, so that what is to be ended is ended."""

    def end(number: int, _: object) -> None:
        sys.stderr.write("borecheck: terminated\n")
        raise SystemExit(128 + number)

    with _handling({signal.SIGTERM: end}):
        yield


@contextmanager
def _undisturbed() -> Iterator[None]:
    """A second Ctrl-C must not keep the first from ending the workers."""
    with _handling({signal.SIGTERM: signal.SIG_IGN, signal.SIGINT: signal.SIG_IGN}):
        yield


@contextmanager
def _handling(handlers: Mapping[signal.Signals, Any]) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    before = {number: signal.signal(number, h) for number, h in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _deaf_to_interruptions() -> None:
    """In a worker: Ctrl-C is the parent's business, SIGTERM ends it at once.

    A function instead of SIG_IGN, which the processes it starts would inherit.
    """
    signal.signal(signal.SIGINT, lambda *_: None)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _told_plainly(check: Check, file: str) -> list[Finding]:
    """A check in a worker; our errors need two arguments, which do not travel."""
    try:
        return check(file)
    except BorecheckError as error:
        raise BorecheckError(str(error)) from None


def _died(files: Sequence[str]) -> str:
    more = f" and {len(files) - NAMED} more" if len(files) > NAMED else ""
    return (
        "a process died (out of memory?), give fewer --jobs; not finished: "
        f"{', '.join(files[:NAMED])}{more}"
    )


def key_of(options: Options, rules: Mapping[str, tuple[str, ...]]) -> str:
    """What a kept result depends on beside the file: everything that was asked."""
    text = f"{__version__} {options} {rules}"
    return sha256(text.encode()).hexdigest()[:16]


def without_ignored(
    findings: Iterable[Finding], file: str, rules: Iterable[tuple[str, tuple[str, ...]]]
) -> list[Finding]:
    """The findings that no per-file rule leaves out."""
    codes = tuple(
        code
        for pattern, ignored in rules
        if fnmatch(file, pattern) or fnmatch(Path(file).name, pattern)
        for code in ignored
    )
    return [f for f in findings if not (codes and f.code.startswith(codes))]


def _hash(file: str) -> str:
    try:
        return sha256(Path(file).read_bytes()).hexdigest()
    except OSError:
        return "unreadable"


def _keep(path: Path, file: str, key: str, findings: list[Finding]) -> None:
    record = {"file": file, "sha256": _hash(file), "key": key}
    line = json.dumps({**record, "findings": [to_record(f) for f in findings]})
    with telling(path), path.open("a", encoding="utf-8") as stream:
        stream.write(line + "\n")


def _finished(
    path: Path, files: Sequence[str], key: Callable[[str], str]
) -> dict[str, list[Finding]]:
    if not path.exists():
        return {}
    wanted, done = set(files), {}
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(path, f"cannot be read: {error}") from error
    for line in lines:
        try:
            record = json.loads(line)
            file = record["file"]
            if (
                file in wanted
                and record["key"] == key(file)
                and _hash(file) == record["sha256"]
            ):
                done[file] = [from_record(entry) for entry in record["findings"]]
        except (ValueError, KeyError, TypeError):
            sys.stderr.write(f"{path}: a line cut short is done again\n")
    return done


def from_record(record: dict[str, object]) -> Finding:
    """A finding out of plain data, the way back of `to_record`."""
    values = dict(record)
    values["severity"] = Severity(str(values["severity"]))
    values["libraries"] = tuple(values["libraries"])  # type: ignore[arg-type]
    return Finding(**values)  # type: ignore[arg-type]
