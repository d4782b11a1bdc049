"""`borecheck validate`: options, work, output, exit status."""

import argparse
import os
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from borecheck.errors import UsageError
from borecheck.validate import baseline, many
from borecheck.validate.as_text import as_text, wants_colour
from borecheck.validate.config import Settings, find_settings, read_settings
from borecheck.validate.findings import Finding, Severity
from borecheck.validate.options import PROFILES, Options
from borecheck.validate.registry import all_checks
from borecheck.validate.run import check_file, validate_text

CLEAN, FINDINGS, COULD_NOT_RUN = 0, 1, 2
FORMATS = ("text", "json", "sarif", "junit", "markdown", "html")
FAIL_ON = ("error", "warning", "info", "never")

Results = Sequence[tuple[str, Sequence[Finding]]]


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
    add("--format", choices=FORMATS, default="text", help="of the result (text)")
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
    add("--containment", action="store_true", help="an open collision mesh is an error")
    add("--self-intersection", action="store_true", help="search meshes for crossings")
    add("--self-contact", type=int, metavar="N", help="sample N configurations")
    add("--samples", type=int, metavar="N", help="configurations compared (20)")
    add("--seed", type=int, metavar="K", help="of random configurations (0)")


def _add_expectations(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument_group("what must be there").add_argument
    add("--frame", action="append", metavar="NAME", help="a link that must exist")
    add("--link", action="append", metavar="NAME", help="must have collision geometry")
    add("--srdf", type=Path, metavar="FILE", help="check the names in this SRDF")
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
    settings = read_settings(args.config) if args.config else find_settings(Path.cwd())
    options, files = _options(args, settings), many.expand_files(args.files)
    if args.fix:
        from borecheck.validate.fix import fix_files

        return fix_files(files, write=args.write, options=options)
    results = _results(args, files, options, settings)
    _write(args, results, options)
    return _status(results, _fail_on(args, settings))


def _options(args: argparse.Namespace, settings: Settings) -> Options:
    def pick(key: str, default: Any = None) -> Any:
        given = getattr(args, key.replace("-", "_"), None)
        return settings.values.get(key, default) if given is None else given

    paths = [*(args.package_path or []), *settings.values.get("package-path", [])]
    arguments = {**settings.values.get("arg", {}), **_pairs(args.arg or [])}
    meshes = settings.values.get("meshes", True) and not args.no_meshes
    srdf = pick("srdf")
    return Options(
        profile=pick("profile", "collision"),
        arguments=arguments,
        package_paths=tuple(Path(path) for path in paths),
        select=_codes(pick("select", [])),
        ignore=_codes(pick("ignore", [])),
        meshes=meshes,
        run=meshes and settings.values.get("run", True) and not args.no_run,
        containment=args.containment or settings.values.get("containment", False),
        self_intersection=args.self_intersection
        or settings.values.get("self-intersection", False),
        self_contact=pick("self-contact", 0),
        samples=pick("samples", 20),
        seed=pick("seed", 0),
        frames=tuple(pick("frame", [])),
        links=tuple(pick("link", [])),
        remote_centres=settings.declared.get("remote-centre", ()),
        tool_axes=settings.declared.get("tool-axis", ()),
        loops=settings.declared.get("loop", ()),
        srdf=None if srdf is None else Path(srdf),
    )


def _pairs(words: Sequence[str]) -> dict[str, str]:
    pairs = {}
    for word in words:
        name, mark, value = word.partition("=")
        if not mark or not name:
            raise UsageError(f"--arg {word!r} is not NAME=VALUE")
        pairs[name] = value
    return pairs


def _codes(words: Sequence[str]) -> tuple[str, ...]:
    """Codes, beginnings of codes or names, separated by commas."""
    by_name = {check.name: check.code for check in all_checks()}
    codes = [part.strip() for word in words for part in word.split(",") if part.strip()]
    known = [check.code for check in all_checks()]
    found = []
    for code in codes:
        chosen = by_name.get(code.lower(), code.upper())
        if not any(name.startswith(chosen) for name in known):
            raise UsageError(
                f"{code!r} is no check; see borecheck validate --list-checks"
            )
        found.append(chosen)
    return tuple(found)


def _results(
    args: argparse.Namespace, files: list[str], options: Options, settings: Settings
) -> list[tuple[str, list[Finding]]]:
    show = len(files) > 20 or (len(files) > 3 and sys.stderr.isatty())
    results = many.check_many(
        files,
        partial(check_one, options=options),
        jobs=args.jobs or os.cpu_count() or 1,
        resume=args.resume,
        key=many.options_key(options),
        progress=sys.stderr if show else None,
    )
    rules = list(settings.per_file_ignore.items())
    results = [(f, many.without_ignored(found, f, rules)) for f, found in results]
    if args.write_baseline:
        every = [finding for _, found in results for finding in found]
        baseline.write_baseline(args.write_baseline, every)
    known_file = args.baseline or settings.values.get("baseline")
    if known_file:
        known = baseline.read_baseline(Path(known_file))
        results = [(f, baseline.new_findings(found, known)) for f, found in results]
    return results


def check_one(file: str, options: Options) -> list[Finding]:
    """The findings of one file; "-" is the standard input."""
    if file == "-":
        return validate_text(sys.stdin.buffer.read(), "<stdin>", options)
    return check_file(Path(file), options)


def _write(args: argparse.Namespace, results: Results, options: Options) -> None:
    to_screen = args.out is None
    colour = to_screen and wants_colour(sys.stdout)
    text = render(args.format, results, options, args, colour)
    if to_screen:
        sys.stdout.write(text)
    else:
        args.out.write_text(text, encoding="utf-8")
    if args.report is not None:
        page = render("html", results, options, args, False)
        args.report.write_text(page, encoding="utf-8")


def render(
    form: str,
    results: Results,
    options: Options,
    args: argparse.Namespace,
    colour: bool,
) -> str:
    """The results in one of FORMATS."""
    if form == "text":
        full = not args.brief
        return as_text(results, colour=colour, explain=full, source=full)
    if form == "sarif":
        from borecheck.validate.as_sarif import as_sarif

        return as_sarif(results, options.profile)
    if form == "junit":
        from borecheck.validate.as_junit import as_junit

        return as_junit(results, _threshold(args.fail_on or "error"))
    if form == "markdown":
        from borecheck.validate.as_markdown import as_markdown

        return as_markdown(results)
    from borecheck.validate.as_json import as_json, to_document

    extra = {"argv": ["borecheck", *getattr(args, "argv", [])]}
    if form == "json":
        return as_json(results, options.profile, extra)
    from importlib import import_module

    document = to_document(results, options.profile, extra)
    return str(import_module("borecheck.report.page").page(document))


def _threshold(word: str) -> Severity | None:
    return None if word == "never" else Severity(word)


def _fail_on(args: argparse.Namespace, settings: Settings) -> Severity | None:
    word = args.fail_on or settings.values.get("fail-on", "error")
    if word not in FAIL_ON:
        raise UsageError(f"fail-on {word!r} is none of {', '.join(FAIL_ON)}")
    return _threshold(word)


def _status(results: Results, fail_on: Severity | None) -> int:
    found = [finding for _, findings in results for finding in findings]
    if any(finding.code == "D101" for finding in found):
        return COULD_NOT_RUN
    if fail_on is not None and any(f.severity.rank >= fail_on.rank for f in found):
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
