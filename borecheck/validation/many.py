"""Many files: found in folders and by patterns, checked in parallel, resumable."""

import json
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fnmatch import fnmatch
from hashlib import sha256
from pathlib import Path
from typing import Any, TextIO

from borecheck import __version__
from borecheck.errors import InputError, UsageError
from borecheck.validation.as_json import to_record
from borecheck.validation.findings import Finding, Severity

SUFFIXES = (".urdf", ".urdf.xacro")
PARALLEL_FROM = 4  # fewer files are done before another process has started

Check = Callable[[str], list[Finding]]


def expand_files(words: Sequence[str]) -> list[str]:
    """The files that names, folders and patterns mean, each once, in order.

    Folders are searched for .urdf and .urdf.xacro without following links; "-" is the
    standard input.

    Raises:
        UsageError: A folder or pattern that holds no such file.
    """
    found: list[str] = []
    for word in words:
        if word == "-" or not (set(word) & set("*?[") or Path(word).is_dir()):
            found.append(word)
            continue
        matches = list(_in_folder(word) if Path(word).is_dir() else _by_pattern(word))
        if not matches:
            raise UsageError(
                f"{word}: holds no file that ends in {' or '.join(SUFFIXES)}"
            )
        found += matches
    return list(dict.fromkeys(found))


def _in_folder(word: str) -> Iterator[str]:
    for folder, below, files in os.walk(word):
        below.sort()
        for name in sorted(files):
            if name.endswith(SUFFIXES):
                yield str(Path(folder) / name)


def _by_pattern(word: str) -> Iterator[str]:
    if Path(word).is_file():
        yield word
        return
    import glob

    for name in sorted(glob.glob(word, recursive=True)):  # noqa: PTH207  keeps the prefix as typed
        if Path(name).is_file():
            yield name


def check_many(
    files: Sequence[str],
    check: Check,
    *,
    jobs: int,
    resume: Path | None,
    key: str,
    progress: TextIO | None,
) -> list[tuple[str, list[Finding]]]:
    """(file, findings) for each file, in order.

    Args:
        files: The files.
        check: A function that can be sent to another process.
        jobs: Processes at most.
        resume: Finished results are kept here and not computed again.
        key: What else a kept result depends on.
        progress: Where to tell how far it is.
    """
    done = _finished(resume, files, key) if resume is not None else {}
    left = [file for file in files if file not in done]
    for count, (file, findings) in enumerate(_checked(left, check, jobs), start=1):
        done[file] = findings
        if resume is not None:
            _keep(resume, file, key, findings)
        if progress is not None:
            progress.write(f"\r{count}/{len(left)} files")
            progress.flush()
    if progress is not None and left:
        progress.write("\n")
    return [(file, done[file]) for file in files]


def _checked(
    files: Sequence[str], check: Check, jobs: int
) -> Iterator[tuple[str, list[Finding]]]:
    if jobs < 2 or len(files) < PARALLEL_FROM:
        for file in files:
            yield file, check(file)
        return
    from concurrent.futures import ProcessPoolExecutor, as_completed

    with ProcessPoolExecutor(max_workers=min(jobs, len(files))) as pool:
        running = {pool.submit(check, file): file for file in files}
        try:
            for future in as_completed(running):
                yield running[future], future.result()
        except KeyboardInterrupt:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def key_of(given: Mapping[str, Any], config: Path | None) -> str:
    """What a kept result depends on beside the file."""
    text = f"{__version__} {sorted(given.items())} {config}"
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
    with path.open("a", encoding="utf-8") as stream:
        stream.write(line + "\n")


def _finished(path: Path, files: Sequence[str], key: str) -> dict[str, list[Finding]]:
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
                record["key"] == key
                and file in wanted
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
