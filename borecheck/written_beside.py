"""Files that appear whole: written under another name first, then renamed."""

import os
import tempfile
from pathlib import Path


def written_beside(target: Path, content: bytes) -> Path:
    """A new file with this content in the target's folder, whole on the disk.

    To be renamed to the target, or removed, by the caller. Its permissions are those
    that any new file gets.

    Raises:
        OSError: It cannot be written; nothing is left of it.
    """
    folder = target.absolute().parent
    handle, name = tempfile.mkstemp(dir=folder, prefix=f".{target.name}-")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return Path(name)
