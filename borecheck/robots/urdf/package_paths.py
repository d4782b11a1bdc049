"""Where does `package://arm/meshes/base.stl` lie: found without ROS, tried paths kept.

A reference is searched, in this order, under the roots the user gives, above the
file that makes the reference (walking up to `package.xml`), and in the environment
(ROS, ament, Gazebo). Nothing is guessed: what is found only by another spelling is
named as a near miss, and what leaves the file's reach (`reach`) is refused.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote

from borecheck.robots.urdf.reach import (
    LEVELS_UP,
    NO_ROOTS,
    Reach,
    Roots,
    environment_roots,
    manifest_of,
    reach_of,
)

CRAWL_DEPTH = 4  # how deep below a given root a package.xml is looked for
CRAWL_LIMIT = 5000  # directories visited at most, so that a root of / ends

_NAME_TAG = re.compile(r"<name[^>]*>\s*([^<\s]+)\s*</name>")


@dataclass(frozen=True)
class Resolution:
    """What became of one reference.

    Attributes:
        reference: The text as it stands in the file.
        path: The file, if it was found.
        tried: Every path that was looked at, in order.
        problem: Why there is no path, in one line; None if there is one.
        near_miss: A file that exists under another spelling (case, backslash).
        is_refused: Whether the reference leads out of what the file may read.
    """

    reference: str
    path: Path | None
    tried: tuple[Path, ...]
    problem: str | None = None
    near_miss: Path | None = None
    is_refused: bool = False


def resolve(
    reference: str,
    base: Path,
    roots: Roots = NO_ROOTS,
    environment: Mapping[str, str] | None = None,
) -> Resolution:
    """The file that a mesh (or include) reference means.

    Args:
        reference: `package://`, `model://`, `file://`, absolute or relative.
        base: Folder of the file that makes the reference.
        roots: Folders that hold packages, or are packages (`--package-path`).
        environment: Where the search variables stand; the process's by default.

    Returns:
        The resolution; its path exists, is a regular file within the reach of the
        file, or it is None.
    """
    text = reference.strip()
    if text != reference:  # no library trims it, so the file is not found
        trimmed = resolve(text, base, roots, environment)
        miss = trimmed.path or trimmed.near_miss
        problem = "white space around the name"
        return Resolution(reference, None, trimmed.tried, problem, miss)
    base = base.absolute()
    reach = reach_of(base, roots, environment)
    scheme, mark, rest = text.partition("://")
    if not mark or scheme not in ("package", "model", "file"):
        if mark and "/" not in scheme:
            return Resolution(reference, None, (), f"scheme {scheme}:// is not a file")
        return _choose(reference, list(_plain_candidates(text, base, roots)), reach)
    if scheme == "file":
        return _choose(reference, [Path(unquote(rest))], reach)
    package, _, inside = rest.partition("/")
    if not package and inside:
        return _without_empty_package(reference, inside, base, roots, environment)
    found = package_folders(package, base, roots, environment)
    return _choose(reference, [folder / inside for folder in found], reach)


def find_package(
    package: str,
    base: Path,
    roots: Roots = NO_ROOTS,
    environment: Mapping[str, str] | None = None,
) -> Resolution:
    """The folder of a package within reach of a file in `base`."""
    reach = reach_of(base, roots, environment)
    tried = tuple(map(_normal, package_folders(package, base, roots, environment)))
    there = [folder for folder in tried if _is(folder, Path.is_dir)]
    for folder in there:
        if reach.holds(folder):
            return Resolution(package, folder, tried)
    if there:
        return Resolution(
            package, None, tried, reach.refusal(there[0]), is_refused=True
        )
    return Resolution(package, None, tried, "no such package")


def package_folders(
    package: str,
    base: Path,
    roots: Roots = NO_ROOTS,
    environment: Mapping[str, str] | None = None,
) -> Iterator[Path]:
    """Folders that may be the package, best first; not all of them exist."""
    if not package or package in (".", ".."):
        return
    folders = [Path(folder).absolute() for folder in roots.folders]
    yield from _below_roots(package, folders)
    yield from _above(package, base)
    env = os.environ if environment is None else environment
    for root, entry in environment_roots(env):
        yield root / package
        if entry.name == package:
            yield entry
    for folder in folders:
        yield from _crawled(folder, package)


def _below_roots(package: str, roots: Sequence[Path]) -> Iterator[Path]:
    for root in roots:
        if root.name == package or _package_name(root) == package:
            yield root
        yield root / package
        yield root / "share" / package


def _above(package: str, base: Path) -> Iterator[Path]:
    start = base.absolute()
    for folder in [start, *start.parents][:LEVELS_UP]:
        if folder.name == package or _package_name(folder) == package:
            yield folder
        yield folder / package


def _plain_candidates(text: str, base: Path, roots: Roots) -> Iterator[Path]:
    if Path(text).is_absolute():
        yield Path(text)
        return
    yield base / text
    for root in roots.folders:
        yield Path(root).absolute() / text


def _choose(reference: str, candidates: Sequence[Path], reach: Reach) -> Resolution:
    """The first candidate that is a file, of those within reach."""
    tried: list[Path] = []
    beyond: list[Path] = []
    for path in map(_normal, candidates):
        tried.append(path)
        if not reach.holds(path):
            beyond.append(path)
        elif _is(path, Path.is_file):
            return Resolution(reference, path, tuple(tried))
    refused = next((path for path in beyond if _is_refused(reference, path)), None)
    if refused is not None:
        problem = reach.refusal(refused)
        return Resolution(reference, None, tuple(tried), problem, is_refused=True)
    within = [path for path in tried if path not in beyond]
    problem = _problem(within) if tried else "the reference names no file"
    miss = _near_miss(within, reach)
    return Resolution(reference, None, tuple(tried), problem, miss)


def _is_refused(reference: str, path: Path) -> bool:
    """Whether a reference beyond reach is refused; else it is only not there.

    One that climbs out is, whatever it would meet.
    """
    climbs = ".." in reference.replace("\\", "/").split("/")
    return climbs or _is(path, Path.exists)


def _normal(path: Path) -> Path:
    return Path(os.path.normpath(path))


def _problem(tried: list[Path]) -> str:
    for path in tried:
        if _is(path, Path.is_dir):
            return f"{path} is a directory"
    return "no such file"


def _without_empty_package(
    reference: str,
    inside: str,
    base: Path,
    roots: Roots,
    environment: Mapping[str, str] | None,
) -> Resolution:
    """`package:///pkg/file`: a slash too many; what it would be without is named."""
    meant = resolve(f"package://{inside}", base, roots, environment)
    problem = "the package's name is missing (three slashes?)"
    return Resolution(reference, None, meant.tried, problem, meant.path)


def _near_miss(tried: list[Path], reach: Reach) -> Path | None:
    for path in tried:
        if "\\" in str(path):
            straight = _normal(Path(str(path).replace("\\", "/")))
            if reach.holds(straight) and _is(straight, Path.is_file):
                return straight
        other = _other_case(path, reach)
        if other is not None and reach.holds(other):
            return other
    return None


def _other_case(path: Path, reach: Reach) -> Path | None:
    """The existing file whose path differs only by upper and lower case."""
    existing = next((p for p in path.parents if _is(p, Path.is_dir)), None)
    if existing is None or existing == path.parents[-1] or not reach.holds(existing):
        return None
    current = existing
    for part in path.relative_to(existing).parts:
        try:
            names = sorted(entry.name for entry in current.iterdir())
        except OSError:
            return None
        match = next((n for n in names if n.lower() == part.lower()), None)
        if match is None:
            return None
        current = current / match
    return current if _is(current, Path.is_file) else None


def _crawled(root: Path, package: str) -> Iterator[Path]:
    names = _packages_below(str(root))
    if package in names:
        yield names[package]


@lru_cache(maxsize=64)
def _packages_below(root: str) -> dict[str, Path]:
    found: dict[str, Path] = {}
    depth_of_root = root.rstrip(os.sep).count(os.sep)
    for visited, (folder, below, files) in enumerate(os.walk(root)):
        if visited >= CRAWL_LIMIT:
            break
        if folder.count(os.sep) - depth_of_root >= CRAWL_DEPTH:
            below.clear()
        below.sort()
        if "package.xml" in files:
            name = _package_name(Path(folder))
            if name is not None:
                found.setdefault(name, Path(folder))
    return found


@lru_cache(maxsize=4096)
def _package_name(folder: Path) -> str | None:
    manifest = manifest_of(folder)
    if manifest is None:
        return None
    try:
        with manifest.open(encoding="utf-8", errors="replace") as stream:
            match = _NAME_TAG.search(stream.read(65536))
    except OSError:
        return None
    return match.group(1) if match else None


def _is(path: Path, question: object) -> bool:
    """`question(path)`, where a symlink loop or a bad name is simply a no."""
    try:
        return bool(question(path))  # type: ignore[operator]
    except (OSError, ValueError):
        return False
