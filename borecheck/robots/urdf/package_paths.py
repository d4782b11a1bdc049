"""Where does `package://arm/meshes/base.stl` lie: found without ROS, tried paths kept.

A reference is searched, in this order, under the roots the user gives, above the
file that makes the reference (walking up to `package.xml`), and in the environment
(ROS, ament, Gazebo). Nothing is guessed: what is found only by another spelling is
named as a near miss, and what leaves its package is refused.
"""

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from urllib.parse import unquote

LEVELS_UP = 8  # how far above the referring file a package is looked for
RELATIVE_LEVELS_UP = 3  # how far `../` may lead where no package.xml bounds it
CRAWL_DEPTH = 4  # how deep below a given root a package.xml is looked for
CRAWL_LIMIT = 5000  # directories visited at most, so that a root of / ends

# Each variable and what is appended to its entries before the package's name.
ENVIRONMENT = (
    ("BORECHECK_PACKAGE_PATH", ""),
    ("ROS_PACKAGE_PATH", ""),
    ("AMENT_PREFIX_PATH", "share"),
    ("CMAKE_PREFIX_PATH", "share"),
    ("GZ_SIM_RESOURCE_PATH", ""),
    ("GAZEBO_MODEL_PATH", ""),
)

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
    """

    reference: str
    path: Path | None
    tried: tuple[Path, ...]
    problem: str | None = None
    near_miss: Path | None = None


def resolve(
    reference: str,
    base: Path,
    roots: Sequence[Path] = (),
    environment: Mapping[str, str] | None = None,
) -> Resolution:
    """The file that a mesh (or include) reference means.

    Args:
        reference: `package://`, `model://`, `file://`, absolute or relative.
        base: Folder of the file that makes the reference.
        roots: Folders that hold packages, or are packages (`--package-path`).
        environment: Where the search variables stand; the process's by default.

    Returns:
        The resolution; its path exists and is a regular file, or it is None.
    """
    text = reference.strip()
    if text != reference:  # no library trims it, so the file is not found
        trimmed = resolve(text, base, roots, environment)
        miss = trimmed.path or trimmed.near_miss
        problem = "white space around the name"
        return Resolution(reference, None, trimmed.tried, problem, miss)
    base, roots = base.absolute(), [Path(root).absolute() for root in roots]
    scheme, mark, rest = text.partition("://")
    if not mark or scheme not in ("package", "model", "file"):
        if mark and "/" not in scheme:
            return Resolution(reference, None, (), f"scheme {scheme}:// is not a file")
        return _choose(reference, list(_plain_candidates(text, base, roots)))
    if scheme == "file":
        return _choose(reference, [(Path(unquote(rest)), None)])
    package, _, inside = rest.partition("/")
    if not package and inside:
        return _without_empty_package(reference, inside, base, roots)
    found = package_folders(package, base, roots, environment)
    return _choose(reference, [(folder / inside, folder) for folder in found])


def find_package(
    package: str,
    base: Path,
    roots: Sequence[Path] = (),
    environment: Mapping[str, str] | None = None,
) -> tuple[Path | None, tuple[Path, ...]]:
    """The folder of a package, and every folder that was tried."""
    tried: list[Path] = []
    for folder in package_folders(package, base, roots, environment):
        tried.append(folder)
        if _is(folder, Path.is_dir):
            return folder, tuple(tried)
    return None, tuple(tried)


def package_folders(
    package: str,
    base: Path,
    roots: Sequence[Path] = (),
    environment: Mapping[str, str] | None = None,
) -> Iterator[Path]:
    """Folders that may be the package, best first; not all of them exist."""
    if not package or package in (".", ".."):
        return
    yield from _below_roots(package, roots)
    yield from _above(package, base)
    env = os.environ if environment is None else environment
    for variable, share in ENVIRONMENT:
        for entry in filter(None, env.get(variable, "").split(os.pathsep)):
            yield Path(entry) / share / package
            if Path(entry).name == package:
                yield Path(entry)
    for root in roots:
        yield from _crawled(Path(root), package)


def _below_roots(package: str, roots: Sequence[Path]) -> Iterator[Path]:
    for root in map(Path, roots):
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


def _plain_candidates(
    text: str, base: Path, roots: Sequence[Path]
) -> Iterator[tuple[Path, Path | None]]:
    if Path(text).is_absolute():
        yield Path(text), None
        return
    yield base / text, _bound(base)
    for root in roots:
        yield Path(root) / text, Path(root)


def _bound(base: Path) -> Path:
    """The folder that a relative reference may not leave."""
    start = base.absolute()
    above = [start, *start.parents]
    for folder in above[:LEVELS_UP]:
        if _is(folder / "package.xml", Path.is_file):
            return folder.parent  # a sister package is a common, honest reference
    return above[min(RELATIVE_LEVELS_UP, len(above) - 1)]


def _choose(
    reference: str, candidates: Sequence[tuple[Path, Path | None]]
) -> Resolution:
    tried: list[Path] = []
    for path, bound in candidates:
        path = Path(os.path.normpath(path))
        if bound is not None and not path.is_relative_to(os.path.normpath(bound)):
            problem = f"the path leaves {bound}, so it is not followed"
            return Resolution(reference, None, (*tried, path), problem)
        tried.append(path)
        if _is(path, Path.is_file):
            return Resolution(reference, path, tuple(tried))
    problem = _problem(tried)
    return Resolution(reference, None, tuple(tried), problem, _near_miss(tried))


def _problem(tried: list[Path]) -> str:
    if not tried:
        return "the reference names no file"
    for path in tried:
        if _is(path, Path.is_dir):
            return f"{path} is a directory"
    return "no such file"


def _without_empty_package(
    reference: str, inside: str, base: Path, roots: Sequence[Path]
) -> Resolution:
    """`package:///pkg/file`: a slash too many; what it would be without is named."""
    package, _, rest = inside.partition("/")
    found = [(f / rest, f) for f in package_folders(package, base, roots)]
    meant = _choose(reference, found)
    problem = "the package's name is missing (three slashes?)"
    return Resolution(reference, None, meant.tried, problem, meant.path)


def _near_miss(tried: list[Path]) -> Path | None:
    for path in tried:
        if "\\" in str(path):
            straight = Path(os.path.normpath(str(path).replace("\\", "/")))
            if _is(straight, Path.is_file):
                return straight
        other = _other_case(path)
        if other is not None:
            return other
    return None


def _other_case(path: Path) -> Path | None:
    """The existing file whose path differs only by upper and lower case."""
    existing = next((p for p in path.parents if _is(p, Path.is_dir)), None)
    if existing is None or existing == path.parents[-1]:
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
    manifest = folder / "package.xml"
    try:
        if not manifest.is_file():
            return None
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
