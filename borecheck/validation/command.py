"""`borecheck validate`: options, work, output, exit status."""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any

from borecheck.errors import UnknownNameError, UsageError
from borecheck.validation import baseline, many
from borecheck.validation.as_text import as_text, wants_colour
from borecheck.validation.codes import codes_of
from borecheck.validation.config import (
    FAIL_ON,
    Settings,
    find_settings,
    options_with,
    read_settings,
    settings_in,
)
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.options import PROFILES, check_count
from borecheck.validation.registry import all_checks
from borecheck.validation.run import check_file, not_read, validate_text
from borecheck.validation.writing import check_writable, write_text

CLEAN, FINDINGS, COULD_NOT_RUN = 0, 1, 2
FORMATS = ("text", "json", "sarif", "junit", "markdown", "html")

Results = Sequence[tuple[str, Sequence[Finding]]]
Thresholds = Mapping[str, Severity | None]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Adds the options of `borecheck validate`."""
    add = parser.add_argument
    add("files", nargs="*", metavar="FILE", help="URDF or xacro, folder, pattern, or -")
    add("--arg", action="append", metavar="NAME=VALUE", help="xacro argument")
    add("--package-path", action="append", metavar="DIR", help="root for package://")
    add("--profile", choices=PROFILES, help="what the robot is for (collision)")
    add("--select", action="append", metavar="CODES", help="report only these")
    add("--ignore", action="append", metavar="CODES", help="leave these out")
    add("--fail-on", choices=FAIL_ON, help="exit 1 from this severity on (error)")
    add("--format", choices=FORMATS, help="of the result (text)")
    add("--out", metavar="FILE", type=Path, help="write the result here")
    add("--report", metavar="FILE", type=Path, help="write an HTML page as well")
    add("--brief", action="store_true", help="one line per finding")
    _add_depth(parser)
    _add_expectations(parser)
    _add_work(parser)


def _add_depth(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("how deep").add_argument
    add("--no-meshes", action="store_true", help="read no mesh file, run no library")
    add(
        "--no-run", action="store_true", help="do not move the robot in other libraries"
    )
    add("--load-meshes", action="store_true", help="in Pinocchio and Coal, too")
    add("--containment", action="store_true", help="an open collision mesh is an error")
    add("--self-intersection", action="store_true", help="search meshes for crossings")
    add("--self-contact", type=int, metavar="N", help="sample N configurations")
    add("--write-srdf", type=Path, metavar="FILE", help="what --self-contact found")
    add("--samples", type=int, metavar="N", help="configurations compared (20)")
    add("--seed", type=int, metavar="K", help="of random configurations (0)")


def _add_expectations(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("what must be there").add_argument
    add("--frame", action="append", metavar="NAME", help="a link that must exist")
    add("--link", action="append", metavar="NAME", help="must have collision geometry")
    add("--srdf", type=Path, metavar="FILE", help="check the names in this SRDF")
    add("--reference", type=Path, metavar="FILE", help="must move as this file does")
    add("--closed-form", metavar="MODULE:FUNCTION", help="must move as it says")
    add("--config", type=Path, metavar="FILE", help="instead of the nearest one")
    add("--baseline", type=Path, metavar="FILE", help="report only what is new")
    add("--write-baseline", type=Path, metavar="FILE", help="keep what is found")


def _add_work(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("work").add_argument
    add("--jobs", type=int, metavar="N", help="processes (one per core)")
    add("--resume", type=Path, metavar="FILE", help="keep finished results here")
    add("--fix", action="store_true", help="show what needs no guessing, as a diff")
    add("--write", action="store_true", help="with --fix: change the files")
    add("--list-checks", action="store_true", help="list all checks and stop")


def run(args: argparse.Namespace) -> int:
    """Runs `borecheck validate`; returns the exit status."""
    if args.list_checks:
        sys.stdout.write(_listed(args.profile or "collision") + "\n")
        return CLEAN
    if not args.files:
        raise UsageError("no file given; name URDF or xacro files, folders or -")
    _refuse_nonsense(args)
    files, given = many.expand_files(args.files), _given(args)
    _remembered.cache_clear()  # files may have changed since another run
    _named.cache_clear()
    settings = {file: settings_of(file, args.config) for file in files}
    options = {f: options_with(found, given) for f, found in settings.items()}
    if args.fix:
        from borecheck.validation.fix import fix_files

        return fix_files(options, write=args.write)
    known = _baselines(args, settings)
    for name in ("out", "report", "resume", "write_baseline", "write_srdf"):
        if getattr(args, name) is not None:
            check_writable(getattr(args, name))
    if args.write_srdf is not None:
        from borecheck.validation.srdf_proposal import write_proposal

        write_proposal(files, options[files[0]], args.write_srdf)
    results = _results(args, files, given)
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


def _refuse_nonsense(args: argparse.Namespace) -> None:
    """Options that would have no effect, or not the one that was meant."""
    if args.write and not args.fix:
        raise UsageError("--write goes with --fix")
    for name in ("format", "out", "report", "resume", "write_baseline", "write_srdf"):
        if args.fix and getattr(args, name) is not None:
            option = f"--{name.replace('_', '-')}"
            raise UsageError(f"--fix shows a diff: {option} does not go with it")
    for folder in args.package_path or ():
        if not Path(folder).is_dir():
            raise UsageError(f"--package-path {folder!r} is no folder")


def _baselines(
    args: argparse.Namespace, settings: Mapping[str, Settings]
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


def _given(args: argparse.Namespace) -> dict[str, Any]:
    """What the command line says, as fields of `Options`; None where it is silent."""
    for name in ("samples", "seed", "self_contact", "jobs"):
        if getattr(args, name) is not None:
            check_count(f"--{name.replace('_', '-')}", getattr(args, name))
    return {
        "profile": args.profile,
        "arguments": _pairs(args.arg or []),
        "package_paths": args.package_path,
        "select": _codes("--select", args.select),
        "ignore": _codes("--ignore", args.ignore),
        "meshes": False if args.no_meshes else None,
        "run": False if args.no_run or args.no_meshes else None,
        "load_meshes": args.load_meshes or None,
        "containment": args.containment or None,
        "self_intersection": args.self_intersection or None,
        "self_contact": args.self_contact,
        "samples": args.samples,
        "seed": args.seed,
        "frames": args.frame,
        "links": args.link,
        "srdf": args.srdf,
        "reference": args.reference,
        "closed_form": _closed_form(args.closed_form),
    }


def _closed_form(text: str | None) -> Any:
    if text is None:
        return None
    from borecheck.validation.references import ClosedForm

    return ClosedForm(text)


def _pairs(words: Sequence[str]) -> dict[str, str]:
    pairs = {}
    for word in words:
        name, mark, value = word.partition("=")
        if not mark or not name:
            raise UsageError(f"--arg {word!r} is not NAME=VALUE")
        pairs[name] = value
    return pairs


def _codes(option: str, words: Sequence[str] | None) -> tuple[str, ...] | None:
    if words is None:
        return None
    try:
        return codes_of(words)
    except UnknownNameError as error:
        raise UsageError(
            f"{option}: {error.name!r} is no check; see borecheck validate "
            "--list-checks"
        ) from error


def _results(
    args: argparse.Namespace, files: list[str], given: dict[str, Any]
) -> list[tuple[str, list[Finding]]]:
    show = len(files) > 20 or (len(files) > 3 and sys.stderr.isatty())
    return many.check_many(
        files,
        partial(check_one, given=given, config=args.config),
        jobs=args.jobs or os.cpu_count() or 1,
        resume=args.resume,
        key=partial(_key, given=given, config=args.config),
        progress=sys.stderr if show else None,
    )


def settings_of(file: str, config: Path | None) -> Settings:
    """The named settings, or those nearest to a file."""
    folder = Path.cwd() if file == "-" else Path(file).absolute().parent
    if config is not None:
        return _named(config)
    return find_settings(folder, _remembered)


@cache
def _remembered(folder: Path) -> Settings:
    return settings_in(folder)


@lru_cache(maxsize=1)
def _named(config: Path) -> Settings:
    return read_settings(config)


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


def _write(
    args: argparse.Namespace, results: Results, profile: str, fail_on: Thresholds
) -> None:
    to_screen = args.out is None
    colour = to_screen and wants_colour(sys.stdout)
    text = render(args.format or "text", results, profile, args, colour, fail_on)
    if to_screen:
        sys.stdout.write(text)
    else:
        write_text(args.out, text)
    if args.report is not None:
        page = render("html", results, profile, args, False, fail_on)
        write_text(args.report, page)


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
        from borecheck.validation.as_sarif import as_sarif

        return as_sarif(results, profile)
    if form == "junit":
        from borecheck.validation.as_junit import as_junit

        return as_junit(results, fail_on)
    if form == "markdown":
        from borecheck.validation.as_markdown import as_markdown

        return as_markdown(results)
    from borecheck.validation.as_json import as_json, to_document

    extra = {"argv": ["borecheck", *getattr(args, "argv", [])]}
    if form == "json":
        return as_json(results, profile, extra)
    from importlib import import_module

    excerpts = import_module("borecheck.report.excerpts")
    document = excerpts.with_excerpts(to_document(results, profile, extra))
    return str(import_module("borecheck.report.page").page(document))


def _fail_on(args: argparse.Namespace, settings: Settings) -> Severity | None:
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
