"""Where the xacro package is held: what it evaluates, reads and counts goes through us.

The package keeps its functions and its state in module globals; for one expansion some
of them are replaced, and put back afterwards. This stands on its internals, so its
version is bounded in `pyproject.toml`.
"""

import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf import package_paths
from borecheck.robots.urdf.xacro import names, values
from borecheck.robots.urdf.xacro.document import parse_document, unmark
from borecheck.robots.urdf.xacro.environment import environment_names
from borecheck.robots.urdf.xacro.expression import evaluate
from borecheck.robots.urdf.xacro.includes import included_files
from borecheck.robots.urdf.xacro.run import (
    MAX_DEFINITIONS,
    MAX_ELEMENTS,
    MAX_MACRO_CALLS,
    Run,
    UnreadableError,
)
from borecheck.robots.urdf.xacro.text import text_evaluator
from borecheck.robots.urdf.xacro.yaml_files import parse_yaml

MAX_PARAMETERS = 20_000  # letters of a macro's parameter list

# xacro's own, but without its ways to try every split of a long word: a quoted text, a
# word without quotes and their sequence each match in one way only.
_DEFAULT = r"\$\{.*?\}|\$\(.*?\)|(?:'[^'\n]*+'|\"[^\"\n]*+\"|[^\s'\"]++)++|"
_MACRO_ARGUMENT = re.compile(
    rf"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?({_DEFAULT})(?:\s+|$)(.*)"
)


class PackageNotFoundError(Exception):
    """`$(find pkg)` met no package; carries the tried paths through the xacro code."""


@contextmanager
def held(xacro: ModuleType, run: Run) -> Iterator[None]:
    """The xacro package with our evaluation, search, marks and limits."""
    changes = [*_package_changes(xacro, run), *_substitution_changes(run)]
    before = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    try:
        for owner, name, value in changes:
            setattr(owner, name, value)
        yield
    finally:
        for owner, name, value in before:
            setattr(owner, name, value)


Change = tuple[Any, str, Any]


def _package_changes(xacro: ModuleType, run: Run) -> Iterator[Change]:
    symbols = names.global_names(run.budget, _xacro_names(xacro, run), xacro.warning)

    def value_of(text: str, table: Any, _: object = None) -> Any:
        return evaluate(text, table, run.budget)

    eval_text = text_evaluator(run, value_of, _extension(xacro))
    yield xacro, "_global_symbols", symbols
    yield xacro, "safe_eval", value_of
    yield xacro, "eval_text", eval_text
    yield xacro, "parse", _parser(xacro, run)
    yield xacro, "get_include_files", included_files(run, eval_text)
    yield xacro, "is_valid_name", _is_name
    yield xacro, "re_macro_arg", _MACRO_ARGUMENT
    # One node for all documents: an expansion that ends halfway would leave it astray.
    yield xacro, "_empty_text_node", xacro._empty_text_node.cloneNode(False)
    for name in ("check_attrs", "process_include"):
        yield xacro, name, _entering(run, getattr(xacro, name))
    for name in ("grab_property", "grab_macro"):
        yield xacro, name, _entering(run, _defining(run, getattr(xacro, name)))
    yield xacro, "handle_macro_call", _calling(run, xacro.handle_macro_call)
    yield xacro, "eval_all", _visiting(run, xacro.eval_all)


def _substitution_changes(run: Run) -> Iterator[Change]:
    from xacro import substitution_args

    def find(package: str) -> str:
        return _find(package, run)

    def arg(name: str, args: Mapping[str, str]) -> Any:
        run.referenced.add(name)
        return eval_arg(name, args)

    def eval_in(text: str, context: Any) -> str:
        known = {"find": find, "env": env, "optenv": optenv}
        table = _EvalNames(context.setdefault("arg", {}), run, known)
        return str(evaluate(text, table, run.budget))

    eval_arg = substitution_args._eval_arg
    env, optenv = environment_names(run)
    yield substitution_args, "_eval_find", find
    yield substitution_args, "_eval_arg", arg
    yield substitution_args, "_eval_env", env
    yield substitution_args, "_eval_optenv", optenv
    yield substitution_args, "_eval", eval_in


def _xacro_names(xacro: ModuleType, run: Run) -> dict[str, Any]:
    """What stands behind `xacro.` in an expression."""
    own = xacro._global_symbols["xacro"]

    def load_yaml(filename: str) -> Any:
        path = xacro.abs_filename_spec(filename)
        data = run.read(path, f"load_yaml({filename!r})")
        run.data_files.append(Path(path))
        found = parse_yaml(
            data,
            Path(path),
            lambda text: evaluate(text, xacro._global_symbols, run.budget),
            run.budget,
        )
        return xacro.YamlListWrapper.wrap(found)

    def arg(name: str) -> Any:
        run.referenced.add(name)
        return own["arg"](name)

    def spoken(name: str) -> Callable[..., str]:
        def tell(*words: Any, **how: Any) -> str:
            run.budget.spend(sum(len(str(word)) for word in words))
            kept = {"print_location": how.get("print_location", name != "message")}
            return str(own[name](*map(str, words), **kept))

        return tell

    found = {
        "load_yaml": load_yaml,
        "abs_filename": xacro.abs_filename_spec,
        "dotify": lambda given: xacro.YamlDictWrapper(dict(given)),
        "arg": arg,
        "fatal": own["fatal"],
        "print_location": lambda: str(own["print_location"]()),
        "tokenize": _tokens,
        **{name: spoken(name) for name in ("message", "warning", "error")},
    }
    return {name: values.Function(name, call) for name, call in found.items()}


def _tokens(text: str, sep: str = ",; ", skip_empty: bool = True) -> list[str]:
    """`xacro.tokenize`, whose separators are taken as letters, not as a pattern."""
    parts = re.split(f"[{re.escape(sep)}]", text) if sep else [text]
    return [part for part in parts if part] if skip_empty else parts


def _extension(xacro: ModuleType) -> Callable[[str], Any]:
    """The replacement of `xacro.eval_extension`: `$(arg ...)`, `$(find ...)` ..."""
    from xacro import substitution_args

    def extend(text: str) -> Any:
        if text == "$(cwd)":
            return os.path.abspath(xacro.root_dir)  # noqa: PTH100  as xacro writes it
        try:
            context = xacro.substitution_args_context
            return substitution_args.resolve_args(text, context=context)
        except (UrdfError, MemoryError, RecursionError):
            raise
        except Exception as error:
            raise xacro.XacroException(exc=error) from error

    return extend


class _EvalNames:
    """What `$(eval ...)` may name: arguments, `math` and a few functions."""

    def __init__(self, arguments: Mapping[str, str], run: Run, known: Any) -> None:
        python = names.python_names(run.budget)
        self._known = {
            **{n: python[n] for n in ("list", "dict", "map", "str", "float", "int")},
            **names.math_names(),
            **{"true": True, "false": False, "True": True, "False": False},
            **{n: values.Function(n, made) for n, made in known.items()},
            "arg": values.Function("arg", self.argument),
        }
        self._arguments = arguments

    def __getitem__(self, name: str) -> Any:
        if name in self._known:
            return self._known[name]
        if name not in self._arguments:
            raise KeyError(name)
        return self.argument(name)

    def argument(self, name: str) -> Any:
        from xacro import substitution_args

        value = substitution_args._eval_arg(name, self._arguments)
        return substitution_args.convert_value(value, "auto")


def _find(package: str, run: Run) -> str:
    base = run.place[0].parent if run.place else run.files[-1].parent
    found = package_paths.find_package(package, base, run.roots)
    if found.path is not None and not run.reach.holds(found.path):
        raise run.error(f"$(find {package}): {run.reach.refusal(found.path)}")
    if found.is_refused:
        raise run.error(f"$(find {package}): {found.problem}")
    if found.path is None:
        looked = ", ".join(map(str, found.tried)) or "nowhere: no roots are known"
        raise PackageNotFoundError(
            f"$(find {package}): no such package; tried {looked}"
        )
    folder = str(found.path.absolute())
    run.packages[folder] = None
    return folder


def _parser(xacro: ModuleType, run: Run) -> Callable[..., Any]:
    """The replacement of `xacro.parse`: a DOM whose elements carry file and line."""

    def parse(_: object, filename: str) -> Any:
        try:
            data = run.read(filename, f"xacro:include {filename!r}")
        except UnreadableError as error:
            if not run.files:
                raise
            xacro.filestack.pop()  # as xacro does for a file that it cannot open
            problem = error.problem.removeprefix("xacro: ")
            raise xacro.XacroException(problem, exc=OSError()) from error
        run.files.append(Path(os.path.normpath(filename)))
        document = parse_document(data, run)
        for node in document.getElementsByTagName("xacro:arg"):
            run.declared.setdefault(node.getAttribute("name"), run.files[-1])
        return document

    return parse


def _is_name(name: str) -> bool:
    from keyword import iskeyword

    return name.isidentifier() and not iskeyword(name)


def _defining(run: Run, original: Callable[..., Any]) -> Callable[..., Any]:
    """A property or macro defined; xacro looks through all that is beside it."""

    def define(node: Any, table: Any) -> Any:
        run.count("definitions", MAX_DEFINITIONS)
        if len(node.getAttribute("params")) > MAX_PARAMETERS:
            raise run.error(f"parameters of more than {MAX_PARAMETERS} letters")
        return original(node, table)

    return define


def _entering(run: Run, original: Callable[..., Any]) -> Callable[..., Any]:
    """A step on one xacro element: its place is spoken and its mark taken off."""

    def step(node: Any, *rest: Any) -> Any:
        run.enter(node)
        unmark(node)
        return original(node, *rest)

    return step


def _calling(run: Run, original: Callable[..., Any]) -> Callable[..., Any]:
    def handle_macro_call(node: Any, *rest: Any) -> Any:
        if not node.tagName.startswith("xacro:"):
            return False
        run.enter(node)
        unmark(node)
        run.count("macro calls", MAX_MACRO_CALLS)
        return original(node, *rest)

    return handle_macro_call


def _visiting(run: Run, original: Callable[..., Any]) -> Callable[..., Any]:
    def eval_all(node: Any, *rest: Any) -> Any:
        run.enter(node)
        run.count("elements", MAX_ELEMENTS)
        return original(node, *rest)

    return eval_all
