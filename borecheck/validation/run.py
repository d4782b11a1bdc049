"""One validation: load, check, collect; everything found comes back as values."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.core.text import printable
from borecheck.validation.catalogue import all_checks, find_check
from borecheck.validation.codes import codes_of
from borecheck.validation.config import ValidationSettings, find_settings, options_with
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.load import Loaded, load_file, load_text
from borecheck.validation.options import Options
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Check, Problem

# A file with thousands of equal faults needs no thousands of lines.
MOST_PER_CHECK = 200
RUN_CODES = ("K601", "K608", "K609", "K611", "K612", "K615")


def validate_file(
    path: str | Path,
    *,
    arguments: Mapping[str, str] | None = None,
    package_paths: Sequence[str | Path] = (),
    profile: str | None = None,
    configured: bool = True,
    select: str | Iterable[str] | None = None,
    ignore: str | Iterable[str] | None = None,
    closed_form: Callable[[Mapping[str, float]], Mapping[str, Any]] | None = None,
    **more: Any,
) -> list[Finding]:
    """Everything that is wrong with a URDF or xacro file.

    Args:
        path: The file; one that ends in .xacro is expanded.
        arguments: Values of xacro arguments.
        package_paths: Roots for `package://` and `$(find)`.
        profile: kinematics, collision (if nothing else is configured) or dynamics.
        configured: Whether the settings nearest to the file hold too.
        select: Codes, their beginnings or names of checks to report; all by default.
        ignore: Codes, their beginnings or names of checks to leave out.
        closed_form: `{joint: position} -> {frame: T_root_frame}`, compared as well.
        more: Further fields of `Options`.

    Returns:
        The findings, by file and line; suppressed ones are left out.

    Raises:
        UnknownNameError: A code, name or profile that does not exist.
        InputError: Settings that cannot be used.
    """
    given = {
        "profile": profile,
        "arguments": arguments,
        "package_paths": tuple(package_paths),
        "select": None if select is None else codes_of(select),
        "ignore": None if ignore is None else codes_of(ignore),
        "closed_form": closed_form,
        **more,
    }
    settings = ValidationSettings()
    if configured:
        settings = find_settings(Path(path).absolute().parent)
    return check_file(Path(path), options_with(settings, given))


def check_file(path: Path, options: Options) -> list[Finding]:
    """As `validate_file`, with the options in one record."""
    chosen = _with_codes(options)
    return findings_of(load_file(path, chosen), chosen)


def _with_codes(options: Options) -> Options:
    """The options with codes for names; a word that no check goes by is an error."""
    codes = {"select": codes_of(options.select), "ignore": codes_of(options.ignore)}
    return replace(options, **codes)  # type: ignore[arg-type]


def not_read(path: Path, problem: str, options: Options) -> Finding:
    """The finding about what could not be looked at: said whatever is selected."""
    check = find_check("D101")
    return Finding(
        code=check.code,
        severity=check.levels[options.profile],
        tier=check.tier,
        element="",
        file=str(path),
        line=1,
        message=printable(problem),
        why=check.why,
        hint=check.fix,
        libraries=check.libraries,
        name=check.name,
    )


def validate_text(
    text: str | bytes, file: str = "<text>", options: Options | None = None
) -> list[Finding]:
    """As `validate_file`, for URDF text."""
    chosen = _with_codes(options or Options())
    return findings_of(load_text(text, file, chosen), chosen)


def findings_of(loaded: Loaded, options: Options) -> list[Finding]:
    """The findings about what was loaded."""
    robot, suppressions = loaded
    if isinstance(robot, Finding):
        # Nothing else was looked at: that is said whatever was selected.
        ignored = options.ignore and robot.code.startswith(options.ignore)
        return [] if ignored else [robot]
    if options.run and any(options.wants(code) for code in RUN_CODES):
        from borecheck.validation.checks.running import start_libraries

        with np.errstate(all="ignore"):
            start_libraries(robot)  # they load while the other checks run
    found: list[Finding] = []
    # Numbers of any size may stand in a strange file; what overflows fails comparisons.
    with np.errstate(all="ignore"):
        for check in sorted(all_checks(), key=lambda check: check.stage == "last"):
            if options.wants(check.code) and _is_due(check, robot):
                new = _findings(check, robot)
                robot.has_errors |= any(f.severity is Severity.ERROR for f in new)
                found += [f for f in new if not any(s.covers(f) for s in suppressions)]
    return sorted(found, key=lambda f: (f.file, f.line, f.code, f.element))


def _ignored_errors(robot: CheckedUrdf) -> bool:
    """Whether a check that is ignored would have found an error."""
    ignored = [c for c in all_checks() if c.code.startswith(robot.options.ignore)]
    return any(
        finding.severity is Severity.ERROR
        for check in ignored
        if check.stage != "last" and _is_due(check, robot)
        for finding in _findings(check, robot)
    )


def _is_due(check: Check, robot: CheckedUrdf) -> bool:
    if check.stage == "last":  # what is silenced is known, and not told again
        return not robot.has_errors and not _ignored_errors(robot)
    if check.stage == "meshes":
        return robot.options.meshes
    if check.stage == "run":
        return robot.options.run
    return True


def _findings(check: Check, robot: CheckedUrdf) -> list[Finding]:
    found: list[Finding] = []
    for problem in check.find(robot):
        found.append(_finding(check, robot, problem))
        if len(found) == MOST_PER_CHECK:
            break
    return found


def _finding(check: Check, robot: CheckedUrdf, problem: Problem) -> Finding:
    place = robot.source.place(problem.element)
    return Finding(
        code=check.code,
        severity=problem.severity or check.levels[robot.options.profile],
        tier=check.tier,
        element=printable(place.path),
        file=place.file,
        line=place.line,
        message=printable(problem.message),
        why=check.why,
        hint=printable(problem.hint or check.fix),
        libraries=check.libraries,
        name=check.name,
        attribute=problem.attribute,
    )
