"""The folder that the live view was started in: it reads and writes nothing beyond.

What the browser's fields name is not what the user typed at a command line; who gets at
the page must not get at other files.
"""

from pathlib import Path

from borecheck.core.whole_files import check_writable
from borecheck.errors import UsageError
from borecheck.robots.file_text import split_file_text

MESH_SUFFIXES = (".stl", ".obj", ".ply", ".dae")


class Folder:
    """A folder as a border.

    Args:
        path: The folder; links in it that lead beyond it are not followed.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()

    def readable(self, text: str) -> str:
        """A mesh as `FILE[:unit][:frame][@pose]`, with the file's whole path.

        Raises:
            UsageError: The file is beyond the folder, or no mesh.
        """
        typed = split_file_text(text)
        file = self._inside(typed.path)
        if file.suffix.lower() not in MESH_SUFFIXES:
            raise UsageError(f"{typed.path}: give a mesh: {', '.join(MESH_SUFFIXES)}")
        words = [str(file), *(word for word in (typed.unit, typed.frame) if word)]
        return ":".join(words) + (f"@{typed.pose}" if typed.pose is not None else "")

    def writable(
        self, name: str, suffixes: tuple[str, ...], *, overwrite: bool = False
    ) -> Path:
        """Where a file may be written.

        Raises:
            UsageError: It is beyond the folder, has none of these suffixes, or is there
                already and nobody said that it may go.
            InputError: It cannot be written.
        """
        file = self._inside(Path(name))
        if file.suffix.lower() not in suffixes:
            raise UsageError(f"{name!r} does not end with {' or '.join(suffixes)}")
        check_writable(file, stream=False)
        if file.exists() and not overwrite:
            raise UsageError(f"{name} is there already: tick Overwrite to replace it")
        return file

    def _inside(self, path: Path) -> Path:
        try:
            file = (self.path / path).resolve()
        except (OSError, RuntimeError, ValueError) as error:
            raise UsageError(f"{path} names no file: {error}") from None
        if not file.is_relative_to(self.path):
            raise UsageError(
                f"{path} is not in {self.path}, where the live view was started"
            )
        return file
