"""Generated meshes on disk: the shipped coarse ones, or finer ones made when asked."""

import json
import shutil
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any

from borecheck.core.cache import cache_folder
from borecheck.core.private_folder import make_private
from borecheck.errors import BorecheckError, UnknownNameError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.robots.description import LEVELS, Description, hook, plugin_hook


def mesh_folder(
    description: Description, level: str, arguments: Mapping[str, str]
) -> Path | None:
    """The folder with the meshes of a level of detail, generated if need be.

    A description without a mesh hook has none: its file says what it is drawn with.

    Args:
        description: Robot or scanner.
        level: coarse, middle or fine.
        arguments: The xacro arguments, complete.

    Raises:
        UnknownNameError: No such level.
        BorecheckError: The cache folder cannot be written.
    """
    if level not in LEVELS:
        raise UnknownNameError("level", level, LEVELS)
    if not description.meshes:
        return None
    shaping = {
        name: arguments[name]
        for name, argument in description.arguments.items()
        if argument.shapes
    }
    if level == "coarse" and all(
        value == description.arguments[name].default for name, value in shaping.items()
    ):
        return description.shipped
    folder = cache_folder() / "meshes" / _key(description, level, shaping)
    if not _is_complete(folder):
        _generate(description, level, arguments, folder)
    return folder


def _is_complete(folder: Path) -> bool:
    try:
        return (folder / "complete").is_file()
    except OSError:  # a folder that may not be looked into
        return False


def _key(description: Description, level: str, shaping: Mapping[str, str]) -> str:
    """Name of the folder: what the meshes depend on, the generator's text included."""
    module = description.meshes.partition(":")[0]
    digest = sha256(json.dumps([level, dict(shaping)], sort_keys=True).encode())
    for source in _generator_sources(module):
        digest.update(source.read_bytes())
    return f"{description.name}-{level}-{digest.hexdigest()[:16]}"


def _generator_sources(module: str) -> list[Path]:
    """The files a mesh generator is written in: its package, whole."""
    from importlib.util import find_spec

    spec = find_spec(module)
    if spec is None or spec.origin is None:
        raise BorecheckError(f"mesh generator {module!r} cannot be found")
    folders = {Path(spec.origin).parent}
    shapes = find_spec("borecheck_models")
    if shapes is not None and shapes.origin is not None:
        folders.add(Path(shapes.origin).parent)
    return sorted(path for folder in folders for path in folder.glob("*.py"))


def _not_meshes(result: Any) -> str | None:
    """What is wrong with what the hook returned."""
    if isinstance(result, Mapping) and all(
        isinstance(mesh, TriangleMesh) for mesh in result.values()
    ):
        return None
    return "it must be {file stem: TriangleMesh}"


def _generate(
    description: Description, level: str, arguments: Mapping[str, str], folder: Path
) -> None:
    build = plugin_hook(description, "meshes", hook, _not_meshes)
    meshes = build(level, dict(arguments))
    try:
        make_private(folder.parent)
        made = Path(tempfile.mkdtemp(dir=folder.parent, prefix=".making-"))
        try:
            for stem, mesh in meshes.items():
                write_stl(made / f"{stem}.stl", mesh)
            (made / "complete").write_text("all meshes of this level are here\n")
            _move_into_place(made, folder)
        finally:
            shutil.rmtree(made, ignore_errors=True)
    except OSError as error:
        raise BorecheckError(
            f"{folder}: meshes cannot be written ({error.strerror}); "
            "set BORECHECK_CACHE to a folder that can be"
        ) from error


def _move_into_place(made: Path, folder: Path) -> None:
    """Renames the finished folder; whoever comes second leaves an equal copy alone."""
    try:
        made.rename(folder)
    except OSError:
        if _is_complete(folder):
            return
        shutil.rmtree(folder, ignore_errors=True)
        made.rename(folder)
