"""xacro to URDF text without ROS: packages found over given roots, lines kept.

The `xacro` package does the expanding. Around it this module puts its own search for
`$(find pkg)`, a record of where each element came from, limits, and one kind of error.
"""

import io
import os
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf import package_paths, xacro_limits
from borecheck.robots.urdf.xacro_limits import (
    TimeUpError,
    bounded_memory,
    bounded_time,
    limited_range,
)

MAX_FILE_BYTES = 20_000_000  # one xacro file; the largest public ones are below 1 MB
MAX_MACRO_CALLS = 100_000  # a doubling macro bomb passes this in a second
MAX_POWER = 1000  # exponents in expressions: 10**10**10 would never return

_MARK = "borecheck-place"  # attribute that carries file and line through the expansion
_LOCK = threading.Lock()  # the xacro package keeps its state in module globals


@dataclass(frozen=True)
class Expanded:
    """The outcome of one expansion.

    Attributes:
        text: URDF text.
        arguments: Every declared argument and the value it had.
        unused: Arguments that were given but that no file declares or uses.
        unreferenced: Arguments declared by the main file that nothing refers to.
        files: Files read, the main one first.
        places: (file, line) of the source of each element of `text`, in document order.
        warnings: What the xacro package had to say.
    """

    text: str
    arguments: Mapping[str, str]
    unused: tuple[str, ...]
    unreferenced: tuple[str, ...]
    files: tuple[Path, ...]
    places: tuple[tuple[Path, int], ...]
    warnings: tuple[str, ...]


class _PackageNotFoundError(Exception):
    """`$(find pkg)` met no package; carries the tried paths through the xacro code."""


@dataclass
class _Run:
    """What is noted while one file is expanded."""

    roots: Sequence[Path]
    files: list[Path] = field(default_factory=list)
    declared: dict[str, Path] = field(default_factory=dict)
    referenced: set[str] = field(default_factory=set)
    macro_calls: int = 0
    place: tuple[Path, int] | None = None

    def enter(self, node: Any) -> None:
        """Notes where the expansion is; the mark is taken off the element."""
        mark = node.getAttribute(_MARK) if node.hasAttributes() else ""
        if mark:
            file, _, line = mark.partition(":")
            self.place = (self.files[int(file)], int(line))


def is_xacro(path: Path, text: str = "") -> bool:
    """Whether a file is to be expanded: by its name, or by the tags in it."""
    return path.suffix == ".xacro" or "<xacro:" in text


def expand(
    path: Path,
    arguments: Mapping[str, str] | None = None,
    package_paths: Sequence[Path] = (),
) -> Expanded:
    """Expands a xacro file.

    Args:
        path: The main file; relative includes are relative to the including file.
        arguments: Values of `<xacro:arg>`.
        package_paths: Roots in which `$(find pkg)` looks for packages, beside the
            folders above each file and the environment.

    Raises:
        UrdfError: With file and line, for anything that stops the expansion.
    """
    given = dict(arguments or {})
    run = _Run(tuple(package_paths))
    noise = io.StringIO()
    with _LOCK, redirect_stderr(noise):
        text, places, values = _process(Path(path), given, run)
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
        places=places,
        warnings=tuple(line for line in noise.getvalue().splitlines() if line),
    )


def _process(
    path: Path, given: dict[str, str], run: _Run
) -> tuple[str, tuple[tuple[Path, int], ...], dict[str, str]]:
    """Text, places and the values of all arguments."""
    import xml.parsers.expat

    import xacro

    values = dict(given)
    with _patched(xacro, run):
        try:
            with bounded_memory(), bounded_time():
                xacro.init_stacks(str(path))
                document = xacro.parse(None, str(path))
                xacro.process_doc(document, mappings=values, verbosity=0)
                places = tuple(_collect_places(document.documentElement, run))
                return _serialised(document), places, values
        except UrdfError:
            raise
        except TimeUpError as error:
            problem = f"the expansion takes longer than {xacro_limits.MAX_SECONDS:g} s"
            raise _error(path, run, problem) from error
        except xml.parsers.expat.ExpatError as error:
            file = run.files[-1] if run.files else path
            problem = f"not well-formed XML: {error}"
            raise UrdfError(file, problem, f"line {error.lineno}") from error
        except RecursionError as error:
            raise _error(path, run, "the expansion recurses without end") from error
        except Exception as error:  # an expression in the file may raise anything
            raise _error(path, run, _reason(error)) from error
        finally:
            xacro.filestack = None


def _error(path: Path, run: _Run, problem: str) -> UrdfError:
    if run.place is None:
        return UrdfError(path, f"xacro: {problem}")
    file, line = run.place
    return UrdfError(file, f"xacro: {problem}", f"line {line}")


def _reason(error: BaseException) -> str:
    inner: object = error
    while getattr(inner, "exc", None) is not None:
        inner = inner.exc  # type: ignore[attr-defined]
    if type(inner).__name__ == "ArgException":
        return f"argument {str(inner)!r} has no value: declare it or give --arg"
    if isinstance(inner, MemoryError):
        most = xacro_limits.MAX_MEMORY_BYTES // 10**6
        return f"the expansion needs more than {most} MB of memory"
    if isinstance(inner, _PackageNotFoundError):
        return str(inner)
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def _patched(xacro: ModuleType, run: _Run) -> Iterator[None]:
    """The xacro package with our search, marks and limits; restored afterwards."""
    from xacro import substitution_args

    def find(package: str) -> str:
        return _find(package, run)

    changes: list[tuple[Any, str, Any]] = [
        (substitution_args, "_eval_find", find),
        (substitution_args, "_eval_arg", _noting(run, substitution_args._eval_arg)),
        (xacro, "parse", _parser(run)),
        (xacro, "safe_eval", _guarded(xacro.safe_eval)),
    ]
    for name in ("check_attrs", "grab_macro", "grab_property", "process_include"):
        changes.append((xacro, name, _entering(run, getattr(xacro, name))))
    changes.append((xacro, "handle_macro_call", _calling(run, xacro.handle_macro_call)))
    changes.append((xacro, "eval_all", _visiting(run, xacro.eval_all)))
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    entries = [
        (substitution_args._eval_dict, "find", find),
        *(
            (symbols, "range", limited_range(symbols["range"]))
            for symbols in (xacro._global_symbols, xacro._global_symbols["python"])
        ),
    ]
    entries_before = [(owner, name, owner[name]) for owner, name, _ in entries]
    try:
        for owner, name, value in changes:
            setattr(owner, name, value)
        for owner, name, value in entries:
            owner[name] = value
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)
        for owner, name, value in entries_before:
            owner[name] = value


def _find(package: str, run: _Run) -> str:
    base = run.place[0].parent if run.place else run.files[-1].parent
    folder, tried = package_paths.find_package(package, base, run.roots)
    if folder is None:
        looked = ", ".join(map(str, tried)) or "nowhere: no roots are known"
        raise _PackageNotFoundError(
            f"$(find {package}): no such package; tried {looked}"
        )
    return str(folder.absolute())


def _noting(run: _Run, original: Callable[..., Any]) -> Callable[..., Any]:
    def eval_arg(name: str, args: Mapping[str, str]) -> Any:
        run.referenced.add(name)
        return original(name, args)

    return eval_arg


def _entering(run: _Run, original: Callable[..., Any]) -> Callable[..., Any]:
    """A step on one xacro element: its place is noted and its mark taken off."""

    def step(node: Any, *rest: Any) -> Any:
        run.enter(node)
        _unmark(node)
        return original(node, *rest)

    return step


def _calling(run: _Run, original: Callable[..., Any]) -> Callable[..., Any]:
    def handle_macro_call(node: Any, *rest: Any) -> Any:
        if not node.tagName.startswith("xacro:"):
            return False
        run.enter(node)
        _unmark(node)
        run.macro_calls += 1
        if run.macro_calls > MAX_MACRO_CALLS:
            raise RuntimeError(f"more than {MAX_MACRO_CALLS} macro calls")
        return original(node, *rest)

    return handle_macro_call


def _visiting(run: _Run, original: Callable[..., Any]) -> Callable[..., Any]:
    def eval_all(node: Any, *rest: Any) -> Any:
        run.enter(node)
        return original(node, *rest)

    return eval_all


def _guarded(original: Callable[..., Any]) -> Callable[..., Any]:
    def safe_eval(expression: str, *rest: Any) -> Any:
        if "**" in expression or "<<" in expression:
            _check_powers(expression)
        return original(expression, *rest)

    return safe_eval


def _check_powers(expression: str) -> None:
    import ast

    for node in ast.walk(ast.parse(expression.strip(), mode="eval")):
        if not isinstance(node, ast.BinOp):
            continue
        if isinstance(node.op, ast.Pow | ast.LShift):
            right = node.right
            plain = isinstance(right, ast.Constant | ast.UnaryOp | ast.Name)
            large = isinstance(right, ast.Constant) and (
                not isinstance(right.value, int | float) or right.value > MAX_POWER
            )
            if large or (isinstance(right, ast.BinOp) and not plain):
                raise ValueError(f"the exponent in {expression!r} is not allowed")


def _parser(run: _Run) -> Callable[..., Any]:
    """The replacement of `xacro.parse`: a DOM whose elements carry file and line."""

    def parse(_: object, filename: str) -> Any:
        try:
            data = _read(Path(filename), run)
        except UrdfError as error:
            if not run.files:
                raise
            raise _missing_include(error) from error
        run.files.append(Path(os.path.normpath(filename)))
        document = _marked_document(data, len(run.files) - 1, Path(filename))
        for node in document.getElementsByTagName("xacro:arg"):
            run.declared.setdefault(node.getAttribute("name"), run.files[-1])
        return document

    return parse


def _missing_include(error: UrdfError) -> Exception:
    """The exception by which the xacro package knows an optional include."""
    import xacro

    xacro.filestack.pop()
    exception: Exception = xacro.XacroException(
        error.problem.removeprefix("xacro: "), exc=OSError()
    )
    return exception


def _read(path: Path, run: _Run) -> bytes:
    try:
        if path.is_dir():
            raise _error(path, run, f"{path} is a directory")
        if not path.is_file():
            raise _error(path, run, f"{path}: no such file")
        if path.stat().st_size > MAX_FILE_BYTES:
            problem = f"{path} is larger than {MAX_FILE_BYTES // 10**6} MB"
            raise _error(path, run, problem)
        return path.read_bytes()
    except OSError as error:
        problem = f"{path}: {error.strerror or error}"
        raise _error(path, run, problem) from error


def _marked_document(data: bytes, number: int, path: Path) -> Any:
    from xml.dom import expatbuilder

    class Builder(expatbuilder.ExpatBuilderNS):
        def start_element_handler(self, name: str, attributes: Any) -> None:
            super().start_element_handler(name, attributes)
            line = self.getParser().CurrentLineNumber
            element: Any = self.curNode
            element.setAttribute(_MARK, f"{number}:{line}")

        def start_doctype_decl_handler(self, *args: Any) -> None:
            if args[-1]:
                raise UrdfError(path, "a document type with declarations is refused")
            super().start_doctype_decl_handler(*args)

    return Builder().parseString(data)


def _unmark(node: Any) -> None:
    if node.hasAttribute(_MARK):
        node.removeAttribute(_MARK)


def _collect_places(node: Any, run: _Run) -> Iterator[tuple[Path, int]]:
    """Takes the marks off, in document order; the unmarked lie where parents do."""
    stack = [(node, (run.files[0], 1))]
    while stack:
        element, place = stack.pop()
        mark = element.getAttribute(_MARK)
        if mark:
            file, _, line = mark.partition(":")
            place = (run.files[int(file)], int(line))
            element.removeAttribute(_MARK)
        yield place
        children = [c for c in element.childNodes if c.nodeType == c.ELEMENT_NODE]
        stack.extend((child, place) for child in reversed(children))


def _serialised(document: Any) -> str:
    _drop_blank(document.documentElement)
    return str(document.toprettyxml(indent="  "))


def _drop_blank(node: Any) -> None:
    stack = [node]
    while stack:
        element = stack.pop()
        for child in list(element.childNodes):
            if child.nodeType == child.TEXT_NODE and not child.data.strip():
                element.removeChild(child)
            elif child.nodeType == child.ELEMENT_NODE:
                stack.append(child)
