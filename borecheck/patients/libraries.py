"""Libraries of the extra `ct`, imported when a scan is read and not before."""

from importlib import import_module
from typing import Any

from borecheck.errors import UsageError


def library(module: str, package: str | None = None) -> Any:
    """A module of a library that only scans need.

    Args:
        module: Its name in Python: "pydicom".
        package: Its name for pip, if another.

    Raises:
        UsageError: It is not installed.
    """
    try:
        return import_module(module)
    except ImportError as error:
        name = package or module.partition(".")[0]
        raise UsageError(
            f"scans are read with {name}, which is not installed ({error}): "
            f"pip install 'borecheck[ct]'"
        ) from error
