"""xacro to URDF text without ROS: packages found over given roots, lines kept.

The `xacro` package does the expanding. Around it `hooks` puts our own evaluation of
expressions, a search for `$(find pkg)`, a record of where each element came from, the
reach of the file, limits; here all that goes wrong becomes one kind of error.
"""

import io
import threading
from collections.abc import Mapping
from contextlib import redirect_stderr
from dataclasses import dataclass
from pathlib import Path

from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import NO_ROOTS, Roots, reach_of
from borecheck.robots.urdf.xacro import limits
from borecheck.robots.urdf.xacro.document import serialised
from borecheck.robots.urdf.xacro.hooks import PackageNotFoundError, held
from borecheck.robots.urdf.xacro.limits import (
    TimeUpError,
    bounded_memory,
    bounded_time,
)
from borecheck.robots.urdf.xacro.run import Run

_LOCK = threading.Lock()  # the xacro package keeps its state in module globals
_SHOWN = 400  # letters of a reason


@dataclass(frozen=True)
class Expanded:
    """The outcome of one expansion.

    Attributes:
        text: URDF text.
        arguments: Every declared argument and the value it had.
        unused: Arguments that were given but that no file declares or uses.
        unreferenced: Arguments declared by the main file that nothing refers to.
        files: XML files read, the main one first.
        data_files: YAML files read.
        packages: Folders that `$(find ...)` stood for.
        places: (file, line) of the source of each element of `text`, in document order.
        warnings: What the xacro package had to say.
        stray: Bytes around the text of files that were read over, in a line each.
    """

    text: str
    arguments: Mapping[str, str]
    unused: tuple[str, ...]
    unreferenced: tuple[str, ...]
    files: tuple[Path, ...]
    data_files: tuple[Path, ...]
    packages: tuple[str, ...]
    places: tuple[tuple[Path, int], ...]
    warnings: tuple[str, ...]
    stray: tuple[str, ...] = ()


def expand(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    roots: Roots = NO_ROOTS,
) -> Expanded:
    """Expands a xacro file.

    Args:
        path: The main file; relative includes are relative to the including file.
        arguments: Values of `<xacro:arg>`.
        roots: Where `$(find pkg)` looks for packages and files may lie, beside the
            folders above each file and the environment.

    Raises:
        UrdfError: With file and line, for anything that stops the expansion, a file
            that is out of reach included.
    """
    given = dict(arguments or {})
    main = Path(path)
    run = Run(main, roots, reach_of(main.parent, roots))
    noise = io.StringIO()
    with _LOCK, redirect_stderr(noise):
        text, places, values = _process(given, run)
    return Expanded(
        text=text,
        arguments={name: values[name] for name in run.declared if name in values},
        unused=tuple(sorted(set(given) - set(run.declared) - run.referenced)),
        unreferenced=tuple(
            name
            for name, file in run.declared.items()
            if file == run.files[0] and name not in run.referenced
        ),
        files=tuple(dict.fromkeys(run.files)),
        data_files=tuple(dict.fromkeys(run.data_files)),
        packages=tuple(run.packages),
        places=places,
        warnings=tuple(line for line in noise.getvalue().splitlines() if line),
        stray=tuple(run.stray),
    )


def _process(
    given: dict[str, str], run: Run
) -> tuple[str, tuple[tuple[Path, int], ...], dict[str, str]]:
    """Text, places and the values of all arguments."""
    import xml.parsers.expat

    import xacro

    values = dict(given)
    with held(xacro, run):
        try:
            with bounded_memory(), bounded_time():
                xacro.init_stacks(str(run.main))
                document = xacro.parse(None, str(run.main))
                xacro.process_doc(document, mappings=values, verbosity=0)
                places = tuple(run.unmarked(document.documentElement))
                return serialised(document), places, values
        except UrdfError:
            raise
        except TimeUpError as error:
            problem = f"the expansion takes longer than {limits.MAX_SECONDS:g} s"
            raise run.error(problem) from error
        except xml.parsers.expat.ExpatError as error:
            file = run.files[-1] if run.files else run.main
            problem = f"not well-formed XML: {error}"
            raise UrdfError(file, problem, f"line {error.lineno}") from error
        except RecursionError as error:
            raise run.error("the expansion recurses without end") from error
        except Exception as error:  # an expression in the file may raise anything
            raise run.error(_reason(error)) from error
        finally:
            xacro.filestack = None


def _reason(error: BaseException) -> str:
    inner: object = error
    while getattr(inner, "exc", None) is not None:
        inner = inner.exc  # type: ignore[attr-defined]
    if type(inner).__name__ == "ArgException":
        return f"argument {str(inner)!r} has no value: declare it or give --arg"
    if isinstance(inner, MemoryError):
        most = limits.MAX_MEMORY_BYTES // 10**6
        return f"the expansion needs more than {most} MB of memory"
    if isinstance(inner, PackageNotFoundError):
        return str(inner)
    reason = " ".join(str(error).split()) or type(error).__name__
    return reason if len(reason) <= _SHOWN else f"{reason[:_SHOWN]}..."
