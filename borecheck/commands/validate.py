"""`borecheck validate`: options, work, output, exit status."""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from borecheck.commands.options.validate import add_arguments, given_by, refuse_nonsense
from borecheck.commands.output import refuse_outputs
from borecheck.core.text import printable
from borecheck.core.whole_files import check_writable, write_whole
from borecheck.errors import UsageError
from borecheck.validation import baseline, many
from borecheck.validation.catalogue import all_checks
from borecheck.validation.config import (
    ValidationSettings,
    find_settings,
    options_with,
    read_settings,
    settings_in,
)
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.load import Loaded
from borecheck.validation.options import Options
from borecheck.validation.outputs.text import as_text, wants_colour
from borecheck.validation.run import check_file, findings_of, not_read, validate_text

__all__ = ["add_arguments", "run"]

CLEAN, FINDINGS, COULD_NOT_RUN = 0, 1, 2

Results = Sequence[tuple[str, Sequence[Finding]]]
Thresholds = Mapping[str, Severity | None]


def run(args: argparse.Namespace) -> int:
    """Runs `borecheck validate`; returns the exit status."""
    if args.list_checks:
        sys.stdout.write(_listed(args.profile or "collision") + "\n")
        return CLEAN
    if not args.files:
        raise UsageError("no file given; name URDF or xacro files, folders or -")
    refuse_nonsense(args)
    _refuse_outputs(args)
    skipped: list[str] = []
    files, given = many.expand_files(args.files, skipped), given_by(args)
    if skipped:
        _tell_skipped(skipped)
    _remembered.cache_clear()  # files may have changed since another run
    _named.cache_clear()
    settings = {file: settings_of(file, args.config) for file in files}
    options = {f: options_with(found, given) for f, found in settings.items()}
    if args.fix:
        from borecheck.validation.fix import fix_files

        return fix_files(options, write=args.write)
    known = _baselines(args, settings)
    check: many.Check = partial(check_one, given=given, config=args.config)
    if args.write_srdf is not None:
        from borecheck.validation.srdf_proposal import write_proposal

        file = files[0]
        loaded = write_proposal(files, options[file], args.write_srdf)
        check = partial(
            _check_loaded,
            loaded=loaded,
            options=options[file],
            settings=settings[file],
        )
    results = _results(args, files, given, check)
    if args.write_baseline:
        every = [finding for _, found in results for finding in found]
        baseline.write_baseline(args.write_baseline, every)
    results = [
        (f, baseline.new_findings(found, known[f]) if f in known else found)
        for f, found in results
    ]
    fail_on = {f: _fail_on(args, found) for f, found in settings.items()}
    _write(args, results, options[files[0]].profile, fail_on)
    return _status(results, fail_on)


def _refuse_outputs(args: argparse.Namespace) -> None:
    """Refuses outputs that cannot be written or would be lost, before the work."""
    written = ("out", "report", "resume", "write_baseline", "write_srdf")
    if args.resume is not None:
        # a run is resumed from what was kept, so that must be a file
        check_writable(args.resume, stream=False)
    refuse_outputs(args, *written, renewed=("write_baseline",))


def _tell_skipped(folders: Sequence[str]) -> None:
    """How many folders were not looked into; the first says which kind."""
    count = f"{len(folders)} folder{'s' if len(folders) > 1 else ''}"
    sys.stderr.write(
        f"borecheck: {count} not looked into, hidden or of installed packages, "
        f"such as {printable(folders[0])}; name one to validate it\n"
    )


def _baselines(
    args: argparse.Namespace, settings: Mapping[str, ValidationSettings]
) -> dict[str, Counter[str]]:
    """What is known of each file that has a baseline: the named one, or its own.

    Where a new baseline is written, only a named one counts.
    """
    read: dict[str, Counter[str]] = {}
    known = {}
    for file, found in settings.items():
        own = None if args.write_baseline else found.values.get("baseline")
        path = args.baseline or own
        if path is not None:
            if str(path) not in read:
                read[str(path)] = baseline.read_baseline(Path(path))
            known[file] = read[str(path)]
    return known


def _results(
    args: argparse.Namespace,
    files: list[str],
    given: dict[str, Any],
    check: many.Check,
) -> list[tuple[str, list[Finding]]]:
    show = len(files) > 20 or (len(files) > 3 and sys.stderr.isatty())
    return many.check_many(
        files,
        check,
        jobs=args.jobs or os.cpu_count() or 1,
        resume=args.resume,
        key=partial(_key, given=given, config=args.config),
        progress=sys.stderr if show else None,
    )


def settings_of(file: str, config: Path | None) -> ValidationSettings:
    """The named settings, or those nearest to a file."""
    folder = Path.cwd() if file == "-" else Path(file).absolute().parent
    if config is not None:
        return _named(config)
    return find_settings(folder, _remembered)


@cache
def _remembered(folder: Path) -> ValidationSettings:
    return settings_in(folder)


@lru_cache(maxsize=1)
def _named(config: Path) -> ValidationSettings:
    return replace(read_settings(config), is_named=True)


def _key(file: str, given: Mapping[str, Any], config: Path | None) -> str:
    """What a kept result depends on beside the file: everything that was asked."""
    settings = settings_of(file, config)
    return many.key_of(options_with(settings, given), settings.per_file_ignore)


def check_one(
    file: str, given: Mapping[str, Any], config: Path | None
) -> list[Finding]:
    """The findings of one file; "-" is the standard input."""
    settings = settings_of(file, config)
    options = options_with(settings, given)
    if file == "-":
        found = validate_text(sys.stdin.buffer.read(), "<stdin>", options)
    elif os.path.isdir(file):  # noqa: PTH112  False where it may not be asked
        problem = many.why_unreadable(Path(file)) or "is a directory, not a URDF file"
        found = [not_read(Path(file), problem, options)]
    else:
        found = check_file(Path(file), options)
    return many.without_ignored(found, file, settings.per_file_ignore.items())


def _check_loaded(
    file: str, loaded: Loaded, options: Options, settings: ValidationSettings
) -> list[Finding]:
    """The findings of a file that was loaded before, with what is remembered in it."""
    found = findings_of(loaded, options)
    return many.without_ignored(found, file, settings.per_file_ignore.items())


def _write(
    args: argparse.Namespace, results: Results, profile: str, fail_on: Thresholds
) -> None:
    to_screen = args.out is None
    colour = to_screen and wants_colour(sys.stdout)
    text = render(args.format or "text", results, profile, args, colour, fail_on)
    if to_screen:
        sys.stdout.write(text)
    else:
        write_whole(args.out, text)
    if args.report is not None:
        page = render("html", results, profile, args, False, fail_on)
        write_whole(args.report, page)


def render(
    form: str,
    results: Results,
    profile: str,
    args: argparse.Namespace,
    colour: bool,
    fail_on: Thresholds,
) -> str:
    """The results in one of FORMATS."""
    if form == "text":
        full = not args.brief
        return as_text(results, colour=colour, explain=full, source=full)
    if form == "sarif":
        from borecheck.validation.outputs.sarif import as_sarif

        return as_sarif(results, profile)
    if form == "junit":
        from borecheck.validation.outputs.junit import as_junit

        return as_junit(results, fail_on)
    if form == "markdown":
        from borecheck.validation.outputs.markdown import as_markdown

        return as_markdown(results)
    from borecheck.validation.outputs.json import as_json, to_document

    extra = {"argv": ["borecheck", *getattr(args, "argv", [])]}
    if form == "json":
        return as_json(results, profile, extra)
    from importlib import import_module

    excerpts = import_module("borecheck.report.excerpts")
    document = excerpts.with_excerpts(to_document(results, profile, extra))
    return str(import_module("borecheck.report.page").page(document))


def _fail_on(args: argparse.Namespace, settings: ValidationSettings) -> Severity | None:
    word = args.fail_on or settings.values.get("fail-on", "error")
    return None if word == "never" else Severity(word)


def _status(results: Results, fail_on: Thresholds) -> int:
    if all(any(f.code == "D101" for f in findings) for _, findings in results):
        return COULD_NOT_RUN
    for file, findings in results:
        least = fail_on[file]
        if least is not None and any(f.severity.rank >= least.rank for f in findings):
            return FINDINGS
    return CLEAN


def _listed(profile: str) -> str:
    lines = [f"{'code':5} {'tier':10} {profile:10} {'name':28} what is wrong"]
    for check in all_checks():
        level = str(check.levels[profile])
        lines.append(
            f"{check.code:5} {check.tier:10} {level:10} {check.name:28} {check.title}"
        )
    return "\n".join(lines)
